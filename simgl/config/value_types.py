"""Kinds of values that the tables of scenario files share.

Bands are in the order R, G, B, N (600-700, 500-600, 400-500, 700-1000 nm).
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Positive = Annotated[float, Meta(gt=0.0)]
NonNegative = Annotated[float, Meta(ge=0.0)]
Fraction = Annotated[float, Meta(ge=0.0, le=1.0)]
Vector = tuple[float, float, float]
# One number for all bands, or four. The limits 0..1 are checked by the loader: msgspec 0.22 mixes
# up the limits of a number with the length of a tuple where the two form a union.
BandValues = float | tuple[float, float, float, float]
Quaternion = tuple[float, float, float, float]


class Table(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of the file."""
