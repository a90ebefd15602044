"""The messages of Basilisk's vizInterface that a camera needs: protobuf by field number.

Only what is read here is kept; every other field is skipped, so newer messages are read too. The
encoding is that of https://protobuf.dev/programming-guides/encoding (proto3).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar

from simgl.errors import BridgeError

# Wire types.
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
# A list of numbers has nine at most in these messages.
_MAX_NUMBERS = 64


class UnreadableError(BridgeError):
    """Bytes that are no such message."""


@dataclass(frozen=True, kw_only=True)
class Instant:
    """frame_number : counts the updates; sim_time_ns : elapsed, a double on the wire."""

    frame_number: int = field(default=0, compare=False)
    sim_time_ns: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Epoch:
    """A calendar date; the time scale is not on the wire."""

    year: int = 0
    month: int = 0
    day: int = 0
    hours: int = 0
    minutes: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, kw_only=True)
class CelestialBody:
    """position [m], velocity [m/s]; rotation is row-major, fixed axes from J2000; radius_km."""

    name: str = ""
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    rotation: tuple[float, ...] = ()
    radius_km: float = 0.0
    radius_ratio: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Light:
    """A lamp of a spacecraft, of which only the name is of use here."""

    label: str = ""


@dataclass(frozen=True, kw_only=True)
class SpacecraftState:
    """position [m], velocity [m/s] in J2000 axes; sigma_BN : modified Rodrigues parameters."""

    name: str = ""
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    sigma_BN: tuple[float, ...] = ()
    lights: tuple[Light, ...] = ()
    model: str = ""


@dataclass(frozen=True, kw_only=True)
class CameraConfig:
    """A camera as Basilisk sends it.

    field_of_view_deg : edge to edge along the image's height
    resolution : width, height
    position_B : [m]
    direction_B : modified Rodrigues parameters, not a direction; see ``scene``
    render_mode : 1 asks for depth
    """

    id: int = 0
    parent: str = ""
    field_of_view_deg: float = 0.0
    resolution: tuple[int, ...] = ()
    position_B: tuple[float, ...] = ()
    direction_B: tuple[float, ...] = ()
    post_processing: int = 0
    render_mode: int = 0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """ambient : share of light from everywhere that is asked for."""

    ambient: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Live:
    """What a simulation says while it runs."""

    terminate: int = 0


@dataclass(frozen=True, kw_only=True)
class Update:
    """One state of the simulation. Two are equal where a picture of them is.

    settings, epoch : in the first messages, and later not always
    """

    instant: Instant = Instant()
    bodies: tuple[CelestialBody, ...] = ()
    spacecraft: tuple[SpacecraftState, ...] = ()
    cameras: tuple[CameraConfig, ...] = ()
    settings: Settings | None = None
    epoch: Epoch | None = None
    live: Live | None = None


# Field number to attribute and kind; a list says that the field repeats.
_FIELDS: dict[type, dict[int, tuple[str, Any]]] = {
    Instant: {1: ("frame_number", int), 2: ("sim_time_ns", float)},
    Epoch: {
        1: ("year", int),
        2: ("month", int),
        3: ("day", int),
        4: ("hours", int),
        5: ("minutes", int),
        6: ("seconds", float),
    },
    CelestialBody: {
        1: ("name", str),
        2: ("position", [float]),
        3: ("velocity", [float]),
        4: ("rotation", [float]),
        6: ("radius_km", float),
        7: ("radius_ratio", float),
    },
    Light: {1: ("label", str)},
    SpacecraftState: {
        1: ("name", str),
        2: ("position", [float]),
        3: ("velocity", [float]),
        4: ("sigma_BN", [float]),
        12: ("lights", [Light]),
        13: ("model", str),
    },
    CameraConfig: {
        1: ("id", int),
        2: ("parent", str),
        3: ("field_of_view_deg", float),
        4: ("resolution", [int]),
        7: ("position_B", [float]),
        8: ("direction_B", [float]),
        11: ("post_processing", int),
        16: ("render_mode", int),
    },
    Settings: {1: ("ambient", float)},
    Live: {3: ("terminate", int)},
    Update: {
        1: ("instant", Instant),
        2: ("bodies", [CelestialBody]),
        3: ("spacecraft", [SpacecraftState]),
        4: ("cameras", [CameraConfig]),
        7: ("settings", Settings),
        8: ("epoch", Epoch),
        10: ("live", Live),
    },
}

_Message = TypeVar("_Message")


def read_update(data: bytes) -> Update:
    """The state in a SIM_UPDATE; raises UnreadableError where there is none."""
    return _read(Update, memoryview(data))


def read_recording(data: bytes) -> Iterator[Update]:
    """The states of a ``_UnityViz.bin`` file, each with its length before it.

    Raises UnreadableError where the file is damaged, after the states before that.
    """
    view, place = memoryview(data), 0
    while place < len(view):
        length, place = _varint(view, place)
        if length > len(view) - place:
            raise UnreadableError(f"ends {length - (len(view) - place)} bytes early")
        yield _read(Update, view[place : place + length])
        place += length


def _read(cls: type[_Message], data: memoryview) -> _Message:
    known = _FIELDS[cls]
    values: dict[str, Any] = {}
    for number, wire, value in _records(data):
        if number not in known:
            continue
        name, kind = known[number]
        if isinstance(kind, list):
            values.setdefault(name, []).extend(_items(kind[0], wire, value, name))
        else:
            values[name] = _item(kind, wire, value, name)
    return cls(**{n: tuple(v) if isinstance(v, list) else v for n, v in values.items()})


def _records(data: memoryview) -> Iterator[tuple[int, int, Any]]:
    """Number, wire type and raw value of the fields in a message."""
    place = 0
    while place < len(data):
        tag, place = _varint(data, place)
        number, wire = tag >> 3, tag & 7
        if wire == _VARINT:
            value, place = _varint(data, place)
            yield number, wire, value
            continue
        if wire == _BYTES:
            size, place = _varint(data, place)
        elif wire in (_FIXED64, _FIXED32):
            size = 8 if wire == _FIXED64 else 4
        else:
            raise UnreadableError(f"field {number} has the unknown wire type {wire}")
        if size > len(data) - place:
            raise UnreadableError(f"field {number} ends {size - len(data) + place} bytes early")
        yield number, wire, data[place : place + size]
        place += size


def _varint(data: memoryview, place: int) -> tuple[int, int]:
    value = 0
    for count in range(10):
        if place >= len(data):
            raise UnreadableError("ends inside a number")
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << (7 * count)
        if byte < 0x80:
            return value & (2**64 - 1), place
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
    numbers, place = [], 0
    while place < len(value):
        number, place = _varint(value, place)
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
