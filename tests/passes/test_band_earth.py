"""The Earth in bands of a scenario: against the default's, and electrons before it by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.arrays import Array, Array32, Image8
from simgl.passes.background import earth_textures
from simgl.passes.background.earth_air import pair_table
from simgl.passes.background.map_levels import MapLevels, map_levels
from simgl.physics.band_air import air_in_bands
from simgl.physics.spectrum import BANDS as DEFAULT
from simgl.physics.spectrum import Bands
from simgl.scenario.loader import scenario_from_dict
from simgl.scene.earth import Clouds, Earth, EarthMaps, load_map
from simgl.scene.noise_projection import LEVELS
from simgl.simulator import Product, Simulator
from tests.passes.band_scenes import ORBIT, over_earth
from tests.scenes import Table

H, C, K, SIGMA = 6.62607015e-34, 299792458.0, 1.380649e-23, 5.670374419e-8
# Of one term each, so that one set of tables serves all.
BANDS = [[545.0, 555.0], [610.0, 625.0], [640.0, 660.0], [840.0, 860.0]]


def _scene(boresight: list[float], *, bands: list[list[float]] | None, **tables: Any) -> Table:
    return over_earth(
        boresight,
        [1.0, 0.0, 0.0],
        bands,
        spacecraft={
            "board": {
                "model": {
                    "plate": {"width_m": 0.5, "height_m": 0.5, "material": {"reflectance": 0.4}}
                },
                "position_icrf_m": [ORBIT - 40.0, 9.0, 0.0],
                # The plate's side +z looks along +x, away from the Earth.
                "quaternion_icrf_from_body_xyzw": [0.0, 0.5**0.5, 0.0, 0.5**0.5],
            }
        },
        **tables,
    ) | {"epoch": {"utc": "2026-03-20T10:00:00"}}


def _taken(gl: moderngl.Context, scene: Table) -> tuple[Array, Array]:
    """Radiance and electrons."""
    scenario = scenario_from_dict(scene)
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        taken = simulator.capture(state, "cam", {Product.RADIANCE, Product.ELECTRONS})
    assert taken.radiance is not None
    assert taken.electrons is not None
    return taken.radiance.radiance.astype(np.float64), taken.electrons.electrons.astype(np.float64)


def _sunlight(nm: Array) -> Array:
    """[W m-2 nm-1] at 1 au."""
    m = nm * 1e-9
    planck = 2e-9 * H * C**2 / m**5 / np.expm1(H * C / (m * K * 5772.0))
    return 1361.0 * planck * np.pi / (SIGMA * 5772.0**4)


def test_ground_and_limb_in_a_band_about_550_nm_are_the_default_s_g(gl: moderngl.Context) -> None:
    earth = {"albedo": 0.3}
    default, other = (
        _taken(gl, _scene([-0.45, 0.8, 0.4], bands=bands, earth=earth))[0]
        for bands in (None, BANDS)
    )
    green = default[..., 1] / np.sum(_sunlight(np.arange(500.0, 600.0) + 0.5))
    band = other[..., 0] / np.sum(_sunlight(np.arange(545.0, 555.0) + 0.5))
    lit = green > 0.05 * green.max()
    assert lit.mean() > 0.5
    # G has the depths of 550 nm. The ozone of the bands is 0.002 less of the vertical, of which a
    # ray into the limb has up to 10 where its light comes from.
    np.testing.assert_allclose(band[lit], green[lit], rtol=0.02)


def test_a_sunlit_board_before_the_earth_has_the_electrons_of_its_sunlight(
    gl: moderngl.Context,
) -> None:
    scene = _scene([-1.0, 0.225, 0.0], bands=BANDS, earth={"albedo": 0.3})
    scene["sun"] = {"direction_icrf": [0.9, 0.2, 0.38]}
    scene["camera"]["cam"] |= {"width_px": 65, "height_px": 65, "pixel_pitch_um": 5.0}
    scene["camera"]["cam"]["up"] = [0.0, 0.0, 1.0]
    # Nothing is behind it that comes over its edges: its middle pixel sees the board alone.
    radiance, electrons = _taken(gl, scene)
    # The side that is seen looks away from the Earth, whose light it does not get.
    cosine = 0.9 / np.linalg.norm([0.9, 0.2, 0.38])
    expected = 0.0
    for low, high in BANDS:
        nm = np.arange(low, high, 0.05) + 0.025
        power = _sunlight(nm) * cosine * 0.4 / np.pi
        expected += float(np.sum(power * 0.5 * nm * 1e-9) * 0.05 / (H * C))
    expected *= np.pi / (4.0 * 4.0**2) * (5e-6) ** 2 * 1e-4
    assert electrons[32, 32] == pytest.approx(expected, rel=5e-3)
    assert radiance[2, 2].min() > 0.0


def test_clouds_are_made_of_the_default_s_land_in_any_bands(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pixels = np.random.default_rng(1).integers(0, 255, (32, 64, 3), dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "land.png")
    maps = EarthMaps(land=load_map(tmp_path / "land.png", "RGB"))
    seen: list[bytes] = []

    def drawn(_ctx: object, _clouds: object, _maps: object, ground: Any) -> MapLevels:
        seen.append(ground[0].read())
        return map_levels(np.zeros((256, 512, 4), dtype=np.uint8))

    def small_chart(_seed: int) -> tuple[list[Image8], Array32]:
        return [np.zeros((2, 2, 8), dtype=np.uint8)], np.zeros((LEVELS, 6), dtype=np.float32)

    monkeypatch.setattr(earth_textures, "weather_map", drawn)
    monkeypatch.setattr(earth_textures, "chart", small_chart)
    edges = ((1550e-9, 1700e-9),)
    for bands, seed in ((DEFAULT, 901), (Bands(names=("s",), edges=edges), 902)):
        textures = earth_textures.EarthTextures(gl)
        textures.of(Earth(bands=bands, maps=maps, clouds=Clouds(seed=seed)))
        textures.release()
    # Of the infrared's land the clouds would be others, and kept for all bands.
    assert seen[0] == seen[1]


def test_light_that_passes_lines_twice_is_the_longer_way_s() -> None:
    bands = Bands(names=("o",), edges=((759e-9, 771e-9),))
    air = air_in_bands(bands)
    pairs = pair_table(air, 6378e3)[..., 0]
    depth = np.concatenate(
        [
            np.add(np.add(one.rayleigh, one.aerosol), one.ozone)
            + np.sum([gas.depth for gas in one.absorbers], axis=0)
            for one in air.parts
        ]
    )
    shares = air.all_shares[0]
    # Straight down and up from the ground: places 31, 31 have the cosine 1.
    once, twice = shares @ np.exp(-depth), shares @ np.exp(-2.0 * depth)
    assert pairs[0, -1, -1] == pytest.approx(twice / once**2, rel=1e-3)
    # A third more than by Beer's law; next to nothing where no line is left above.
    assert pairs[0, -1, -1] > 1.2
    assert np.all(np.diff(pairs[:, -1, -1]) < 0.0)
