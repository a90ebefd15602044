"""What lights the Earth at night: the Moon, and the air itself."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.physics.airglow import (
    GLOW_DEPTH,
    ground_irradiance,
    path_in_layers,
    zenith_glow,
)
from simgl.physics.atmosphere import STANDARD
from simgl.physics.lunar_model import moonlight
from simgl.scene.earth import Clouds, Earth
from tests.passes.air_scenes import RADIUS, sphere, window

UP, ASIDE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
MOON_KM = 384_400.0


def above(height: float) -> np.ndarray:
    return UP * (RADIUS + height)


def test_a_full_moon_gives_a_quarter_of_a_lux() -> None:
    # The Sun's 128 klx outside the air: 1361 W m-2 at 94 lm/W (Gueymard 2004).
    # 5 deg from opposition, as on most nights of full Moon.
    full = moonlight(np.ones(4), MOON_KM * 1e3, np.radians(5.0))
    assert 128e3 * full[1] == pytest.approx(0.3, abs=0.05)
    # At the quarters a tenth of that (Allen 1976: -10.0 against -12.74 mag is 0.08).
    assert moonlight(np.ones(4), MOON_KM * 1e3, np.pi / 2)[1] / full[1] == pytest.approx(
        0.09, abs=0.02
    )


@pytest.mark.parametrize("angle", [0.0, 60.0])
def test_the_full_moon_lights_ground_by_its_irradiance(gl: moderngl.Context, angle: float) -> None:
    a = np.radians(angle)
    towards = np.cos(a) * UP + np.sin(a) * ASIDE
    earth = replace(sphere(0.4, air=None), moonlight=True)
    with window(gl) as seen:
        lit = seen.picture(earth, above(4e5), -UP, -towards, moon=MOON_KM * 1e3 * towards)[1, 1]
    # pi L / E = albedo cos z of the Moon's light; float32.
    np.testing.assert_allclose(
        lit, 0.4 * np.cos(a) * moonlight(np.ones(4), MOON_KM * 1e3, 0.0), rtol=1e-3
    )


def test_moonlit_air_is_sunlit_air_by_another_light(gl: moderngl.Context) -> None:
    """Behind the Earth the Sun gives nothing, and the Moon what the Sun would in its place."""
    towards = np.array([0.6, 0.0, 0.8])
    dark = sphere(0.1, air=STANDARD)
    with window(gl) as seen:
        night = seen.picture(
            replace(dark, moonlight=True), above(4e5), -UP, -towards, moon=MOON_KM * 1e3 * towards
        )[1, 1]
        day = seen.picture(dark, above(4e5), -UP, towards)[1, 1]
    share = moonlight(np.ones(4), MOON_KM * 1e3, 0.0)
    np.testing.assert_allclose(night / share, day, rtol=1e-3)


def test_the_airglow_over_black_ground_is_its_radiance_at_the_zenith(gl: moderngl.Context) -> None:
    earth = replace(sphere(0.0, air=STANDARD), airglow=True)
    with window(gl) as seen:
        down = seen.picture(earth, above(4e5), -UP, -UP)[1, 1] / np.pi
        up = seen.picture(earth, above(2.0), UP, -UP)[1, 1] / np.pi
    np.testing.assert_allclose(down, zenith_glow(from_below=False), rtol=1e-3)
    # From the ground, through the vertical air.
    depth = np.array(STANDARD.rayleigh) + np.array(STANDARD.aerosol) + np.array(STANDARD.ozone)
    np.testing.assert_allclose(up, zenith_glow(from_below=True) * np.exp(-depth), rtol=5e-3)


@pytest.mark.parametrize("albedo", [(0.0,) * 4, None])
def test_the_airglow_at_the_limb_is_brighter_by_its_longer_way(
    gl: moderngl.Context, albedo: tuple[float, float, float, float] | None
) -> None:
    """Two passages of the layers; the air at 75 km and higher takes less than 1e-3."""
    earth = replace(sphere(0.0, air=STANDARD), airglow=True, albedo=albedo)
    r = RADIUS + 4e5
    with window(gl) as seen:
        for height in (75e3, 81e3, 85e3, 90.5e3, 95e3, 99e3):
            sine = (RADIUS + height) / r
            view = -np.sqrt(1.0 - sine**2) * UP + sine * np.array([0.0, 1.0, 0.0])
            limb = seen.picture(earth, above(4e5), view, -UP, pixel=1e-7)[1, 1] / np.pi
            path = path_in_layers(RADIUS, np.array([height]))[0]
            wanted = zenith_glow(from_below=False) * 2.0 * path / GLOW_DEPTH
            # float32 knows the lowest point to a few metres; near a layer's rim that is 1e-3.
            np.testing.assert_allclose(limb, wanted, rtol=5e-3, atol=1e-10)


def test_the_airglow_lights_level_ground_by_what_comes_from_all_over_the_sky() -> None:
    """A flat layer would give 2 pi L; the Earth's curve takes some of it near the horizon."""
    per_zenith = ground_irradiance(RADIUS) / zenith_glow(from_below=True)
    assert np.all((per_zenith > 1.4 * np.pi) & (per_zenith < 2.0 * np.pi))


def test_a_sea_at_night_is_never_black(gl: moderngl.Context) -> None:
    night = Earth(air=STANDARD, clouds=None, airglow=True)
    place = np.array([6.8e6, 0.0, 0.0])
    with window(gl) as seen:
        sea = seen.picture(night, place, -UP, -UP)[1, 1] / np.pi
    assert np.all(sea > 0.99 * zenith_glow(from_below=False))


@pytest.mark.parametrize("zenith", [0.0, 60.0, 87.0])
def test_by_day_moon_and_airglow_change_nothing(gl: moderngl.Context, zenith: float) -> None:
    z = np.radians(zenith)
    sun = np.cos(z) * UP + np.sin(z) * ASIDE
    day = Earth(air=STANDARD, clouds=Clouds())
    night = replace(day, moonlight=True, airglow=True)
    place, moon = np.array([6.8e6, 0.0, 0.0]), MOON_KM * 1e3 * UP
    with window(gl) as seen:
        with_both = seen.picture(night, place, -UP, sun, moon=moon, size=(32, 24), pixel=2e-2)
        without = seen.picture(day, place, -UP, sun, size=(32, 24), pixel=2e-2)
    np.testing.assert_allclose(with_both, without, rtol=1e-4, atol=1e-9)
