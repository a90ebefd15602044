"""Checks the values of a request; the error names the field that cannot be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from simgl.errors import did_you_mean
from simgl_bridge.framing import BadMessageError, one_line, quoted
from simgl_bridge.message_parts import Shot
from simgl_bridge.messages import (
    ErrorCode,
    Message,
    Render,
    State,
)
from simgl_bridge.renderer_messages import ServedJoint, ServedScene
from simgl_bridge.value_ranges import out_of_range

# Products on the wire, and their units.
UNITS = {
    "dn": "DN",
    "radiance": "W m-2 sr-1",
    "electrons": "e-",
    "depth": "m",
    "part_id": "",
    "range": "m",
    "lidar_range": "m",
    "lidar_electrons": "e-",
    "thermal_radiance": "W m-2 sr-1",
    "temperature": "K",
}
_OF_LIDAR = ("lidar_range", "lidar_electrons")
_OF_THERMAL = ("thermal_radiance", "temperature")
_OF_VISIBLE = ("radiance", "electrons", *_OF_LIDAR)
# A name that a client chose may be in it.
_LONGEST_FIELD = 120
# Tolerance of a joint's limits [rad] or [m].
_TOLERANCE = 1e-9

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


def check_ranges(request: Message) -> None:
    """Raises BadMessageError for a value that no scenario allows."""
    invalid = out_of_range(request)
    if invalid is not None:
        field, problem = invalid
        id = None if field == "id" else getattr(request, "id", None)
        raise BadMessageError(ErrorCode.BAD_VALUE, one_line(field, _LONGEST_FIELD), problem, id)


def check_request(scene: ServedScene, request: ImageRequest) -> None:
    """Raises BadMessageError unless a scene has what a request asks for.

    The request has passed ``check_ranges``.
    """
    errors = FieldErrors(request.id)
    if isinstance(request, Render) and request.compression not in ("", *scene.compressions):
        wanted, offered = request.compression, scene.compressions
        errors.unknown_name("compression", wanted, offered, ErrorCode.BAD_VALUE)
    for name in request.lamps:
        if name not in scene.lamps:
            errors.unknown_name("lamps", name, scene.lamps, ErrorCode.NO_LAMP)
    for name, pose in request.bodies.items():
        if name not in scene.models:
            errors.unknown_name("bodies", name, scene.models, ErrorCode.NO_BODY)
        _check_joints(errors, f"bodies.{name}.joints", pose.joints, scene.models[name].joints)
    if not request.cameras:
        errors.refuse("cameras", "must name at least one camera")
    for index, shot in enumerate(request.cameras):
        _check_shot(errors, f"cameras[{index}]", shot, scene)
        if shot.camera in [other.camera for other in request.cameras[:index]]:
            errors.refuse(f"cameras[{index}].camera", f"repeats {quoted(shot.camera)}")


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
    if not shot.products:
        errors.refuse(f"{field}.products", f"must name at least one of {', '.join(UNITS)}")
    for index, product in enumerate(shot.products):
        if product not in UNITS:
            place = f"{field}.products[{index}]"
            errors.unknown_name(place, product, UNITS, ErrorCode.BAD_VALUE)
        if product in _OF_LIDAR and not scene.cameras[shot.camera].lidar:
            problem = f"{quoted(product)} needs a LIDAR, which camera {quoted(shot.camera)} has not"
            errors.refuse(f"{field}.products[{index}]", problem)
        if product in _OF_THERMAL and not scene.cameras[shot.camera].thermal:
            problem = f"{quoted(product)} needs a thermal camera; {quoted(shot.camera)} is none"
            errors.refuse(f"{field}.products[{index}]", problem)
        if product in _OF_VISIBLE and scene.cameras[shot.camera].thermal:
            problem = f"{quoted(product)} is of visible light; {quoted(shot.camera)} is thermal"
            errors.refuse(f"{field}.products[{index}]", problem)
        if product in shot.products[:index]:
            errors.refuse(f"{field}.products[{index}]", f"repeats {quoted(product)}")
