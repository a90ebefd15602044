"""The Moon: rotation, and a reflectance model fitted to the light of the full disc.

Radiance at cosines of incidence mu0 and emergence mu under the Sun's band irradiance E:

    L = E 2 p / pi  f(alpha)  mu0 / (mu0 + mu)

The disc function is Lommel-Seeliger, under which the full Moon is uniformly bright. f makes the
integral over the disc follow the measured phase curve; p is the geometric albedo.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.ephemeris import julian_date_tt

# V: the full Moon's -12.74 at 384,400 km (Allen's Astrophysical Quantities, 4th ed., section 12)
# against the Sun's -26.76 at 1 au (Willmer 2018, ApJS 236, 47) over a disc of 1737.4 km.
_ALBEDO_V = 10.0 ** (-0.4 * (26.76 - 12.74)) * (384_400.0 / 1737.4) ** 2
# Bands relative to V: disc reflectance at 45 deg phase by the lunar irradiance model of Kieffer &
# Stone (2005, AJ 129, 2887), table 4, linear between its wavelengths, weighted by sunlight over the
# bands. It reddens with phase: 1.20, 1, 0.83, 1.35 at 10 deg; 1.25, 1, 0.78, 1.50 at 110 deg.
GEOMETRIC_ALBEDO = _ALBEDO_V * np.array([1.23, 1.0, 0.80, 1.44])

# The measured phase curve ends near crescents of two days; f is constant from here on [rad].
_LAST_PHASE = np.radians(150.0)


def disc_brightness(phase: float) -> float:
    """Light of the disc at a phase angle [rad], relative to the full Moon (Allen 1976).

    A smooth curve without the opposition surge. From 7 to 130 deg the modelled disc has 0.95 to
    1.14 times the light of Kieffer & Stone (2005) in every band, at 2 deg 0.89 in V.
    """
    degrees = np.degrees(abs(phase))
    return float(10.0 ** (-0.4 * (0.026 * degrees + 4e-9 * degrees**4)))


def _lommel_seeliger_disc(phase: float) -> float:
    """The same for a sphere that reflects as mu0 / (mu0 + mu)."""
    half = 0.5 * abs(phase)
    if half < 1e-6:
        return 1.0
    return float(1.0 + np.sin(half) * np.tan(half) * np.log(np.tan(0.5 * half)))


def surface_factor(phase: float) -> float:
    """Factor f of the reflectance model at a phase angle [rad]."""
    held = min(abs(phase), _LAST_PHASE)
    return disc_brightness(held) / _lommel_seeliger_disc(held)


def moonlight(sunlight: Array, distance: float, phase: float) -> Array:
    """(4,) irradiance by the full disc [W m-2].

    sunlight : (4,) irradiance at the Moon [W m-2]
    distance : from the Moon's centre [m]
    phase : angle between Sun and observer, seen from the Moon [rad]
    """
    disc = surface_factor(phase) * _lommel_seeliger_disc(phase)
    return sunlight * GEOMETRIC_ALBEDO * (disc * (MOON_RADIUS / distance) ** 2)


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
