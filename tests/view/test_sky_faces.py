"""The sky around a spacecraft: fine where the Sun lights the Earth along its limb."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, Array32
from simgl.environment_map import cube_directions, cube_solid_angles, fill_between, irradiance
from simgl.glossy_sky import prefiltered
from simgl.lru_cache import HashedOnce
from simgl.simulator import Simulator
from simgl.view.background import LIMB_TEXELS, sky_view
from simgl.view.background_tiles import TILE, ground_tiles
from tests.passes import earth_light_scenes
from tests.passes.earth_light_scenes import EARTH, UP, R, before, facing, sun_at
from tests.scenes import Table, lambert

BALL = {"sphere": {"radius_m": 1.0, "material": lambert(1.0)}}
AIRY = {**EARTH, "atmosphere": "source"}


@pytest.mark.parametrize(
    ("altitude", "zenith_deg"),
    [
        *((2e5, 100.0), (4e5, 99.5), (4e5, 102.0), (4e5, 104.0), (4e5, 107.0), (2e6, 120.0)),
        *((3.6e7, 110.0), (3.6e7, 130.0), (3.6e7, 165.0), (3.8e8, 100.0), (3.8e8, 140.0)),
    ],
)
def test_all_sunlit_ground_lies_in_fine_tiles(
    monkeypatch: pytest.MonkeyPatch, altitude: float, zenith_deg: float
) -> None:
    """From low orbits to the distance of the Moon, of an Earth without air."""
    seen_from = (R + altitude) * UP
    monkeypatch.setattr(earth_light_scenes, "PLACE", seen_from)
    in_body = cube_directions(LIMB_TEXELS).reshape(-1, 3)
    for seed in range(8):
        turn = Rotation.random(random_state=seed)
        scenario = before(BALL, turn, facing(0.0, 0.0), zenith_deg, earth=EARTH)
        state = scenario.at(scenario.epoch_tai_ns)
        sky = sky_view(state, "body", state.bodies["body"])
        assert sky is not None
        assert sky.texels == LIMB_TEXELS
        fine = np.zeros((6, *[LIMB_TEXELS // TILE] * 2), dtype=bool)
        planets = {face: one.planet for face, one in enumerate(sky.faces) if one.planet is not None}
        first = next(iter(planets.values()))
        turns = [planet.sphere_from_camera for planet in planets.values()]
        size, intrinsics = (LIMB_TEXELS, LIMB_TEXELS), sky.faces[0].intrinsics
        tiles = ground_tiles(first, turns, intrinsics, size).in_light_of(first.sun_direction_itrf)
        fine[list(planets)] = tiles.brightest
        seen = turn.apply(in_body)
        along = seen @ seen_from
        root = along**2 - seen_from @ seen_from + R**2
        hits = (root > 0.0) & (along < 0.0)
        place = seen_from + (-along - np.sqrt(np.maximum(root, 0.0)))[:, None] * seen
        sunlit = hits & (place @ np.array(sun_at(zenith_deg)) > 0.0)
        assert sunlit.any()
        of_texels = fine.repeat(TILE, axis=1).repeat(TILE, axis=2).ravel()
        assert np.all(of_texels[sunlit])
        # Nor are all fine: the Earth alone fills some 650 tiles.
        assert fine.sum() < 200


@pytest.mark.parametrize("earth", [{"shape": "wgs84"}, AIRY])
@pytest.mark.parametrize("zenith_deg", [100.0, 107.0, 115.0])
def test_coarse_texels_elsewhere_hardly_change_the_light(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, earth: Table, zenith_deg: float
) -> None:
    """Of an Earth with ground, clouds and air, and of one of a single albedo with air."""
    turn = Rotation.random(random_state=3)
    scenario = before(BALL, turn, facing(0.0, 0.0), zenith_deg, earth=earth)
    state = scenario.at(scenario.epoch_tai_ns)
    view = sky_view(state, "body", state.bodies["body"])
    assert view is not None
    with Simulator(scenario, gl) as simulator:
        skies = simulator.skies.renderer.skies
        parts = skies.sky(view)
        # All of it finely, not in parts.
        monkeypatch.setattr("simgl.rendering.sky_renderer.LIMB_TEXELS", None)
        whole = skies.sky(replace(view, key=HashedOnce(("whole",))))
    assert parts.radiance.shape == whole.radiance.shape == (6, LIMB_TEXELS, LIMB_TEXELS, 4)
    assert np.any(parts.radiance != whole.radiance)
    planes = irradiance(parts), irradiance(whole)
    assert _relative_rms(*planes) < 1e-3
    lobes = prefiltered(parts, planes[0]), prefiltered(whole, planes[1])
    for of_parts, of_whole in zip(*lobes, strict=True):
        assert _relative_rms(of_parts, of_whole) < 1e-3
    assert _relative_rms(parts.radiance, whole.radiance) < 3e-3


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.2)])
def test_clouds_light_a_spacecraft_as_much_in_coarse_texels_as_in_fine_ones(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, direction: tuple[float, float, float]
) -> None:
    """Noon at 400 km, from all sides; texels of 1.4 and 0.35 deg, 10 and 2.5 km of ground at nadir
    and beyond 100 km at the limb, where most clouds are seen."""
    up = np.array(direction) / np.linalg.norm(direction)
    monkeypatch.setattr(earth_light_scenes, "PLACE", (R + 4e5) * up)
    monkeypatch.setattr(earth_light_scenes, "sun_at", lambda _: tuple(up))
    earth = {"shape": "wgs84"}
    scenario = before(BALL, Rotation.identity(), facing(0.0, 0.0), 0.0, earth=earth)
    with Simulator(scenario, gl) as simulator:
        skies = simulator.skies.renderer.skies

        def light() -> Array:
            state = scenario.at(scenario.epoch_tai_ns)
            view = sky_view(state, "body", state.bodies["body"])
            assert view is not None
            radiance = skies.sky(view).radiance
            return np.einsum("fyxb,yx->b", radiance, cube_solid_angles(view.texels))

        coarse = light()
        monkeypatch.setattr("simgl.view.background.SKY_TEXELS", LIMB_TEXELS)
        # All of it finely, not in parts.
        monkeypatch.setattr("simgl.rendering.sky_renderer.LIMB_TEXELS", None)
        fine = light()
    # The goal for Earth light is 2 %. Means of cover and thickness each for itself lost 4.5 %.
    np.testing.assert_allclose(coarse, fine, rtol=0.02)


def _relative_rms(got: Array32, expected: Array32) -> float:
    return float(np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2)))


def test_coarse_texels_fill_what_is_between_fine_tiles() -> None:
    drawn = np.arange(6 * 8 * 8 * 4, dtype=np.float32).reshape(6, 8, 8, 4)
    tiles = np.zeros((6, 2, 2), dtype=bool)
    tiles[1, 0, 1] = tiles[4, 1, 0] = True
    coarse = -1.0 - np.arange(6 * 4 * 4 * 4, dtype=np.float32).reshape(6, 4, 4, 4)
    whole = drawn.copy()
    fill_between(whole, tiles, coarse)
    known = tiles.repeat(4, axis=1).repeat(4, axis=2)
    np.testing.assert_array_equal(whole[known], drawn[known])
    between = coarse.repeat(2, axis=1).repeat(2, axis=2)
    np.testing.assert_array_equal(whole[~known], between[~known])
