"""The Sun's disc: darker at the limb, the same light in all, and what an eclipse leaves of it."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.air_profile import Exponential
from simgl.physics.atmosphere import SOURCE, Atmosphere
from simgl.physics.eclipse import (
    past_the_moon,
    sunlit_shares,
    sunlit_transmission,
    visible_disc_fraction,
    visible_light_fraction,
)
from simgl.physics.solar_disc import UNIFORM, astm_g173_light, limb_darkening, limb_profile
from simgl.physics.spectrum import Bands, black_body_light
from tests.authorities.eclipse import ALTITUDE, EARTH_RADIUS, SUN_HALF_ANGLE_DEG

SUN = np.radians(SUN_HALF_ANGLE_DEG)
SPHERE = np.full(3, EARTH_RADIUS)
LIMB = limb_darkening()


def test_darkening_keeps_the_light_of_the_whole_disc() -> None:
    # Rings of equal area have equal steps of mu^2.
    mu = np.sqrt((np.arange(100_000) + 0.5) / 100_000)
    np.testing.assert_allclose(limb_profile(mu, LIMB).mean(axis=0), 1.0, rtol=1e-6)


def test_the_profile_is_that_of_the_published_table() -> None:
    # Edge over middle, 1 - u2 - v2 of Allen's table at both ends of each band.
    edge = limb_profile(np.array(0.0), LIMB) / limb_profile(np.array(1.0), LIMB)
    assert np.all(edge > np.array([0.35, 0.25, 0.14, 0.42]))
    assert np.all(edge < np.array([0.42, 0.35, 0.25, 0.56]))
    # Blue fades most, infrared least.
    assert edge[2] < edge[1] < edge[0] < edge[3]


def test_a_uniform_disc_has_the_same_radiance_everywhere() -> None:
    np.testing.assert_array_equal(limb_profile(np.linspace(0, 1, 5), UNIFORM), np.ones((5, 4)))


def _by_sampling(body: float, separation: float) -> Array:
    """Light from outside the body by a fine grid over the disc, plane trigonometry; in radii."""
    n = 1500
    x, y = np.meshgrid(*2 * [(np.arange(n) + 0.5) / n * 2.0 - 1.0])
    r2 = x**2 + y**2
    light = limb_profile(np.sqrt(np.maximum(1.0 - r2, 0.0)), LIMB) * (r2 < 1.0)[..., None]
    seen = np.hypot(x - separation, y) > body
    return (light * seen[..., None]).sum(axis=(0, 1)) / light.sum(axis=(0, 1))


@pytest.mark.parametrize(
    ("body", "separation"),
    [(0.5, 0.0), (0.5, 0.3), (0.5, 0.6), (0.9, 0.3), (1.05, 0.9), (1.05, 0.02), (3.0, 2.4),
     (250.0, 249.5), (250.0, 250.7), (250.0, 250.95)],
)  # fmt: skip
def test_any_body_hides_the_light_that_lies_behind_it(body: float, separation: float) -> None:
    ours = visible_light_fraction(SUN, body * SUN, separation * SUN, LIMB)
    # The grid's staircase along the edge: 1500 cells that err by up to half a cell of 1.8e-6 of the
    # disc at random, some 2e-5; a body of 250 radii is no longer plane: its edge, a curve over the
    # disc, lies 1e-3 of a radius off.
    assert np.abs(ours - _by_sampling(body, separation)).max() < (3e-5 if body < 100.0 else 8e-4)


@pytest.mark.parametrize("separation", [0.05, 0.4, 0.99, 1.3, 1.8])
def test_without_darkening_light_is_solid_angle(separation: float) -> None:
    tiny = np.full((2, 4), 1e-15)
    ours = visible_light_fraction(SUN, 0.8 * SUN, separation * SUN, tiny)
    exact = visible_disc_fraction(SUN, 0.8 * SUN, separation * SUN)
    # Cosines of angles of 5 mrad leave the closed form 4e-7.
    np.testing.assert_allclose(ours, exact, atol=1e-6)
    same = visible_light_fraction(SUN, 0.8 * SUN, separation * SUN, UNIFORM)
    np.testing.assert_array_equal(same, np.full(4, exact))


def at_depression(beta_deg: float, limb: Array, air: Atmosphere | None = None) -> Array:
    position = np.array([EARTH_RADIUS + ALTITUDE, 0.0, 0.0])
    b = np.radians(beta_deg)
    sun = np.array([-np.sin(b), np.cos(b), 0.0])
    if air is None:
        return sunlit_shares(position, sun, SUN, SPHERE, limb)
    return sunlit_transmission(position, sun, SUN, SPHERE, air, limb)


def test_half_a_disc_is_half_its_light_and_a_sliver_of_the_limb_less_than_its_area() -> None:
    position = np.array([EARTH_RADIUS + ALTITUDE, 0.0, 0.0])
    for beta in (19.6, 19.9, 20.0293):
        b = np.radians(beta)
        towards = np.array([-np.sin(b), np.cos(b), 0.0])
        area = float(sunlit_shares(position, towards, SUN, SPHERE, UNIFORM)[0])
        light = at_depression(beta, LIMB)
        assert np.all((light > area) == (area > 0.5)), beta
        # The darker the limb of a band, the further it is from its area.
        off = np.abs(light - area)
        assert off[2] > off[1] > off[0] > off[3]
    np.testing.assert_allclose(at_depression(19.7926, LIMB), 0.50017, atol=3e-4)


@pytest.mark.parametrize("beta_deg", [19.6, 19.75, 19.9, 20.0])
def test_air_that_takes_nothing_leaves_the_light_past_a_bare_sphere(beta_deg: float) -> None:
    """Two ways over the disc, rings about its centre and arcs about the Earth's, agree."""
    none = (0.0, 0.0, 0.0, 0.0)
    clear = Atmosphere(
        name="clear",
        rayleigh=none,
        depolarisation=0.0,
        aerosol=none,
        aerosol_albedo=none,
        aerosol_asymmetry=none,
        ozone=none,
        refractivity=none,
        rayleigh_profile=Exponential(8e3),
        aerosol_profile=Exponential(1e3),
        ozone_profile=Exponential(8e3),
    )
    # Both leave out the square of the disc's radius, 2e-5, in the cosine of emergence.
    np.testing.assert_allclose(
        at_depression(beta_deg, LIMB, clear), at_depression(beta_deg, LIMB), atol=1e-5
    )


def test_a_darkened_lower_limb_loses_less_to_the_air_below() -> None:
    # The air reddens the lower limb first, which counts for less of a darkened disc.
    assert np.all(at_depression(18.8, LIMB, SOURCE) > at_depression(18.8, UNIFORM, SOURCE))


def test_the_ring_of_an_annular_eclipse_is_the_dark_part_of_the_disc() -> None:
    point, towards = np.zeros(3), np.array([1.0, 0.0, 0.0])
    far = 4.1e8 * towards
    bare, dark = (past_the_moon(point, far, towards, SUN, limb) for limb in (UNIFORM, LIMB))
    # Outside x = 0.923 of the radius mu < 0.385: the mean there is that of the limb.
    assert np.all(dark < 0.8 * bare)
    assert np.all(dark > 0.3 * bare)


def test_the_measured_spectrum_is_near_the_black_bodys_and_scales() -> None:
    measured, planck = astm_g173_light(1361.0), black_body_light(1361.0, 5772.0)
    # The Sun's spectrum is within a tenth of the black body of its effective temperature.
    np.testing.assert_allclose(measured.irradiance, planck.irradiance, rtol=0.10)
    np.testing.assert_allclose(measured.photons_per_joule, planck.photons_per_joule, rtol=0.01)
    twice = astm_g173_light(2722.0)
    np.testing.assert_allclose(twice.irradiance, 2.0 * measured.irradiance, rtol=1e-15)


def test_the_measured_spectrums_bands_are_those_of_the_table() -> None:
    # ASTM G173-03, extraterrestrial: at 550 nm 1.863 W m-2 nm-1, and the band's mean nearby.
    light = astm_g173_light(1366.1)
    np.testing.assert_allclose(light.irradiance[1] / 100.0, 1.86, rtol=0.02)
    np.testing.assert_allclose(light.irradiance, [158.768, 184.677, 186.519, 311.320], atol=5e-4)


def test_the_measured_sun_in_bands_that_are_r_g_b_n_is_that_of_the_default() -> None:
    other = astm_g173_light(1361.0, Bands(names=("w", "x", "y", "z")))
    default = astm_g173_light(1361.0)
    # Five digits of the table, and steps of 0.1 nm.
    np.testing.assert_allclose(other.irradiance, default.irradiance, rtol=1e-4)
    np.testing.assert_allclose(other.photons_per_joule, default.photons_per_joule, rtol=1e-4)


def test_the_measured_sun_is_weaker_than_a_black_body_in_the_ultraviolet() -> None:
    bands = Bands(names=("u",), edges=((300e-9, 400e-9),))
    measured = astm_g173_light(1366.1, bands).irradiance[0]
    # ASTM E490-00a: of 1366.1 W m-2 8.0 % lie below 400 nm and 1.2 % below 300 nm.
    assert measured == pytest.approx((0.080 - 0.012) * 1366.1, rel=0.03)
    assert measured < 0.9 * black_body_light(1366.1, 5772.0, bands).irradiance[0]
