"""The shading points of a tile: what the samples of each cell see of each smooth surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np

from simgl.arrays import AnyArray, Mask
from simgl.gpu.compute_screen import Depths
from simgl.gpu.context import prefers_compute, wait_for_draws
from simgl.gpu.fullscreen import Screen, screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import Format, GrowingTarget, textures_of
from simgl.gpu.screen_shader import ScreenShader
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.even_squares import EvenSquares, with_larger, without_penumbras
from simgl.passes.mesh_store import MeshStore
from simgl.passes.page_numbers import PageNumbers
from simgl.passes.shading_points import (
    CELL_GROUPS,
    COLUMNS,
    MARKED,
    OTHERS,
    PAGE_ENTRIES,
    POINT_GROUPS,
    SEEN,
    EvenLight,
    PointScreen,
    ShadingPoints,
    blocks_of,
    blocks_of_squares,
    draw_marked,
    page_table,
    point_shader,
)
from simgl.passes.shared_blocks import (
    JOINT_RATES,
    JOINTS,
    MATERIALS,
    SPACECRAFT,
    TILE,
)
from simgl.passes.texture_store import IMAGE_UNITS
from simgl.passes.view_blocks import ViewBlocks
from simgl.sample_grid import ANGLE
from simgl.view.raster_tiles import RasterTile

# Of the byte of a block, the bits that hold its pages, and those that tell whether each of its
# cells shows one smooth surface, and whether one of them is bare (shaders/gbuffer/cells.glsl).
_COUNT, _ONE_SURFACE, BARE = 31, 32, 128
# Of the squares of a tile, the least part that shows one surface for which it is worth asking
# whether light is smooth over them.
_WORTH_ASKING = 0.02
# Texels of four groups each that hold those of a cell: of a narrow one, whose square never holds
# 3 x 3 samples, and of any. These need a square of 2 (cos a + sin a) along its edge, turned by a;
# half of that square's extent along an axis is half as wide, times (cos a + sin a) again.
_FOURS = 2, len(CELL_GROUPS)
_REACH_OF_FEW = (np.cos(ANGLE) + np.sin(ANGLE)) ** 2
# A point that is not there.
EMPTY = -1.0
# The targets of shaders/gbuffer/gbuffer.frag; those with images and vertex colours have more.
_PLAIN, _DETAILED = 4, 7
# Of a variant, what tells where its triangles are.
_OF_PLACES = ("DETAILED", "JOINTED", "MOVING", "JOINTS_MOVE")

_CORNERS_UNIT, _VERTICES_UNIT, _LIGHT_UNIT = range(1, 4)
_GRIDS = {"light_grids": 4, "grid_light": 5, "grid_rows": 6}
# Besides the groups of points, which have the unit of the cells' in other passes.
_CELLS_UNIT = 17
# Of the bytes of blocks, for squares, which have no points.
_BLOCKS_UNIT = 16
_OF_POINTS = POINT_GROUPS | PAGE_ENTRIES
_TRIANGLES, _SURFACES = ({name: unit} for name, unit in SEEN.items())


_NONE_EVEN = without_penumbras(np.zeros((0, 0), dtype=np.uint8))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pages:
    """Pages of a tile, as ``ShadingPoints`` has them.

    entries, first : R32UI, of each page, and the first page of each block
    """

    rows: int
    entries: moderngl.Texture
    first: moderngl.Texture
    read_entries: Callable[[], AnyArray]
    bare: Mask | None = None
    wide_pages: bool = False
    wide_rows: tuple[int, int, int] = (0, 0, 0)
    squares: EvenSquares = _NONE_EVEN


class GBufferPass:
    """Groups the samples of each cell, and looks up what the groups see of a spacecraft.

    The depth buffer then says which points are that spacecraft's, and which of its materials are
    layered, so that even a renderer without real branches spends on a point only what it needs.
    Points of several spacecraft are marked before they are looked up; where there is one, nearly
    all of them are its own, and they are marked as they are looked up.
    """

    marking = State(depth=True, depth_func="1", write_color=False)
    looking_up = State(depth=True, depth_func="1")
    colour_only = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore, blocks: ViewBlocks) -> None:
        self._ctx, self._meshes, self._blocks = ctx, meshes, blocks
        self._grouping: dict[tuple[int, int], PointScreen] = {}
        first = {"cell_groups": CELL_GROUPS["cell_groups"]}
        # Of a GPU; None where the CPU numbers the pages.
        self._numbers = PageNumbers(ctx) if prefers_compute(ctx) else None
        self._counting = screen(ctx, ScreenShader("gbuffer/pages", 0.0, [TILE], first))
        paged = CELL_GROUPS | PAGE_ENTRIES
        self._paging = screen(ctx, ScreenShader("gbuffer/point_groups", 0.0, [TILE], paged))
        self._unmarked = screen(ctx, ScreenShader("gbuffer/unmarked", OTHERS, [], {}))
        self._marks: dict[tuple[str, ...], PointScreen] = {}
        self._lookups: dict[tuple[str, ...], PointScreen] = {}
        self._groups = GrowingTarget(ctx, [range(n) for n in _FOURS], Format("u4", 4))
        self._counts = GrowingTarget(ctx, [[0]], Format("u1"))
        self._point_groups = GrowingTarget(ctx, [[0]], Format("u4"))
        self._page_entries = GrowingTarget(ctx, [[0]], Format("u4"))
        self._block_pages = GrowingTarget(ctx, [[0]], Format("u4"))
        self._depths = GrowingTarget(ctx, [[0]], Format("f4"))
        self._targets = {n: GrowingTarget(ctx, [range(n)]) for n in (_PLAIN, _DETAILED)}
        self._edges = GrowingTarget(ctx, [[0]])
        self._squares = GrowingTarget(ctx, [range(_PLAIN)])
        self._larger_squares = GrowingTarget(ctx, [range(_PLAIN)])

    def group(
        self,
        tile: RasterTile,
        visibility: Sequence[moderngl.Texture],
        spacecraft: Sequence[DrawnSpacecraft],
        lit: Callable[[], None] | None = None,
        *,
        edges: bool = False,
        even: EvenLight | None = None,
    ) -> ShadingPoints:
        """Group the samples that see the same. No point is looked up yet.

        visibility : of the visibility pass, in the order of ``SEEN``
        spacecraft : of the tile
        lit : called before light of other surfaces is read
        edges : whether the points also tell along which line their groups end
        even : tells over which squares light is smooth; only for a tile of one spacecraft. A GPU
            does not ask: it shades a point for each cell in less time than to read back the answer
        """
        cells, blocks = tile.cells.size, blocks_of(tile.cells.size)
        few, many = self._groups.covering(cells)
        self._blocks.bind_tile(tile)
        _bind_seen(visibility)
        target = few if tile.cells.reach < _REACH_OF_FEW else many
        fours = len(target.color_attachments)
        self._grouping_for(tile.cells.texels, fours).draw(self.colour_only, target, (0, 0, *cells))
        groups = textures_of(many)
        counts = self._draw_counts(groups[0], blocks)
        if self._numbers is None:
            pages = self._numbered(tile, counts, blocks, spacecraft[0], even, lit)
        else:
            pages = self._numbered_on_gpu(self._numbers, counts, blocks)
        detailed = any("DETAILED" in drawn.view.model.variant for drawn in spacecraft)
        size = COLUMNS, 4 * pages.rows
        depths = self._depths_of(size)
        point_groups = self._groups_of_points(groups, pages.entries, size, depths)
        (target,) = self._targets[_DETAILED if detailed else _PLAIN].covering(size)
        depth = target.depth_attachment
        assert isinstance(depth, moderngl.Renderbuffer)
        by_rays = any(drawn.lit_bodies for drawn in spacecraft)
        if by_rays:
            # Read on the CPU.
            self.colour_only.apply(self._ctx, target, (0, 0, *size), (0, 0, *size))
            target.clear(EMPTY, EMPTY, EMPTY, EMPTY, viewport=(0, 0, *size))
        return ShadingPoints(
            cells=cells,
            visibility=tuple(visibility),
            groups=groups,
            point_groups=point_groups,
            rows=pages.rows,
            read_entries=pages.read_entries,
            bare=pages.bare,
            wide_pages=pages.wide_pages,
            wide_rows=pages.wide_rows,
            partly_lit=pages.squares.partly_lit,
            of_one=len(spacecraft) == 1 and not by_rays,
            page_entries=pages.entries,
            block_pages=pages.first,
            textures=textures_of(target),
            edges=self._edges.covering(size, depth)[0] if edges else None,
            framebuffer=target,
            depth=depth,
            depths=depths,
        )

    def _depths_of(self, size: tuple[int, int]) -> Depths | None:
        """Of the points, for compute shaders."""
        if isinstance(self._counting, Screen):
            return None
        rows = None if self._numbers is None else self._numbers.rows
        (texture,) = textures_of(*self._depths.covering(size))
        return Depths(texture, rows)

    def _draw_counts(
        self, cell_groups: moderngl.Texture, blocks: tuple[int, int]
    ) -> moderngl.Framebuffer:
        """R8UI, of each block of cells the byte that tells of its pages."""
        (counts,) = self._counts.covering(blocks)
        cell_groups.use(CELL_GROUPS["cell_groups"])
        self._counting.draw(self.colour_only, counts, (0, 0, *blocks))
        return counts

    def _numbered_on_gpu(
        self, numbers: PageNumbers, counts: moderngl.Framebuffer, blocks: tuple[int, int]
    ) -> _Pages:
        (of_block,) = textures_of(counts)
        tables = self._page_entries, self._block_pages
        rows = numbers.number(of_block, blocks, *tables)
        entries, first = (textures_of(*table.covering((1, 1)))[0] for table in tables)
        return _Pages(
            rows=rows, entries=entries, first=first, read_entries=partial(numbers.read, entries)
        )

    def _numbered(
        self,
        tile: RasterTile,
        counts: moderngl.Framebuffer,
        blocks: tuple[int, int],
        drawn: DrawnSpacecraft,
        even: EvenLight | None,
        lit: Callable[[], None] | None,
    ) -> _Pages:
        wait_for_draws(self._ctx)
        area = (0, 0, *blocks)
        data = counts.read(viewport=area, components=1, alignment=1, dtype="u1")
        of_block = np.frombuffer(data, dtype=np.uint8).reshape(blocks[::-1])
        squares = self._even_squares(tile, of_block, drawn, even, lit)
        entries, first, wide_rows = page_table(of_block & _COUNT, squares)
        return _Pages(
            rows=len(entries),
            entries=self._page_entries.written(entries),
            first=self._block_pages.written(first),
            read_entries=lambda: entries,
            bare=of_block >= BARE,
            wide_rows=wide_rows,
            wide_pages=even is not None,
            squares=squares,
        )

    def _even_squares(
        self,
        tile: RasterTile,
        of_block: AnyArray,
        drawn: DrawnSpacecraft,
        even: EvenLight | None,
        lit: Callable[[], None] | None,
    ) -> EvenSquares:
        """Over which squares of 2 x 2 blocks light is smooth: they have one page together."""
        if even is None:
            return _NONE_EVEN
        candidates = np.bitwise_and.reduce(blocks_of_squares(of_block)) & _ONE_SURFACE
        if np.count_nonzero(candidates) < _WORTH_ASKING * candidates.size or not candidates.size:
            return _NONE_EVEN
        if lit is not None:
            lit()
        size = candidates.shape[1], candidates.shape[0]
        (target,) = self._squares.covering(size)
        self._bind_mesh(tile, drawn)
        textures_of(*self._counts.covering((1, 1)))[0].use(_BLOCKS_UNIT)
        variant = ("JOINTED",) * (drawn.mesh.motion is not None)
        if drawn.vertex_lighting is not None:
            variant += drawn.vertex_lighting.defines
        for_squares = *variant, "OF_SQUARES"
        self._look_up_for(for_squares).draw(self.colour_only, target, (0, 0, *size))
        larger = 0, 0, size[0] // 2, size[1] // 2
        (target_of_larger,) = self._larger_squares.covering(larger[2:])
        look_up = self._look_up_for((*for_squares, "LARGER"))
        look_up.draw(self.colour_only, target_of_larger, larger)
        squares = even(textures_of(target), size)
        data = target_of_larger.read(viewport=larger, components=4, attachment=2, dtype="f4")
        smooth = np.frombuffer(data, dtype=np.float32).reshape(larger[3], larger[2], 4)[..., 3]
        return with_larger(squares, smooth > 0.5)

    def _groups_of_points(
        self,
        groups: Sequence[moderngl.Texture],
        page_entries: moderngl.Texture,
        size: tuple[int, int],
        depths: Depths | None,
    ) -> moderngl.Texture:
        """R32UI, of columns and rows of points: all passes over them read one texel of it."""
        (target,) = self._point_groups.covering(size)
        for unit, texture in zip(CELL_GROUPS.values(), groups, strict=True):
            texture.use(unit)
        page_entries.use(PAGE_ENTRIES["page_entries"])
        self._paging.draw(self.colour_only, target, (0, 0, *size), depths)
        return textures_of(target)[0]

    @property
    def reads_back(self) -> bool:
        """Whether ``group`` waits for what is drawn, and tells which blocks are bare."""
        return self._numbers is None

    def lacked_room(self) -> bool:
        """Whether tiles since the last call had pages for which there was no room, as there is now:
        what was drawn of them is to be drawn again. Waits for what is drawn."""
        return self._numbers is not None and self._numbers.lacked_room()

    def look_up(self, tile: RasterTile, points: ShadingPoints, drawn: DrawnSpacecraft) -> None:
        """Fill the points that see one spacecraft."""
        area = (0, 0, *points.size)
        _bind_seen(points.visibility)
        points.bind()
        model, lighting = drawn.view.model, drawn.vertex_lighting
        self._bind_mesh(tile, drawn)
        if not points.of_one:
            # Drawn, not cleared: both come to the depth buffer's bits in the same way.
            for marks in self._unmarked, self._marks_for(model.variant):
                marks.draw(self.marking, points.framebuffer, area, points.depths)
        variant = tuple(d for d in model.variant if d == "DETAILED")
        if variant:
            self._meshes.bind_surface(model)
        if drawn.mesh.motion is not None:
            variant = (*variant, "JOINTED")
        if lighting is not None:
            variant += lighting.defines
        motion = drawn.view.motion
        if motion is not None:
            variant += motion.variant
            if motion.joint_rates is not None:
                self._meshes.bind_joint_rates(motion)
                variant += ("JOINTS_MOVE",)
        if points.of_one:
            layered = ("LAYERED",) * ("LAYERED" in model.variant)
            look_up = self._look_up_for((*variant, *layered, "MARK_AT"))
            look_up.draw(self.looking_up, points.framebuffer, area, points.depths)
        else:
            draw_marked(points.framebuffer, points, self._look_up_for(variant))
        if points.edges is not None:
            points.groups[0].use(_CELLS_UNIT)
            of_places = tuple(name for name in variant if name in _OF_PLACES)
            draw_marked(points.edges, points, self._look_up_for((*of_places, "EDGES")))

    def _bind_mesh(self, tile: RasterTile, drawn: DrawnSpacecraft) -> None:
        self._blocks.bind_tile(tile)
        self._blocks.bind_spacecraft(drawn)
        tables = self._meshes.tables(drawn.mesh)
        tables.corners.use(_CORNERS_UNIT)
        tables.vertices.use(_VERTICES_UNIT)
        self._meshes.bind_materials(drawn.view.model)
        if drawn.mesh.motion is not None:
            self._meshes.bind_joints(drawn.view.model, drawn.mesh)
        lighting = drawn.vertex_lighting
        if lighting is not None:
            lighting.light.use(_LIGHT_UNIT)
            if lighting.grids is not None:
                lighting.grids.of_triangle.use(_GRIDS["light_grids"])
                lighting.grids.light.use(_GRIDS["grid_light"])
                lighting.grids.rows.use(_GRIDS["grid_rows"])

    def _marks_for(self, variant: tuple[str, ...]) -> PointScreen:
        """The shader that marks the points of models of a variant."""
        layered = "LAYERED" in variant
        variant = ("LAYERED",) * layered
        if variant not in self._marks:
            seen = SEEN if layered else _SURFACES
            self._marks[variant] = point_shader(
                self._ctx,
                "gbuffer/marks",
                MARKED,
                [TILE, SPACECRAFT] + [MATERIALS] * layered,
                seen | _OF_POINTS | ({"triangle_corners": _CORNERS_UNIT} if layered else {}),
                dict.fromkeys(variant, 1),
            )
        return self._marks[variant]

    def _grouping_for(self, texels: int, fours: int) -> PointScreen:
        variant = texels, fours
        if variant not in self._grouping:
            defines = {"CELL_TEXELS": texels, "FOURS": fours}
            shader = ScreenShader("gbuffer/groups", 0.0, [TILE], _SURFACES, defines)
            self._grouping[variant] = screen(self._ctx, shader)
        return self._grouping[variant]

    def _look_up_for(self, variant: tuple[str, ...]) -> PointScreen:
        """The shader for models of a variant; those without images do not pay for them."""
        if variant not in self._lookups:
            detailed, lit = "DETAILED" in variant, "INTERREFLECTION" in variant
            samplers = {
                "triangle_corners": _CORNERS_UNIT,
                "mesh_vertices": _VERTICES_UNIT,
            }
            samplers |= {"blocks": _BLOCKS_UNIT} if "OF_SQUARES" in variant else _OF_POINTS
            # Edges of a triangle are the same from both sides.
            samplers |= _TRIANGLES if "EDGES" in variant else SEEN
            if detailed:
                samplers |= IMAGE_UNITS
            if lit:
                samplers |= {"vertex_light": _LIGHT_UNIT}
            if "EDGES" in variant:
                samplers |= {"cell_groups": _CELLS_UNIT}
            if "LIGHT_GRIDS" in variant:
                samplers |= _GRIDS
            self._lookups[variant] = point_shader(
                self._ctx,
                "gbuffer/gbuffer",
                OTHERS,
                [TILE, SPACECRAFT]
                + [MATERIALS] * bool({"DETAILED", "LAYERED", "OF_SQUARES"} & set(variant))
                + [JOINTS] * ("JOINTED" in variant)
                + [JOINT_RATES] * ("JOINTS_MOVE" in variant),
                samplers,
                {name: MARKED if name == "MARK_AT" else 1.0 for name in variant},
            )
        return self._lookups[variant]

    def release(self) -> None:
        """Free everything."""
        growing = (
            self._groups,
            self._counts,
            self._point_groups,
            self._page_entries,
            self._block_pages,
            self._depths,
            self._edges,
            self._squares,
            self._larger_squares,
        )
        for target in (*growing, *self._targets.values()):
            target.release()
        for grouping in (self._counting, self._paging, self._unmarked, *self._grouping.values()):
            grouping.release()
        for shader in (*self._marks.values(), *self._lookups.values()):
            shader.release()
        if self._numbers is not None:
            self._numbers.release()


def _bind_seen(visibility: Sequence[moderngl.Texture]) -> None:
    for unit, texture in zip(SEEN.values(), visibility, strict=True):
        texture.use(unit)
