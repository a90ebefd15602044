"""The textures that the planet is drawn with, made when an Earth first needs them."""

from __future__ import annotations

from collections.abc import Iterable

import moderngl

from simgl.gpu.fullscreen import Texture
from simgl.passes.earth_maps import Bytes, ground_textures, map_texture
from simgl.passes.weather import noise_texture, weather_codes
from simgl.scene.earth import Clouds, Earth, EarthMaps

# In the order of ``EarthTextures.of``.
SAMPLERS = ["land_map", "form_map", "weather_map", "noise_volume"]

# The last two weathers of the process, which take seconds on software renderers.
_weather: dict[tuple[Clouds, EarthMaps | None], Bytes] = {}


class EarthTextures:
    """Keeps those of the last Earth that had maps."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._maps: EarthMaps | None = None
        self._ground: list[moderngl.Texture] = []
        self._clouds: Clouds | None = None
        self._weather: list[Texture] = []

    def of(self, earth: Earth, *, mipmaps: bool) -> list[Texture]:
        """Land, form, weather and noise; may draw, so it comes before a pass sets its state.

        mipmaps : whether the maps are read smaller than they are
        """
        if earth.maps != self._maps:
            self.release()
            self._ground, self._maps = ground_textures(self._ctx, earth.maps), earth.maps
        if not self._weather or earth.clouds != self._clouds:
            _release(self._weather)
            self._weather, self._clouds = self._weather_of(earth.clouds), earth.clouds
        smaller = moderngl.LINEAR_MIPMAP_LINEAR if mipmaps else moderngl.LINEAR
        for texture in (*self._ground, self._weather[0]):
            texture.filter = (smaller, moderngl.LINEAR)
        return [*self._ground, *self._weather]

    def _weather_of(self, clouds: Clouds | None) -> list[Texture]:
        noise = noise_texture(self._ctx, clouds.seed if clouds else 0)
        if clouds is None:
            return [self._ctx.texture((1, 1), 4, bytes(4), alignment=1), noise]
        return [map_texture(self._ctx, self._codes(clouds, noise)), noise]

    def _codes(self, clouds: Clouds, noise: moderngl.Texture3D) -> Bytes:
        key = clouds, self._maps
        if key not in _weather:
            while len(_weather) > 1:
                _weather.pop(next(iter(_weather)))
            _weather[key] = weather_codes(self._ctx, clouds, noise, self._ground)
        return _weather[key]

    def release(self) -> None:
        """Free everything."""
        _release(self._ground)
        _release(self._weather)
        self._ground, self._weather, self._maps = [], [], None


def _release(textures: Iterable[Texture]) -> None:
    for texture in textures:
        texture.release()
