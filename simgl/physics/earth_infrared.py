"""The Earth in the thermal infrared: temperature by latitude, month, local time; its radiance.

A climate in closed form, without weather: zonal means of an energy-balance model (North 1975), a
seasonal and a daily swing, one layer of air and one of cloud. Brightness temperatures of a
place are right to some 10 K, zonal means to 5 K: good for the light that the Earth sends to a
spacecraft and for what stands behind it in an image, not for meteorology.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS

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
# Share of that mean swing that sea and land have, so that 29 % of land give the mean.
_SEA_SWING, _LAND_SWING = 0.2, 2.96
# [K m-1] of the standard atmosphere; how far below the ground the absorbing air is [K]; its scale
# height, which is that of water vapour [m]; and the tropopause, which nothing is colder than [K].
_LAPSE, _AIR_COLDER, _AIR_SCALE, _COLDEST_AIR = 6.5e-3, 20.0, 2.5e3, 200.0
# Of thin high cloud [m].
_HIGH_CLOUD = 10e3


@dataclass(frozen=True)
class InfraredAir:
    """The air in a band.

    transmission : at zenith, to space, of clear air; 1 without air
    cloud_cover, cloud_height : share of the ground below cloud, and its top [m]
    reflectance : of the Earth for sunlight in the band
    """

    transmission: float
    cloud_cover: float
    cloud_height: float
    reflectance: float = 0.1


def clear_transmission(band: tuple[float, float]) -> float:
    """At zenith through a standard atmosphere: estimates for 8-14 and 3-5 um, of band means.

    Between the two windows and beyond them the air is dark: 0.1.

    band : [m]
    """
    middle = 0.5 * (band[0] + band[1])
    if 7e-6 < middle < 14e-6:
        return 0.60
    return 0.45 if middle < 5.5e-6 else 0.10


def ground_temperature(sin_latitude: ArrayLike, day: float, hour: ArrayLike) -> Array:
    """(...) of the ground [K].

    sin_latitude, hour : (...) hour of local solar time
    day : of the year
    """
    x = np.asarray(sin_latitude, dtype=np.float64)
    daily = _DAY * np.sqrt(np.maximum(1.0 - x * x, 0.0))
    swing = np.cos(2.0 * np.pi * (np.asarray(hour) - _WARMEST_HOUR) / 24.0)
    return zonal_temperature(x, day) + daily * swing


def zonal_temperature(sin_latitude: ArrayLike, day: float) -> Array:
    """(...) mean over a day and a circle of latitude [K]."""
    x = np.asarray(sin_latitude, dtype=np.float64)
    season = np.cos(2.0 * np.pi * (day - _WARMEST_DAY) / 365.2425)
    return np.asarray(_MEAN + _SECOND * 0.5 * (3.0 * x * x - 1.0) + _YEAR * x * season)


def outgoing_longwave(sin_latitude: ArrayLike, day: float) -> Array:
    """(...) flux that leaves the Earth at all wavelengths, in the mean over a day [W m-2]."""
    return MEAN_LONGWAVE + _PER_KELVIN * (zonal_temperature(sin_latitude, day) - _MEAN)


def grazing_mass(radius: float = WGS84_EQUATORIAL_RADIUS) -> float:
    """Air along a path that leaves the ground horizontally over that at zenith: sqrt(pi R/2H)."""
    return float(np.sqrt(0.5 * np.pi * radius / _AIR_SCALE))


def air_mass(view_cosine: Array) -> Array:
    """(...) air along a path that leaves the ground at a cosine, over that at zenith.

    1 / sqrt(mu^2 + 2 H / pi R): an exponential layer around a sphere, exact along the vertical and
    the horizon, 8 % off between.
    """
    return np.asarray(1.0 / np.sqrt(np.asarray(view_cosine) ** 2 + grazing_mass() ** -2))


def shader_values(day: float, radius: float) -> dict[str, float]:
    """The climate as simgl/passes/background/infrared_earth.py hands it on; lengths in km."""
    return {
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


def earth_radiance(
    temperature: Array, view_cosine: Array, air: InfraredAir, emission: Emission
) -> Array:
    """(...) radiance towards space of ground, cloud and air, of black emitters.

    temperature : (...) of the ground [K]
    view_cosine : (...) of the angle between the vertical and the line of sight there
    emission : radiance of a black body in the band

    Clear: t B(T) + (1 - t) B(T - 20 K) with t the transmission along the path; cloudy:
    B(T - 6.5 K km-1 h).
    """
    grid = np.linspace(150.0, 340.0, 191)
    known = emission(grid)

    def black(t: Array) -> Array:
        return np.interp(t, grid, known)

    path = air.transmission ** air_mass(view_cosine)
    clear = path * black(temperature) + (1.0 - path) * black(temperature - _AIR_COLDER)
    cloud = black(temperature - _LAPSE * air.cloud_height)
    return np.asarray((1.0 - air.cloud_cover) * clear + air.cloud_cover * cloud)
