"""Checks of the values that a program gives: each raises ValueError with name, limits and value."""

from __future__ import annotations

from collections.abc import Collection
from math import inf
from operator import index
from typing import Any

from simgl.physics.spectrum import CHANNELS

# Seeds are 32 bits wide, and so are the numbers of draws.
LARGEST_SEED = 2**32 - 1

# Times are TAI nanoseconds in 64 bits.
LARGEST_TIME = 2**63 - 1


def check_integer(name: str, value: Any, low: int, high: int) -> None:
    """``value`` must be an integer of Python or numpy from ``low`` to ``high``."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise ValueError(f"{name} must be an integer, got {value!r:.80}")
    if not low <= index(value) <= high:
        raise ValueError(f"{name} must lie in {low}..{high}, got {value}")


def check_within(name: str, value: Any, low: float, high: float = inf) -> None:
    """``value`` must be a finite number from ``low`` to ``high``."""
    if not (_is_number(value) and low <= value <= high and abs(value) < inf):
        limits = f"be {low:g} or more" if high == inf else f"lie in {low:g}..{high:g}"
        raise ValueError(f"{name} must {limits}, got {_shown(value)}")


def check_bands(name: str, values: Collection[float]) -> None:
    """``values`` must be one fraction from 0 to 1 for each channel."""
    if len(values) != CHANNELS:
        raise ValueError(f"{name} must have {CHANNELS} bands, got {len(values)}")
    for value in values:
        check_within(name, value, 0.0, 1.0)


def check_positive(name: str, value: Any) -> None:
    """``value`` must be a finite number above 0."""
    if not (_is_number(value) and 0.0 < value < inf):
        raise ValueError(f"{name} must be above 0, got {_shown(value)}")


def check_choice(name: str, value: Any, allowed: Collection[str]) -> None:
    """``value`` must be one of some texts."""
    if value not in allowed:
        raise ValueError(f"{name} must be one of {', '.join(allowed)}, got {_shown(value)}")


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return not isinstance(value, str | bytes | bool)


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else f"{value!r:.80}"
