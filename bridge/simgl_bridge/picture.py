"""From a Render request to the picture: values checked, scene built, planes named."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgl.errors import ConfigError, did_you_mean
from simgl.images import saturated
from simgl.physics.constants import LIGHT_SPEED
from simgl.physics.ephemeris import FIRST_YEAR, LAST_YEAR, tai_ns_from_utc
from simgl.physics.frames import Pose, matrix_from_quaternion, quaternion_from_matrix
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.scene.trajectory import FixedAttitude, FixedPosition, Motion, poses
from simgl.simulator import Exposure, Product, Simulator
from simgl_bridge.messages import ErrorCode, Plane, Render, SentPose, Vector
from simgl_bridge.wire import BadMessageError, shown

# What a request may ask for: which product of a capture brings it, and its unit.
PRODUCTS = {
    "dn": (Product.DN, "DN"),
    "radiance": (Product.RADIANCE, "W m-2 sr-1"),
    "electrons": (Product.ELECTRONS, "e-"),
    "depth": (Product.TRUTH, "m"),
    "part_id": (Product.TRUTH, ""),
}
# 1e12 m is 7 au: room for any mission near the Earth, and far from where float64 overflows.
FARTHEST = 1e12
# A still picture of moving bodies means nothing long before an hour.
LONGEST_EXPOSURE = 3600.0

_EARLIEST = tai_ns_from_utc(f"{FIRST_YEAR}-01-01")
_LATEST = tai_ns_from_utc(f"{LAST_YEAR}-12-31T23:59:59.999999999")


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """An exposure with its planes in the order asked for.

    exposure_time : used [s]
    saturated_pixels : None without digital numbers
    """

    exposure: Exposure
    exposure_time: float
    saturated_pixels: int | None
    planes: tuple[Plane, ...]
    pixels: tuple[NDArray[Any], ...]

    @property
    def camera_position(self) -> Vector:
        """Of the pinhole, Earth-centred ICRF [m]."""
        x, y, z = (float(v) for v in self.exposure.info.position)
        return x, y, z

    @property
    def q_camera_from_icrf_xyzw(self) -> tuple[float, float, float, float]:
        """Hamilton, scalar last, w >= 0."""
        R = self.exposure.info.R_camera_from_icrf
        x, y, z, w = (float(v) for v in quaternion_from_matrix(R))
        return x, y, z, w


def take_picture(simulator: Simulator, request: Render) -> Picture:
    """The picture of exactly the state in a request.

    Raises BadMessageError where a value is impossible, or its scene is.
    """
    _check(simulator.scenario, request)
    state = requested_state(simulator.scenario, request)
    wanted = {PRODUCTS[name][0] for name in request.products}
    try:
        exposure = simulator.capture(state, request.camera, wanted)
    except ConfigError as error:
        raise _bad_scene(error, request.id) from None
    frames = {name: _pixels(exposure, name) for name in request.products}
    planes = tuple(
        Plane(product=name, dtype=array.dtype.str, shape=array.shape, unit=PRODUCTS[name][1])
        for name, array in frames.items()
    )
    dn = frames.get("dn")
    camera = state.cameras[request.camera].camera
    return Picture(
        exposure=exposure,
        exposure_time=camera.exposure_time,
        saturated_pixels=None if dn is None else int(saturated(dn, camera.detector).sum()),
        planes=planes,
        pixels=tuple(frames.values()),
    )


def requested_state(scenario: Scenario, request: Render) -> SceneState:
    """The scene of a request whose values are possible.

    Spacecraft that were not sent keep their laws; a law relative to a sent one follows it.
    """
    motions = dict(scenario.motions)
    for name, sent in request.bodies.items():
        pose = _pose(sent, f"bodies.{name}", request.id)
        motions[name] = Motion(
            trajectory=FixedPosition(position=pose.position, velocity=pose.velocity),
            attitude=FixedAttitude(R_icrf_from_body=pose.R_icrf_from_body),
        )
    exposures = {}
    if request.exposure_time_s is not None:
        exposures[request.camera] = float(request.exposure_time_s)
    try:
        return scenario.with_poses(request.tai_ns, poses(motions, request.tai_ns), exposures)
    except ConfigError as error:
        raise _bad_scene(error, request.id) from None


def _pose(sent: SentPose, field: str, id: int) -> Pose:
    try:
        # Components near the end of float64 have the norm infinity, which is no unit either.
        with np.errstate(over="ignore"):
            R_icrf_from_body = matrix_from_quaternion(sent.q_icrf_from_body_xyzw)
    except ValueError as error:
        where = f"{field}.q_icrf_from_body_xyzw"
        raise BadMessageError(ErrorCode.BAD_VALUE, where, str(error), id) from None
    return Pose(
        position=np.array(sent.position_m, dtype=np.float64),
        velocity=np.array(sent.velocity_m_s, dtype=np.float64),
        R_icrf_from_body=R_icrf_from_body,
    )


def _check(scenario: Scenario, request: Render) -> None:
    if not 0 <= request.id < 2**63:
        raise BadMessageError(ErrorCode.BAD_VALUE, "id", f"must lie in 0..2^63-1, got {request.id}")

    def refuse(field: str, problem: str, code: ErrorCode = ErrorCode.BAD_VALUE) -> None:
        raise BadMessageError(code, field, problem, request.id)

    if not _EARLIEST <= request.tai_ns <= _LATEST:
        years = f"{FIRST_YEAR} to {LAST_YEAR}"
        problem = f"must lie in the years {years} ({_EARLIEST}..{_LATEST}), got {request.tai_ns}"
        refuse("tai_ns", problem)
    if request.camera not in scenario.cameras:
        refuse("camera", _not_there(request.camera, scenario.cameras), ErrorCode.NO_CAMERA)
    for name, pose in request.bodies.items():
        if name not in scenario.models:
            refuse("bodies", _not_there(name, scenario.models), ErrorCode.NO_BODY)
        if wrong := _vector_problem(pose.position_m, FARTHEST, "m"):
            refuse(f"bodies.{name}.position_m", wrong)
        if wrong := _vector_problem(pose.velocity_m_s, LIGHT_SPEED, "m/s"):
            refuse(f"bodies.{name}.velocity_m_s", wrong)
    seconds = request.exposure_time_s
    if seconds is not None and not 0.0 < seconds <= LONGEST_EXPOSURE:
        refuse(
            "exposure_time_s", f"must lie above 0, up to {LONGEST_EXPOSURE:g} s, got {seconds:g}"
        )
    if not request.products:
        refuse("products", f"must name at least one of {', '.join(PRODUCTS)}")
    for index, product in enumerate(request.products):
        if product not in PRODUCTS:
            refuse(f"products[{index}]", _not_there(product, PRODUCTS))
        if product in request.products[:index]:
            refuse(f"products[{index}]", f"repeats {shown(product)}")


def _vector_problem(values: Vector, limit: float, unit: str) -> str | None:
    """What is wrong with a vector, or None."""
    if not all(math.isfinite(v) for v in values):
        return f"must be finite, got {list(values)}"
    if not all(abs(v) <= limit for v in values):
        return f"must be at most {limit:g} {unit} along each axis, got {list(values)}"
    return None


def _not_there(name: str, allowed: Mapping[str, object]) -> str:
    return f"{shown(name)} does not exist here; {did_you_mean(name[:60], allowed)}"


def _bad_scene(error: ConfigError, id: int) -> BadMessageError:
    # The table alone: where the scenario file lies is the server's affair.
    table = error.where[max(error.where.rfind("["), 0) :]
    field = f"{table} {error.key}".strip()
    return BadMessageError(ErrorCode.BAD_SCENE, field, error.problem, id)


def _pixels(exposure: Exposure, product: str) -> NDArray[Any]:
    if product == "dn" and exposure.digital is not None:
        return exposure.digital.dn
    if product == "radiance" and exposure.radiance is not None:
        return exposure.radiance.radiance
    if product == "electrons" and exposure.electrons is not None:
        return exposure.electrons.electrons
    assert exposure.truth is not None
    return exposure.truth.depth if product == "depth" else exposure.truth.part_id
