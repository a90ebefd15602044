"""The law of loose grains is the same both ways, takes no more than it gets, and has its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.regolith import MARS, face_on, geometric_albedo, reflectance


def test_light_goes_both_ways_alike() -> None:
    rng = np.random.default_rng(5)
    mu0, mu = rng.uniform(0.02, 1.0, (2, 500))
    psi = rng.uniform(0.0, np.pi, 500)
    cos_phase = mu0 * mu + np.sqrt((1.0 - mu0**2) * (1.0 - mu**2)) * np.cos(psi)
    there = reflectance(MARS, mu0, mu, cos_phase) / mu0
    back = reflectance(MARS, mu, mu0, cos_phase) / mu
    np.testing.assert_allclose(there, back, rtol=1e-12)


@pytest.mark.parametrize("mu0", [1.0, 0.6, 0.2])
def test_a_plane_sends_up_less_than_it_gets(mu0: float) -> None:
    mu = (np.arange(200) + 0.5) / 200
    psi = np.pi * (np.arange(200) + 0.5) / 200
    mu, psi = np.meshgrid(mu, psi)
    cos_phase = mu0 * mu + np.sqrt((1.0 - mu0**2) * (1.0 - mu**2)) * np.cos(psi)
    share = 2.0 * np.pi * float((reflectance(MARS, mu0, mu, cos_phase) * mu).mean()) / mu0
    # Grains of albedo 0.85 in a thick layer: (1 - sqrt(0.15)) / (1 + sqrt(0.15)) = 0.44 for
    # isotropic ones under diffuse light, and roughness takes off some.
    assert 0.3 < share < 0.44


def test_a_smooth_isotropic_ground_is_lommel_and_seeligers_with_h_functions() -> None:
    smooth = replace(MARS, lobe=0.0, surge=0.0, roughness=1e-3, single_scattering=0.4)
    mu0, mu = 0.7, 0.5
    gamma = np.sqrt(0.6)
    multiple = (1.0 + 2.0 * mu0) / (1.0 + 2.0 * mu0 * gamma)
    multiple *= (1.0 + 2.0 * mu) / (1.0 + 2.0 * mu * gamma)
    expected = 0.4 / (4.0 * np.pi) * mu0 / (mu0 + mu) * multiple
    assert float(reflectance(smooth, mu0, mu, 0.6)) == pytest.approx(expected, rel=1e-5)


def test_the_full_disc_of_mars_is_flat_to_the_limb() -> None:
    mu = np.array([1.0, 0.5, 0.1])
    profile = reflectance(MARS, mu, mu, 1.0) / reflectance(MARS, 1.0, 1.0, 1.0)
    # A Lambertian disc has 0.5 and 0.1.
    assert profile[1] > 0.75
    assert profile[2] > 0.7


def test_the_geometric_albedo_is_the_mean_over_the_disc() -> None:
    rng = np.random.default_rng(11)
    # Points strewn evenly on the disc.
    mu = np.sqrt(1.0 - rng.uniform(0.0, 1.0, 20_000))
    mean = float(np.pi * reflectance(MARS, mu, mu, 1.0).mean())
    # The spread over the disc is a tenth: 1e-3 of the mean of so many.
    assert geometric_albedo(MARS) == pytest.approx(mean, rel=3e-3)
    assert face_on(MARS) > geometric_albedo(MARS)


def test_no_light_where_the_sun_is_down() -> None:
    assert float(reflectance(MARS, -0.1, 0.5, 0.3)) == 0.0
