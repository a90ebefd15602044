"""Bands that a scenario chooses: means of spectra over them, against integrals done here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.lunar_model import disc_reflectance
from simgl.physics.spectrum import BANDS, Bands, black_body_light, photon_mean, planck_radiance
from simgl.physics.starlight import band_irradiance

NARROW = Bands(names=("led", "eye"), edges=((840e-9, 860e-9), (1500e-9, 1600e-9)))
# A step within the band, and edges that are no whole nanometres.
FILTER = ((830.0, 845.5, 845.6, 856.2), (0.2, 0.4, 0.9, 0.0))
FILTERED = Bands(names=("f",), edges=((835e-9, 870e-9),), filter=FILTER)


def _fine(low_nm: float, high_nm: float) -> tuple[Array, float]:
    """Middles [m] of steps of 0.01 nm or less, and their width [m]."""
    count = round(100 * (high_nm - low_nm))
    edges = np.linspace(low_nm, high_nm, count + 1) * 1e-9
    return 0.5 * (edges[1:] + edges[:-1]), float(edges[1] - edges[0])


def test_light_through_a_filter_is_the_integral_with_its_curve() -> None:
    wavelength, step = _fine(835.0, 870.0)
    through = np.interp(wavelength * 1e9, *FILTER, left=0.0, right=0.0)
    power = planck_radiance(wavelength, 5772.0) * through
    light = black_body_light(1361.0, 5772.0, FILTERED)
    total = 5.670374419e-8 * 5772.0**4 / np.pi
    # The rectangle rule errs by half a step at the filter's step: 2e-4 of its 20 nm.
    np.testing.assert_allclose(light.irradiance[0], 1361.0 * power.sum() * step / total, rtol=3e-4)
    per_joule = np.sum(power * wavelength) / np.sum(power) / (6.62607015e-34 * 299792458.0)
    np.testing.assert_allclose(light.photons_per_joule[0], per_joule, rtol=1e-5)
    # Channels without a band hold zeros, no NaN.
    assert light.irradiance[1:].tolist() == light.photons_per_joule[1:].tolist() == [0.0] * 3


def test_bands_that_tile_a_wider_one_share_its_light() -> None:
    edges = ((300e-9, 450.3e-9), (450.3e-9, 451.4e-9), (451.4e-9, 1700e-9), (1700e-9, 2500e-9))
    parts = black_body_light(1.0, 5772.0, Bands(names=("a", "b", "c", "d"), edges=edges))
    all_of_it = black_body_light(1.0, 5772.0, Bands(names=("a",), edges=((300e-9, 2500e-9),)))
    # 48 nodes over 2200 nm: 1e-8.
    assert parts.irradiance.sum() == pytest.approx(all_of_it.irradiance[0], rel=1e-8)
    assert parts.photon_irradiance.sum() == pytest.approx(all_of_it.photon_irradiance[0], rel=1e-8)


def test_numbers_for_r_g_b_n_hold_all_over_their_bands_and_beyond_them() -> None:
    given = (0.1, 0.2, 0.3, 0.4)
    # In the default bands nothing changes, to the last bit.
    assert BANDS.of_rgbn(given) == given
    assert replace(BANDS, names=("r", "g", "b", "n")).of_rgbn(given) == pytest.approx(given)
    edges = ((300e-9, 400e-9), (550e-9, 650e-9), (1400e-9, 2500e-9))
    below, between, beyond, unused = Bands(names=("u", "v", "w"), edges=edges).of_rgbn(given)
    assert (below, beyond, unused) == pytest.approx((0.3, 0.4, 0.0))
    wavelength, _ = _fine(550.0, 650.0)
    photons = planck_radiance(wavelength, 5772.0) * wavelength
    share = float(photons[wavelength >= 600e-9].sum() / photons.sum())
    # Steps of 1 nm, none of which straddles 600 nm: 1e-5.
    assert between == pytest.approx(share * 0.1 + (1.0 - share) * 0.2, rel=1e-5)


def test_power_for_r_g_b_n_is_even_within_them_and_none_beyond() -> None:
    edges = ((300e-9, 400e-9), (450e-9, 550e-9), (900e-9, 1100e-9))
    power = Bands(names=("u", "v", "w"), edges=edges).power_of_rgbn((4.0, 2.0, 1.0, 3.0))
    # Half of B and half of G; a third of N.
    assert power == pytest.approx((0.0, 1.5, 1.0, 0.0), rel=1e-9)
    assert BANDS.power_of_rgbn((4.0, 2.0, 1.0, 3.0)) == (4.0, 2.0, 1.0, 3.0)


def test_a_measured_curve_is_weighted_by_photons_and_keeps_its_ends() -> None:
    curve = ((400.0, 845.0, 1550.0), (0.0, 0.445, 0.8))
    led, eye, *unused = NARROW.photon_mean_of(curve, 5772.0)
    for mean, (low, high) in ((led, (840, 860)), (eye, (1500, 1600))):
        wavelength, _ = _fine(low, high)
        photons = planck_radiance(wavelength, 5772.0) * wavelength
        expected = np.sum(photons * np.interp(wavelength * 1e9, *curve)) / photons.sum()
        assert mean == pytest.approx(float(expected), rel=1e-5)
    assert unused == [0.0, 0.0]


def test_quantum_efficiency_is_weighted_by_the_photons_that_pass_the_filter() -> None:
    wavelength, _ = _fine(835.0, 870.0)
    through = np.interp(wavelength * 1e9, *FILTER, left=0.0, right=0.0)
    photons = planck_radiance(wavelength, 5772.0) * wavelength * through
    qe = np.interp(wavelength, [800e-9, 900e-9], [0.9, 0.1])
    mean = photon_mean(np.array([800e-9, 900e-9]), np.array([0.9, 0.1]), 5772.0, FILTERED)
    # The filter's step of 0.1 nm within steps of 1 nm: half a step of 20, over which the
    # efficiency changes by a tenth.
    assert mean[0] == pytest.approx(float(np.sum(photons * qe) / photons.sum()), rel=5e-3)


@pytest.mark.parametrize(
    ("nm", "solar"), [(1235.0, 452.0), (1662.0, 226.0), (2159.0, 89.5)], ids=["J", "H", "Ks"]
)
def test_the_sun_as_a_star_has_its_infrared_magnitudes(nm: float, solar: float) -> None:
    bands = Bands(names=("x",), edges=(((nm - 10) * 1e-9, (nm + 10) * 1e-9),))
    star = band_irradiance(np.array([-26.76]), np.array([0.653]), np.array([0.702]), bands)
    # W m-2 um-1 at magnitude 0 of 2MASS times the Sun's; the factors are the mean of Sun and Vega.
    assert float(star[0, 0]) / 0.02 == pytest.approx(solar, rel=0.06)


def test_the_moon_in_narrow_bands_is_that_of_the_broad_ones() -> None:
    edges = tuple((low + 1e-12, high) for low, high in BANDS.edges)
    for degrees in (5.0, 45.0, 90.0):
        narrow = disc_reflectance(np.radians(degrees), Bands(edges=edges))
        # Neighbouring wavelengths of the model are averaged.
        np.testing.assert_allclose(narrow, disc_reflectance(np.radians(degrees)), rtol=0.025)
