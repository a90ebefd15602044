"""Light of the sky between the planets and stars: zodiacal light, and stars too faint to be listed.

Zodiacal light is sunlight scattered by dust between the planets. Source of all numbers: Leinert et
al. (1998, A&AS 127, 1), good to 10 %; its seasonal change, another 10 %, is left out.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.spectrum import BANDS, Bands
from simgl.physics.starlight import band_irradiance

# Spectral radiance at 500 nm [1e-8 W m-2 sr-1 um-1]: table 17. Rows by ecliptic longitude from the
# Sun, columns by ecliptic latitude [deg], the last one the pole's. 0 where it has no value.
_LONGITUDES = np.array(
    [0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 60, 75, 90, 105, 120, 135, 150, 165, 180], dtype=float
)
_LATITUDES = np.array([0, 5, 10, 15, 20, 25, 30, 45, 60, 75, 90], dtype=float)
_TABLE = np.array(
    [
        (0, 0, 0, 3140, 1610, 985, 640, 275, 150, 100, 77),
        (0, 0, 0, 2940, 1540, 945, 625, 271, 150, 100, 77),
        (0, 0, 4740, 2470, 1370, 865, 590, 264, 148, 100, 77),
        (11500, 6780, 3440, 1860, 1110, 755, 525, 251, 146, 100, 77),
        (6400, 4480, 2410, 1410, 910, 635, 454, 237, 141, 99, 77),
        (3840, 2830, 1730, 1100, 749, 545, 410, 223, 136, 97, 77),
        (2480, 1870, 1220, 845, 615, 467, 365, 207, 131, 95, 77),
        (1650, 1270, 910, 680, 510, 397, 320, 193, 125, 93, 77),
        (1180, 940, 700, 530, 416, 338, 282, 179, 120, 92, 77),
        (910, 730, 555, 442, 356, 292, 250, 166, 116, 90, 77),
        (505, 442, 352, 292, 243, 209, 183, 134, 104, 86, 77),
        (338, 317, 269, 227, 196, 172, 151, 116, 93, 82, 77),
        (259, 251, 225, 193, 166, 147, 132, 104, 86, 79, 77),
        (212, 210, 197, 170, 150, 133, 119, 96, 82, 77, 77),
        (188, 186, 177, 154, 138, 125, 113, 90, 77, 74, 77),
        (179, 178, 166, 147, 134, 122, 110, 90, 77, 73, 77),
        (179, 178, 165, 148, 137, 127, 116, 96, 79, 72, 77),
        (196, 192, 179, 165, 151, 141, 131, 104, 82, 72, 77),
        (230, 212, 195, 178, 163, 148, 134, 105, 83, 72, 77),
    ],
    dtype=float,
)
# Within 15 deg of the Sun brightness falls as the elongation to this power; across the ecliptic,
# where an angle counts so many times, faster. Both join the table's row and column at 15 deg.
_FALL = -2.3
_FLATTENING = (11500.0 / 3140.0) ** (-1.0 / _FALL)
# Nearer to the Sun the corona shines, which is left out [deg].
_NEAREST = 1.0
# Left out of the mean over the sky [deg].
_AROUND_SUN = 30.0

# One star of tenth magnitude in a square degree, in this unit and at 500 nm (section 2.2).
_S10 = 1.28
# The sky of all stars beyond magnitude 6.5 by galactic latitude, in stars of tenth magnitude in a
# square degree, averaged over longitude. A disc of stars in dust: 1 - exp(-T / sin b), with the
# values of the pole (30) and of the plane (160) from Pioneer 10 (section 10). Any one place of the
# Milky Way differs by a factor of two.
_PLANE, _POLE = 160.0, 30.0
# To the north pole of the galaxy in ICRS axes: right ascension, declination [deg] (Hipparcos,
# volume 1, equation 1.5.11).
_GALACTIC_POLE = np.radians([192.85948, 27.12825])
_OBLIQUITY = np.radians(84381.406 / 3600.0)  # of the ecliptic of J2000 (IAU 2006)


def ecliptic_from_icrf() -> Array:
    """R_ecliptic_from_icrf (3, 3), of the mean ecliptic of J2000."""
    c, s = np.cos(_OBLIQUITY), np.sin(_OBLIQUITY)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def zodiacal_radiance(direction: Array, sun_direction: Array, bands: Bands = BANDS) -> Array:
    """(n, 4) radiance per band, seen from near the Earth [W m-2 sr-1].

    direction : (n, 3) unit, ICRF
    sun_direction : (3,) unit, ICRF

    The table is interpolated in the logarithm. It has sunlight's colour, redder with the wavelength
    as measured (equation 22).
    """
    R = ecliptic_from_icrf()
    seen, sun = direction @ R.T, R @ sun_direction
    latitude = np.degrees(np.arcsin(np.clip(seen[:, 2], -1.0, 1.0)))
    away = np.arctan2(seen[:, 1], seen[:, 0]) - np.arctan2(sun[1], sun[0])
    longitude = np.degrees(np.abs(np.arctan2(np.sin(away), np.cos(away))))
    elongation = np.degrees(np.arccos(np.clip(direction @ sun_direction, -1.0, 1.0)))
    at_500_nm = _from_table(longitude, np.abs(latitude), elongation) * 1e-8
    # Of elongations up to 30 deg, and from 90 deg on.
    share = np.clip((elongation - 30.0) / 60.0, 0.0, 1.0)[:, None]
    near, far = _width_in_band(1.2, 0.8, bands), _width_in_band(0.9, 0.6, bands)
    return at_500_nm[:, None] * (near + share * (far - near))


def faint_starlight(direction: Array, bands: Bands = BANDS) -> Array:
    """(n, 4) mean radiance of stars too faint for the catalogue [W m-2 sr-1].

    direction : (n, 3) unit, ICRF

    In the Sun's colours. By galactic latitude alone; the Milky Way's clouds and dust are left out.
    """
    a, d = _GALACTIC_POLE
    pole = np.array([np.cos(d) * np.cos(a), np.cos(d) * np.sin(a), np.sin(d)])
    # A disc of finite width: the plane itself has a sine of 0.
    sine = np.maximum(np.abs(direction @ pole), 1e-3)
    thickness = -np.log1p(-_POLE / _PLANE)
    s10 = _PLANE * -np.expm1(-thickness / sine)
    return s10[:, None] * (_S10 * 1e-8 * _width_in_band(0.0, 0.0, bands))


@lru_cache(maxsize=8)
def mean_diffuse_sky(bands: Bands = BANDS) -> Array:
    """(4,) mean of zodiacal light and faint stars over the sky [W m-2 sr-1].

    Without the 30 deg around the Sun: while it does not outshine them, the Earth covers them.
    """
    # A midpoint rule, even on the sphere.
    sine = (np.arange(90) + 0.5) / 45.0 - 1.0
    longitude = (np.arange(180) + 0.5) * (2.0 * np.pi / 180.0)
    z, angle = (axis.ravel() for axis in np.meshgrid(sine, longitude, indexing="ij"))
    across = np.sqrt(1.0 - z**2)
    direction = np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    # On the ecliptic; the mean is the same wherever it stands there.
    sun = np.array([1.0, 0.0, 0.0])
    far = direction[direction @ sun < np.cos(np.radians(_AROUND_SUN))]
    light = zodiacal_radiance(far, sun, bands).mean(axis=0) + faint_starlight(far, bands).mean(
        axis=0
    )
    light.flags.writeable = False
    return light


def _from_table(longitude: Array, latitude: Array, elongation: Array) -> Array:
    """(n,) spectral radiance at 500 nm [1e-8 W m-2 sr-1 um-1]; angles in degrees, from 0."""
    table = _filled_table()
    row = np.clip(np.searchsorted(_LONGITUDES, longitude) - 1, 0, len(_LONGITUDES) - 2)
    column = np.clip(np.searchsorted(_LATITUDES, latitude) - 1, 0, len(_LATITUDES) - 2)
    x = (longitude - _LONGITUDES[row]) / (_LONGITUDES[row + 1] - _LONGITUDES[row])
    y = (latitude - _LATITUDES[column]) / (_LATITUDES[column + 1] - _LATITUDES[column])
    low = table[row, column] * (1.0 - x) + table[row + 1, column] * x
    high = table[row, column + 1] * (1.0 - x) + table[row + 1, column + 1] * x
    far = np.exp(low * (1.0 - y) + high * y)
    # The table's corner at the Sun, where steps of 5 deg are too coarse.
    return np.where(elongation < 5.0, _near_sun(longitude, latitude), far)


@lru_cache(maxsize=1)
def _filled_table() -> Array:
    """Logarithm of the table, its gap at the Sun filled."""
    near = _near_sun(_LONGITUDES[:, None], _LATITUDES[None, :])
    return np.log(np.where(_TABLE > 0.0, _TABLE, near))


def _near_sun(longitude: Array, latitude: Array) -> Array:
    distance = np.maximum(np.hypot(longitude, _FLATTENING * latitude), _NEAREST)
    return 11500.0 * (distance / 15.0) ** _FALL


@lru_cache(maxsize=16)
def _width_in_band(below: float, above: float, bands: Bands) -> Array:
    """(4,) band radiance over the spectral radiance at 500 nm [um].

    below, above : reddening per factor of ten in wavelength, on either side of 500 nm
    """
    # The Sun's spectral irradiance at 500 nm is 1.28e-8 W m-2 um-1 sr-1 for one S10; the star of
    # the Sun's colours gives the bands beside it.
    star = band_irradiance(np.array([10.0]), np.array([0.653]), np.array([0.702]), bands)[0]
    widths = star * np.degrees(1.0) ** 2 / (_S10 * 1e-8)
    middle = np.array([0.5 * (low + high) for low, high in bands.channel_edges.tolist()]) / 500e-9
    slope = np.where(middle < 1.0, below, above)
    widths = widths * (1.0 + slope * np.log10(middle))
    widths.flags.writeable = False
    return widths
