"""The Moon: rotation, and a reflectance model with the light of the measured disc.

Radiance at cosines of incidence mu0 and emergence mu under the Sun's band irradiance E, for a
ground of the disc's mean reflectance:

    L = E K(alpha) (s mu0 / (mu0 + mu) + (1 - s) mu0 / 2)

The disc function is McEwen's, Lommel-Seeliger's and Lambert's laws in the share s(alpha): the full
Moon is uniformly bright, crescents fall off to the terminator. K makes the integral over the disc
the measured reflectance of Kieffer & Stone (2005, AJ 129, 2887), which has the opposition surge and
the reddening with phase, on the scale of Toledano et al. (2024, ACP 24, 3649).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.ephemeris import julian_date_tt
from simgl.physics.spectrum import BANDS, Bands

# Rows R, G, B, N: coefficients a0 to a3 and d1 to d3 of the disc's reflectance, table 4, linear
# between its wavelengths, means over the bands weighted by sunlight. The terms odd in the Sun's
# longitude stand for the seas; the map has those. Libration changes the light by up to 4 %.
_DISC = np.array(
    [
        (-1.93766, -1.59780, 0.31772, -0.18252, 0.37498, -0.13590, 0.01140),
        (-2.12511, -1.64112, 0.34529, -0.19058, 0.37069, -0.10610, 0.00797),
        (-2.32415, -1.69473, 0.39216, -0.20758, 0.35761, -0.06039, 0.00266),
        (-1.78302, -1.57918, 0.30242, -0.17469, 0.41138, -0.20308, 0.01659),
    ]
)
# The same coefficients over wavelength [nm], each the mean of neighbours within 25 nm: 2 % of the
# bands above. From one wavelength to the next the model scatters by 5 %, beyond 2 um by 15 %.
_DISC_CURVES = np.array(
    [
        (352.6, -2.69718, -1.76418, 0.47568, -0.24446, 0.3403, 0.01526, -0.01299),
        (410.6, -2.37769, -1.72885, 0.42031, -0.21764, 0.35795, -0.04322, -0.00143),
        (441.6, -2.31964, -1.72114, 0.37286, -0.19304, 0.37935, -0.09562, 0.0097),
        (475.9, -2.29145, -1.66097, 0.38542, -0.20933, 0.34355, -0.04874, 0.00139),
        (549.0, -2.12383, -1.6444, 0.35997, -0.19702, 0.3707, -0.10396, 0.00592),
        (665.1, -1.88914, -1.58096, 0.30477, -0.17908, 0.37141, -0.13514, 0.01248),
        (698.4, -1.90756, -1.5933, 0.32502, -0.18497, 0.38132, -0.15518, 0.01083),
        (745.3, -1.86896, -1.57522, 0.33712, -0.19415, 0.36888, -0.14828, 0.00958),
        (769.2, -1.82764, -1.53269, 0.25364, -0.15957, 0.38017, -0.16569, 0.01942),
        (873.3, -1.74784, -1.59994, 0.36366, -0.19923, 0.39756, -0.19899, 0.00897),
        (936.6, -1.729, -1.52387, 0.12122, -0.09339, 0.49037, -0.2921, 0.04183),
        (1059.5, -1.59323, -1.71358, 0.50599, -0.25178, 0.4816, -0.29486, 0.00116),
        (1243.2, -1.53594, -1.55214, 0.31479, -0.18178, 0.4904, -0.3097, 0.01237),
        (1538.7, -1.33802, -1.46208, 0.15784, -0.11712, 0.53831, -0.38432, 0.03473),
        (1633.6, -1.34567, -1.46057, 0.23813, -0.15494, 0.54393, -0.37182, 0.01845),
        (1981.5, -1.26203, -1.25138, -0.06569, -0.04005, 0.49099, -0.36092, 0.04707),
        (2126.3, -1.18946, -2.55069, 2.10026, -0.87285, 0.29239, -0.34784, -0.13444),
        (2250.9, -1.04232, -1.46809, 0.43817, -0.24632, 0.38154, -0.28937, -0.0111),
        (2383.6, -1.08403, -1.31032, 0.20323, -0.15863, 0.36134, -0.28408, 0.0101),
    ]
)
# Traceable measurements lie 3 to 5 % above that model in the visible and near infrared (Toledano et
# al.).
_SCALE = 1.04
# p1 to p4 of the same [deg].
_P1, _P2, _P3, _P4 = 4.06054, 12.8802, -30.5858, 16.7498
# The reflectance was measured up to here; from here on the disc darkens as Allen's curve [rad].
_MEASURED_TO = np.radians(97.0)
# That curve ends near crescents of two days; K is constant from here on [rad].
_LAST_PHASE = np.radians(150.0)


@lru_cache(maxsize=8)
def _coefficients(bands: Bands) -> Array:
    """(4, 7) a0 to a3, d1 to d3 of each band; beyond 350 and 2384 nm the ends of the model hold."""
    if bands == BANDS:
        return _DISC
    nm = tuple(_DISC_CURVES[:, 0].tolist())
    curves = _DISC_CURVES[:, 1:].T.tolist()
    return np.array([bands.photon_mean_of((nm, tuple(curve))) for curve in curves]).T


def disc_reflectance(phase: float, bands: Bands = BANDS) -> Array:
    """(4,) light of the disc at a phase angle [rad], over that of a white Lambertian disc of the
    same size that faces the Sun and the observer.

    Good to 2 % in scale; seas and libration change it by up to 5 %. From 97 deg on 20 %.
    """
    held = min(abs(phase), _MEASURED_TO)
    degrees = float(np.degrees(held))
    near = [
        np.exp(-degrees / _P1),
        np.exp(-degrees / _P2),
        np.cos((degrees - _P3) / _P4),
    ]
    disc = _coefficients(bands)
    measured = _SCALE * np.exp(disc[:, :4] @ held ** np.arange(4) + disc[:, 4:] @ near)
    return np.asarray(measured * _allen(abs(phase)) / _allen(held))


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
    turns = Rotation.from_euler("ZXZ", [alpha + 90.0, 90.0 - delta, w % 360.0], degrees=True)
    return np.asarray(turns.as_matrix().T)
