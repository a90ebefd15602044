"""The planets that the eye sees: places, magnitudes and colours.

Positions are SOFA's plan94 (Simon et al. 1994), with the light's travel time. Against DE200 they
err by at most 4, 5, 17, 71 and 81 arcsec in longitude from the Sun for Mercury, Venus, Mars,
Jupiter and Saturn (rms; SOFA's notes), from 1800 to 2050.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import erfa
import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import ASTRONOMICAL_UNIT, LIGHT_SPEED
from simgl.physics.ephemeris import earth_motion, julian_date_tt
from simgl.physics.frames import norm
from simgl.physics.spectrum import BANDS, Bands
from simgl.physics.starlight import band_irradiance

# Name, number in plan94, B-V of the whole disc (Allen's Astrophysical Quantities, 4th ed., table
# 12.6), V-I from the Sun's 0.70 and the ratio of the albedos at 800 and 545 nm, good to 0.15 mag.
_PLANETS = (
    ("mercury", 1, 0.93, 1.0),
    ("venus", 2, 0.82, 0.75),
    ("mars", 4, 1.36, 1.3),
    ("jupiter", 5, 0.83, 0.4),
    ("saturn", 6, 1.04, 0.8),
)
# To Saturn's north pole: right ascension, declination [deg] (IAU, Archinal et al. 2018).
_SATURN_POLE = np.radians([40.589, 83.537])
# Phase angles between which the laws of Mercury and Venus were measured [deg].
_MERCURY, _VENUS = (2.0, 170.0), (0.0, 179.0)
_DAY = 86400.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Planet:
    """A planet at an instant, as the Earth's centre sees it without aberration.

    magnitude : Johnson's V
    position : (3,) from the Earth's centre, at the time that the light left it [m], ICRF
    irradiance : (4,) per band, facing it [W m-2]
    """

    name: str
    magnitude: float
    position: Array
    irradiance: Array


def planets(tai_ns: int, bands: Bands = BANDS) -> tuple[Planet, ...]:
    """Mercury, Venus, Mars, Jupiter and Saturn at an epoch."""
    result = []
    for (name, *_), of_magnitude_0, from_sun, from_earth in zip(
        _PLANETS, _magnitude_0(bands), *_places(tai_ns), strict=True
    ):
        v = magnitude(name, from_sun, from_earth)
        light, position = 10.0 ** (-0.4 * v) * of_magnitude_0, from_earth * ASTRONOMICAL_UNIT
        result.append(Planet(name=name, magnitude=v, position=position, irradiance=light))
    return tuple(result)


@lru_cache(maxsize=8)
def _magnitude_0(bands: Bands) -> Array:
    """(n, 4) irradiance of each planet at V = 0 [W m-2]."""
    b_v, v_i = (np.array([planet[column] for planet in _PLANETS]) for column in (2, 3))
    light = band_irradiance(np.zeros(len(b_v)), b_v, v_i, bands)
    light.flags.writeable = False
    return light


def _places(tai_ns: int) -> tuple[Array, Array]:
    """(n, 3) of each planet from the Sun and from the Earth [au], when the light left that arrives
    at an epoch."""
    earth = earth_motion(tai_ns)[0]["p"]
    motion = erfa.plan94(*julian_date_tt(tai_ns), [number for _, number, *_ in _PLANETS])
    from_sun = now = np.asarray(motion["p"])
    # Straight on for minutes: of Mercury's orbit 3e-8 au are lost. Planets move at less than 2e-4
    # of light's speed: the second round is exact to 1e-8 of the way.
    for _ in range(2):
        distance = np.linalg.norm(from_sun - earth, axis=1, keepdims=True) * ASTRONOMICAL_UNIT
        from_sun = now - motion["v"] * (distance / LIGHT_SPEED / _DAY)
    return from_sun, from_sun - earth


def magnitude(name: str, from_sun: Array, from_earth: Array) -> float:
    """V of a planet at (3,) places from the Sun and from the observer [au].

    Mallama & Hilton (2018, Astronomy and Computing 25, 10), equations 2 to 13, good to 0.05 mag.
    Of Mars the rotation and the season are left out, up to 0.1 mag; Saturn is with its rings.
    """
    r, d = norm(from_sun), norm(from_earth)
    cosine = float(from_sun @ from_earth) / (r * d)
    a = float(np.degrees(np.arccos(min(max(cosine, -1.0), 1.0))))
    far = 5.0 * float(np.log10(r * d))
    match name:
        case "mercury":
            terms = (-0.613, 6.3280e-2, -1.6336e-3, 3.3644e-5, -3.4265e-7, 1.6893e-9, -3.0334e-12)
            return far + _series(float(np.clip(a, *_MERCURY)), terms)
        case "venus" if a < 163.7:
            return far + _series(a, (-4.384, -1.044e-3, 3.687e-4, -2.814e-6, 8.938e-9))
        case "venus":
            return far + _series(min(a, _VENUS[1]), (236.05828, -2.81914, 8.39034e-3))
        case "mars" if a <= 50.0:
            return far + _series(a, (-1.601, 2.267e-2, -1.302e-4))
        case "mars":
            return far + _series(a, (-0.367, -0.02573, 3.445e-4))
        case "jupiter":
            return far + _series(a, (-9.395, -3.7e-4, 6.16e-4))
        case _:
            tilt = _ring_tilt(from_sun, from_earth)
            return far - 8.914 - 1.825 * tilt + 0.026 * a - 0.378 * tilt * float(np.exp(-2.25 * a))


def _series(a: float, terms: tuple[float, ...]) -> float:
    # By Horner's rule: numpy takes twenty times as long for one value.
    total = 0.0
    for term in reversed(terms):
        total = total * a + term
    return total


def _ring_tilt(from_sun: Array, from_earth: Array) -> float:
    """Sine of the rings' tilt, between that to the Sun and to the Earth; 0 where these see
    different faces."""
    a, d = _SATURN_POLE
    pole = np.array([np.cos(d) * np.cos(a), np.cos(d) * np.sin(a), np.sin(d)])
    to_sun, to_earth = (float(pole @ v / norm(v)) for v in (from_sun, from_earth))
    angles = float(np.arcsin(to_sun) * np.arcsin(to_earth))
    return float(np.sin(np.sqrt(max(angles, 0.0))))
