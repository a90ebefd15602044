"""Which share of the sunlight reaches the shading points of a spacecraft."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import moderngl
import numpy as np

from simgl.arrays import AnyArray, Array32, IndexArray
from simgl.gpu.compute_screen import ComputeScreen
from simgl.gpu.context import wait_for_draws
from simgl.gpu.fullscreen import screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import Format, GrowingTarget, textures_of
from simgl.gpu.screen_shader import ScreenShader
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.even_squares import (
    PARTLY_LIT,
    EvenSquares,
    with_shares,
    without_penumbras,
)
from simgl.passes.shading_points import (
    COLUMNS,
    ENTRIES,
    OTHERS,
    PAGE_ENTRIES,
    POINT_GROUPS,
    EvenLight,
    PointScreen,
    ShadingPoints,
    at_pages,
    draw_marked,
    gbuffer_units,
    in_list_order,
    in_squares,
    listed_points,
    point_shader,
)
from simgl.passes.shared_blocks import SHADOW, SPACECRAFT, TILE
from simgl.passes.view_blocks import ViewBlocks
from simgl.view.raster_tiles import RasterTile
from simgl.view.spacecraft_view import SpacecraftView

_GBUFFER_UNITS = gbuffer_units("position", "normal_roughness", "face_normal")
# In the order of the shadow pass's textures. Sunlight is drawn before what reads the sky.
_SHADOW_UNITS = {
    "sun_depths": 12,
    "sun_behind": 13,
    "sun_tops": 14,
    "sun_planes": 15,
    "sun_slabs": 10,
    "sun_slopes": 23,
}
_POINTS_UNIT, _FIRST = 22, {"sunlight": 11}


class SunlightPass:
    """Looks up what bounds on the casters tell, and searches through the Sun's disc for the rest.

    The points to search are few, and scattered: they are searched one beside the other, for a
    renderer spends on a point alone what it spends on a whole block. So are those near casters,
    where the texels of the map are so small that few points are. Compute shaders search them where
    they lie: that takes less than to read on the CPU which they are.
    """

    # Keeps the depth buffer as it is.
    colour_only = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, blocks: ViewBlocks) -> None:
        self._ctx, self._blocks = ctx, blocks
        depths, behind, tops, planes, slabs, slopes = (
            {name: unit} for name, unit in _SHADOW_UNITS.items()
        )
        grouped = _GBUFFER_UNITS | POINT_GROUPS
        self._unknown = screen(ctx, ScreenShader("surface/unknown", 0.0, [], _FIRST))
        self._in_place = ("IN_PLACE",) * isinstance(self._unknown, ComputeScreen)
        second = grouped | _FIRST
        if not self._in_place:
            second |= {"searched_points": _POINTS_UNIT}
        searched = second | PAGE_ENTRIES
        of_squares = _GBUFFER_UNITS | tops | {"searched_points": _POINTS_UNIT}
        # By the way in which it is drawn.
        self._samplers = {
            (): grouped | depths | tops,
            ("PLANES",): _GBUFFER_UNITS | tops | planes,
            ("PLANES", "OF_SQUARES"): _GBUFFER_UNITS | tops | planes,
            ("OF_SQUARES",): _GBUFFER_UNITS | tops,
            ("SEARCH",): searched | depths | behind,
            ("SEARCH", "SLABS"): searched | slabs | behind,
            ("SEARCH", "OF_SQUARES"): of_squares | depths | behind,
            ("SEARCH", "SLABS", "OF_SQUARES"): of_squares | slabs | behind,
            ("NEIGHBOURS",): second | depths,
        }
        self._slopes = slopes
        # By that, by how a spacecraft moves, and by whether open sheets shade it.
        self._screens: dict[tuple[str, ...], PointScreen] = {}
        for way in (), ("SEARCH",):
            self._screen_for(way, ())
        self._sunlight = GrowingTarget(ctx, [[0]])
        self._results = GrowingTarget(ctx, [[0]])
        self._masks = GrowingTarget(ctx, [[0]], Format("u1"))
        self._even_squares = GrowingTarget(ctx, [[0]], Format("u1"))
        self._points = GrowingTarget(ctx, [[0]], Format("u4"))
        self._pages = GrowingTarget(ctx, [[0]], Format("u4", 2))

    def _screen_for(self, way: tuple[str, ...], variant: tuple[str, ...]) -> PointScreen:
        if {"SEARCH", "NEIGHBOURS"} & set(way) and "OF_SQUARES" not in way:
            variant = *variant, *self._in_place
        defines = *way, *variant
        if defines not in self._screens:
            blocks = [TILE, SPACECRAFT, SHADOW]
            samplers = self._samplers[way]
            if "SHEETS" in variant and ("SEARCH" in way or not {"PLANES", "OF_SQUARES"} & set(way)):
                samplers = samplers | self._slopes
            self._screens[defines] = point_shader(
                self._ctx,
                "surface/sunlight",
                OTHERS,
                blocks,
                samplers,
                dict.fromkeys(defines, 1),
            )
        return self._screens[defines]

    def even_light(
        self, tile: RasterTile, spacecraft: Sequence[DrawnSpacecraft]
    ) -> EvenLight | None:
        """Tells where light is smooth on the only spacecraft of a tile that no lamp lights: where
        all sunlight arrives, or none, or in a wide penumbra. None for several, without sunlight,
        and for one that has images, moves, or is lit by rays.
        """
        drawn, view = spacecraft[0], spacecraft[0].view
        by_rays = drawn.lit_bodies or drawn.mirrored
        uneven = "DETAILED" in view.model.variant or view.lit_variant or by_rays
        if len(spacecraft) > 1 or uneven or not view.sun_irradiance.any():
            return None
        return partial(self._even, tile, drawn)

    def _even(
        self,
        tile: RasterTile,
        drawn: DrawnSpacecraft,
        squares: Sequence[moderngl.Texture],
        size: tuple[int, int],
    ) -> EvenSquares:
        (target,) = self._even_squares.covering(size)
        self._bind(tile, squares, drawn)
        variant = _variant(drawn.view)
        close = drawn.view.shadow.close is not None
        first = (*("PLANES",) * close, "OF_SQUARES")
        self._screen_for(first, variant).draw(self.colour_only, target, (0, 0, *size))
        kinds = self._bytes(target, (0, 0, *size))
        row, column = np.nonzero(kinds == PARTLY_LIT)
        if not len(row):
            return without_penumbras(kinds)
        search = ("SEARCH", *("SLABS",) * close, "OF_SQUARES")
        return with_shares(kinds, self._at_points(row, column, self._screen_for(search, variant)))

    def _at_points(self, row: IndexArray, column: IndexArray, search: PointScreen) -> Array32:
        """(n, 4, 4) shares of the sunlight per band at the four points of squares, row by row;
        negative where they are not linear between these."""
        points = (row << 16 | column << 2)[:, None] + np.arange(4)
        listed = in_squares(points.ravel())
        self._points.written(listed).use(_POINTS_UNIT)
        area = (0, 0, COLUMNS, len(listed))
        (results,) = self._results.covering(area[2:])
        search.draw(self.colour_only, results, area)
        wait_for_draws(self._ctx)
        data = results.read(viewport=area, components=4, dtype="f4")
        values = np.frombuffer(data, dtype=np.float32).reshape(-1, COLUMNS, 4)
        return in_list_order(values)[: points.size].reshape(-1, 4, 4)

    def draw(
        self, tile: RasterTile, points: ShadingPoints, drawn: DrawnSpacecraft
    ) -> tuple[moderngl.Texture, ...]:
        """Shares of the sunlight per band, valid until the next draw.

        points : those of this spacecraft have been looked up last
        returns : of every point, negative where it was looked for afterwards and apart; of those
            where it was, and where they are (``listed_points``)
        """
        area = (0, 0, *points.size)
        (sunlight,) = self._sunlight.covering(points.size, points.depth)
        (shares,) = textures_of(sunlight)
        self.colour_only.apply(self._ctx, sunlight, area, area)
        sunlight.clear(viewport=area)
        lit, known = 4 * points.wide_rows[0], 4 * points.known_rows
        if lit:
            sunlight.clear(1.0, 1.0, 1.0, 1.0, viewport=(0, 0, COLUMNS, lit))
        if drawn.view.sun_irradiance.any():
            self._bind(tile, points.textures, drawn)
            points.bind()
            variant = _variant(drawn.view)
            # In a close map texels are small against what stands on a spacecraft: most points are
            # free, but many of those that are not are to be searched.
            close = drawn.view.shadow.close is not None
            first = ("PLANES",) if close else ()
            search = ("SEARCH", "SLABS") if close else ("SEARCH",)
            draw_marked(sunlight, points, self._screen_for(first, variant), known)
            shares.use(_FIRST["sunlight"])
            self._look_for_the_rest(points, search, variant)
        (results,), (pages,) = self._results.covering((1, 1)), self._pages.covering((1, 1))
        return shares, *textures_of(results), *textures_of(pages)

    def _bind(
        self, tile: RasterTile, gbuffer: Sequence[moderngl.Texture], drawn: DrawnSpacecraft
    ) -> None:
        self._blocks.bind_tile(tile)
        self._blocks.bind_spacecraft(drawn)
        self._blocks.bind_shadow(drawn.view, tile.sample_grid)
        for unit, texture in zip(_GBUFFER_UNITS.values(), gbuffer, strict=False):
            texture.use(unit)
        for unit, texture in zip(_SHADOW_UNITS.values(), drawn.shadow_maps, strict=True):
            texture.use(unit)

    def _look_for_the_rest(
        self, points: ShadingPoints, search: tuple[str, ...], variant: tuple[str, ...]
    ) -> None:
        """Draw the points that are still unknown."""
        if not self._in_place:
            self._draw_listed(points, search, variant)
            return
        self._lay_partly_lit(points)
        (sunlight,) = self._sunlight.covering(points.size, points.depth)
        for way in search, ("NEIGHBOURS",):
            draw_marked(sunlight, points, self._screen_for(way, variant), 4 * points.known_rows)

    def _lay_partly_lit(self, points: ShadingPoints) -> None:
        """What is known of partly lit squares."""
        lit, dark, partly = points.wide_rows
        if partly:
            (sunlight,) = self._sunlight.covering(points.size, points.depth)
            area = (0, 4 * (lit + dark), COLUMNS, 4 * partly)
            textures_of(sunlight)[0].write(at_pages(points.partly_lit).data, viewport=area)

    def _draw_listed(
        self, points: ShadingPoints, search: tuple[str, ...], variant: tuple[str, ...]
    ) -> None:
        """Draw one beside the other those to search, and below them those near casters."""
        masks = self._unknown_points(points)
        # No draw is left that it would wait for.
        self._lay_partly_lit(points)
        if not masks.any():
            return
        pages = np.zeros((*masks.shape, 2), dtype=np.uint32)
        searched = listed_points(masks & 15, pages[..., 0])
        near = listed_points(masks >> 4, pages[..., 1], searched.size)
        rows = len(searched), len(near)
        self._points.written(np.concatenate([searched, near])).use(_POINTS_UNIT)
        (results,) = self._results.covering((COLUMNS, sum(rows)))
        ways = search, ("NEIGHBOURS",)
        for way, first, count in zip(ways, (0, rows[0]), rows, strict=True):
            if count:
                area = (0, first, COLUMNS, count)
                self._screen_for(way, variant).draw(self.colour_only, results, area)
        self._pages.written(pages)

    def _unknown_points(self, points: ShadingPoints) -> AnyArray:
        """(rows of squares, ENTRIES) uint8: of each page the points to search, and from bit 4 on
        those near casters, as ``listed_points`` takes them."""
        known, rows = points.known_rows, points.rows
        masks = np.zeros((rows, ENTRIES), dtype=np.uint8)
        (target,) = self._masks.covering((ENTRIES, rows))
        area = (0, known, ENTRIES, rows - known)
        self._unknown.draw(self.colour_only, target, area)
        masks[known:] = self._bytes(target, area)
        return masks

    def _bytes(self, target: moderngl.Framebuffer, area: tuple[int, int, int, int]) -> AnyArray:
        wait_for_draws(self._ctx)
        data = target.read(viewport=area, components=1, alignment=1, dtype="u1")
        return np.frombuffer(data, dtype=np.uint8).reshape(area[:1:-1])

    def release(self) -> None:
        """Free everything."""
        targets = self._sunlight, self._results, self._masks, self._points, self._pages
        for target in (*targets, self._even_squares):
            target.release()
        for drawn in (self._unknown, *self._screens.values()):
            drawn.release()


def _variant(view: SpacecraftView) -> tuple[str, ...]:
    casters = view.shadow.maps[0].casters
    sheets = any(c.model.open_sheets for c in casters)
    return (*view.lit_variant, "SHEETS") if sheets else view.lit_variant
