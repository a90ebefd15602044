"""Textures whose making fails once: nothing released or half made takes their place."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array32, Image8
from simgl.gpu.fullscreen import Texture
from simgl.gpu.render_targets import GrowingTarget, textures_of
from simgl.passes.background import earth_textures
from simgl.passes.background.earth_textures import SAMPLERS, EarthTextures
from simgl.passes.background.map_levels import MapLevels, map_levels
from simgl.scene.earth import Clouds, Earth
from simgl.scene.noise_projection import LEVELS
from tests.simulator.failing_opengl import counted_calls


def contents(textures: Sequence[Texture]) -> list[bytes]:
    """Some texels of each; released ones cannot be read."""
    flat = [texture for texture in textures if isinstance(texture, moderngl.Texture)]
    return [texture.read()[:64] for texture in flat]


@pytest.mark.parametrize("failing", ["weather_map", "chart", "map_texture", "shores"])
def test_the_textures_of_another_earth_may_fail_and_those_before_come_back(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    def codes(_: object, clouds: Clouds, *__: object) -> MapLevels:
        return map_levels(np.full((8, 16, 4), clouds.seed, dtype=np.uint8))

    def small_ground(*_: object) -> list[MapLevels]:
        return [map_levels(np.full((8, 16, n), n, dtype=np.uint8)) for n in (4, 2, 1, 1)]

    def small_chart(seed: int) -> tuple[list[Image8], Array32]:
        levels = [np.full((8 >> n, 8 >> n, 8), seed, dtype=np.uint8) for n in range(3)]
        return levels, np.zeros((LEVELS, 6), dtype=np.float32)

    monkeypatch.setattr(earth_textures, "ground_levels", small_ground)
    monkeypatch.setattr(earth_textures, "weather_map", codes)
    monkeypatch.setattr(earth_textures, "chart", small_chart)
    earth_textures._weather.clear()
    one, other = (Earth(clouds=Clouds(seed=seed)) for seed in (1, 2))
    textures = EarthTextures(gl)
    try:
        if failing != "shores":
            before = contents(textures.of(one))
        with monkeypatch.context() as once:
            once.setattr(earth_textures, failing, lambda *_: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                textures.of(other)
        if failing != "shores":
            assert contents(textures.of(one)) == before
        assert contents(textures.of(other))[SAMPLERS.index("weather_map")] == bytes([2]) * 64
        assert textures.cells is not None
    finally:
        textures.release()
        earth_textures._weather.clear()


@pytest.mark.parametrize("call", range(1, 6))
def test_a_target_that_cannot_grow_is_made_whole_the_next_time(
    gl: moderngl.Context, call: int
) -> None:
    target = GrowingTarget(gl, [[0], [1, 2]])
    with counted_calls() as calls:
        target.covering((10, 10))
        calls.count, calls.failing = 0, call
        with pytest.raises(moderngl.Error):
            target.covering((300, 300))
    one, two = target.covering((300, 300))
    assert [t.size for t in (*textures_of(one), *textures_of(two))] == [(512, 512)] * 3
    target.release()
