"""Sunlight past the Earth's air and the Moon: against quadrature, a truth table and limits."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP, Exponential, column
from simgl.physics.atmosphere import (
    SOURCE,
    STANDARD,
    Atmosphere,
    grazing_optical_depth,
    optical_depth_to_space,
)
from simgl.physics.eclipse import past_the_moon, sunlit_shares, sunlit_transmission
from simgl.physics.solar_disc import UNIFORM
from tests.authorities.eclipse import REDDENED, SUN_HALF_ANGLE_DEG

RADIUS = 6.371e6
SUN = np.radians(SUN_HALF_ANGLE_DEG)
SPHERE = np.full(3, RADIUS)
ALTITUDE = 500e3


def along_a_line(air: Atmosphere, start: float, cosine: float) -> Array:
    """(4,) optical depth from a radius [m] to space, in steps of 80 m at most."""
    reach = np.sqrt((RADIUS + AIR_TOP) ** 2 - start**2 * (1.0 - cosine**2)) - start * cosine
    s = np.linspace(0.0, reach, 30_001)
    height = np.sqrt(start**2 + s * (2.0 * start * cosine + s)) - RADIUS
    parts = (
        (air.rayleigh, air.rayleigh_profile),
        (air.aerosol, air.aerosol_profile),
        (air.ozone, air.ozone_profile),
    )
    columns = [np.trapezoid(p.density(height), s) / column(p) for _, p in parts]
    return np.array(columns) @ np.array([depth for depth, _ in parts])


@pytest.mark.parametrize("air", [STANDARD, SOURCE], ids=lambda a: a.name)
@pytest.mark.parametrize("height", [0.0, 7e3, 18e3, 30e3, 60e3])
def test_a_grazing_ray_loses_what_quadrature_says(air: Atmosphere, height: float) -> None:
    got = grazing_optical_depth(air, RADIUS, np.array([height]))[0]
    expected = 2.0 * along_a_line(air, RADIUS + height, 0.0)
    # The table's places between the kinks, and 160 nodes over them.
    np.testing.assert_allclose(got, expected, rtol=5e-4)


def light_at(tangent_height: float) -> Array:
    """Red, green, blue, NIR at 500 km with the Sun's centre at a tangent height [m]."""
    distance = RADIUS + ALTITUDE
    angle = np.arcsin((RADIUS + tangent_height) / distance)
    sun = np.array([-np.cos(angle), np.sin(angle), 0.0])
    return sunlit_transmission(np.array([distance, 0.0, 0.0]), sun, SUN, SPHERE, SOURCE)


@pytest.mark.parametrize(("height_km", "red", "green", "blue"), REDDENED)
def test_the_setting_sun_reddens_as_in_the_table(
    height_km: float, red: float, green: float, blue: float
) -> None:
    # The table is a Monte Carlo's, with four digits and air up to 100 km.
    np.testing.assert_allclose(light_at(1e3 * height_km)[:3], (red, green, blue), atol=2e-3)


def test_half_of_the_light_is_left_13_km_up_in_red_and_27_in_blue() -> None:
    heights = np.arange(0.0, 50e3, 100.0)
    light = np.array([light_at(h) for h in heights])
    half = [heights[np.argmin(np.abs(light[:, band] - 0.5))] for band in (0, 2)]
    np.testing.assert_allclose(half, (13e3, 27e3), atol=1e3)


def test_the_light_falls_steadily_and_without_steps() -> None:
    light = np.array([light_at(h) for h in np.arange(-30e3, 160e3, 200.0)])
    steps = np.diff(light, axis=0)
    assert np.all(steps > -1e-9)
    # Nothing changes faster than the bare disc would: 24 km of it by 0.2 km at 2 / pi of its width.
    assert steps.max() < 0.2 / 24.0 * 4.0 / np.pi
    assert np.all(light[0] == 0.0)
    np.testing.assert_allclose(light[-1], 1.0, atol=1e-6)


def test_air_without_density_is_no_air() -> None:
    nothing = Atmosphere(
        name="nothing",
        rayleigh=(0.0,) * 4,
        depolarisation=0.0,
        aerosol=(0.0,) * 4,
        aerosol_albedo=(1.0,) * 4,
        aerosol_asymmetry=(0.0,) * 4,
        ozone=(0.0,) * 4,
        refractivity=(0.0,) * 4,
        rayleigh_profile=Exponential(8e3),
        aerosol_profile=Exponential(1e3),
        ozone_profile=Exponential(8e3),
    )
    position = np.array([0.3, 0.2, 6.871e6])
    for degrees in np.linspace(109.0, 112.5, 40):
        z = np.radians(degrees)
        sun = np.array([np.sin(z), 0.0, np.cos(z)])
        bare = float(sunlit_shares(position, sun, SUN, SPHERE, UNIFORM)[0])
        airy = sunlit_transmission(position, sun, SUN, SPHERE, nothing)
        np.testing.assert_allclose(airy, bare, atol=1e-9)


def test_the_moon_covers_what_geometry_says() -> None:
    """In line, a Moon smaller than the Sun leaves a ring; a larger one leaves nothing."""
    point, towards = np.zeros(3), np.array([1.0, 0.0, 0.0])
    near, far = 3.3e8 * towards, 4.1e8 * towards
    assert not past_the_moon(point, near, towards, SUN).any()
    ring = 1.0 - (np.arcsin(1737.4e3 / 4.1e8) / SUN) ** 2
    np.testing.assert_allclose(past_the_moon(point, far, towards, SUN), ring, rtol=1e-5)
    aside = np.array([0.0, 4e8, 0.0])
    np.testing.assert_array_equal(past_the_moon(point, aside, towards, SUN), np.ones(4))


@pytest.mark.parametrize("air", [STANDARD, SOURCE], ids=lambda a: a.name)
@pytest.mark.parametrize("height", [0.0, 3e3, 30e3])
@pytest.mark.parametrize("cosine", [1.0, 0.3, 0.02, 0.0, -0.02])
def test_a_ray_from_inside_the_air_loses_what_quadrature_says(
    air: Atmosphere, height: float, cosine: float
) -> None:
    start = RADIUS + height
    if start * np.sqrt(1.0 - cosine**2) < RADIUS:
        return
    got = optical_depth_to_space(air, RADIUS, height, np.array([cosine]))[0]

    # The same.
    np.testing.assert_allclose(got, along_a_line(air, start, cosine), rtol=5e-4, atol=4e-5)


@pytest.mark.parametrize("zenith_deg", [0.0, 50.0, 75.0, 89.0])
def test_sunlight_inside_the_air_joins_that_above_it(zenith_deg: float) -> None:
    """On the ground it is the vertical's loss by airmass; at the top of the air nothing jumps."""
    z = np.radians(zenith_deg)
    sun = np.array([np.cos(z), np.sin(z), 0.0])

    def share(height: float) -> Array:
        place = np.array([RADIUS + height, 0.0, 0.0])
        return sunlit_transmission(place, sun, SUN, SPHERE, SOURCE)

    np.testing.assert_allclose(share(AIR_TOP - 100.0), share(AIR_TOP + 100.0), atol=1e-4)
    if zenith_deg <= 50.0:
        vertical = np.array(SOURCE.rayleigh) + np.array(SOURCE.aerosol)
        # The Earth's curvature shortens the way by 2e-3 of the airmass at 50 deg.
        np.testing.assert_allclose(share(0.1), np.exp(-vertical / np.cos(z)), rtol=2e-3)
