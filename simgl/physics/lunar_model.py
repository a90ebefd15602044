"""The Moon: rotation, and a reflectance model with the light of the measured disc.

Radiance at cosines of incidence mu0 and emergence mu under the Sun's band irradiance E, for a
ground of the disc's mean reflectance:

    L = E K(alpha) (s mu0 / (mu0 + mu) + (1 - s) mu0 / 2)

The disc function is McEwen's, Lommel-Seeliger's and Lambert's laws in the share s(alpha): the full
Moon is uniformly bright, crescents fall off to the terminator. K makes the integral over the disc
the measured reflectance of the Lunar Irradiance Model of ESA (LIME; Toledano et al. 2024, ACP 24,
3649), which has the opposition surge and the reddening with phase, in the form of Kieffer & Stone
(2005, AJ 129, 2887).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.ephemeris import julian_date_tt
from simgl.physics.frames import rotation_zxz
from simgl.physics.spectrum import BANDS, Bands

# Wavelengths [nm], and there the coefficients a0 to a3 and d1 to d3 of the disc's reflectance, of
# LIME's release of 2025-10-10. The terms odd in the Sun's longitude stand for the seas; the map has
# those. Libration changes the light by up to 4 %.
_WAVELENGTHS = (440.0, 500.0, 675.0, 870.0, 1020.0, 1640.0)
_DISC = np.array(
    [
        (-2.845826, -0.638992, -0.356838, -0.018674, 0.530384, 0.623965, -0.003982),
        (-2.835119, -0.256738, -0.669409, 0.070965, 0.398940, 0.758700, -0.002567),
        (-2.488881, -0.371945, -0.538320, 0.030280, 0.411764, 0.626867, -0.002009),
        (-2.401018, -0.144913, -0.711386, 0.079849, 0.412738, 0.676622, -0.000823),
        (-2.323384, -0.129630, -0.713925, 0.081491, 0.414863, 0.654198, -0.001379),
        (-1.852121, -0.268270, -0.543445, 0.027159, 0.402154, 0.480524, -0.001853),
    ]
)
# p1 to p4 of the same [deg].
_P1, _P2, _P3, _P4 = 1.306236, 18.77138, 12.315492, 8.973327
# Between these wavelengths the disc has the spectrum of soil and breccia of Apollo 16, 95 and 5 %,
# as in that model and in Kieffer & Stone's, whose own wavelengths scatter by 5 %. Wavelength [nm],
# reflectance.
_SOIL = np.array(
    [
        (350, 0.0997), (400, 0.1183), (450, 0.1333), (500, 0.1464), (550, 0.1577), (600, 0.1678),
        (650, 0.1778), (700, 0.1866), (750, 0.1940), (800, 0.1990), (850, 0.2009), (900, 0.2015),
        (950, 0.2054), (1000, 0.2121), (1100, 0.2290), (1200, 0.2435), (1400, 0.2691),
        (1600, 0.2902), (1800, 0.3011), (2000, 0.3132), (2200, 0.3303), (2500, 0.3587),
    ]
)  # fmt: skip
# The reflectance was measured up to here; from here on the disc darkens as Allen's curve [rad].
_MEASURED_TO = np.radians(90.0)
# That curve ends near crescents of two days; K is constant from here on [rad].
_LAST_PHASE = np.radians(150.0)


@lru_cache(maxsize=8)
def _of_wavelengths(bands: Bands) -> Array:
    """(4, 6) what the reflectance at each of ``_WAVELENGTHS`` adds to that of each band."""
    nm = np.arange(_SOIL[0, 0], _SOIL[-1, 0] + 1.0, 5.0)
    soil = np.interp(nm, *_SOIL.T)
    shares = []
    for index, wavelength in enumerate(_WAVELENGTHS):
        between = np.interp(nm, _WAVELENGTHS, np.eye(len(_WAVELENGTHS))[index])
        over = between * soil / np.interp(wavelength, *_SOIL.T)
        shares.append(bands.photon_mean_of((tuple(nm.tolist()), tuple(over.tolist()))))
    return np.array(shares).T


def disc_reflectance(phase: float, bands: Bands = BANDS) -> Array:
    """(4,) light of the disc at a phase angle [rad], over that of a white Lambertian disc of the
    same size that faces the Sun and the observer.

    Good to 2 % in scale; seas and libration change it by up to 5 %. From 90 deg on 20 %.
    """
    held = min(abs(phase), _MEASURED_TO)
    degrees = float(np.degrees(held))
    near = [
        np.exp(-degrees / _P1),
        np.exp(-degrees / _P2),
        np.cos((degrees - _P3) / _P4),
    ]
    measured = np.exp(_DISC[:, :4] @ held ** np.arange(4) + _DISC[:, 4:] @ near)
    return np.asarray(_of_wavelengths(bands) @ measured * _allen(abs(phase)) / _allen(held))


def _allen(phase: float) -> float:
    """Light of the disc relative to the full Moon (Allen's Astrophysical Quantities, section 12),
    without the surge."""
    degrees = np.degrees(phase)
    return float(10.0 ** (-0.4 * (0.026 * degrees + 4e-9 * degrees**4)))


def lommel_seeliger_share(phase: float) -> float:
    """s of the disc function (McEwen 1996, LPSC 27, 841); 0 beyond 104 deg."""
    a = float(np.degrees(abs(phase)))
    return max(1.0 - 0.019 * a + 0.242e-3 * a**2 - 1.46e-6 * a**3, 0.0)


def _disc_sum(phase: float) -> float:
    """The disc function's integral over the disc, over its value at full Moon."""
    a, half = abs(phase), 0.5 * abs(phase)
    lommel_seeliger = 1.0
    if half > 1e-6:
        lommel_seeliger += np.sin(half) * np.tan(half) * np.log(np.tan(0.5 * half))
    lambert = 2.0 / (3.0 * np.pi) * (np.sin(a) + (np.pi - a) * np.cos(a))
    s = lommel_seeliger_share(a)
    return float(s * lommel_seeliger + (1.0 - s) * lambert)


def surface_factor(phase: float, bands: Bands = BANDS) -> Array:
    """(4,) factor K of the reflectance model at a phase angle [rad], in sr-1."""
    held = min(abs(phase), _LAST_PHASE)
    return 2.0 / np.pi * disc_reflectance(held, bands) / _disc_sum(held)


def moonlight(sunlight: Array, distance: float, phase: float, bands: Bands = BANDS) -> Array:
    """(4,) irradiance by the full disc [W m-2].

    sunlight : (4,) irradiance at the Moon [W m-2]
    distance : from the Moon's centre [m]
    phase : angle between Sun and observer, seen from the Moon [rad]
    """
    disc = 0.5 * np.pi * surface_factor(phase, bands) * _disc_sum(phase)
    return np.asarray(sunlight * disc * (MOON_RADIUS / distance) ** 2)


# Light of the Earth over that of a white Lambertian globe at the same phase: 0.297 over R, G and B
# (Goode et al. 2001, GRL 28, 1671), its colours rounded from spectra of the distant Earth, good to
# 10 %. Weather and continents change it by as much.
_EARTH = np.array([0.27, 0.28, 0.34, 0.28])
_EARTH_RADIUS = 6371.0e3  # [m]


def earthlight(sunlight: Array, distance: float, phase: float, bands: Bands = BANDS) -> Array:
    """(4,) irradiance at the Moon by the Earth [W m-2].

    sunlight : (4,) irradiance at the Earth [W m-2]
    distance : from the Earth's centre [m]
    phase : angle between Sun and Moon, seen from the Earth [rad]
    """
    a = abs(phase)
    globe = 2.0 / (3.0 * np.pi) * (np.sin(a) + (np.pi - a) * np.cos(a))
    return np.asarray(
        sunlight
        * np.array(bands.of_rgbn(_EARTH.tolist()))
        * (globe * (_EARTH_RADIUS / distance) ** 2)
    )


# Angles E1 to E13 of the Moon's rotation [deg, deg per day], and their terms in the pole's right
# ascension (sine) and declination (cosine) and in the prime meridian (sine) [deg]: report of the
# IAU working group on cartographic coordinates (Archinal et al. 2011, 2018), table 2.
_ROTATION = np.array(
    [
        (125.045, -0.0529921, -3.8787, 1.5419, 3.5610),
        (250.089, -0.1059842, -0.1204, 0.0239, 0.1208),
        (260.008, 13.0120009, 0.0700, -0.0278, -0.0642),
        (176.625, 13.3407154, -0.0172, 0.0068, 0.0158),
        (357.529, 0.9856003, 0.0, 0.0, 0.0252),
        (311.589, 26.4057084, 0.0072, -0.0029, -0.0066),
        (134.963, 13.0649930, 0.0, 0.0009, -0.0047),
        (276.617, 0.3287146, 0.0, 0.0, -0.0046),
        (34.226, 1.7484877, 0.0, 0.0, 0.0028),
        (15.134, -0.1589763, -0.0052, 0.0008, 0.0052),
        (119.743, 0.0036096, 0.0, 0.0, 0.0040),
        (239.961, 0.1643573, 0.0, 0.0, 0.0019),
        (25.053, 12.9590088, 0.0043, -0.0009, -0.0044),
    ]
)


def moon_from_icrf(tai_ns: int) -> Array:
    """R_moon_from_icrf: x to the mean sub-Earth point, z to the north pole; within 0.01 deg."""
    day, rest = julian_date_tt(tai_ns)
    d = (day - 2451545.0) + rest
    e = np.radians(_ROTATION[:, 0] + _ROTATION[:, 1] * d)
    alpha = 269.9949 + 0.0031 * d / 36525.0 + np.sum(_ROTATION[:, 2] * np.sin(e))
    delta = 66.5392 + 0.0130 * d / 36525.0 + np.sum(_ROTATION[:, 3] * np.cos(e))
    w = 38.3213 + 13.17635815 * d - 1.4e-12 * d * d + np.sum(_ROTATION[:, 4] * np.sin(e))
    turns = (math.radians(angle) for angle in (alpha + 90.0, 90.0 - delta, w % 360.0))
    return rotation_zxz(*turns).T
