"""Vertical profiles of the atmosphere's constituents: their densities by height, up to its top.

A profile is a shape; how much there is of a constituent is the vertical optical depth that goes
with it. Heights in m.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from simgl.arrays import Array

# Top of the scattering atmosphere: a vertical ray loses 1e-8 above it, and the limb's light has
# fallen there to that of the night sky [m].
AIR_TOP = 120e3

# Places of a table by height, even in its root: an exponential profile with a scale height of
# 1.2 km is interpolated within 5e-5.
PROFILE_PLACES = 1024


class Profile(Protocol):
    """Density of a constituent, in any unit."""

    def density(self, height: Array) -> Array:
        """At heights (...) [m]."""

    def __hash__(self) -> int:
        """Of its values."""


@dataclass(frozen=True)
class Exponential:
    """Falls by e in every scale height [m]."""

    scale_height: float

    def density(self, height: Array) -> Array:
        """Relative to the ground's."""
        return np.exp(-height / self.scale_height)


@dataclass(frozen=True)
class Layers:
    """Between tabulated heights [m]; outside of them as at the nearest."""

    heights: tuple[float, ...]
    densities: tuple[float, ...]

    def density(self, height: Array) -> Array:
        """In the unit of the table."""
        return np.interp(height, self.heights, self.densities)


@dataclass(frozen=True)
class Sum:
    """Profiles with their shares of the column."""

    parts: tuple[tuple[float, Profile], ...]

    def density(self, height: Array) -> Array:
        """Share of the column in a metre [m-1]."""
        per_column = (share * p.density(height) / column(p) for share, p in self.parts)
        return np.sum([*per_column], axis=0)


# The standard's layers: geopotential height of the foot [m], temperature gradient [K m-1].
_FEET = np.array([0.0, 11e3, 20e3, 32e3, 47e3, 51e3, 71e3])
_GRADIENTS = np.array([-6.5e-3, 0.0, 1e-3, 2.8e-3, 0.0, -2.8e-3, -2e-3])
_RADIUS = 6356766.0  # of the Earth, that turns geometric into geopotential heights [m]
_SEA_TEMPERATURE, _SEA_DENSITY = 288.15, 1.225  # [K], [kg m-3]
_HYDROSTATIC = 9.80665 * 28.9644e-3 / 8.31432  # g M / R [K m-1]
# Above 86 km: geometric height [m], density [kg m-3].
_HIGH = np.array(
    [
        (86e3, 6.958e-6),
        (90e3, 3.416e-6),
        (95e3, 1.393e-6),
        (100e3, 5.604e-7),
        (105e3, 2.325e-7),
        (110e3, 9.708e-8),
        (115e3, 4.289e-8),
        (120e3, 2.222e-8),
    ]
)


@dataclass(frozen=True)
class UsStandard1976:
    """Mass density of the air [kg m-3] in the U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562).

    Up to 86 km by its layers of linear temperature; above by its table, by the logarithm.
    """

    def density(self, height: Array) -> Array:
        """[kg m-3]"""
        geopotential = _RADIUS * height / (_RADIUS + height)
        layer = np.searchsorted(_FEET[1:], geopotential, side="right")
        rise, foot = geopotential - _FEET[layer], _TEMPERATURES[layer]
        fall = _pressure_fall(foot, _GRADIENTS[layer], rise) + _FALLS[layer]
        low = -fall - np.log((foot + _GRADIENTS[layer] * rise) / _SEA_TEMPERATURE)
        high = np.interp(height, _HIGH[:, 0], np.log(_HIGH[:, 1] / _SEA_DENSITY))
        return _SEA_DENSITY * np.exp(np.where(height > _HIGH[0, 0], high, low))


def _pressure_fall(temperature: Array, gradient: Array, rise: Array) -> Array:
    """Logarithm of the pressure at a layer's foot, of this temperature, over that higher up."""
    even = np.where(gradient == 0.0, 1.0, gradient)
    sloping = np.log1p(gradient * rise / temperature) / even
    return _HYDROSTATIC * np.where(gradient == 0.0, rise / temperature, sloping)


_RISES = np.diff(_FEET)
# At the feet: temperature, and the pressure's fall from the ground.
_TEMPERATURES = _SEA_TEMPERATURE + np.cumsum([0.0, *(_GRADIENTS[:-1] * _RISES)])
_FALLS = np.cumsum([0.0, *_pressure_fall(_TEMPERATURES[:-1], _GRADIENTS[:-1], _RISES)])


# Ozone at mid-latitudes, the 1976 standard's: molecules per volume [1e17 m-3] every 2 km from the
# ground (Krueger and Minzner 1976, J. Geophys. Res. 81, 4477). Its lowest value, at 2 km, is taken
# down to the ground.
MIDLATITUDE_OZONE = Layers(
    heights=tuple(np.arange(0.0, 75e3, 2e3).tolist()),
    densities=(
        *(6.8, 6.8, 5.8, 5.7, 6.5, 11.3, 20.2, 23.5, 29.5, 40.4, 47.7, 48.6, 45.4),
        *(40.3, 32.4, 25.2, 20.3, 15.8, 12.2, 8.73, 6.07, 3.98, 2.74, 1.69, 1.03, 0.664),
        *(0.384, 0.255, 0.161, 0.112, 0.0733, 0.0481, 0.0317, 0.0172, 0.0075, 0.0054),
        *(0.0022, 0.0),
    ),
)

# Background aerosol of the stratosphere, autumn and winter: extinction at 550 nm [1e-4 km-1] from
# 10 km up (Shettle and Fenn 1979, AFGL-TR-79-0214, as tabulated in LOWTRAN 7).
STRATOSPHERIC_AEROSOL = Layers(
    heights=(*np.arange(10e3, 26e3, 1e3).tolist(), 30e3, 35e3),
    densities=(
        *(0.0, 7.14, 6.64, 6.23, 6.45, 6.43, 6.41, 6.00, 5.62, 4.91),
        *(4.23, 3.52, 2.95, 2.42, 1.90, 1.50, 0.332, 0.0),
    ),
)


def profile_place(height: Array) -> Array:
    """Of heights (...) [m] in a table of a profile, 0 to 1."""
    return np.sqrt(np.clip(height / AIR_TOP, 0.0, 1.0))


@lru_cache(maxsize=64)
def column(profile: Profile) -> float:
    """Integral of the density from the ground to the top, as the table interpolates it [m]."""
    x = np.linspace(0.0, 1.0, PROFILE_PLACES)
    low, high = (profile.density(AIR_TOP * end**2) for end in (x[:-1], x[1:]))
    # Of a function that is linear in the root of height.
    step = AIR_TOP / 3.0 * (x[1] - x[0])
    return float(np.sum(step * (low * (2.0 * x[:-1] + x[1:]) + high * (x[:-1] + 2.0 * x[1:]))))


def shape(profile: Profile) -> Array:
    """(PROFILE_PLACES,) share of the column in a metre of height [m-1], by ``profile_place``."""
    height = AIR_TOP * np.linspace(0.0, 1.0, PROFILE_PLACES) ** 2
    return profile.density(height) / column(profile)
