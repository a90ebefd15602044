"""Stars: irradiance in each band from magnitude and colours, and apparent directions.

Catalogue directions are unit vectors in ICRS axes at the epoch J1991.25 (TT).
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import ASTRONOMICAL_UNIT, LIGHT_SPEED
from simgl.physics.ephemeris import earth_motion, julian_date_tt
from simgl.physics.spectrum import BANDS, Bands, Curve, rgbn_curve

EPOCH_JD_TT = 2448349.0625  # J1991.25
DAYS_PER_YEAR = 365.25
MILLIARCSECOND = np.pi / (180.0 * 3600.0e3)  # [rad]

# Effective wavelengths [m] of B, V, I (Cousins) and spectral irradiance of magnitude 0 there
# [W m-2 m-1]: Bessell, Castelli & Plez (1998, A&A 333, 231), table A2.
_WAVELENGTHS = np.array([438e-9, 545e-9, 798e-9])
_ZERO_POINTS = np.array([6.32e-2, 3.631e-2, 1.126e-2])
# Measured band irradiance over that of the interpolation, geometric mean of two CALSPEC spectra:
# Vega (alpha_lyr_stis_011; V 0.03, no colour) and the Sun (sun_reference_stis_001; V -26.76,
# B-V 0.653, V-I 0.702). They differ from the mean by 2.0, 0.7, 0.3 and 1.1 %.
_MEASURED = np.array([1.0164, 1.0332, 1.0630, 1.0705])
# The same ratio beyond 1000 nm at J, H, Ks [nm]: zero points of 2MASS (Cohen et al. 2003, AJ 126,
# 1090), Vega 0.03, the Sun -27.90, -28.25, -28.30 (Willmer 2018, ApJS 236, 47). Both lie within
# 5 % of the mean; stars of class M are fainter in H and Ks by up to 20 %.
_MEASURED_BEYOND: Curve = ((1235.0, 1662.0, 2159.0), (1.252, 1.385, 1.316))
# Longest wavelength of the interpolation by Wien's law [m].
_WIEN_TO = 1000e-9
# Points of a filter's curve.
_FILTER_STEPS = 2000


def band_irradiance(v: Array, b_v: Array, v_i: Array, bands: Bands = BANDS) -> Array:
    """(n, 4) irradiance outside the atmosphere on a plane that faces the star [W m-2].

    v, b_v, v_i : (n,) Johnson's V and B-V, Cousins' V-I [mag]

    ln(E wavelength^5) is linear in 1 / wavelength on either side of V, as in Wien's law.
    Accurate to 2 % for stars like Vega and the Sun, to some 10 % for class M with its molecular
    bands; below 400 nm an estimate: hot stars have up to half as much there.
    """
    magnitudes = np.stack([v + b_v, v, v - v_i], axis=-1)
    logarithm = np.log(_ZERO_POINTS * _WAVELENGTHS**5) - 0.4 * np.log(10.0) * magnitudes
    at = 1.0 / _WAVELENGTHS
    blue = (logarithm[:, 0] - logarithm[:, 1]) / (at[0] - at[1])
    red = (logarithm[:, 2] - logarithm[:, 1]) / (at[2] - at[1])
    result = np.zeros((len(v), 4))
    measured = _measured(bands)
    for band, (low, high) in enumerate(bands.edges):
        # Smooth except at V: steps of 10 nm are accurate to 1e-4.
        count = max(round((high - low) / 10e-9), 1 if bands.filter is None else _FILTER_STEPS)
        points = low + (np.arange(count) + 0.5) * (high - low) / count
        slope = np.where(points < _WAVELENGTHS[1], blue[:, None], red[:, None])
        curve = np.exp(logarithm[:, 1:2] + slope * (1.0 / points - at[1])) / points**5
        curve = curve * _past_wien(points, red) * bands.transmission(points)
        result[:, band] = measured[band] * (high - low) * curve.mean(axis=1)
    return result


def _measured(bands: Bands) -> Array:
    """(4,) measured irradiance over that of the interpolation in each band."""
    if bands == BANDS:
        return _MEASURED
    below, values = rgbn_curve(_MEASURED.tolist())
    return np.array(
        bands.photon_mean_of(
            (
                (*below, 1e9 * _WIEN_TO, *_MEASURED_BEYOND[0]),
                (*values, values[-1], *_MEASURED_BEYOND[1]),
            )
        )
    )


def _past_wien(points: Array, red: Array) -> Array:
    """(n, wavelengths) Planck's law over Wien's beyond 1000 nm, 1 up to there.

    points : [m]
    red : (n,) slope of ln(E wavelength^5) over 1 / wavelength beyond V [m]
    """
    exponent = np.maximum(-red, 1e-7)[:, None]
    planck = np.expm1(-exponent / _WIEN_TO) / np.expm1(-exponent / np.maximum(points, _WIEN_TO))
    return np.where(points <= _WIEN_TO, 1.0, planck)


def years_since_catalogue(tai_ns: int) -> float:
    """Julian years from J1991.25 to an epoch."""
    day, rest = julian_date_tt(tai_ns)
    return ((day - EPOCH_JD_TT) + rest) / DAYS_PER_YEAR


def earth_from_barycentre(tai_ns: int) -> tuple[Array, Array]:
    """Position (3,) [m] and velocity (3,) [m s-1] of the Earth's centre, ICRS axes (SOFA epv00)."""
    _, barycentric = earth_motion(tai_ns)
    position = barycentric["p"] * ASTRONOMICAL_UNIT
    return position, barycentric["v"] * (ASTRONOMICAL_UNIT / 86400.0)


def directions(
    direction: Array, motion: Array, parallax: Array, years: float, place: Array
) -> Array:
    """(n, 3) unit directions at an epoch, for an observer at rest at a place.

    direction : (n, 3) unit, at the catalogue's epoch
    motion : (n, 3) change of the unit vector [rad per Julian year]
    parallax : (n,) [rad]
    years : since the catalogue's epoch
    place : (3,) of the observer from the solar system's barycentre [m]

    Uniform straight motion. Radial velocity is neglected: at most 1 arcsec in a century for the
    nearest stars.
    """
    moved = direction + years * motion - parallax[:, None] * (place / ASTRONOMICAL_UNIT)
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)


def aberrated(direction: Array, velocity: Array) -> Array:
    """(n, 3) unit directions with stellar aberration.

    direction : (n, 3) unit, for an observer at rest
    velocity : (3,) of the moving observer relative to that one [m s-1]

    The Lorentz transformation of the light's direction, exact in v / c.
    """
    beta = velocity / LIGHT_SPEED
    inverse_gamma = np.sqrt(1.0 - np.dot(beta, beta))
    along = direction @ beta
    seen = inverse_gamma * direction + (1.0 + along / (1.0 + inverse_gamma))[:, None] * beta
    return seen / (1.0 + along)[:, None]
