"""Value types that the tables of scenario files share, and checks beyond their types.

Bands are in the order R, G, B, N (600-700, 500-600, 400-500, 700-1000 nm).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from msgspec import Meta, Struct

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.physics.frames import unit

Positive = Annotated[float, Meta(gt=0.0)]
NonNegative = Annotated[float, Meta(ge=0.0)]
Fraction = Annotated[float, Meta(ge=0.0, le=1.0)]
Four = tuple[float, float, float, float]
Vector = tuple[float, float, float]
# One number for all bands, or four. Limits are checked by ``fractions`` and ``amounts``: in a
# union, msgspec 0.22 confuses the limits of a number with the length of a tuple.
BandValues = float | Four
Quaternion = Four


class Table(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base of all tables; unknown keys are errors."""


def _bands(value: float | Sequence[float]) -> Four:
    r, g, b, n = (value,) * 4 if isinstance(value, (int, float)) else value
    return float(r), float(g), float(b), float(n)


def fractions(value: float | Sequence[float], where: str, key: str) -> Four:
    """Four band values 0..1 from one number or four; ConfigError for others."""
    bands = _bands(value)
    for one in bands:
        if not 0.0 <= one <= 1.0:
            raise ConfigError(where, key, f"must lie in 0..1, got {one:g}")
    return bands


def amounts(value: float | Sequence[float], where: str, key: str) -> Four:
    """Four non-negative band values from one number or four; ConfigError for others."""
    bands = _bands(value)
    for one in bands:
        if one < 0.0:
            raise ConfigError(where, key, f"must be 0 or more, got {one:g}")
    return bands


def direction(value: Sequence[float], where: str, key: str) -> Array:
    """(3,) unit vector from three numbers; ConfigError for zeros."""
    try:
        return unit(value)
    except ValueError as error:
        raise ConfigError(where, key, str(error)) from None
