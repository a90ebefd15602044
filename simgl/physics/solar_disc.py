"""The Sun's disc: limb darkening and measured spectrum, per band.

Limb darkening is an array (2, 4), the coefficients u and v of each band:

    I(mu) / I(1) = 1 - u (1 - mu) - v (1 - mu)^2

with mu the cosine of emergence, mu^2 = 1 - (distance from the disc's centre / its radius)^2. Zeros
are a uniform disc.
"""

from __future__ import annotations

import numpy as np

from simgl import assets
from simgl.arrays import Array
from simgl.physics.constants import LIGHT_SPEED, PLANCK, SOLAR_TEMPERATURE
from simgl.physics.spectrum import BANDS, BandLight, Bands, channels, planck_radiance

UNIFORM = np.zeros((2, 4))

# Wavelength [um], u2, v2 of the continuum in 1 - u2 - v2 + u2 mu + v2 mu^2: Allen's Astrophysical
# Quantities, 4th ed. (Cox 2000), section 14.7. Linear in between; beyond, the ends hold,
# an estimate: at 2 um the limb is brighter than that.
_LIMB_TABLE = np.array(
    [
        (0.40, 0.91, -0.05),
        (0.45, 0.99, -0.17),
        (0.50, 0.97, -0.22),
        (0.55, 0.93, -0.23),
        (0.60, 0.88, -0.23),
        (0.80, 0.73, -0.22),
        (1.00, 0.64, -0.20),
    ]
)

# Extraterrestrial column of ASTM G173-03 (after Gueymard 2004), integrated by the trapezoid rule in
# steps of 0.1 nm from the copy in pvlib 0.16: R, G, B, N [W m-2] and photons [J-1].
_G173_IRRADIANCE = (158.76830, 184.67730, 186.51915, 311.32037)
_G173_PHOTONS = (3.2633479e18, 2.7663860e18, 2.2741035e18, 4.1971167e18)
_G173_TOTAL = 1366.1  # [W m-2] over all wavelengths, the solar constant of that spectrum


# Steps in which its table is integrated over other bands [m].
_G173_STEP = 1e-10


def astm_g173_light(total_irradiance: float, bands: Bands = BANDS) -> BandLight:
    """Sunlight outside the atmosphere with the measured spectrum of ASTM G173-03.

    total_irradiance : over all wavelengths [W m-2]
    """
    if bands != BANDS:
        return _g173_in_bands(total_irradiance, bands)
    return BandLight(
        irradiance=total_irradiance / _G173_TOTAL * np.array(_G173_IRRADIANCE),
        photons_per_joule=np.array(_G173_PHOTONS),
    )


def _g173_in_bands(total_irradiance: float, bands: Bands) -> BandLight:
    """By the table ``simgl/data/sunlight.csv``, linear between its points."""
    nm, irradiance = np.loadtxt(assets.data() / "sunlight.csv", delimiter=",", skiprows=1).T
    power, photons = [], []
    for low, high in bands.edges:
        count = max(round((high - low) / _G173_STEP), 20)
        wavelength = low + (high - low) * (np.arange(count) + 0.5) / count
        step = (high - low) / count * 1e9
        parts = np.interp(wavelength * 1e9, nm, irradiance) * bands.transmission(wavelength) * step
        power.append(np.sum(parts))
        photons.append(np.sum(parts * wavelength) / (PLANCK * LIGHT_SPEED))
    return BandLight(
        irradiance=total_irradiance / _G173_TOTAL * np.array(channels(power)),
        photons_per_joule=np.array(channels(np.array(photons) / np.array(power))),
        bands=bands,
    )


def limb_darkening(temperature: float = SOLAR_TEMPERATURE, bands: Bands = BANDS) -> Array:
    """(2, 4) coefficients u, v of each band.

    temperature : of the black body that weights the wavelengths of a band [K]

    At each wavelength the profile is scaled to a mean of 1 over the disc; the band's profile is
    their mean by irradiance, which has the same form.
    """
    result = []
    for index in range(len(bands.edges)):
        points = bands.steps(index)
        u2, v2 = (np.interp(points * 1e6, _LIMB_TABLE[:, 0], c) for c in _LIMB_TABLE[:, 1:].T)
        u, v = u2 + 2.0 * v2, -v2
        weight = planck_radiance(points, temperature) * bands.transmission(points)
        weight = weight / _disc_mean(u, v)
        centre = np.sum(weight)
        result.append((np.sum(weight * u) / centre, np.sum(weight * v) / centre))
    return np.array([channels(coefficients) for coefficients in np.array(result).T])


def limb_profile(mu: Array, limb: Array) -> Array:
    """(..., 4) radiance at a point of the disc relative to the disc's mean.

    mu : (...) cosine of emergence, sqrt(1 - (distance from the centre / radius)^2)
    limb : (2, 4) coefficients u, v
    """
    u, v = limb
    fall = 1.0 - np.asarray(mu, dtype=np.float64)[..., None]
    return (1.0 - u * fall - v * fall * fall) / _disc_mean(u, v)


def _disc_mean(u: Array, v: Array) -> Array:
    """Mean of the profile over the disc, the integral of 2 mu I(mu) / I(1)."""
    return 1.0 - u / 3.0 - v / 6.0
