"""From a request to its images: builds the scene, runs the cameras, names the planes."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
from msgspec import structs
from scipy.spatial.transform import Rotation

from simgl.arrays import AnyArray, Array, Image16
from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import read_out
from simgl.errors import ConfigError, SimglError
from simgl.images import saturation_level
from simgl.physics.frames import Pose, matrix_from_quaternion, quaternion_from_matrix
from simgl.scenario.scenario import Scenario
from simgl.scene.lamps import LampState
from simgl.scene.state import BodyState, SceneState
from simgl.simulator import Capture, Product
from simgl.thermal.scene_temperatures import (
    Temperatures,
    UnknownTemperaturesError,
    history_of,
    name_of,
)
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.framing import BadMessageError, one_line
from simgl_bridge.message_parts import (
    CameraImage,
    Plane,
    SentPose,
    Shot,
    Vector,
)
from simgl_bridge.messages import ErrorCode, Render
from simgl_bridge.validate_request import UNITS, ImageRequest

# Products on the wire: which product of a capture holds it.
PRODUCTS = {
    "dn": Product.DN,
    "radiance": Product.RADIANCE,
    "electrons": Product.ELECTRONS,
    "depth": Product.TRUTH,
    "part_id": Product.TRUTH,
    "range": Product.TRUTH,
    "lidar_range": Product.LIDAR,
    "lidar_electrons": Product.LIDAR,
    "thermal_radiance": Product.THERMAL,
    "temperature": Product.THERMAL,
}
# At the end of where an error is: a table of the scenario.
_TABLE = re.compile(r"\[[\w.-]+\]$")
# Pixels counted together: they fit into the processor's cache.
_BLOCK = 65536


class ImageSource(Protocol):
    """Where captures come from, such as a RenderSession."""

    @property
    def scenario(self) -> Scenario:
        """The scenario being rendered."""

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: frozenset[Product],
        during: Callable[[int], SceneState] | None = None,
        draw: int = 0,
        temperatures: Temperatures | None = None,
    ) -> Capture:
        """The capture of a camera; ``during`` gives the scene at other epochs."""

    def temperatures(self, state: SceneState, before: str) -> Temperatures:
        """Of the spacecraft, from earlier ones of that name on; steady for none.

        Raises UnknownTemperaturesError, and SimglError for temperatures that are not earlier.
        """


@dataclass(frozen=True, kw_only=True, eq=False)
class RenderedImages:
    """The answer to a request, before it has an id.

    bodies : every spacecraft's pose as it was used
    pixels : the planes of all images, in order
    digital : camera and DN of the first image, for a preview; None where DN were not asked for
    """

    bodies: dict[str, SentPose]
    images: tuple[CameraImage, ...]
    pixels: tuple[AnyArray, ...]
    digital: tuple[Camera, Image16] | None


def render_images(render_session: ImageSource, request: ImageRequest) -> RenderedImages:
    """The images of exactly the state in a request, which was checked.

    Raises BadMessageError for a scene that is impossible.
    """
    state = requested_state(render_session.scenario, request)
    during = partial(requested_state, render_session.scenario, request) if request.moving else None
    temperatures = _temperatures(render_session, state, request)
    images: list[CameraImage] = []
    pixels: list[AnyArray] = []
    digital = None
    for shot in request.cameras:
        start = time.perf_counter()
        products = frozenset(PRODUCTS[name] for name in shot.products)
        try:
            capture = render_session.capture(
                state, shot.camera, products, during, request.draw, temperatures
            )
        except ConfigError as error:
            raise bad_scene(error, request.id) from None
        frames = {name: _pixels(capture, name) for name in shot.products}
        image = _camera_image(state, shot, capture, frames, time.perf_counter() - start)
        if temperatures and state.cameras[shot.camera].camera.thermal is not None:
            image = structs.replace(
                image,
                thermal_state=name_of(temperatures),
                thermal_history=history_of(temperatures),
            )
        images.append(image)
        pixels.extend(frames.values())
        if digital is None and capture.digital is not None:
            digital = (capture.info.camera, capture.digital.dn)
    # The numbers that were sent, not those converted to a matrix and back.
    used = {name: _as_used(body, request.bodies.get(name)) for name, body in state.bodies.items()}
    return RenderedImages(bodies=used, images=tuple(images), pixels=tuple(pixels), digital=digital)


def reach_temperatures(render_session: ImageSource, request: ImageRequest) -> None:
    """Work out the temperatures of a request without its images, for those that go on from them.

    What is refused is refused when its images are asked for.
    """
    with suppress(BadMessageError):
        _temperatures(render_session, requested_state(render_session.scenario, request), request)


def _temperatures(
    render_session: ImageSource, state: SceneState, request: ImageRequest
) -> Temperatures | None:
    """Of the spacecraft, where a camera of the request sees them."""
    before = request.thermal_from if isinstance(request, Render) else ""
    if all(state.cameras[shot.camera].camera.thermal is None for shot in request.cameras):
        if before:
            problem = "requires a thermal camera, and none is requested"
            raise BadMessageError(ErrorCode.BAD_VALUE, "thermal_from", problem, request.id)
        return None
    try:
        return render_session.temperatures(state, before)
    except UnknownTemperaturesError as error:
        code = ErrorCode.NO_THERMAL_STATE
        raise BadMessageError(code, "thermal_from", str(error), request.id) from None
    except SimglError as error:
        problem = one_line(str(error), 200)
        raise BadMessageError(ErrorCode.BAD_VALUE, "thermal_from", problem, request.id) from None


def requested_state(
    scenario: Scenario, request: ImageRequest, tai_ns: int | None = None
) -> SceneState:
    """The scene of a request whose values were checked.

    Spacecraft that were not sent follow their laws; a law relative to a sent one follows it.

    tai_ns : epoch while the shutter is open, to which sent poses are extrapolated; None takes the
        request's own
    """
    epoch = request.tai_ns if tai_ns is None else tai_ns
    bodies = {}
    for name, sent in request.bodies.items():
        pose = _pose(sent)
        if epoch != request.tai_ns:
            pose = _extrapolated(pose, sent.angular_velocity_rad_s, (epoch - request.tai_ns) * 1e-9)
        bodies[name] = pose
    joint_angles = {name: sent.joints for name, sent in request.bodies.items() if sent.joints}
    sun = None if request.sun is None else np.array(request.sun.position_m, dtype=np.float64)
    try:
        state = scenario.with_poses(epoch, bodies, joint_angles=joint_angles, sun=sun)
    except ConfigError as error:
        raise bad_scene(error, request.id) from None
    changed = [s for s in request.cameras if (s.exposure_time_s, s.gain_dn_per_e) != (None, None)]
    if changed:
        cameras = dict(state.cameras)
        for shot in changed:
            camera_state = cameras[shot.camera]
            cameras[shot.camera] = replace(
                camera_state, camera=_with_settings(camera_state.camera, shot)
            )
        state = replace(state, cameras=cameras)
    if request.lamps:
        # A lamp that is off is left out, so that it costs nothing.
        burning = (lamp for lamp in state.lamps if request.lamps.get(lamp.lamp.name, 1.0) > 0.0)
        state = replace(state, lamps=tuple(_dimmed(lamp, request.lamps) for lamp in burning))
    return state


def _extrapolated(pose: Pose, angular_velocity: Vector, duration: float) -> Pose:
    """A pose after a time [s] of constant velocity and angular velocity."""
    rotation = Rotation.from_rotvec(duration * np.array(angular_velocity)).as_matrix()
    return replace(
        pose,
        position=pose.position + duration * pose.velocity,
        R_icrf_from_body=pose.R_icrf_from_body @ rotation,
    )


def _dimmed(state: LampState, shares: Mapping[str, float]) -> LampState:
    lamp = state.lamp
    share = shares.get(lamp.name, 1.0)
    return replace(state, lamp=replace(lamp, power=share * lamp.power))


def _as_used(body: BodyState, sent: SentPose | None) -> SentPose:
    """A pose as it was used, with all its joints."""
    model = body.model
    pose = BodyPose.from_pose(body.pose).as_sent() if sent is None else sent
    if not model.joints:
        return pose
    angles = model.angles or (0.0,) * len(model.joints)
    joints = {joint.name: angle for joint, angle in zip(model.joints, angles, strict=True)}
    return structs.replace(pose, joints=joints)


def _with_settings(camera: Camera, shot: Shot) -> Camera:
    """A camera with the exposure and gain of a request."""
    if shot.exposure_time_s is not None:
        camera = replace(camera, exposure_time=float(shot.exposure_time_s))
    if shot.gain_dn_per_e is not None:
        detector = replace(camera.detector, gain_dn_per_e=float(shot.gain_dn_per_e))
        camera = replace(camera, detector=detector)
    return camera


def _pose(sent: SentPose) -> Pose:
    return Pose(
        position=np.array(sent.position_m, dtype=np.float64),
        velocity=np.array(sent.velocity_m_s, dtype=np.float64),
        R_icrf_from_body=matrix_from_quaternion(sent.q_icrf_from_body_xyzw),
    )


def bad_scene(error: ConfigError, id: int) -> BadMessageError:
    """The refusal of a request whose scene is impossible.

    It names the table alone: the path of the scenario file stays on the server.
    """
    table = _TABLE.search(error.where)
    field = f"{table[0] if table else ''} {error.key}".strip()
    return BadMessageError(ErrorCode.BAD_SCENE, field, error.problem, id)


def _camera_image(
    state: SceneState,
    shot: Shot,
    capture: Capture,
    frames: Mapping[str, AnyArray],
    seconds: float,
) -> CameraImage:
    info, truth, camera = capture.info, capture.truth, state.cameras[shot.camera].camera
    dn = frames.get("dn")
    exposure_ns = round(camera.exposure_time * 1e9)
    at_end = camera.thermal is not None and camera.thermal.reads_at_epoch
    start = state.tai_ns - (exposure_ns if at_end else exposure_ns // 2)
    # A rolling shutter exposes half of its rows after the middle one.
    rows_after = 0.5 * read_out(camera)
    readout_end = start + exposure_ns + round(max(camera.readout_time, rows_after) * 1e9)
    return CameraImage(
        camera=camera.name,
        position_m=_floats(info.position),
        q_camera_from_icrf_xyzw=_floats(quaternion_from_matrix(info.R_camera_from_icrf)),
        intrinsics=_floats(camera.intrinsics),
        exposure_time_s=camera.exposure_time,
        gain_dn_per_e=camera.detector.gain_dn_per_e,
        exposure_start_tai_ns=start,
        exposure_end_tai_ns=start + exposure_ns,
        readout_end_tai_ns=readout_end,
        available_tai_ns=readout_end + round(camera.transport_latency * 1e9),
        sun_direction_icrf=_floats(info.sun_direction_icrf),
        sun_irradiance_w_m2=_floats(info.sun_irradiance),
        saturated_pixels=None if dn is None else _count_saturated(dn, camera),
        render_us=round(seconds * 1e6),
        planes=tuple(
            Plane(product=name, dtype=array.dtype.str, shape=array.shape, unit=UNITS[name])
            for name, array in frames.items()
        ),
        part_names=truth.part_names if truth and "part_id" in shot.products else {},
        interreflection=info.interreflection,
    )


def _count_saturated(dn: Image16, camera: Camera) -> int:
    level = saturation_level(camera.detector)
    # Most images have none; the maximum shows that in less than half the time.
    if int(dn.max()) < level:
        return 0
    # By blocks, without a mask of the full image.
    flat = dn.reshape(-1)
    blocks = range(0, flat.size, _BLOCK)
    return sum(int(np.count_nonzero(flat[at : at + _BLOCK] >= level)) for at in blocks)


def _floats(values: Array) -> Any:
    """Numbers of an array as nested tuples, as messages hold them."""
    return tuple(values.tolist() if values.ndim == 1 else map(_floats, values))


def _pixels(capture: Capture, product: str) -> AnyArray:
    if product == "dn" and capture.digital is not None:
        return capture.digital.dn
    if product == "radiance" and capture.radiance is not None:
        return capture.radiance.radiance
    if product == "electrons" and capture.electrons is not None:
        return capture.electrons.electrons
    if capture.thermal is not None and product in ("thermal_radiance", "temperature"):
        thermal = capture.thermal
        return thermal.radiance if product == "thermal_radiance" else thermal.temperature
    if product.startswith("lidar_"):
        assert capture.lidar is not None
        return capture.lidar.range if product == "lidar_range" else capture.lidar.electrons
    assert capture.truth is not None
    if product == "range":
        return capture.truth.range.astype(np.float32)
    return capture.truth.depth if product == "depth" else capture.truth.part_id
