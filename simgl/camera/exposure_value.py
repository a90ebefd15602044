"""Exposure values: of an aperture and a time, and of a light."""

from __future__ import annotations

import math

# The exposure value that the software of the source study shows at its setting 0, by its own
# account; 2^9.416 = 683.
BLENDER_ZERO = 9.416

# Constants of reflected- and incident-light meters at ISO 100 (ISO 2720).
_REFLECTED, _INCIDENT = 12.5, 250.0
_ISO = 100.0


def exposure_value(f_number: float, exposure_time: float) -> float:
    """log2(N^2 / t), t in seconds: 16 at f/4 and 1/4096 s."""
    return math.log2(f_number**2 / exposure_time)


def exposure_time(value: float, f_number: float) -> float:
    """The time [s] that gives an exposure value at an f-number."""
    return float(f_number**2 / 2.0**value)


def blender_exposure(value: float) -> float:
    """The setting of the source study's software that stands for an exposure value."""
    return BLENDER_ZERO - value


def value_from_blender(setting: float) -> float:
    """The exposure value that a setting of the source study's software stands for."""
    return BLENDER_ZERO - setting


def value_for_luminance(luminance: float) -> float:
    """The exposure value at ISO 100 that a meter advises for a luminance [cd m-2]."""
    return math.log2(luminance * _ISO / _REFLECTED)


def value_for_illuminance(illuminance: float) -> float:
    """The exposure value at ISO 100 that an incident-light meter advises [lx]."""
    return math.log2(illuminance * _ISO / _INCIDENT)
