"""Values per band and directions in files, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simgl.errors import ConfigError
from simgl.physics.frames import unit

Four = tuple[float, float, float, float]


def _bands(value: float | Sequence[float]) -> Four:
    r, g, b, n = (value,) * 4 if isinstance(value, (int, float)) else value
    return float(r), float(g), float(b), float(n)


def fractions(value: float | Sequence[float], where: str, key: str) -> Four:
    """Four band values 0..1 from one number or four."""
    bands = _bands(value)
    for one in bands:
        if not 0.0 <= one <= 1.0:
            raise ConfigError(where, key, f"must lie in 0..1, got {one:g}")
    return bands


def amounts(value: float | Sequence[float], where: str, key: str) -> Four:
    """Four band values of 0 or more from one number or four."""
    bands = _bands(value)
    for one in bands:
        if one < 0.0:
            raise ConfigError(where, key, f"must be 0 or more, got {one:g}")
    return bands


def direction(value: Sequence[float], where: str, key: str) -> np.ndarray[Any, Any]:
    """(3,) unit vector from three numbers."""
    try:
        return unit(value)
    except ValueError as error:
        raise ConfigError(where, key, str(error)) from None
