"""Band numbers against Planck's law summed another way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from simgl.physics.spectrum import (
    BANDS,
    Bands,
    black_body_light,
    photon_mean,
    planck_radiance,
)

# SI, exact.
H, C, K = 6.62607015e-34, 299792458.0, 1.380649e-23


def _energy_below(wavelength: float, temperature: float) -> float:
    """Fraction of a black body's power below a wavelength [m], by the series in exp(-x)."""
    x, n = H * C / (wavelength * K * temperature), np.arange(1, 200)
    terms = np.exp(-n * x) / n * (x**3 + 3 * x**2 / n + 6 * x / n**2 + 6 / n**3)
    return float(15.0 / np.pi**4 * np.sum(terms))


def _photons_below(wavelength: float, temperature: float) -> float:
    """Photons below a wavelength [m] for each joule of the whole spectrum."""
    x, n = H * C / (wavelength * K * temperature), np.arange(1, 200)
    terms = np.exp(-n * x) / n * (x**2 + 2 * x / n + 2 / n**2)
    return float(15.0 / np.pi**4 * np.sum(terms) / (K * temperature))


def test_the_bands_of_the_source_study_hold_its_numbers() -> None:
    light = black_body_light(1367.0, 5777.0)
    # As printed: half a unit of the last digit.
    np.testing.assert_allclose(
        light.irradiance, [154.439, 174.774, 171.947, 313.358], atol=5e-4, rtol=0.0
    )
    np.testing.assert_allclose(
        light.photon_irradiance, [5.042833e20, 4.833659e20, 3.904501e20, 1.314942e21], rtol=5e-7
    )


def test_light_from_400_to_700_nm_is_0_366614_of_the_source_studys_sun() -> None:
    light = black_body_light(1367.0, 5777.0)
    assert abs(light.irradiance[:3].sum() / 1367.0 - 0.366614) < 5e-7


@pytest.mark.parametrize("temperature", [1000.0, 3000.0, 5772.0, 20000.0, 50000.0])
def test_band_light_is_plancks_integral(temperature: float) -> None:
    light = black_body_light(1.0, temperature)
    watts = [_energy_below(b, temperature) - _energy_below(a, temperature) for a, b in BANDS.edges]
    photons = [
        _photons_below(b, temperature) - _photons_below(a, temperature) for a, b in BANDS.edges
    ]
    # The Stefan-Boltzmann constant has ten digits; differences of the series lose two at 1000 K.
    np.testing.assert_allclose(light.irradiance, watts, rtol=1e-8)
    np.testing.assert_allclose(light.photon_irradiance, photons, rtol=1e-8)


def test_a_black_body_radiates_sigma_t_to_the_fourth() -> None:
    # Bands that tile 0.1 um to 1 mm leave 2e-6 of a 1000 K body outside (Rayleigh-Jeans tail).
    edges = [1e-7 * 1.2**i for i in range(51)]
    tiles = list(pairwise(edges))
    total = sum(
        black_body_light(1.0, 1000.0, Bands(edges=tuple(tiles[i : i + 4]))).irradiance.sum()
        for i in range(0, len(tiles), 4)
    )
    assert abs(total - 1.0) < 3e-6


def test_spectral_radiance_peaks_where_wien_says() -> None:
    wavelength = np.linspace(400e-9, 600e-9, 200001)
    peak = wavelength[np.argmax(planck_radiance(wavelength, 5772.0))]
    # Displacement constant 2.897771955 mm K; the grid has steps of 1 pm.
    assert abs(peak - 2.897771955e-3 / 5772.0) < 1e-12


def test_twice_the_irradiance_is_twice_the_watts_and_photons() -> None:
    once, twice = black_body_light(683.5, 5777.0), black_body_light(1367.0, 5777.0)
    np.testing.assert_allclose(twice.irradiance, 2.0 * once.irradiance, rtol=1e-15)
    np.testing.assert_allclose(twice.photon_irradiance, 2.0 * once.photon_irradiance, rtol=1e-15)
    np.testing.assert_allclose(twice.photons_per_joule, once.photons_per_joule, rtol=1e-15)


def test_the_mean_photon_of_a_band_lies_within_the_band() -> None:
    per_joule = black_body_light(1367.0, 5777.0).photons_per_joule
    wavelength = per_joule * H * C
    for mean, (low, high) in zip(wavelength, BANDS.edges, strict=True):
        assert low < mean < high


def test_photon_mean_of_a_flat_curve_is_the_constant() -> None:
    wavelength = np.array([300e-9, 1100e-9])
    np.testing.assert_allclose(
        photon_mean(wavelength, np.array([0.37, 0.37]), 5777.0), [0.37] * 4, rtol=1e-14
    )


def test_photon_mean_weighs_by_photons_and_takes_zero_beyond_the_curve() -> None:
    # One up to 850 nm, nothing beyond: the mean is the share of the photons below.
    means = photon_mean(np.array([300e-9, 850e-9]), np.array([1.0, 1.0]), 5777.0)
    below = _photons_below(850e-9, 5777.0) - _photons_below(700e-9, 5777.0)
    band = _photons_below(1000e-9, 5777.0) - _photons_below(700e-9, 5777.0)
    # The midpoint rule with steps of 1 nm errs by h^2 f' / 24 at each end: below 1e-7.
    np.testing.assert_allclose(means, [1.0, 1.0, 1.0, below / band], rtol=1e-6)
