"""The textures that the planet is drawn with, made when an Earth first needs them."""

from __future__ import annotations

from collections.abc import Iterable

import moderngl
import numpy as np

from simgl.arrays import Image8, IndexArray
from simgl.gpu.fullscreen import Texture
from simgl.passes.background.cloud_map import noise_texture, weather_codes
from simgl.passes.background.earth_maps import ground_textures, map_texture, shores
from simgl.scene.earth import Clouds, Earth, EarthMaps
from simgl.scene.noise_projection import LEVELS, chart

# In the order of ``EarthTextures.of``.
MAPS = ["land_map", "form_map", "weather_map"]
SAMPLERS = [*MAPS, "chart"]

# The last two weathers of the process, which take seconds on software renderers.
_weather: dict[tuple[Clouds, EarthMaps | None], Image8] = {}


class EarthTextures:
    """Keeps those of the last Earth that had maps.

    chart_variance : (LEVELS, 4) variance of the noise of clouds and hills by halvings
    shores : how many cells of the map are not far from any, as ``earth_maps.shores`` counts
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._maps: EarthMaps | None = None
        self._ground: list[moderngl.Texture] = []
        self._clouds: Clouds | None = None
        self._weather: list[moderngl.Texture] = []
        self._halved: dict[int, list[moderngl.Texture]] = {}
        self._chart_seed: int | None = None
        self._chart: list[moderngl.Texture] = []
        self.chart_variance = np.zeros((LEVELS, 4), dtype=np.float32)
        self.shores: IndexArray | None = None

    def of(self, earth: Earth) -> list[Texture]:
        """Land, form, weather and the noise's chart.

        May draw, so it comes before a pass sets its state.
        """
        if earth.maps != self._maps:
            self.release()
            self._ground, self._maps = ground_textures(self._ctx, earth.maps), earth.maps
            self.shores = shores(earth.maps)
        if not self._weather or earth.clouds != self._clouds:
            _release(self._weather)
            self._forget_halved()
            self._weather, self._clouds = self._weather_of(earth.clouds), earth.clouds
        seed = earth.clouds.seed if earth.clouds else 0
        if seed != self._chart_seed:
            _release(self._chart)
            self._chart, self._chart_seed = self._charts_of(seed), seed
        return [*self._ground, *self._weather, self._chart[0]]

    def chart_with(self, level: int) -> moderngl.Texture:
        """The chart at a halving alone, for the last sampler in place of all of them."""
        return self._chart[1 + level]

    def read_maps(self, smaller: int) -> None:
        """How to read the maps of ``of`` where pixels are larger than texels: an OpenGL filter."""
        for texture in (*self._ground, *self._weather):
            texture.filter = (smaller, moderngl.LINEAR)

    def maps_with(self, level: int) -> list[moderngl.Texture]:
        """The maps at a halving alone, in the order of ``MAPS``; those of ``of`` for none."""
        maps = [*self._ground, *self._weather]
        if level and level not in self._halved:
            self._halved[level] = [_level_copy(self._ctx, complete, level) for complete in maps]
        return self._halved[level] if level else maps

    def _weather_of(self, clouds: Clouds | None) -> list[moderngl.Texture]:
        if clouds is None:
            return [self._ctx.texture((1, 1), 4, bytes(4), alignment=1)]
        return [map_texture(self._ctx, self._codes(clouds))]

    def _codes(self, clouds: Clouds) -> Image8:
        key = clouds, self._maps
        if key not in _weather:
            while len(_weather) > 1:
                _weather.pop(next(iter(_weather)))
            noise = noise_texture(self._ctx, clouds.seed)
            _weather[key] = weather_codes(self._ctx, clouds, noise, self._ground)
            noise.release()
        return _weather[key]

    def _charts_of(self, seed: int) -> list[moderngl.Texture]:
        """The noise with its halvings as mipmaps, and each halving alone.

        Software renderers read mipmaps at several times the cost of a texture that has none.
        """
        levels, self.chart_variance[:, :2] = chart(seed)
        complete = _chart_texture(self._ctx, levels[0])
        complete.build_mipmaps(max_level=len(levels) - 1)
        for level, codes in enumerate(levels):
            complete.write(codes.tobytes(), level=level, alignment=1)
        complete.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)
        return [complete, *(_chart_texture(self._ctx, codes) for codes in levels)]

    def _forget_halved(self) -> None:
        for maps in self._halved.values():
            _release(maps)
        self._halved.clear()

    def release(self) -> None:
        """Free everything."""
        self._forget_halved()
        _release(self._ground)
        _release(self._weather)
        _release(self._chart)
        self._ground, self._weather, self._chart = [], [], []
        self._maps = self._chart_seed = None


def _chart_texture(ctx: moderngl.Context, codes: Image8) -> moderngl.Texture:
    texture = ctx.texture(codes.shape[1::-1], 4, codes.tobytes(), alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    return texture


def _level_copy(ctx: moderngl.Context, complete: moderngl.Texture, level: int) -> moderngl.Texture:
    """A halving of a map, or its smallest."""
    level = min(level, max(complete.size).bit_length() - 1)
    size = max(complete.width >> level, 1), max(complete.height >> level, 1)
    texture = ctx.texture(size, 4, complete.read(level=level, alignment=1), alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x, texture.repeat_y = complete.repeat_x, complete.repeat_y
    return texture


def _release(textures: Iterable[Texture]) -> None:
    for texture in textures:
        texture.release()
