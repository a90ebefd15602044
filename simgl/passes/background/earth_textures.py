"""The textures that the planet is drawn with, made when an Earth first needs them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl import assets
from simgl.arrays import Array, Image8, IndexArray
from simgl.gpu.fullscreen import Texture
from simgl.gpu.texture_levels import texture_with_levels
from simgl.lru_cache import MANY, LruCache
from simgl.passes.background.cloud_map import has_weather, weather_map
from simgl.passes.background.earth_maps import (
    HEIGHT,
    cell_sums,
    ground_levels,
    ground_makers,
    ground_textures,
    kind_map,
    over_cells,
    shores,
)
from simgl.passes.background.map_levels import (
    MapLevels,
    level_texture,
    map_levels,
    map_texture,
    size_of,
)
from simgl.physics.earth_spectra import cloud_table
from simgl.physics.spectrum import BANDS, Bands
from simgl.progress import ProgressCallback, begin_stage
from simgl.scene.earth import Clouds, Earth, EarthMaps
from simgl.scene.frost import frost_edges
from simgl.scene.noise_projection import LEVELS, chart, has_chart
from simgl.scene.noise_volume import noise_volume
from simgl.view.map_cells import MapCells

# In the order of ``EarthTextures.of``.
MAPS = ["land_map", "form_map", "shore_map", "lamp_map", "weather_map"]
CHARTS = ["chart", "cloud_chart"]
SAMPLERS = [*MAPS, "frost_edges", "cloud_reflection", *CHARTS]
# Of ``EarthTextures.in_bands``, with their units.
BAND_SAMPLERS = {"land_kind": 13, "cloud_bands": 14}
# Of these what clouds and their ground in the thermal infrared take.
WEATHER = ["shore_map", "weather_map", "cloud_chart"]

# The last weathers of the process, which take seconds on software renderers: two of the usual size.
_weather = LruCache[tuple[Clouds, EarthMaps], MapLevels](MANY, max_bytes=86 << 20)


@dataclass(frozen=True, kw_only=True, eq=False)
class Weather:
    """Clouds of an Earth.

    textures : in the order of ``WEATHER``
    of_block : what the block of the planet holds of them
    """

    textures: tuple[Texture, ...]
    of_block: Mapping[str, object]


class EarthTextures:
    """Keeps those of the last Earth that had maps.

    chart_variance : (LEVELS, 4) variance of the noise of hills and of ice fibres by halvings
    cloud_variance : (LEVELS, 4) of the kinds of cloud
    cells : what the cells of the maps hold
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._maps: tuple[EarthMaps, Bands] | None = None
        self._ground: list[moderngl.Texture] = []
        self._ground_levels: list[MapLevels] = []
        self._clouds: Clouds | None = None
        self._weather: list[moderngl.Texture] = []
        self._weather_levels: MapLevels = ()
        self._halved: dict[int, list[moderngl.Texture]] = {}
        # How all of these are read.
        self._smaller: int | None = None
        self._tables: list[moderngl.Texture | moderngl.Texture3D] = []
        self._bands: list[moderngl.Texture | moderngl.Texture3D] = []
        self._chart_seed: int | None = None
        self._chart: list[list[moderngl.Texture]] = []
        self.chart_variance = np.zeros((LEVELS, 4), dtype=np.float32)
        self.cloud_variance = np.zeros((LEVELS, 4), dtype=np.float32)
        self.cells: MapCells | None = None
        self._shores: tuple[IndexArray, IndexArray]

    def of(self, earth: Earth) -> list[Texture]:
        """In the order of ``SAMPLERS``.

        May draw, so it comes before a pass sets its state.
        """
        self._make_maps(earth)
        seed = earth.clouds.seed if earth.clouds else 0
        if not self._chart or seed != self._chart_seed:
            self._forget_chart()
            self._chart = self._charts_of(seed)
            self._chart_seed = seed
        return [*self._ground, *self._weather, *self._tables, *self._chart[0]]

    def _make_maps(self, earth: Earth) -> None:
        """All but the charts."""
        if not self._ground or (earth.maps, earth.bands) != self._maps:
            self.release()
            self._shores = shores(earth.maps)
            self._ground_levels = ground_levels(earth.maps, earth.bands)
            self._ground = [map_texture(self._ctx, levels) for levels in self._ground_levels]
            self._maps = earth.maps, earth.bands
        if not self._weather or earth.clouds != self._clouds:
            self._forget_weather()
            self._weather_levels = self._weather_of(earth)
            self._weather = [map_texture(self._ctx, self._weather_levels)]
            self._smaller = None
            share, high = (
                over_cells(np.maximum, self._weather_levels[0][..., channel]) > 0
                for channel in (0, 2)
            )
            self.cells = MapCells(
                shores=np.stack(self._shores),
                clouds=np.stack([cell_sums(high), cell_sums(share | high)]),
            )
            self._clouds = earth.clouds
        if not self._tables:
            self._tables = [_frost_texture(self._ctx), _cloud_reflection(self._ctx)]

    def in_bands(self, earth: Earth) -> list[Texture]:
        """What tells land and clouds in bands of a scenario, in the order of ``BAND_SAMPLERS``."""
        if not self._bands:
            kinds = map_texture(self._ctx, map_levels(kind_map(earth.maps.land)))
            kinds.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)
            self._bands = [kinds, _table_texture(self._ctx, cloud_table(earth.bands))]
        return list(self._bands)

    @property
    def _coarser(self) -> list[float]:
        """Halvings by which the maps are coarser than the shipped one of form, as in ``MAPS``."""
        return [float(np.log2(HEIGHT / one.height)) for one in (*self._ground, *self._weather)]

    @property
    def of_block(self) -> dict[str, object]:
        """What the block of the planet holds of them; zeros before an Earth had maps."""
        coarser = self._coarser or [0.0] * len(MAPS)
        return {
            "chart_variance": self.chart_variance,
            "cloud_variance": self.cloud_variance,
            "map_halvings": coarser[:4],
            "weather_halvings": coarser[4],
        }

    def weather(self, earth: Earth) -> Weather:
        """Its clouds; valid as long as ``of``."""
        textures = self.of(earth)
        chosen = tuple(textures[SAMPLERS.index(name)] for name in WEATHER)
        return Weather(textures=chosen, of_block=self.of_block)

    def prepare(
        self,
        earth: Earth,
        progress: ProgressCallback | None = None,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> None:
        """Make what no earlier run has made, so that no frame waits for it.

        All else waits for a frame that shows it.

        meanwhile : work of this thread that needs none of it
        """
        seed = earth.clouds.seed if earth.clouds else 0
        drawn = earth.clouds is None or has_weather(self._ctx, earth.clouds, earth.maps)
        if drawn and has_chart(seed):
            meanwhile()
            return
        with ThreadPoolExecutor(thread_name_prefix="simgl-map") as threads:
            # What takes longest begins first; all of it is work of the CPU.
            charts = threads.submit(chart, seed)
            makers = ground_makers(earth.maps, earth.bands)
            if not drawn:
                makers.append(lambda: (noise_volume(seed),))
            needed = [threads.submit(maker) for maker in makers]
            meanwhile()
            begin_stage(progress, "maps of the Earth")
            for one in needed:
                one.result()
            self._make_maps(earth)
            charts.result()
        self.of(earth)

    def charts_with(self, level: int) -> list[moderngl.Texture]:
        """The charts at a halving alone, for ``CHARTS`` in place of all of them."""
        return self._chart[1 + level]

    def read_maps(self, smaller: int) -> None:
        """How to read the maps of ``of`` where pixels are larger than texels: an OpenGL filter."""
        if smaller != self._smaller:
            for texture in (*self._ground, *self._weather):
                texture.filter = (smaller, moderngl.LINEAR)
            self._smaller = smaller

    def maps_with(self, level: int) -> list[moderngl.Texture]:
        """The maps at a halving alone, in the order of ``MAPS``; those of ``of`` for none."""
        if not level:
            return [*self._ground, *self._weather]
        if level not in self._halved:
            maps = [*self._ground_levels, self._weather_levels]
            self._halved[level] = [
                level_texture(self._ctx, levels, max(level - round(coarser), 0))
                for levels, coarser in zip(maps, self._coarser, strict=True)
            ]
        return self._halved[level]

    def _weather_of(self, earth: Earth) -> MapLevels:
        if earth.clouds is None:
            return (np.zeros((1, 1, 4), dtype=np.uint8),)
        clouds, maps = earth.clouds, earth.maps

        def made() -> MapLevels:
            if earth.bands == BANDS:
                return weather_map(self._ctx, clouds, maps, self._ground)
            # Clouds are where the land is green or bare: by R, G, B and N, whatever is drawn.
            ground = ground_textures(self._ctx, maps)
            try:
                return weather_map(self._ctx, clouds, maps, ground)
            finally:
                _release(ground)

        return _weather.get((clouds, maps), made, size_of)

    def _charts_of(self, seed: int) -> list[list[moderngl.Texture]]:
        """The noise of ground and clouds with its halvings as mipmaps, and each halving alone.

        Software renderers read mipmaps at several times the cost of a texture that has none.
        """
        levels, variance = chart(seed)
        self.chart_variance[:, :2], self.cloud_variance[:] = variance[:, :2], variance[:, 2:]
        each = [(codes[..., :4].copy(), codes[..., 4:].copy()) for codes in levels]
        complete = [
            texture_with_levels(self._ctx, halvings) for halvings in zip(*each, strict=True)
        ]
        for texture in complete:
            texture.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)
        return [complete, *([_chart_texture(self._ctx, codes) for codes in two] for two in each)]

    # What is released is forgotten with it: the next of a kind may fail to be made.

    def _forget_weather(self) -> None:
        _release(self._weather)
        self._weather = []
        for maps in self._halved.values():
            _release(maps)
        self._halved.clear()

    def _forget_chart(self) -> None:
        for charts in self._chart:
            _release(charts)
        self._chart = []

    def release(self) -> None:
        """Free everything."""
        self._forget_weather()
        self._forget_chart()
        _release(self._tables)
        self._tables = []
        _release(self._bands)
        self._bands = []
        _release(self._ground)
        self._ground = []


def _chart_texture(ctx: moderngl.Context, codes: Image8) -> moderngl.Texture:
    texture = ctx.texture(codes.shape[1::-1], 4, codes.tobytes(), alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    return texture


def _release(textures: Iterable[moderngl.Texture | moderngl.Texture3D]) -> None:
    for texture in textures:
        texture.release()


def _frost_texture(ctx: moderngl.Context) -> moderngl.Texture:
    """``simgl.scene.frost.frost_edges`` by longitude and month, both of which go round."""
    edges = frost_edges().astype(np.float32)
    texture = ctx.texture(edges.shape[1::-1], 3, edges.tobytes(), dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    return texture


def _cloud_reflection(ctx: moderngl.Context) -> moderngl.Texture3D:
    """The table of ``tools/cloud_reflection.py``."""
    return _table_texture(ctx, np.load(assets.data() / "earth" / "cloud_reflection.npy"))


def _table_texture(ctx: moderngl.Context, table: Array) -> moderngl.Texture3D:
    """(depth, height, width, 4) numbers, held beyond their ends."""
    depth, height, width, count = table.shape
    data = table.astype(np.float32).tobytes()
    texture = ctx.texture3d((width, height, depth), count, data, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    return texture
