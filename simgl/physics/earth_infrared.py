"""The Earth in the thermal infrared: temperature by latitude, month, local time; its radiance.

A climate in closed form: zonal means of an energy-balance model (North 1975), a seasonal and a
daily swing, one layer of air; cloud is that of the visible image. shaders/infrared_earth draws it,
in a camera's band and, for heat, at all wavelengths. Brightness temperatures of a place are right
to some 10 K, zonal means to 5 K: good for the light that the Earth sends to a spacecraft and for
what stands behind it in an image, not for meteorology.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array
from simgl.physics.constants import STEFAN_BOLTZMANN, WGS84_EQUATORIAL_RADIUS

# Radiance of a black body of temperatures [K], of any band and unit.
Emission = Callable[[Array], Array]

# Of the ground at sea level: mean, and the second Legendre polynomial of the sine of latitude
# (North 1975, J. Atmos. Sci. 32, 2033: 14.97 and -28.0 degrees Celsius) [K].
_MEAN, _SECOND = 288.1, -28.0
# Swing of the year, times the sine of latitude, warmest in the north on day 205; and of the day,
# times the cosine, warmest at 14 h. Estimates between land and sea [K].
_YEAR, _WARMEST_DAY = 10.0, 205.0
_DAY, _WARMEST_HOUR = 4.0, 14.0
# Long-wave flux that leaves the Earth: its mean (Loeb et al. 2018) and how it changes with the
# ground's temperature (North 1975, after Budyko) [W m-2, W m-2 K-1].
MEAN_LONGWAVE, _PER_KELVIN = 240.0, 2.09
# Of clear skies over ground of the mean temperature, so that the mean over the Earth with the usual
# clouds is that; CERES has 266 to 268 (Loeb et al. 2018) [W m-2].
CLEAR_LONGWAVE = 271.0
# Share of that mean swing that sea and land have, so that 29 % of land give the mean.
_SEA_SWING, _LAND_SWING = 0.2, 2.96
# [K m-1] of the standard atmosphere; how far below the ground the absorbing air is [K]; its scale
# height, which is that of water vapour [m]; and the tropopause, which nothing is colder than [K].
_LAPSE, _AIR_COLDER, _AIR_SCALE, _COLDEST_AIR = 6.5e-3, 20.0, 2.5e3, 200.0
# Of thin high cloud [m].
_HIGH_CLOUD = 10e3
# Of the Earth for sunlight in an infrared band.
SUNLIGHT_REFLECTED = 0.1


def clear_transmission(band: tuple[float, float]) -> float:
    """At zenith through a standard atmosphere: estimates for 8-14 and 3-5 um, of band means.

    Between the two windows and beyond them the air is dark: 0.1.

    band : [m]
    """
    middle = 0.5 * (band[0] + band[1])
    if 7e-6 < middle < 14e-6:
        return 0.60
    return 0.45 if middle < 5.5e-6 else 0.10


def longwave_radiance(temperature: ArrayLike, *, separate_clouds: bool) -> Array:
    """(...) radiance to space at all wavelengths of ground at a temperature, or of cloud whose top
    has it [W m-2 sr-1].

    separate_clouds : cloud is drawn; else the flux is that of the usual clouds over such ground

    The flux is linear, as the air over warmer ground holds more vapour (Budyko 1969). Down to cloud
    at 10 km, with little vapour above it, that stays within 10 % of a black body.
    """
    level = CLEAR_LONGWAVE if separate_clouds else MEAN_LONGWAVE
    flux = level + _PER_KELVIN * (np.asarray(temperature, dtype=np.float64) - _MEAN)
    return np.asarray(np.maximum(flux, 0.0) / np.pi)


def temperature_of_flux(flux: float) -> float:
    """Of a black body that sends a flux [W m-2] [K]."""
    return float((flux / STEFAN_BOLTZMANN) ** 0.25)


def grazing_mass(radius: float = WGS84_EQUATORIAL_RADIUS) -> float:
    """Air along a path that leaves the ground horizontally over that at zenith: sqrt(pi R/2H)."""
    return float(np.sqrt(0.5 * np.pi * radius / _AIR_SCALE))


def shader_values(day: float, radius: float, everywhere: float | None = None) -> dict[str, float]:
    """The climate as simgl/passes/background/infrared_earth.py hands it on; lengths in km.

    everywhere : temperature of all the ground, in place of the climate's [K]
    """
    values = {
        "mean_temperature": _MEAN,
        "second_harmonic": _SECOND,
        "season": _YEAR * float(np.cos(2.0 * np.pi * (day - _WARMEST_DAY) / 365.2425)),
        "warmest_hour": 2.0 * np.pi * (_WARMEST_HOUR - 12.0) / 24.0,
        "sea_swing": _DAY * _SEA_SWING,
        "land_swing": _DAY * _LAND_SWING,
        "mean_land": (1.0 - _SEA_SWING) / (_LAND_SWING - _SEA_SWING),
        "air_colder": _AIR_COLDER,
        "lapse": 1e3 * _LAPSE,
        "air_scale_km": 1e-3 * _AIR_SCALE,
        "grazing_mass": grazing_mass(radius),
        "coldest_air": _COLDEST_AIR,
        "high_cloud_km": 1e-3 * _HIGH_CLOUD,
    }
    if everywhere is None:
        return values
    even = dict.fromkeys(("second_harmonic", "season", "sea_swing", "land_swing"), 0.0)
    return values | even | {"mean_temperature": everywhere}
