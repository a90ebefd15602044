"""From a request to its pictures: scene built, cameras run, planes named."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from msgspec import structs
from scipy.spatial.transform import Rotation

from simgl.arrays import AnyArray, Array, Image16
from simgl.camera.camera import Camera
from simgl.errors import ConfigError
from simgl.images import saturation_level
from simgl.motion.trajectory import FixedAttitude, FixedPosition, Motion, poses
from simgl.physics.frames import Pose, matrix_from_quaternion, quaternion_from_matrix
from simgl.scenario.scenario import Scenario
from simgl.scene.lamps import LampState
from simgl.scene.state import BodyState, SceneState, Sun, SunAtPosition, SunInDirection
from simgl.simulator import Capture, Product
from simgl_bridge.body_pose import sent_pose
from simgl_bridge.framing import BadMessageError
from simgl_bridge.messages import (
    CameraImage,
    ErrorCode,
    Matrix,
    Plane,
    Quaternion,
    SentPose,
    Shot,
    Vector,
)
from simgl_bridge.validate_request import PRODUCTS, Wanted, check_request

# Pixels looked at together.
_BLOCK = 65536


class TakesPictures(Protocol):
    """What pictures come from: a simulator, or what stands before one."""

    @property
    def scenario(self) -> Scenario:
        """The scenario in front of the cameras."""

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: frozenset[Product],
        during: Callable[[int], SceneState] | None = None,
    ) -> Capture:
        """The picture that a camera of a state takes, ``during`` the scene at other epochs."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Pictures:
    """The answer to a request, before it has an id.

    bodies : every spacecraft's pose as it was used
    pixels : the planes of all images, in order
    digital : what the first camera took, for a preview; None where DN were not asked for
    """

    bodies: dict[str, SentPose]
    images: tuple[CameraImage, ...]
    pixels: tuple[AnyArray, ...]
    digital: tuple[Camera, Image16] | None


def take_pictures(render_session: TakesPictures, request: Wanted) -> Pictures:
    """The pictures of exactly the state in a request.

    Raises BadMessageError where a value is impossible, or its scene is.
    """
    check_request(render_session.scenario, request)
    state = requested_state(render_session.scenario, request)
    during = partial(requested_state, render_session.scenario, request) if request.moving else None
    images: list[CameraImage] = []
    pixels: list[AnyArray] = []
    digital = None
    for shot in request.cameras:
        start = time.perf_counter()
        wanted = frozenset(PRODUCTS[name][0] for name in shot.products)
        try:
            exposure = render_session.capture(state, shot.camera, wanted, during)
        except ConfigError as error:
            raise _bad_scene(error, request.id) from None
        frames = {name: _pixels(exposure, name) for name in shot.products}
        images.append(_described(state, shot, exposure, frames, time.perf_counter() - start))
        pixels.extend(frames.values())
        if digital is None and exposure.digital is not None:
            digital = (exposure.info.camera, exposure.digital.dn)
    # The very numbers that were sent, not what is left of them after a matrix and back.
    used = {name: _as_used(body, request.bodies.get(name)) for name, body in state.bodies.items()}
    return Pictures(bodies=used, images=tuple(images), pixels=tuple(pixels), digital=digital)


def requested_state(scenario: Scenario, request: Wanted, tai_ns: int | None = None) -> SceneState:
    """The scene of a request whose values are possible.

    Spacecraft that were not sent keep their laws; a law relative to a sent one follows it.

    tai_ns : while the shutter is open, with sent spacecraft gone on; None is the request's own
    """
    epoch = request.tai_ns if tai_ns is None else tai_ns
    motions = dict(scenario.motions)
    for name, sent in request.bodies.items():
        pose = _pose(sent, f"bodies.{name}", request.id)
        if epoch != request.tai_ns:
            pose = _gone_on(pose, sent.angular_velocity_rad_s, (epoch - request.tai_ns) * 1e-9)
        motions[name] = Motion(
            trajectory=FixedPosition(position=pose.position, velocity=pose.velocity),
            attitude=FixedAttitude(R_icrf_from_body=pose.R_icrf_from_body),
        )
    angles = {name: sent.joints for name, sent in request.bodies.items() if sent.joints}
    try:
        placed = poses(motions, epoch)
        state = scenario.with_poses(epoch, placed, joint_angles=angles)
        if request.sun is not None:
            state = replace(state, sun=_moved_sun(state.sun, request.sun.position_m))
            if scenario.joints:
                state = _turned_to(state, scenario, placed, angles)
    except ConfigError as error:
        raise _bad_scene(error, request.id) from None
    chosen = [s for s in request.cameras if (s.exposure_time_s, s.gain_dn_per_e) != (None, None)]
    if chosen:
        cameras = dict(state.cameras)
        for shot in chosen:
            there = cameras[shot.camera]
            cameras[shot.camera] = replace(there, camera=_set(there.camera, shot))
        state = replace(state, cameras=cameras)
    if request.lamps:
        # A lamp that is off costs nothing where it is not there at all.
        burning = (lamp for lamp in state.lamps if request.lamps.get(lamp.lamp.name, 1.0) > 0.0)
        state = replace(state, lamps=tuple(_dimmed(lamp, request.lamps) for lamp in burning))
    return state


def _gone_on(pose: Pose, angular_velocity: Vector, duration: float) -> Pose:
    """A pose after a time [s] of straight flight and steady turning."""
    turn = Rotation.from_rotvec(duration * np.array(angular_velocity)).as_matrix()
    return replace(
        pose,
        position=pose.position + duration * pose.velocity,
        R_icrf_from_body=pose.R_icrf_from_body @ turn,
    )


def _dimmed(state: LampState, shares: Mapping[str, float]) -> LampState:
    lamp = state.lamp
    share = shares.get(lamp.name, 1.0)
    return replace(state, lamp=replace(lamp, power=share * lamp.power))


def _turned_to(
    state: SceneState,
    scenario: Scenario,
    placed: Mapping[str, Pose],
    angles: Mapping[str, Mapping[str, float]],
) -> SceneState:
    """A state whose drives follow its own Sun, not the scenario's."""
    under = replace(scenario, sun=_as_direction(state.sun))
    return replace(state, bodies=under.with_poses(state.tai_ns, placed, joint_angles=angles).bodies)


def _as_direction(sun: Sun) -> SunInDirection:
    """A Sun in the same direction, as far as drives can tell."""
    if isinstance(sun, SunInDirection):
        return sun
    seen = sun.seen_from(np.zeros(3))
    return SunInDirection(
        direction_icrf=seen.direction_icrf,
        light=sun.light_at_1_au,
        angular_radius=seen.angular_radius,
    )


def _as_used(body: BodyState, sent: SentPose | None) -> SentPose:
    """A pose as it was used, with all its joints."""
    model = body.model
    pose = sent_pose(body.pose) if sent is None else sent
    if not model.joints:
        return pose
    angles = model.angles or (0.0,) * len(model.joints)
    joints = {joint.name: angle for joint, angle in zip(model.joints, angles, strict=True)}
    return structs.replace(pose, joints=joints)


def _set(camera: Camera, shot: Shot) -> Camera:
    """A camera with the exposure and gain of a request."""
    if shot.exposure_time_s is not None:
        camera = replace(camera, exposure_time=float(shot.exposure_time_s))
    if shot.gain_dn_per_e is not None:
        detector = replace(camera.detector, gain_dn_per_e=float(shot.gain_dn_per_e))
        camera = replace(camera, detector=detector)
    return camera


def _moved_sun(sun: Sun, position: Vector) -> Sun:
    place = np.array(position, dtype=np.float64)
    if isinstance(sun, SunAtPosition):
        return replace(sun, position=place)
    assert isinstance(sun, SunInDirection)
    return replace(sun, direction_icrf=place / np.linalg.norm(place))


def _pose(sent: SentPose, field: str, id: int) -> Pose:
    try:
        R_icrf_from_body = matrix_from_quaternion(sent.q_icrf_from_body_xyzw)
    except ValueError as error:
        where = f"{field}.q_icrf_from_body_xyzw"
        raise BadMessageError(ErrorCode.BAD_VALUE, where, str(error), id) from None
    return Pose(
        position=np.array(sent.position_m, dtype=np.float64),
        velocity=np.array(sent.velocity_m_s, dtype=np.float64),
        R_icrf_from_body=R_icrf_from_body,
    )


def _bad_scene(error: ConfigError, id: int) -> BadMessageError:
    # The table alone: where the scenario file lies is the server's affair.
    table = error.where[max(error.where.rfind("["), 0) :]
    field = f"{table} {error.key}".strip()
    return BadMessageError(ErrorCode.BAD_SCENE, field, error.problem, id)


def _described(
    state: SceneState,
    shot: Shot,
    exposure: Capture,
    frames: Mapping[str, AnyArray],
    seconds: float,
) -> CameraImage:
    info, truth, camera = exposure.info, exposure.truth, state.cameras[shot.camera].camera
    dn = frames.get("dn")
    timing = exposure_timing(camera, state.tai_ns)
    return CameraImage(
        camera=camera.name,
        position_m=_vector(info.position),
        q_camera_from_icrf_xyzw=_four(quaternion_from_matrix(info.R_camera_from_icrf)),
        intrinsics=rows(camera),
        exposure_time_s=camera.exposure_time,
        gain_dn_per_e=camera.detector.gain_dn_per_e,
        exposure_start_tai_ns=timing.start,
        exposure_end_tai_ns=timing.end,
        readout_end_tai_ns=timing.read,
        available_tai_ns=timing.available,
        sun_direction_icrf=_vector(info.sun_direction_icrf),
        sun_irradiance_w_m2=_four(info.sun_irradiance),
        saturated_pixels=None if dn is None else _count_saturated(dn, camera),
        render_us=round(seconds * 1e6),
        planes=tuple(
            Plane(product=name, dtype=array.dtype.str, shape=array.shape, unit=PRODUCTS[name][1])
            for name, array in frames.items()
        ),
        part_names=truth.part_names if truth and "part_id" in shot.products else {},
    )


def _count_saturated(dn: Image16, camera: Camera) -> int:
    level = saturation_level(camera.detector)
    # Most pictures have none, which the largest number says in less than half the time.
    if int(dn.max()) < level:
        return 0
    # By blocks that stay in the cache, without a mask of the whole picture.
    flat = dn.reshape(-1)
    blocks = range(0, flat.size, _BLOCK)
    return sum(int(np.count_nonzero(flat[at : at + _BLOCK] >= level)) for at in blocks)


@dataclass(frozen=True, kw_only=True)
class ExposureTiming:
    """When an image comes to be [TAI ns]: first light, last light, last row read, delivered."""

    start: int
    end: int
    read: int
    available: int


def exposure_timing(camera: Camera, mid_tai_ns: int) -> ExposureTiming:
    """The times of an image whose mid-exposure is given."""
    exposure = round(camera.exposure_time * 1e9)
    start = mid_tai_ns - exposure // 2
    read = start + exposure + round(camera.readout_time * 1e9)
    return ExposureTiming(
        start=start,
        end=start + exposure,
        read=read,
        available=read + round(camera.transport_latency * 1e9),
    )


def rows(camera: Camera) -> Matrix:
    """The intrinsic matrix as it travels."""
    a, b, c = camera.intrinsics.tolist()
    return tuple(a), tuple(b), tuple(c)


def _vector(values: Array) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _four(values: Array) -> Quaternion:
    a, b, c, d = values.tolist()
    return a, b, c, d


def _pixels(exposure: Capture, product: str) -> AnyArray:
    if product == "dn" and exposure.digital is not None:
        return exposure.digital.dn
    if product == "radiance" and exposure.radiance is not None:
        return exposure.radiance.radiance
    if product == "electrons" and exposure.electrons is not None:
        return exposure.electrons.electrons
    assert exposure.truth is not None
    return exposure.truth.depth if product == "depth" else exposure.truth.part_id
