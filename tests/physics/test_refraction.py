"""Bent rays: against a ray tracer in Cartesian steps, known angles, and what light must keep."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import STANDARD
from simgl.physics.eclipse import sunlit_transmission
from simgl.physics.refraction import rays_from_inside, rays_from_space
from tests.authorities.bent_rays import RADIUS, refractivity, traced_bending

STATION = RADIUS + 400e3
SPHERE = np.full(3, RADIUS)
SUN = np.radians(0.263)
NOTHING = (0.0, 0.0, 0.0, 0.0)
CLEAR = replace(STANDARD, rayleigh=NOTHING, aerosol=NOTHING, ozone=NOTHING)
STRAIGHT = replace(STANDARD, refractivity=NOTHING)


@pytest.mark.parametrize("height", [50.0, 2e3, 5e3, 10e3, 15e3, 20e3, 30e3, 40e3, 50e3, 60e3])
def test_rays_bend_as_a_ray_tracer_bends_them(height: float) -> None:
    ground = STANDARD.refractivity[1]
    impact = (RADIUS + height) * (1.0 + refractivity(height, ground)[0])
    rays = rays_from_space(STANDARD, RADIUS, STATION)
    apparent = np.arcsin(impact / STATION)
    bending = np.interp(apparent, rays.apparent[:, 1], rays.bending[:, 1])
    assert bending == pytest.approx(traced_bending(height, ground), rel=0.01)


def test_a_star_geometrically_5_km_high_stands_a_quarter_of_a_degree_higher() -> None:
    true = np.arcsin((RADIUS + 5e3) / STATION)
    (apparent,) = rays_from_space(STANDARD, RADIUS, STATION).seen_at(np.array([true]), 1)
    assert np.degrees(apparent - true) == pytest.approx(0.24, abs=0.005)


def test_the_horizon_of_the_ground_lies_1_8_km_high() -> None:
    """n R - R, which lifts it by 0.044 deg seen from 400 km."""
    lowest = STATION * np.sin(rays_from_space(STANDARD, RADIUS, STATION).apparent[0, 1])
    assert lowest - RADIUS == pytest.approx(STANDARD.refractivity[1] * RADIUS, rel=1e-3)
    lifted = rays_from_space(STANDARD, RADIUS, STATION).apparent[0, 1] - np.arcsin(RADIUS / STATION)
    assert np.degrees(lifted) == pytest.approx(0.044, abs=0.001)


def test_the_setting_sun_stands_34_minutes_higher_for_an_observer_on_the_ground() -> None:
    """34', 5.3' and 1.7' by Bennett (1982), for air of 10 deg C, here of 15 deg C and dry."""
    rays = rays_from_inside(STANDARD, RADIUS, 2.0, 1.5, 2.2)
    for elevation, minutes, within in ((0.0, 33.5, 0.7), (10.0, 5.23, 0.05), (30.0, 1.67, 0.04)):
        bending = np.interp(np.radians(90.0 + elevation), rays.apparent[:, 1], rays.bending[:, 1])
        assert np.degrees(bending) * 60.0 == pytest.approx(minutes, abs=within), elevation


def test_blue_bends_more_than_red_by_the_dispersion_of_air() -> None:
    rays = rays_from_space(STANDARD, RADIUS, STATION)
    red, blue = (np.interp(0.0, -rays.depth[:, 3], rays.bending[:, band]) for band in (0, 2))
    assert red == 0.0 == blue
    lowest = rays.bending[0]
    # More than in proportion: what bends more also stays lower.
    assert lowest[2] / lowest[0] == pytest.approx(2.8053 / 2.7632, rel=5e-3)


def test_bending_spreads_light_and_loses_none() -> None:
    """Clear air: behind the Earth as much passes a plane as met the air before it."""
    behind = 2.3e6
    outwards = RADIUS + np.arange(-60e3, 125e3, 250.0)
    sun = np.array([0.0, 0.0, 1.0])
    shares = np.array(
        [
            sunlit_transmission(np.array([r, 0.0, -behind]), sun, 1e-4, SPHERE, CLEAR)
            for r in outwards
        ]
    )
    passed = np.trapezoid(shares * outwards[:, None], outwards, axis=0)
    lowest = RADIUS * (1.0 + np.array(STANDARD.refractivity))
    # The Sun's disc blurs both ends alike; the plane's edges lie 0.25 km apart.
    np.testing.assert_allclose(passed, 0.5 * (outwards[-1] ** 2 - lowest**2), rtol=2e-3)
    assert shares[-1] == pytest.approx(1.0)


def test_sunlight_lasts_longer_for_a_spacecraft_and_longest_in_red() -> None:
    """By the way round at 400 km, 0.065 deg/s, until 3 % of the light are left."""
    angles = np.radians(np.arange(19.0, 22.0, 0.01))
    last = {}
    for air in (STANDARD, STRAIGHT):
        light = [
            sunlit_transmission(
                np.array([STATION, 0.0, 0.0]),
                np.array([-np.sin(a), np.cos(a), 0.0]),
                SUN,
                SPHERE,
                air,
            )
            for a in angles
        ]
        last[air] = [angles[np.flatnonzero(np.array(light)[:, b] > 0.03)[-1]] for b in range(3)]
    seconds = np.degrees(np.subtract(last[STANDARD], last[STRAIGHT])) / 0.0648
    assert 3.0 < seconds[0] < 6.0
    assert seconds[1:].min() > 1.0
    assert seconds[0] > 2.0 * seconds[1:].max()


def test_bent_light_is_continuous_where_a_spacecraft_leaves_the_air() -> None:
    for degrees in (10.5, 11.0, 11.3, 12.0):
        a = np.radians(degrees)
        sun = np.array([-np.sin(a), np.cos(a), 0.0])
        inside, outside = (
            sunlit_transmission(np.array([RADIUS + h, 0.0, 0.0]), sun, SUN, SPHERE, STANDARD)
            for h in (AIR_TOP - 20.0, AIR_TOP + 20.0)
        )
        np.testing.assert_allclose(inside, outside, atol=2e-3)
