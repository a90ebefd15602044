"""The Earth: the background of the image, one full-screen draw."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import moderngl
import numpy as np

from simgl.arrays import Mask
from simgl.gpu.context import is_software
from simgl.gpu.fullscreen import Texture
from simgl.gpu.pipeline_state import SRC1_COLOR, State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.tile_quads import TileFaces
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.background.air import AirBefore, AtmospherePass
from simgl.passes.background.earth_draws import aurora_draws, earth_draws, glow_draws, sky_draws
from simgl.passes.background.earth_textures import (
    BAND_SAMPLERS,
    CHARTS,
    SAMPLERS,
    EarthTextures,
    Weather,
)
from simgl.passes.background.lit_earth import (
    LitEarth,
    PlannedEarth,
    PlannedImage,
    PlannedLight,
)
from simgl.passes.background.planet_blocks import (
    AURORA,
    GROUND_BANDS,
    MAP_TEXEL_M,
    PLANET,
    REGOLITH,
    aurora_values,
    earth_values,
    ground_band_values,
    image_values,
    planet_values,
    regolith_values,
)
from simgl.passes.background.planet_programs import PlanetPrograms
from simgl.passes.background.planet_variants import PAIRS_UNIT, variant_of
from simgl.passes.background.tile_kinds import (
    DARK,
    DUSK,
    TileDraws,
    moonlit_below,
)
from simgl.physics.spectrum import BANDS
from simgl.progress import ProgressCallback, begin_stage
from simgl.scene.earth import Earth
from simgl.scene.noise_projection import LEVELS
from simgl.view.background import Background, PlanetView, SkyView
from simgl.view.background_tiles import (
    TILE,
    BackgroundTiles,
    GroundTiles,
    ground_tiles,
)
from simgl.view.image_box import Box

# An image whose pixels are shorter than the maps' texels by this factor where it looks straight
# down needs no mipmaps, which cost software renderers more than all the rest.
_MAGNIFIED = 0.5


class PlanetPass:
    """Draws the Earth as an exact ellipsoid, alone or before what lies beyond it."""

    state = State()
    before = State(blend=(moderngl.ONE, SRC1_COLOR))
    more = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, air: AtmospherePass) -> None:
        self._ctx, self._air = ctx, air
        self._faces = TileFaces(ctx)
        self._programs = PlanetPrograms(ctx, self._faces)
        # Of images ahead, what has been drawn with already.
        self._compiled: set[tuple[object, ...]] = set()
        # As many images at the same time as a sky has faces.
        self._block, self._moon_block = (UniformBuffer(ctx, PLANET, slots=6) for _ in range(2))
        self._regolith = UniformBuffer(ctx, REGOLITH)
        self._ground_bands = UniformBuffer(ctx, GROUND_BANDS)
        self._aurora = UniformBuffer(ctx, AURORA)
        self._textures = EarthTextures(ctx)
        self._hardware = not is_software(ctx)

    def prepare(self, earth: Earth, progress: ProgressCallback | None = None) -> None:
        """Make what of the Earth and its air does not depend on a view, unless an earlier run has
        made it."""

        def make_air() -> None:
            begin_stage(progress, "tables of the air")
            self._air.prepare(earth, progress)

        if earth.albedo is None:
            self._textures.prepare(earth, progress, make_air)
        else:
            make_air()

    def weather(self, earth: Earth) -> Weather | None:
        """What an Earth's clouds are drawn from; None for an Earth of one albedo."""
        if earth.albedo is not None:
            return None
        weather = self._textures.weather(earth)
        self._textures.read_maps(self._maps_filter(magnified=False))
        return weather

    def planned(
        self, background: Background, target: moderngl.Framebuffer, area: Box, hidden: Mask | None
    ) -> PlannedImage:
        """What ``draw`` takes, worked out by this thread while something else may be drawn.

        area : x, y, width, height of a rectangle of the target [pixels]
        hidden : (rows, columns) of its tiles in which nothing of this is seen, if there are any;
            what they hold then is undefined
        """
        earth = None
        if background.planet is not None:
            lit = self._sunlit(background, [background.planet], target, [area], of_sky=False)
            earth = self._planned(lit, hidden)
        return PlannedImage(background=background, target=target, area=area, earth=earth)

    def draw(self, planned: PlannedImage) -> None:
        """Fill a rectangle with the Earth [W m-2 sr-1].

        Where the view has celestial bodies, the target holds them already; they stay as far as
        they are seen past the Earth.
        """
        if planned.earth is not None:
            self._draw_earths(planned.earth)
            return
        self._over(planned.background).apply(self._ctx, planned.target, planned.area, planned.area)
        if planned.background.celestial is None:
            planned.target.clear(0.0, 0.0, 0.0, 0.0, viewport=planned.area)

    def draw_sky(
        self,
        sky: SkyView,
        texels: int,
        target: moderngl.Framebuffer,
        *,
        brightest: bool = False,
    ) -> Mask:
        """Fill squares one below another with what the faces of a sky show [W m-2 sr-1].

        texels : along an edge of each
        brightest : only tiles that hold nearly all of its light; the others are undefined

        returns : (6, rows, columns) tiles with anything of the Earth that are drawn
        """
        beyond, everything = sky.faces[0].celestial, (0, 0, *target.size)
        light = (0.0, 0.0, 0.0, 0.0) if beyond is None else beyond.radiance
        target.clear(*light, viewport=everything)
        faces = sky.with_edge(texels)
        drawn = np.zeros((len(faces), *[-(-texels // TILE)] * 2), dtype=bool)
        rows = [row for row, face in enumerate(faces) if face.planet is not None]
        planets = [face.planet for face in faces if face.planet is not None]
        if planets:
            areas = [(0, row * texels, texels, texels) for row in rows]
            lit = self._sunlit(faces[rows[0]], planets, target, areas, of_sky=True)
            planned = self._planned(lit, brightest=brightest)
            self._draw_earths(planned)
            drawn[rows] = planned.sunlit.tiles.any
        return drawn

    def prepare_sky(self, sky: SkyView, texels: int, target: moderngl.Framebuffer) -> None:
        """Compile what draws skies of so many texels anywhere on an orbit, by draws that reach no
        pixel: by the Sun and the Moon, with airglow and aurora."""
        face = next((face for face in sky.with_edge(texels) if face.planet is not None), None)
        if face is None or face.planet is None:
            return
        lit = self._sunlit(face, [face.planet], target, [(0, 0, texels, texels)], of_sky=True)
        planned, any_tile = self._planned(lit).sunlit, np.ones((1, 1, 1), dtype=bool)
        variant = variant_of(lit.planet, self._air.stands_inside(lit.planet), far=lit.far)
        draws = sky_draws(lit, any_tile, any_tile, variant)
        for state in (self.more, lit.state):
            lit = replace(lit, areas=((0, 0, 0, 0),), state=state)
            self._draw_lit(replace(planned, lit=lit, covered=any_tile, draws=draws))
        self._begin(lit, self.more)
        if lit.planet.earth.airglow:
            self._draw_faces(lit, glow_draws(lit, any_tile, any_tile))
        if lit.planet.earth.aurora_kp is not None:
            self._draw_faces(lit, aurora_draws(lit, any_tile, any_tile))

    def prepare_images(self, backgrounds: Iterable[tuple[Background, tuple[int, int]]]) -> None:
        """Compile what draws images, given with their width and height, by draws that reach no
        pixel: kinds of tiles that images to come see, and the next one perhaps not.
        """
        target = ImageTarget(self._ctx, (1, 1), (Format("f4", 4),))
        first = None
        for background, size in backgrounds:
            if background.planet is None:
                continue
            image = background, [background.planet], target.framebuffer, [(0, 0, *size)]
            lit = self._sunlit(*image, of_sky=False)
            planned = self._planned(lit)
            # All by the air before the first: a view's tables take longer than to compile.
            first = first or lit
            for light in (planned.sunlit, self._planned_moonlight(planned)):
                if light is not None:
                    self._compile(light, first)
        release_all(self._ctx, target)

    def _compile(self, light: PlannedLight, bound: LitEarth) -> None:
        """What draws the Earth in a light, unless images ahead had it before; bound : from where
        the air is seen."""
        draws = light.draws.without(self._compiled, (light.lit.state, light.magnified))
        if any(draws):
            nowhere = replace(light.lit, planet=bound.planet, areas=((0, 0, 0, 0),))
            self._draw_lit(replace(light, lit=nowhere, draws=draws, covered=np.ones(1, dtype=bool)))

    def _over(self, background: Background) -> State:
        return self.state if background.celestial is None else self.before

    def _sunlit(
        self,
        background: Background,
        planets: Sequence[PlanetView],
        target: moderngl.Framebuffer,
        areas: Sequence[Box],
        *,
        of_sky: bool,
    ) -> LitEarth:
        return LitEarth(
            planet=planets[0],
            turns=tuple(planet.sphere_from_camera for planet in planets),
            background=background,
            target=target,
            areas=tuple(areas),
            state=self._over(background),
            block=self._block,
            of_sky=of_sky,
        )

    def _ground(self, lit: LitEarth) -> GroundTiles:
        if lit.mapped:
            self._textures.of(lit.planet.earth)
        # One program draws all tiles of a sky, whatever is on them.
        cells = self._textures.cells if lit.mapped and not lit.of_sky else None
        noise = not lit.far and not lit.of_sky
        intrinsics, size = lit.background.intrinsics, lit.areas[0][2:]
        return ground_tiles(lit.planet, lit.turns, intrinsics, size, cells, noise=noise)

    def _planned(
        self, sunlit: LitEarth, hidden: Mask | None = None, *, brightest: bool = False
    ) -> PlannedEarth:
        """What of some images is drawn.

        hidden : tiles of which nothing is seen in any of them
        brightest : only those tiles
        """
        ground = self._ground(sunlit)
        tiles = ground.in_light_of(sunlit.planet.sun_direction_itrf)
        if hidden is not None:
            tiles = tiles.within(~hidden)
        if brightest:
            tiles = tiles.within(tiles.brightest)
        return PlannedEarth(ground=ground, sunlit=self._planned_light(sunlit, tiles, lamps=True))

    def _draw_earths(self, planned: PlannedEarth) -> None:
        """Images in sunlight and, where it is night, moonlight."""
        sunlit, tiles = planned.sunlit.lit, planned.sunlit.tiles
        planet = sunlit.planet
        self._draw_lit(planned.sunlit)
        dark = tiles.any & (tiles.low < DARK)
        if planet.earth.airglow and dark.any():
            self._draw_glow(tiles.within(dark), sunlit)
        if planet.earth.aurora_kp is not None and dark.any():
            self._draw_aurora(tiles, sunlit, planet.earth.aurora_kp)
        moonlit = self._planned_moonlight(planned)
        if moonlit is not None and moonlit.tiles.any.any():
            self._draw_lit(moonlit)
        if planet.earth.clouds is not None and planet.height < planet.earth.clouds.height:
            self._draw_ceiling(tiles, replace(sunlit, state=self.before))
            if moonlit is not None:
                night = tiles.any & (tiles.low < moonlit_below(planet))
                self._draw_ceiling(tiles.within(night), moonlit.lit)

    def _planned_moonlight(self, planned: PlannedEarth) -> PlannedLight | None:
        """On top of sunlight, where it is night; None without."""
        sunlit, tiles = planned.sunlit.lit, planned.sunlit.tiles
        moonlight = sunlit.planet.moonlight
        night = tiles.any & (tiles.low < moonlit_below(sunlit.planet))
        if moonlight is None or not night.any():
            return None
        lit = sunlit.by_moon(moonlight, self.more, self._moon_block)
        tiles = planned.ground.in_light_of(lit.planet.sun_direction_itrf)
        tiles = tiles.within(night & (tiles.high > DARK))
        return self._planned_light(lit, tiles, lamps=False)

    def _planned_light(self, lit: LitEarth, tiles: BackgroundTiles, *, lamps: bool) -> PlannedLight:
        """The Earth in one light.

        tiles : that it covers
        lamps : whether cities shine
        """
        textures: Sequence[Texture] = self._textures.of(lit.planet.earth) if lit.mapped else ()
        inside = self._air.stands_inside(lit.planet)
        dark = tiles.low < (DUSK if lit.mapped and lamps else -1.0)
        # On a CPU maps whose texels are larger than pixels, where they are not seen at a slant, are
        # read without mipmaps.
        magnified = lit.mapped and not self._hardware and lit.nadir_pixel < _MAGNIFIED * MAP_TEXEL_M
        variant = variant_of(lit.planet, inside, far=lit.far)
        return PlannedLight(
            lit=lit,
            tiles=tiles,
            lamps=lamps,
            textures=textures,
            covered=tiles.any if inside is not None else tiles.even | tiles.finer | tiles.ground,
            magnified=magnified,
            draws=earth_draws(
                lit, tiles, dark, variant, magnified=magnified, hardware=self._hardware
            ),
        )

    def _draw_lit(self, planned: PlannedLight) -> None:
        lit, textures = planned.lit, planned.textures
        # Bound again: a sky may have been drawn since.
        air = self._air.before(lit.planet)
        self._begin(lit, lit.state)
        self._bind(lit, textures, air, lamps=planned.lamps)
        if lit.state is self.state and not planned.covered.all():
            for area in lit.areas:
                lit.target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)
        maps_filter = self._maps_filter(planned.magnified or not self._hardware)

        def read_step(step: int | None) -> None:
            """Read this halving of the maps and of noise, or all of them."""
            if step is None:
                self._textures.read_maps(self._maps_filter(planned.magnified))
                for unit, texture in enumerate(textures):
                    texture.use(unit)
                return
            of_maps, of_noise = divmod(step, LEVELS)
            self._textures.read_maps(maps_filter)
            for unit, halved in enumerate(self._textures.maps_with(of_maps)):
                halved.use(unit)
            if not lit.far:
                for unit, chart in enumerate(self._textures.charts_with(of_noise)):
                    chart.use(SAMPLERS.index(CHARTS[0]) + unit)

        self._draw_faces(lit, planned.draws, read_step)

    def _begin(self, lit: LitEarth, state: State) -> None:
        """Tiles of every image lie inside its own area."""
        everything = 0, 0, *lit.target.size
        area = lit.areas[0] if len(lit.areas) == 1 else everything
        state.apply(self._ctx, lit.target, everything, area)

    def _bind(
        self, lit: LitEarth, textures: Sequence[Texture], air: AirBefore | None, *, lamps: bool
    ) -> None:
        """Textures and blocks of the Earth in one light; lamps : whether cities shine."""
        regolith = None if lit.mapped else lit.planet.earth.regolith
        if regolith is not None:
            self._regolith.write(regolith_values(regolith))
            self._regolith.bind()
        for unit, texture in enumerate((*textures, *(air.textures if air else ()))):
            texture.use(unit)
        if lit.planet.earth.bands != BANDS:
            self._bind_bands(lit, air)
        seen = lit.background
        images = image_values(seen.intrinsics, lit.turns, lit.areas, lit.target.size)
        values = planet_values(lit.planet, seen.sun_angular_radius) | self._textures.of_block
        lit.block.write(values, images, earth_values(lit.planet.earth, lamps=lamps))

    def _bind_bands(self, lit: LitEarth, air: AirBefore | None) -> None:
        """What only an Earth in bands of a scenario reads."""
        if lit.mapped:
            self._ground_bands.write(ground_band_values(lit.planet.earth.bands))
            self._ground_bands.bind()
            textures = self._textures.in_bands(lit.planet.earth)
            for unit, texture in zip(BAND_SAMPLERS.values(), textures, strict=True):
                texture.use(unit)
        if air is not None and air.pairs is not None:
            air.pairs.use(PAIRS_UNIT)

    def _draw_faces(
        self,
        lit: LitEarth,
        draws: TileDraws,
        read_step: Callable[[int | None], None] = lambda _: None,
    ) -> None:
        """Some draws; read_step : called before those of each step, and with None at the end."""
        self._faces.write(draws.faces)
        step: int | None = -1
        for draw in draws:
            if draw.step != step:
                step = draw.step
                read_step(step)
            lit.block.bind(draw.image)
            self._programs.of(draw.program, draw.defines).draw(draw.first, draw.count)
        if step is not None:
            read_step(None)

    def _draw_glow(self, tiles: BackgroundTiles, lit: LitEarth) -> None:
        """The air's own light, on top of the Earth; reads what that was drawn with."""
        self._begin(lit, self.more)
        rim = tiles.ground | tiles.air
        self._draw_faces(lit, glow_draws(lit, tiles.even | tiles.finer, rim))

    def _draw_aurora(self, tiles: BackgroundTiles, lit: LitEarth, kp: float) -> None:
        """The aurora, on top of all else; reads what the Earth was drawn with.

        It stands higher than the air, so tiles beyond the Earth are drawn too.
        """
        self._begin(lit, self.more)
        self._aurora.write(aurora_values(lit.planet, kp))
        self._aurora.bind()
        rim = tiles.ground | tiles.air
        self._draw_faces(lit, aurora_draws(lit, ~rim, rim))

    def _draw_ceiling(self, tiles: BackgroundTiles, lit: LitEarth) -> None:
        """The clouds over a camera beneath them, over all else."""
        air = self._air.before(lit.planet)
        self._begin(lit, lit.state)
        textures = self._textures.of(lit.planet.earth)
        for unit, texture in enumerate((*textures, *(air.textures if air else ()))):
            texture.use(unit)
        night = ("NIGHT",) if lit.planet.earth.airglow else ()
        variant = (*night, "EARTH_MAPS", *(("AIR", "AIR_INSIDE") if air else ()))
        draws = TileDraws()
        draws.add("planet/ceiling", tiles.ground | tiles.air, variant)
        self._draw_faces(lit, draws)

    def _maps_filter(self, magnified: bool) -> int:
        """How to read the maps; software renderers pay twice for what lies between two halvings."""
        smaller = (
            moderngl.LINEAR_MIPMAP_LINEAR if self._hardware else moderngl.LINEAR_MIPMAP_NEAREST
        )
        return moderngl.LINEAR if magnified else smaller

    def release(self) -> None:
        """Free everything."""
        self._programs.release()
        self._faces.release()
        self._block.release()
        self._moon_block.release()
        self._regolith.release()
        self._ground_bands.release()
        self._aurora.release()
        self._textures.release()
