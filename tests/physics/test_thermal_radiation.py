"""Planck's law over a band, against quadrature of its definition."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.constants import LIGHT_SPEED, PLANCK, STEFAN_BOLTZMANN
from simgl.physics.spectrum import planck_radiance
from simgl.physics.thermal_radiation import (
    band_fraction,
    band_photon_radiance,
    band_radiance,
    band_temperature,
)

BANDS = [(8e-6, 14e-6), (3e-6, 5e-6), (0.4e-6, 1e-6), (10e-6, 10.01e-6), (50e-6, 5e-3)]
TEMPERATURES = (50.0, 100.0, 194.1, 300.0, 700.0, 5772.0)


def quadrature(band: tuple[float, float]) -> tuple[Array, Array]:
    """Wavelengths [m] and weights: Gauss-Legendre of 200 points in the logarithm."""
    x, w = np.polynomial.legendre.leggauss(200)
    half = 0.5 * np.log(band[1] / band[0])
    wavelength = band[0] * np.exp(half * (x + 1.0))
    return wavelength, half * w * wavelength


@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("temperature", TEMPERATURES)
def test_band_radiance_is_the_integral_of_plancks_law(
    band: tuple[float, float], temperature: float
) -> None:
    wavelength, weight = quadrature(band)
    # Terms beyond e^700 are 0 on both sides.
    with np.errstate(over="ignore"):
        power = weight * planck_radiance(wavelength, temperature)
    photons = np.sum(power * wavelength) / (PLANCK * LIGHT_SPEED)
    # The goal is 1e-6; the rounding of the constant of Stefan and Boltzmann alone gives 3e-11.
    assert float(band_radiance(band, temperature)) == pytest.approx(np.sum(power), rel=1e-10)
    assert float(band_photon_radiance(band, temperature)) == pytest.approx(photons, rel=1e-10)


def test_all_wavelengths_together_give_stefan_boltzmann() -> None:
    t = np.array(TEMPERATURES)
    np.testing.assert_allclose(band_fraction((0.0, np.inf), t), 1.0, rtol=1e-14)
    total = np.pi * band_radiance((0.0, np.inf), t)
    np.testing.assert_allclose(total, STEFAN_BOLTZMANN * t**4, rtol=1e-14)


def test_bands_add_up_across_the_middle_of_the_series() -> None:
    edges = np.geomspace(2e-6, 300e-6, 40)
    parts = sum(band_fraction((a, b), 300.0) for a, b in pairwise(edges))
    np.testing.assert_allclose(parts, band_fraction((2e-6, 300e-6), 300.0), rtol=1e-13)


@pytest.mark.parametrize("band", BANDS[:2])
def test_the_temperature_of_a_radiance_is_its_inverse(band: tuple[float, float]) -> None:
    t = np.array([60.0, 150.0, 300.0, 1000.0, 4000.0])
    np.testing.assert_allclose(band_temperature(band, band_radiance(band, t)), t, rtol=1e-8)


def test_a_band_that_goes_backwards_is_refused() -> None:
    with pytest.raises(ValueError, match="longer wavelength"):
        band_radiance((14e-6, 8e-6), 300.0)
