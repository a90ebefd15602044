"""The messages of Basilisk's vizInterface that a camera needs: protobuf by field number.

All other fields are skipped, so messages of newer versions are read too. The encoding is that of
https://protobuf.dev/programming-guides/encoding (proto3).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from simgl.errors import BridgeError

# Wire types.
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
# A repeated number has at most nine values in these messages.
_MAX_NUMBERS = 64


class UnreadableError(BridgeError):
    """Bytes that are not such a message."""


# Fields of messages carry their number on the wire beside their type; a tuple is a repeated field.


@dataclass(frozen=True, kw_only=True)
class Instant:
    """frame_number : counts the updates; sim_time_ns : elapsed, a double on the wire."""

    frame_number: Annotated[int, 1] = field(default=0, compare=False)
    sim_time_ns: Annotated[float, 2] = 0.0


@dataclass(frozen=True, kw_only=True)
class Epoch:
    """A calendar date; the time scale is not on the wire."""

    year: Annotated[int, 1] = 0
    month: Annotated[int, 2] = 0
    day: Annotated[int, 3] = 0
    hours: Annotated[int, 4] = 0
    minutes: Annotated[int, 5] = 0
    seconds: Annotated[float, 6] = 0.0


@dataclass(frozen=True, kw_only=True)
class CelestialBody:
    """position [m], velocity [m/s]; rotation is row-major, fixed axes from J2000; radius_km."""

    name: Annotated[str, 1] = ""
    position: Annotated[tuple[float, ...], 2] = ()
    velocity: Annotated[tuple[float, ...], 3] = ()
    rotation: Annotated[tuple[float, ...], 4] = ()
    radius_km: Annotated[float, 6] = 0.0
    radius_ratio: Annotated[float, 7] = 0.0


@dataclass(frozen=True, kw_only=True)
class Light:
    """A lamp of a spacecraft; only its name is read."""

    label: Annotated[str, 1] = ""


@dataclass(frozen=True, kw_only=True)
class SpacecraftState:
    """position [m], velocity [m/s] in J2000 axes; sigma_BN : modified Rodrigues parameters."""

    name: Annotated[str, 1] = ""
    position: Annotated[tuple[float, ...], 2] = ()
    velocity: Annotated[tuple[float, ...], 3] = ()
    sigma_BN: Annotated[tuple[float, ...], 4] = ()
    lights: Annotated[tuple[Light, ...], 12] = ()
    model: Annotated[str, 13] = ""


@dataclass(frozen=True, kw_only=True)
class CameraConfig:
    """A camera as Basilisk sends it.

    field_of_view_deg : edge to edge along the image's height
    resolution : width, height
    position_B : [m]
    direction_B : modified Rodrigues parameters, not a direction; see ``viz_scene``
    render_mode : 1 asks for depth
    """

    id: Annotated[int, 1] = 0
    parent: Annotated[str, 2] = ""
    field_of_view_deg: Annotated[float, 3] = 0.0
    resolution: Annotated[tuple[int, ...], 4] = ()
    position_B: Annotated[tuple[float, ...], 7] = ()
    direction_B: Annotated[tuple[float, ...], 8] = ()
    post_processing: Annotated[int, 11] = 0
    render_mode: Annotated[int, 16] = 0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """ambient : share of uniform ambient light that is asked for."""

    ambient: Annotated[float, 1] = 0.0


@dataclass(frozen=True, kw_only=True)
class Live:
    """Settings of a live stream."""

    terminate: Annotated[int, 3] = 0


@dataclass(frozen=True, kw_only=True)
class Update:
    """One state of the simulation. Two are equal if their images are.

    settings, epoch : in the first messages, and later not always
    """

    instant: Annotated[Instant, 1] = Instant()
    bodies: Annotated[tuple[CelestialBody, ...], 2] = ()
    spacecraft: Annotated[tuple[SpacecraftState, ...], 3] = ()
    cameras: Annotated[tuple[CameraConfig, ...], 4] = ()
    settings: Annotated[Settings | None, 7] = None
    epoch: Annotated[Epoch | None, 8] = None
    live: Annotated[Live | None, 10] = None


_Message = TypeVar("_Message")


def read_update(data: bytes) -> Update:
    """The state in a SIM_UPDATE; raises UnreadableError where there is none."""
    return _read(Update, memoryview(data))


def read_recording(data: bytes) -> Iterator[Update]:
    """The states of a ``_UnityViz.bin`` file, each with its length before it.

    Raises UnreadableError where the file is damaged, after the states before that.
    """
    view, offset = memoryview(data), 0
    while offset < len(view):
        length, offset = _varint(view, offset)
        if length > len(view) - offset:
            raise UnreadableError(f"ends {length - (len(view) - offset)} bytes early")
        yield _read(Update, view[offset : offset + length])
        offset += length


def _fields(cls: type) -> dict[int, tuple[str, type, bool]]:
    """Name, type and whether it repeats, of each field of a message by its number."""
    table = {}
    for name, hint in get_type_hints(cls, include_extras=True).items():
        kind, number = get_args(hint)
        # (float, ...) of a tuple, (Epoch, None) of an optional message, () of a plain type.
        arguments = get_args(kind)
        table[number] = name, arguments[0] if arguments else kind, get_origin(kind) is tuple
    return table


_MESSAGES = (
    *(Instant, Epoch, CelestialBody, Light, SpacecraftState),
    *(CameraConfig, Settings, Live, Update),
)
_FIELDS: dict[type, dict[int, tuple[str, type, bool]]] = {cls: _fields(cls) for cls in _MESSAGES}


def _read(cls: type[_Message], data: memoryview) -> _Message:
    known = _FIELDS[cls]
    values: dict[str, Any] = {}
    for number, wire, value in _records(data):
        if number not in known:
            continue
        name, kind, repeated = known[number]
        if repeated:
            values.setdefault(name, []).extend(_items(kind, wire, value, name))
        else:
            values[name] = _item(kind, wire, value, name)
    return cls(**{n: tuple(v) if isinstance(v, list) else v for n, v in values.items()})


def _records(data: memoryview) -> Iterator[tuple[int, int, Any]]:
    """Number, wire type and raw value of the fields in a message."""
    offset = 0
    while offset < len(data):
        tag, offset = _varint(data, offset)
        number, wire = tag >> 3, tag & 7
        if wire == _VARINT:
            value, offset = _varint(data, offset)
            yield number, wire, value
            continue
        if wire == _BYTES:
            size, offset = _varint(data, offset)
        elif wire in (_FIXED64, _FIXED32):
            size = 8 if wire == _FIXED64 else 4
        else:
            raise UnreadableError(f"field {number} has the unknown wire type {wire}")
        if size > len(data) - offset:
            raise UnreadableError(f"field {number} ends {size - len(data) + offset} bytes early")
        yield number, wire, data[offset : offset + size]
        offset += size


def _varint(data: memoryview, offset: int) -> tuple[int, int]:
    value = 0
    for count in range(10):
        if offset >= len(data):
            raise UnreadableError("ends inside a number")
        byte = data[offset]
        offset += 1
        value |= (byte & 0x7F) << (7 * count)
        if byte < 0x80:
            return value & (2**64 - 1), offset
    raise UnreadableError("a number has more than 10 bytes")


def _items(kind: type, wire: int, value: Any, name: str) -> list[Any]:
    """The values of a repeated field: numbers may come packed into one."""
    if wire != _BYTES or kind not in (int, float):
        return [_item(kind, wire, value, name)]
    if len(value) > 10 * _MAX_NUMBERS:
        raise UnreadableError(f"{name} has {len(value)} bytes of numbers")
    if kind is float:
        if len(value) % 8:
            raise UnreadableError(f"{name} has {len(value)} bytes, no multiple of 8")
        return [v for (v,) in struct.iter_unpack("<d", value)]
    numbers, offset = [], 0
    while offset < len(value):
        number, offset = _varint(value, offset)
        numbers.append(_signed(number))
    return numbers


def _item(kind: type, wire: int, value: Any, name: str) -> Any:
    if kind is int and wire == _VARINT:
        return _signed(value)
    if kind is float and wire == _FIXED64:
        return struct.unpack("<d", value)[0]
    if kind is str and wire == _BYTES:
        return bytes(value).decode("utf-8", errors="replace")
    if kind in _FIELDS and wire == _BYTES:
        return _read(kind, value)
    raise UnreadableError(f"{name} has the wire type {wire}")


def _signed(value: int) -> int:
    return value - 2**64 if value >= 2**63 else value
