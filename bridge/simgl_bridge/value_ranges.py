"""Ranges of the values in messages: the schema names them, requests are checked against them.

``docs/protocol.md`` is generated from the same annotations.
"""

from __future__ import annotations

import math
import types
import typing
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Protocol

import msgspec

from simgl.physics.constants import LIGHT_SPEED
from simgl.physics.ephemeris import FIRST_YEAR, LAST_YEAR, tai_ns_from_utc
from simgl.physics.frames import QUATERNION_NORM_TOLERANCE, matrix_from_quaternion

# The largest integer that every language holds.
LARGEST_INTEGER = 2**63 - 1
# The noise generator takes keys and counters of 32 bits.
LARGEST_SEED = LARGEST_DRAW = 2**32 - 1
# One hour: longer than any client waits.
LONGEST_DEADLINE_MS = 3_600_000
# An image of fixed bodies is meaningless long before an hour [s].
LONGEST_EXPOSURE = 3600.0
# More than any converter has [DN/e-]; a float32 electron count times this stays finite.
LARGEST_GAIN = 1e6
# 7 au [m]: enough for any mission near the Earth, and far from where float64 overflows.
FARTHEST = 1e12
# Nearer than this the Earth would be inside the Sun [m].
NEAREST_SUN = 1e9
# Sixteen turns a second [rad s-1].
FASTEST_TURN = 100.0


class Limits(Protocol):
    """What a value may be; ``str`` of it completes the sentence "a value ..."."""

    def problem(self, value: Any) -> str | None:
        """What is wrong with a value, or None."""


@dataclass(frozen=True)
class Range:
    """Of a number, both bounds included.

    name : of the range, where it has one
    """

    low: float
    high: float
    unit: str = ""
    name: str = ""

    def __str__(self) -> str:
        high = "2^63-1" if self.high == LARGEST_INTEGER else _shown(self.high)
        numbers = f"{_shown(self.low)}..{high} {self.unit}".strip()
        return f"in {self.name} ({numbers})" if self.name else f"in {numbers}"

    def problem(self, value: float) -> str | None:
        """What is wrong with a number, or None."""
        if self.low <= value <= self.high:
            return None
        return f"must lie {self}, got {_shown(value)}"


@dataclass(frozen=True)
class Positive:
    """A number above zero."""

    high: float
    unit: str

    def __str__(self) -> str:
        return f"above 0, up to {_shown(self.high)} {self.unit}"

    def problem(self, value: float) -> str | None:
        """What is wrong with a number, or None."""
        return None if 0.0 < value <= self.high else f"must lie {self}, got {_shown(value)}"


@dataclass(frozen=True)
class Components:
    """A vector whose components are limited, and its distance from the Earth where it has one."""

    high: float
    unit: str
    nearest: float = 0.0

    def __str__(self) -> str:
        return f"{self._components}, {self._distance}" if self.nearest else self._components

    @property
    def _components(self) -> str:
        return f"at most {_shown(self.high)} {self.unit} along each axis"

    @property
    def _distance(self) -> str:
        return f"at least {_shown(self.nearest)} {self.unit} from the Earth"

    def problem(self, value: Sequence[float]) -> str | None:
        """What is wrong with a vector of three components, or None."""
        x, y, z = map(abs, value)
        if not (x <= self.high and y <= self.high and z <= self.high):
            if not all(map(math.isfinite, value)):
                return f"must be finite, got {list(value)}"
            return f"must be {self._components}, got {list(value)}"
        if self.nearest and (distance := math.hypot(*value)) < self.nearest:
            return f"must be {self._distance}, got {distance:g} {self.unit}"
        return None


@dataclass(frozen=True)
class UnitQuaternion:
    """Four numbers x y z w of norm 1, as ``matrix_from_quaternion`` takes them."""

    def __str__(self) -> str:
        return f"of norm 1, within {QUATERNION_NORM_TOLERANCE:g}"

    def problem(self, value: Sequence[float]) -> str | None:
        """What is wrong with a quaternion x y z w, or None."""
        x, y, z, w = value
        # Most are, and the matrix takes ten times as long.
        if abs(math.sqrt(x * x + y * y + z * z + w * w) - 1.0) <= QUATERNION_NORM_TOLERANCE:
            return None
        try:
            matrix_from_quaternion(value)
        except ValueError as error:
            return str(error)
        return None


def _shown(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    short = f"{value:g}"
    # Not rounded, so that a value beyond a bound never looks like the bound.
    return short if float(short) == value or not math.isfinite(value) else f"{value:.17g}"


_Vector = tuple[float, float, float]

Id = Annotated[int, Range(0, LARGEST_INTEGER)]
Seed = Annotated[int, Range(0, LARGEST_SEED)]
Draw = Annotated[int, Range(0, LARGEST_DRAW)]
DeadlineMs = Annotated[int, Range(1, LONGEST_DEADLINE_MS, "ms")]
TaiNs = Annotated[
    int,
    Range(
        tai_ns_from_utc(f"{FIRST_YEAR}-01-01"),
        tai_ns_from_utc(f"{LAST_YEAR}-12-31T23:59:59.999999999"),
        name=f"the years {FIRST_YEAR} to {LAST_YEAR}",
    ),
]
Share = Annotated[float, Range(0, 1)]
ExposureTime = Annotated[float, Positive(LONGEST_EXPOSURE, "s")]
Gain = Annotated[float, Positive(LARGEST_GAIN, "DN/e-")]
Position = Annotated[_Vector, Components(FARTHEST, "m")]
SunPosition = Annotated[_Vector, Components(FARTHEST, "m", nearest=NEAREST_SUN)]
Velocity = Annotated[_Vector, Components(LIGHT_SPEED, "m/s")]
AngularVelocity = Annotated[_Vector, Components(FASTEST_TURN, "rad/s")]
Attitude = Annotated[tuple[float, float, float, float], UnitQuaternion()]

# Field, relative to the value that was checked, and its problem.
Invalid = tuple[str, str] | None
_Check = Callable[[Any], Invalid]


def out_of_range(message: msgspec.Struct) -> Invalid:
    """Field and problem of the first value of a message that is out of its range, or None."""
    check = _check_of(type(message))
    return None if check is None else check(message)


@cache
def _check_of(kind: Any) -> _Check | None:
    """The check of a type's values; None where any value will do."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is Annotated:
        return _checked_by(arguments[1])
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return _fields_check(kind)
    if origin in (typing.Union, types.UnionType):
        (inner,) = (a for a in arguments if a is not type(None))
        check = _check_of(inner)
        return None if check is None else lambda value: None if value is None else check(value)
    if origin is dict:
        return _items_check(_check_of(arguments[1]), lambda entries: entries.items())
    if origin is tuple and arguments[-1] is Ellipsis:
        return _items_check(_check_of(arguments[0]), enumerate)
    return None


def _checked_by(limits: Limits) -> _Check:
    def check(value: Any) -> Invalid:
        problem = limits.problem(value)
        return None if problem is None else ("", problem)

    return check


def _fields_check(kind: type[msgspec.Struct]) -> _Check | None:
    checks = [(f.name, c) for f in msgspec.structs.fields(kind) if (c := _check_of(f.type))]

    def check(value: Any) -> Invalid:
        for name, of_field in checks:
            if invalid := of_field(getattr(value, name)):
                return _joined(name, invalid)
        return None

    return check if checks else None


def _items_check(
    of_item: _Check | None, items: Callable[[Any], typing.Iterable[tuple[Any, Any]]]
) -> _Check | None:
    def check(value: Any) -> Invalid:
        assert of_item is not None
        for key, item in items(value):
            if invalid := of_item(item):
                name = f"[{key}]" if isinstance(key, int) else str(key)
                return _joined(name, invalid)
        return None

    return None if of_item is None else check


def _joined(name: str, invalid: tuple[str, str]) -> tuple[str, str]:
    inner, problem = invalid
    separator = "." if inner and not inner.startswith("[") else ""
    return f"{name}{separator}{inner}", problem
