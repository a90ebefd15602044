"""Checks the values of a request; the error names the field that cannot be."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from simgl.camera.noise_streams import LARGEST_DRAW
from simgl.errors import did_you_mean
from simgl.physics.constants import LIGHT_SPEED
from simgl.physics.ephemeris import FIRST_YEAR, LAST_YEAR, tai_ns_from_utc
from simgl_bridge.framing import BadMessageError, quoted
from simgl_bridge.messages import ErrorCode, Render, SentPose, Shot, State, Vector
from simgl_bridge.renderer_messages import ServedJoint, ServedScene

# Products on the wire, and their units.
UNITS = {"dn": "DN", "radiance": "W m-2 sr-1", "electrons": "e-", "depth": "m", "part_id": ""}
# 7 au [m]: enough for any mission near the Earth, and far from where float64 overflows.
FARTHEST = 1e12
# Nearer than this the Earth would be inside the Sun [m].
NEAREST_SUN = 1e9
# An image of fixed bodies is meaningless long before an hour [s].
LONGEST_EXPOSURE = 3600.0
# More than any converter has [DN/e-]; a float32 electron count times this stays finite.
LARGEST_GAIN = 1e6
# Sixteen turns a second [rad s-1].
FASTEST_TURN = 100.0
# Tolerance of a joint's limits [rad] or [m].
_TOLERANCE = 1e-9

_EARLIEST = tai_ns_from_utc(f"{FIRST_YEAR}-01-01")
_LATEST = tai_ns_from_utc(f"{LAST_YEAR}-12-31T23:59:59.999999999")

ImageRequest = Render | State


class FieldErrors:
    """Raises the errors of the request of one id."""

    def __init__(self, id: int | None) -> None:
        self.id = id

    def refuse(self, field: str, problem: str, code: ErrorCode = ErrorCode.BAD_VALUE) -> None:
        """Raise a BadMessageError for a field."""
        raise BadMessageError(code, field, problem, self.id)

    def unknown_name(self, field: str, name: str, allowed: Iterable[str], code: ErrorCode) -> None:
        """Raise a BadMessageError for a name that does not exist."""
        listing = did_you_mean(name[:60], allowed)
        self.refuse(field, f"{quoted(name)} does not exist here; {listing}", code)


def check_id(id: int) -> None:
    """Raises BadMessageError unless an id is one that every language can hold."""
    if not 0 <= id < 2**63:
        raise BadMessageError(ErrorCode.BAD_VALUE, "id", f"must lie in 0..2^63-1, got {id}")


def check_deadline(id: int, deadline_ms: int | None) -> None:
    """Raises BadMessageError for a deadline out of range."""
    if deadline_ms is not None and not 0 < deadline_ms <= 3_600_000:
        problem = f"must lie in 1..3600000 ms, got {deadline_ms}"
        raise BadMessageError(ErrorCode.BAD_VALUE, "deadline_ms", problem, id)


def check_request(scene: ServedScene, request: ImageRequest) -> None:
    """Raises BadMessageError unless a scene has what a request asks for, and its values can be."""
    check_id(request.id)
    errors = FieldErrors(request.id)
    if not _EARLIEST <= request.tai_ns <= _LATEST:
        years = f"{FIRST_YEAR} to {LAST_YEAR}"
        problem = f"must lie in the years {years} ({_EARLIEST}..{_LATEST}), got {request.tai_ns}"
        errors.refuse("tai_ns", problem)
    if isinstance(request, Render):
        check_deadline(request.id, request.deadline_ms)
    if not 0 <= request.draw <= LARGEST_DRAW:
        errors.refuse("draw", f"must lie in 0..{LARGEST_DRAW}, got {request.draw}")
    if request.sun is not None:
        _check_sun(errors, request.sun.position_m)
    for name, share in request.lamps.items():
        if name not in scene.lamps:
            errors.unknown_name("lamps", name, scene.lamps, ErrorCode.NO_LAMP)
        if not 0.0 <= share <= 1.0:
            errors.refuse(f"lamps.{name}", f"must lie in 0..1, got {share:g}")
    for name, pose in request.bodies.items():
        if name not in scene.models:
            errors.unknown_name("bodies", name, scene.models, ErrorCode.NO_BODY)
        _check_pose(errors, f"bodies.{name}", pose)
        _check_joints(errors, f"bodies.{name}.joints", pose.joints, scene.models[name].joints)
    if not request.cameras:
        errors.refuse("cameras", "must name at least one camera")
    for index, shot in enumerate(request.cameras):
        _check_shot(errors, f"cameras[{index}]", shot, scene)
        if shot.camera in [other.camera for other in request.cameras[:index]]:
            errors.refuse(f"cameras[{index}].camera", f"repeats {quoted(shot.camera)}")


def _check_sun(errors: FieldErrors, position: Vector) -> None:
    if problem := _vector_problem(position, FARTHEST, "m"):
        errors.refuse("sun.position_m", problem)
    distance = math.hypot(*position)
    if distance < NEAREST_SUN:
        problem = f"must be at least {NEAREST_SUN:g} m from the Earth, got {distance:g} m"
        errors.refuse("sun.position_m", problem)


def _check_pose(errors: FieldErrors, field: str, pose: SentPose) -> None:
    if problem := _vector_problem(pose.position_m, FARTHEST, "m"):
        errors.refuse(f"{field}.position_m", problem)
    if problem := _vector_problem(pose.velocity_m_s, LIGHT_SPEED, "m/s"):
        errors.refuse(f"{field}.velocity_m_s", problem)
    if problem := _vector_problem(pose.angular_velocity_rad_s, FASTEST_TURN, "rad/s"):
        errors.refuse(f"{field}.angular_velocity_rad_s", problem)


def _check_joints(
    errors: FieldErrors, field: str, values: Mapping[str, float], joints: Sequence[ServedJoint]
) -> None:
    known = {joint.name: joint for joint in joints}
    for name, value in values.items():
        if name not in known:
            errors.unknown_name(field, name, known, ErrorCode.NO_JOINT)
        low, high = known[name].limits
        # Limits in degrees are a few units in the last place off in a client's radians.
        if not low - _TOLERANCE <= value <= high + _TOLERANCE:
            limits = f"{low:g}..{high:g} {known[name].unit}"
            errors.refuse(f"{field}.{name}", f"must lie in {limits}, got {value:g}")


def _check_shot(errors: FieldErrors, field: str, shot: Shot, scene: ServedScene) -> None:
    if shot.camera not in scene.cameras:
        errors.unknown_name(f"{field}.camera", shot.camera, scene.cameras, ErrorCode.NO_CAMERA)
    seconds = shot.exposure_time_s
    if seconds is not None and not 0.0 < seconds <= LONGEST_EXPOSURE:
        problem = f"must lie above 0, up to {LONGEST_EXPOSURE:g} s, got {seconds:g}"
        errors.refuse(f"{field}.exposure_time_s", problem)
    gain = shot.gain_dn_per_e
    if gain is not None and not 0.0 < gain <= LARGEST_GAIN:
        problem = f"must lie above 0, up to {LARGEST_GAIN:g} DN/e-, got {gain:g}"
        errors.refuse(f"{field}.gain_dn_per_e", problem)
    if not shot.products:
        errors.refuse(f"{field}.products", f"must name at least one of {', '.join(UNITS)}")
    for index, product in enumerate(shot.products):
        if product not in UNITS:
            place = f"{field}.products[{index}]"
            errors.unknown_name(place, product, UNITS, ErrorCode.BAD_VALUE)
        if product in shot.products[:index]:
            errors.refuse(f"{field}.products[{index}]", f"repeats {quoted(product)}")


def _vector_problem(values: Vector, limit: float, unit: str) -> str | None:
    """What is wrong with a vector, or None."""
    if all(-limit <= v <= limit for v in values):
        return None
    if not all(math.isfinite(v) for v in values):
        return f"must be finite, got {list(values)}"
    return f"must be at most {limit:g} {unit} along each axis, got {list(values)}"
