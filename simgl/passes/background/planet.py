"""The Earth: the background of the image, one full-screen draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import moderngl
import numpy as np

from simgl.arrays import Mask
from simgl.gpu.context import is_software
from simgl.gpu.fullscreen import Texture
from simgl.gpu.pipeline_state import SRC1_COLOR, State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.tile_quads import TileQuads
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.background.air import AIR_SAMPLERS, AirBefore, AtmospherePass
from simgl.passes.background.air_march import AIR_VIEW
from simgl.passes.background.air_tables import AIR
from simgl.passes.background.earth_textures import (
    BAND_SAMPLERS,
    CHARTS,
    SAMPLERS,
    EarthTextures,
    Weather,
)
from simgl.passes.background.lit_earth import LitEarth
from simgl.passes.background.planet_blocks import (
    AURORA,
    GROUND_BANDS,
    MAP_TEXEL_M,
    PLANET,
    REGOLITH,
    aurora_values,
    ground_band_values,
    planet_values,
    regolith_values,
)
from simgl.passes.background.planet_variants import (
    PAIRS_UNIT,
    band_samplers,
    knows_ground_bands,
    unread_samplers,
    variant_of,
)
from simgl.passes.background.tile_kinds import (
    DARK,
    DUSK,
    halvings,
    kinds_at_corners,
    lights_and_seasons,
    moonlit_below,
)
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.spectrum import BANDS
from simgl.progress import ProgressCallback
from simgl.scene.earth import Earth
from simgl.scene.noise_projection import LEVELS, TEXEL_KM
from simgl.view.background import Background, PlanetView, SkyView
from simgl.view.background_tiles import (
    MERGED,
    PARTS,
    TILE,
    BackgroundTiles,
    merged,
    split,
    tiles_of,
)
from simgl.view.image_box import Box

# An image whose pixels are shorter than the maps' texels by this factor where it looks straight
# down needs no mipmaps, which cost software renderers more than all the rest.
_MAGNIFIED = 0.5
# Variants that find light and place at the corners of tiles; the others are cheap or rare.
_EVEN = tuple(
    (*bands, "EARTH_MAPS", *far, "AIR") for bands in ((), ("BANDS",)) for far in ((), ("FAR",))
)
# Where a large tile spans less of an angle, it finds glint, 0.2 rad wide, at its corners.
_SPANNED_ANGLE = 0.03


class PlanetPass:
    """Draws the Earth as an exact ellipsoid, alone or before what lies beyond it."""

    state = State()
    before = State(blend=(moderngl.ONE, SRC1_COLOR))
    more = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, air: AtmospherePass) -> None:
        self._ctx, self._air = ctx, air
        # Software renderers pay for what a shader could do: an Earth of one albedo has its own, and
        # so has one without air.
        self._programs: dict[tuple[str, ...], TileQuads] = {}
        self._block, self._moon_block = UniformBuffer(ctx, PLANET), UniformBuffer(ctx, PLANET)
        self._regolith = UniformBuffer(ctx, REGOLITH)
        self._ground_bands = UniformBuffer(ctx, GROUND_BANDS)
        self._aurora = UniformBuffer(ctx, AURORA)
        self._textures = EarthTextures(ctx)
        self._hardware = not is_software(ctx)

    def prepare(self, earth: Earth, progress: ProgressCallback | None = None) -> None:
        """Make what does not depend on a view, unless an earlier run has made it."""
        if earth.albedo is None:
            self._textures.prepare(earth, progress)

    def weather(self, earth: Earth) -> Weather | None:
        """What an Earth's clouds are drawn from; None for an Earth of one albedo."""
        if earth.albedo is not None:
            return None
        weather = self._textures.weather(earth)
        self._textures.read_maps(self._maps_filter(magnified=False))
        return weather

    def draw(
        self, background: Background, target: moderngl.Framebuffer, area: Box, hidden: Mask | None
    ) -> None:
        """Fill a rectangle with the Earth [W m-2 sr-1].

        Where the view has celestial bodies, the target holds them already; they stay as far as
        they are seen past the Earth.

        area : x, y, width, height [pixels]
        hidden : (rows, columns) of its tiles in which nothing of this is seen, if there are any;
            what they hold then is undefined
        """
        if background.planet is not None:
            earth = self._sunlit(background, background.planet, target, area)
            self._draw_earths([earth], hidden)
            return
        state = self._over(background)
        state.apply(self._ctx, target, area, area)
        if background.celestial is None:
            target.clear(0.0, 0.0, 0.0, 0.0, viewport=area)

    def draw_sky(self, sky: SkyView, target: moderngl.Framebuffer) -> None:
        """Fill squares one below another with what the faces of a sky show [W m-2 sr-1].

        A face of fewer texels fills the first rows and columns of its square.
        """
        by_texels: dict[int, list[LitEarth]] = {}
        for row, (face, edge) in enumerate(zip(sky.faces, sky.face_texels, strict=True)):
            area = 0, row * sky.texels, edge, edge
            if face.celestial is not None:
                target.clear(*face.celestial.radiance, viewport=area)
            if face.planet is None:
                self.draw(face, target, area, None)
            else:
                sunlit = self._sunlit(face, face.planet, target, area)
                by_texels.setdefault(edge, []).append(sunlit)
        for earths in by_texels.values():
            self._draw_earths(earths)

    def _over(self, background: Background) -> State:
        return self.state if background.celestial is None else self.before

    def _sunlit(
        self, background: Background, planet: PlanetView, target: moderngl.Framebuffer, area: Box
    ) -> LitEarth:
        return LitEarth(
            planet=planet,
            background=background,
            target=target,
            area=area,
            state=self._over(background),
            block=self._block,
        )

    def _tiles(self, earths: Sequence[LitEarth]) -> list[BackgroundTiles]:
        """Of images of one size from one place in one light."""
        if not earths:
            return []
        one = earths[0]
        if one.mapped:
            self._textures.of(one.planet.earth)
        cells = self._textures.cells if one.mapped else None
        return tiles_of(
            [lit.planet for lit in earths],
            one.background.intrinsics,
            one.area[2:],
            cells,
            noise=not one.far,
        )

    def _draw_earths(self, earths: Sequence[LitEarth], hidden: Mask | None = None) -> None:
        """Images of one size from one place in one light, in sunlight and moonlight.

        hidden : tiles of which nothing is seen in any of them
        """
        tiles = self._tiles(earths)
        if hidden is not None:
            tiles = [seen.within(~hidden) for seen in tiles]
        nights = [
            seen.any & (seen.low < moonlit_below(lit.planet))
            for lit, seen in zip(earths, tiles, strict=True)
        ]
        moonlit = [
            lit.by_moon(lit.planet.moonlight, self.more, self._moon_block)
            if lit.planet.moonlight is not None and night.any()
            else None
            for lit, night in zip(earths, nights, strict=True)
        ]
        by_moon = iter(self._tiles([lit for lit in moonlit if lit is not None]))
        for lit, seen, night, moon in zip(earths, tiles, nights, moonlit, strict=True):
            self._draw_earth(lit, seen, night, None if moon is None else (moon, next(by_moon)))

    def _draw_earth(
        self,
        sunlit: LitEarth,
        tiles: BackgroundTiles,
        night: Mask,
        by_moon: tuple[LitEarth, BackgroundTiles] | None,
    ) -> None:
        """An image in sunlight and, where it is night, moonlight."""
        planet = sunlit.planet
        self._draw_lit(sunlit, tiles)
        if planet.earth.airglow:
            self._draw_glow(tiles.within(tiles.low < DARK), sunlit)
        if planet.earth.aurora_kp is not None and (tiles.any & (tiles.low < DARK)).any():
            self._draw_aurora(tiles, sunlit, planet.earth.aurora_kp)
        if by_moon is not None:
            self._draw_lit(*by_moon, night)
        if planet.earth.clouds is not None and planet.height < planet.earth.clouds.height:
            self._draw_ceiling(tiles, replace(sunlit, state=self.before))
            if by_moon is not None:
                self._draw_ceiling(tiles.within(night), by_moon[0])

    def _draw_lit(self, lit: LitEarth, tiles: BackgroundTiles, night: Mask | None = None) -> None:
        """The Earth in one light.

        tiles : that it covers
        night : those to draw, without the lamps of cities; None for all tiles, with them
        """
        if night is not None:
            tiles = tiles.within(night & (tiles.high > DARK))
            if not tiles.any.any():
                return
        textures: Sequence[Texture] = self._textures.of(lit.planet.earth) if lit.mapped else ()
        air = self._air.before(lit.planet)
        lit.state.apply(self._ctx, lit.target, lit.area, lit.area)
        self._bind(lit, textures, air, lamps=night is None)
        covered = tiles.any if air is not None else tiles.even | tiles.finer | tiles.ground
        if lit.state is self.state and not covered.all():
            lit.target.clear(0.0, 0.0, 0.0, 0.0, viewport=lit.area)
        dark = tiles.low < (DUSK if lit.mapped and night is None else -1.0)
        # On a CPU maps whose texels are larger than pixels, where they are not seen at a slant, are
        # read without mipmaps.
        magnified = lit.mapped and not self._hardware and lit.nadir_pixel < _MAGNIFIED * MAP_TEXEL_M
        narrow = _SPANNED_ANGLE * float(lit.background.intrinsics[0, 0]) > MERGED * TILE
        variant, full_edge = variant_of(lit.planet, air, far=lit.far), max(lit.area[2:])
        self._draw_tiles(
            tiles, dark, variant, textures, full_edge, magnified=magnified, narrow=narrow
        )

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
        values = planet_values(lit.background, lit.planet, lit.area, lamps=lamps)
        lit.block.write(values | self._textures.of_block)
        lit.block.bind()

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

    def _draw_tiles(
        self,
        tiles: BackgroundTiles,
        dark: Mask,
        variant: tuple[str, ...],
        textures: Sequence[Texture],
        full_edge: int,
        *,
        magnified: bool,
        narrow: bool,
    ) -> None:
        """Every tile with the cheapest program that serves it.

        dark : tiles with lamps and the airglow's light
        full_edge : of a square that covers all tiles [pixels]
        magnified : the maps' texels are larger than pixels
        narrow : tiles span small angles
        """
        ground = tiles.ground
        if variant in _EVEN:
            at_corners = ("SEA_AT_CORNERS",) if narrow else ()
            self._draw_even(tiles, dark, (*at_corners, *variant), textures, magnified)
        else:
            ground = ground | tiles.even | tiles.finer
        if "EARTH_MAPS" in variant:
            self._textures.read_maps(self._maps_filter(magnified))
        for kind, mask in lights_and_seasons(ground, dark, tiles.frosted, tiles.glint):
            program = self._program_for("planet/planet", (*kind, *variant))
            # One large face costs less than its parts.
            full = bool(mask.all())
            program.draw(mask[:1, :1] if full else mask, full_edge if full else TILE)
        if "AIR" in variant:
            self._program_for("planet/air", variant).draw(tiles.air, TILE)

    def _draw_glow(self, tiles: BackgroundTiles, lit: LitEarth) -> None:
        """The air's own light, on top of the Earth; reads what that was drawn with."""
        if not tiles.any.any():
            return
        self.more.apply(self._ctx, lit.target, lit.area, lit.area)
        # Maps move the air's tables to other texture units.
        maps = ("EARTH_MAPS",) if lit.mapped else ()
        inside = ("AIR_INSIDE",) if lit.planet.height < AIR_TOP else ()
        self._program_for("planet/glow", maps).draw(tiles.even | tiles.finer, TILE)
        rim = self._program_for("planet/glow", (*maps, "AIR", *inside))
        rim.draw(tiles.ground | tiles.air, TILE)

    def _draw_aurora(self, tiles: BackgroundTiles, lit: LitEarth, kp: float) -> None:
        """The aurora, on top of all else; reads what the Earth was drawn with.

        It stands higher than the air, so tiles beyond the Earth are drawn too.
        """
        self.more.apply(self._ctx, lit.target, lit.area, lit.area)
        self._aurora.write(aurora_values(lit.planet, kp))
        self._aurora.bind()
        maps = ("EARTH_MAPS",) if lit.mapped else ()
        inside = ("AIR_INSIDE",) if lit.planet.height < AIR_TOP else ()
        rim = tiles.ground | tiles.air
        self._program_for("planet/aurora", maps).draw(~rim, TILE)
        self._program_for("planet/aurora", (*maps, "AIR", *inside)).draw(rim, TILE)

    def _draw_ceiling(self, tiles: BackgroundTiles, lit: LitEarth) -> None:
        """The clouds over a camera beneath them, over all else."""
        air = self._air.before(lit.planet)
        lit.state.apply(self._ctx, lit.target, lit.area, lit.area)
        lit.block.bind()
        textures = self._textures.of(lit.planet.earth)
        for unit, texture in enumerate((*textures, *(air.textures if air else ()))):
            texture.use(unit)
        night = ("NIGHT",) if lit.planet.earth.airglow else ()
        variant = (*night, "EARTH_MAPS", *(("AIR", "AIR_INSIDE") if air else ()))
        self._program_for("planet/ceiling", variant).draw(tiles.ground | tiles.air, TILE)

    def _draw_even(
        self,
        tiles: BackgroundTiles,
        dark: Mask,
        variant: tuple[str, ...],
        textures: Sequence[Texture],
        magnified: bool,
    ) -> None:
        """Tiles found at their corners, by the halvings of noise and maps that they show.

        dark : those with lamps and the airglow's light
        """
        seen = tiles.even | tiles.finer
        noise = np.zeros(seen.shape, dtype=np.int64)
        maps = noise
        if "FAR" not in variant:
            noise = halvings(tiles.noise_pixel, 1e3 * TEXEL_KM)
        self._textures.read_maps(self._maps_filter(magnified or not self._hardware))
        if not (magnified or self._hardware):
            maps = halvings(tiles.pixel, MAP_TEXEL_M)
        for step in np.unique((LEVELS * maps + noise)[seen]).tolist():
            of_maps, of_noise = divmod(step, LEVELS)
            if "FAR" not in variant:
                for unit, chart in enumerate(self._textures.charts_with(of_noise)):
                    chart.use(SAMPLERS.index(CHARTS[0]) + unit)
            for unit, halved in enumerate(self._textures.maps_with(of_maps)):
                halved.use(unit)
            at_step = (maps == of_maps) & (noise == of_noise)
            for kind, mask in kinds_at_corners(tiles.within(at_step), dark):
                program = self._program_for("planet/tiles", ("EVEN", *kind, *variant))
                larger, even = merged(mask & tiles.calm), mask & tiles.even
                rows, columns = (MERGED * length for length in larger.shape)
                even[:rows, :columns] &= ~split(larger, MERGED)
                program.draw(larger, MERGED * TILE, slot=step)
                program.draw(even, TILE, slot=step)
                program.draw(split(mask & tiles.finer, PARTS), TILE // PARTS, slot=step)
        for unit, texture in enumerate(textures):
            texture.use(unit)

    def _program_for(self, name: str, variant: tuple[str, ...]) -> TileQuads:
        key = name, *variant
        if key not in self._programs:
            ground = SAMPLERS if "EARTH_MAPS" in variant else []
            air = AIR_SAMPLERS if "AIR" in variant else ()
            samplers = {sampler: unit for unit, sampler in enumerate((*ground, *air))}
            for sampler in unread_samplers(name, variant):
                samplers.pop(sampler, None)
            samplers |= band_samplers(name, variant)
            if name in ("planet/air", "planet/glow", "planet/aurora"):
                read = AIR_SAMPLERS[2:] if "AIR" in variant else ()
                samplers = {sampler: unit for sampler, unit in samplers.items() if sampler in read}
            # Those that each kind of program reads; the others are spare.
            read_by = (
                ("AIR" in variant, (AIR, AIR_VIEW)),
                ("REGOLITH" in variant, (REGOLITH,)),
                (knows_ground_bands(name, variant), (GROUND_BANDS,)),
                (name == "planet/aurora", (AURORA,)),
            )
            shared = [PLANET, *(block for read, some in read_by if read for block in some)]
            spare = tuple(block for read, some in read_by if not read for block in some)
            self._programs[key] = TileQuads(
                self._ctx, name, samplers, variant, shared=shared, spare=spare
            )
        return self._programs[key]

    def _maps_filter(self, magnified: bool) -> int:
        """How to read the maps; software renderers pay twice for what lies between two halvings."""
        smaller = (
            moderngl.LINEAR_MIPMAP_LINEAR if self._hardware else moderngl.LINEAR_MIPMAP_NEAREST
        )
        return moderngl.LINEAR if magnified else smaller

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._block.release()
        self._moon_block.release()
        self._regolith.release()
        self._ground_bands.release()
        self._aurora.release()
        self._textures.release()
