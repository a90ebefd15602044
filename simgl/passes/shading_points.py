"""Shading points of a tile: what passes hand each other, and how they draw over all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import moderngl
import numpy as np

from simgl.arrays import AnyArray, IndexArray, Mask
from simgl.gpu.compute_screen import ComputeScreen, Depths
from simgl.gpu.fullscreen import Screen, screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.screen_shader import ScreenShader
from simgl.gpu.uniform_blocks import Block
from simgl.passes.even_squares import DARK, LIT, PARTLY_LIT, UNEVEN, EvenSquares, without_penumbras
from simgl.passes.shared_blocks import JOINT_RATES, JOINTS, LAMPS, MATERIALS, TILE

# As in shaders/gbuffer/paging.glsl: groups of a cell that have a shading point each, cells along
# the edge of a block, and squares of four pages in a row of the textures.
LAYERS, BLOCK, _SQUARES = 16, 2, 256
# Pages in a row of squares, and texels along the rows of the textures.
ENTRIES, COLUMNS = 4 * _SQUARES, 4 * _SQUARES
_PRESENT, _WIDE, _LAYER_BIT, _ROW_BIT = 1 << 31, 1 << 30, 26, 13
_WIDTH_BIT = 28
# In a texture of listed points: none.
UNLISTED = 0xFFFFFFFF
# Bits that are set in each mask of a page, and whether each of them is.
_BITS = np.array([n.bit_count() for n in range(16)], dtype=np.uint32)
_SET = np.array([[n >> bit & 1 for bit in range(4)] for n in range(16)], dtype=bool)
# From the first point of a page to each, as in ``listed_points``.
_STEP = np.array([corner // 2 << 16 | corner % 2 for corner in range(4)], dtype=np.uint32)
# They fill squares of so many texels one after the other, so that neighbours stay together.
_EDGE = 4
# Texture units of the groups of cells, and of what tells a point's group, and its cell.
CELL_GROUPS = {"cell_groups": 16, "second_groups": 17, "third_groups": 18, "fourth_groups": 19}
POINT_GROUPS, PAGE_ENTRIES = {"point_groups": 16}, {"page_entries": 20}
# Of what samples see, in the order of the targets of shaders/visibility/visibility.frag.
SEEN = {"seen_triangles": 7, "seen_surfaces": 0}
# Channels of the G-buffer, in the order of the targets of shaders/gbuffer/gbuffer.frag.
GBUFFER = ("position", "normal_roughness", "face_normal", "indirect")


def gbuffer_units(*channels: str) -> dict[str, int]:
    """Texture units of the samplers of channels."""
    return {f"gbuffer_{name}": GBUFFER.index(name) for name in channels}


def page_table(
    counts: AnyArray, even: EvenSquares | None = None
) -> tuple[AnyArray, AnyArray, tuple[int, int, int]]:
    """Which pages there are, by how many each block of cells takes.

    counts : (rows, columns) of the blocks
    even : of squares of 2 x 2 blocks: each that is not ``UNEVEN`` has one page, and so has each
        larger one
    returns : (rows of squares, ENTRIES) uint32, the entry of each page, 0 where there is none;
        (rows, columns) uint32, the first page of each block, 0 of one without pages. Both have a
        bit that tells of wide pages. Of lit, dark and partly lit squares how many rows of squares
        their pages fill, each kind from a new row on; those of blocks follow.
    """
    if even is None or not even.kinds.any():
        even = without_penumbras(np.zeros((0, 0), dtype=np.uint8))
    wide_entries, wide_first, rows_of = _wide_pages(even)
    wide = even.kinds != UNEVEN
    if wide.size:
        counts = counts.copy()
        for of_square in blocks_of_squares(counts):
            of_square[wide] = 0
    # Few blocks have pages of their own: sums and copies of all take four times as long.
    with_pages = counts != 0
    count = counts[with_pages].astype(np.uint32)
    end = np.cumsum(count, dtype=np.uint32)
    total, before = int(end[-1]) if end.size else 0, wide_entries.size
    start = end + np.uint32(before)
    start -= count
    rows = len(wide_entries) + -(-total // ENTRIES)
    entries = np.zeros((max(1, rows), ENTRIES), dtype=np.uint32)
    entries[: len(wide_entries)] = wide_entries
    block_rows, block_columns = (np.arange(n, dtype=np.uint32) for n in counts.shape)
    # What is the same for all pages of a block: the layer counts on from there. In 32 bits, which
    # what is taken away and added again may leave.
    of_block = (_PRESENT | block_rows[:, None] << _ROW_BIT | block_columns)[with_pages]
    of_block -= start << _LAYER_BIT
    number = np.arange(before, before + total, dtype=np.uint32)
    number <<= _LAYER_BIT
    np.add(np.repeat(of_block, count), number, out=entries.reshape(-1)[before : before + total])
    first = np.zeros(counts.shape, dtype=np.uint32)
    first[with_pages] = start
    for of_square in blocks_of_squares(first) if wide.size else ():
        np.copyto(of_square, wide_first, where=wide)
    return entries, first, rows_of


def _wide_pages(even: EvenSquares) -> tuple[AnyArray, AnyArray, tuple[int, int, int]]:
    """(rows of squares, ENTRIES) entries of wide pages, the page of each square and rows of squares
    by kind, as ``page_table`` gives them. Of each kind those of larger squares come first."""
    if not even.kinds.any():
        return np.zeros((0, ENTRIES), np.uint32), np.zeros(even.kinds.shape, np.uint32), (0, 0, 0)
    single = even.kinds.copy()
    of_larger = np.where(even.larger, blocks_of_squares(single)[0], UNEVEN)
    for square in blocks_of_squares(single):
        square[even.larger] = UNEVEN
    first = np.zeros(single.shape, dtype=np.uint32)
    rows_of: list[int] = []
    pages: list[AnyArray] = []
    for kind in (LIT, DARK, PARTLY_LIT):
        before = sum(rows_of) * ENTRIES
        listed = []
        for width, squares in (2, of_larger), (1, single):
            row, column = (width * at for at in np.nonzero(squares == kind))
            page = np.arange(before, before + len(row))
            before += len(row)
            listed.append(_PRESENT | _WIDE | width << _LAYER_BIT | 2 * row << _ROW_BIT | 2 * column)
            for place in range(width * width):
                at = row + place // width, column + place % width
                first[at] = page | _WIDE | width << _WIDTH_BIT
        entries = np.concatenate(listed)
        rows_of.append(-(-len(entries) // ENTRIES))
        filled = np.zeros((rows_of[-1], ENTRIES), dtype=np.uint32)
        filled.reshape(-1)[: len(entries)] = entries
        pages.append(filled)
    lit, dark, partly = rows_of
    return np.concatenate(pages), first, (lit, dark, partly)


def at_pages(values: AnyArray) -> AnyArray:
    """(4 * rows, COLUMNS, bands) of the points of pages one after the other, where they lie in the
    textures; zeros behind the last.

    values : (pages, 4, bands), row by row within a page
    """
    rows, bands = -(-len(values) // ENTRIES), values.shape[2]
    pages = np.zeros((rows * ENTRIES, 4, bands), dtype=values.dtype)
    pages[: len(values)] = values
    squares = pages.reshape(rows, _SQUARES, 2, 2, 2, 2, bands)
    return squares.transpose(0, 2, 4, 1, 3, 5, 6).reshape(4 * rows, COLUMNS, bands)


def blocks_of_squares(values: AnyArray) -> list[AnyArray]:
    """Views of (rows, columns) values: of each whole square of 2 x 2 the first, and the others."""
    rows, columns = (n // 2 * 2 for n in values.shape)
    return [values[i:rows:2, j:columns:2] for i in (0, 1) for j in (0, 1)]


def _texels_of_pages(pages: AnyArray) -> AnyArray:
    """(n,) of the first points of pages: columns, and from bit 16 on rows, in the textures."""
    row = (pages // ENTRIES) * 4 + (pages & 2)
    return row << 16 | (pages >> 2) % _SQUARES * 4 + (pages & 1) * 2


def listed_points(masks: AnyArray, results: AnyArray, before: int = 0) -> AnyArray:
    """Some of the points, square by square, and where to find what came out for them.

    masks : (rows of squares, ENTRIES) uint8, of each page a bit for each of its points that is
        listed
    results : uint32 zeros of that shape, filled: from bit 4 on how many come before the page's,
        below it the mask
    before : so many come before them all
    returns : (rows, COLUMNS) uint32, columns of points, and from bit 16 on rows, in the textures
    """
    pages = np.flatnonzero(masks.ravel() != 0)
    listed = masks.ravel()[pages]
    count = _BITS[listed]
    ends = np.cumsum(count, dtype=np.uint32)
    results.reshape(-1)[pages] = (ends - count + np.uint32(before)) << 4 | listed
    corners = np.broadcast_to(_STEP, (len(pages), 4))[_SET[listed]]
    return in_squares(np.repeat(_texels_of_pages(pages.astype(np.uint32)), count) + corners)


def in_squares(points: AnyArray) -> AnyArray:
    """(rows, COLUMNS) uint32, square by square, of (n,) points one after the other."""
    total = len(points)
    padded = np.full(-(-total // (_EDGE * COLUMNS)) * _EDGE * COLUMNS, UNLISTED, dtype=np.uint32)
    padded[:total] = points
    squares = padded.reshape(-1, COLUMNS // _EDGE, _EDGE, _EDGE)
    return squares.swapaxes(1, 2).reshape(-1, COLUMNS)


def in_list_order(values: AnyArray) -> AnyArray:
    """(n, ...) one after the other as listed, of (rows, COLUMNS, ...) square by square."""
    rest = values.shape[2:]
    squares = values.reshape(-1, _EDGE, COLUMNS // _EDGE, _EDGE, *rest)
    return squares.swapaxes(1, 2).reshape(-1, *rest)


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadingPoints:
    """Shading points of a tile, valid until the next tile.

    cells : columns and rows
    visibility : of the visibility pass, in the order of ``SEEN``
    groups : in the order of ``CELL_GROUPS``, RGBA32UI: of each cell the samples of its groups
    point_groups : R32UI, of each point the samples of its group, 0 where there is none
    rows : of squares, at least those that have pages
    read_entries : gives ``entries``
    bare : (rows, columns) of the blocks of cells, whether a sample there sees nothing; None where
        the CPU does not know it
    wide_pages : whether some pages may be wide
    wide_rows : of lit, dark and partly lit squares how many ``rows`` their pages fill
    partly_lit : of ``EvenSquares``, in the order of their pages
    of_one : whether all are looked up for one spacecraft, and none is read on the CPU
    page_entries, block_pages : R32UI, the entries and the first page of each block
    textures : in the order of the targets of shaders/gbuffer/gbuffer.frag, RGBA32F
    framebuffer : of the textures
    depth : of the same size: which of them are whose (``draw_marked``, ``draw_by_material``)
    depths : the same for compute shaders; None where there are none
    edges : of an RGBA32F texture of that size, of each point the line along which its group ends;
        None unless asked for
    """

    cells: tuple[int, int]
    visibility: tuple[moderngl.Texture, ...]
    groups: tuple[moderngl.Texture, ...]
    point_groups: moderngl.Texture
    rows: int
    read_entries: Callable[[], AnyArray]
    bare: Mask | None
    wide_pages: bool
    wide_rows: tuple[int, int, int]
    partly_lit: AnyArray
    of_one: bool
    page_entries: moderngl.Texture
    block_pages: moderngl.Texture
    textures: tuple[moderngl.Texture, ...]
    framebuffer: moderngl.Framebuffer
    depth: moderngl.Renderbuffer
    depths: Depths | None
    edges: moderngl.Framebuffer | None

    @cached_property
    def entries(self) -> AnyArray:
        """(rows, ENTRIES) of ``page_table``. May wait for what is drawn."""
        return self.read_entries()

    @property
    def known_rows(self) -> int:
        """Of ``rows``: what share of the sunlight their points get is known from the start."""
        return sum(self.wide_rows)

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the part of the textures that holds points."""
        return COLUMNS, 4 * self.rows

    def cells_of(self, row: IndexArray, column: IndexArray) -> tuple[IndexArray, IndexArray]:
        """Row, all layers one above the other, and column of the cells of points.

        row, column : (n,) of the points in the textures
        """
        entry = self.entries[row // 4, column // 4 * 4 + row // 2 % 2 * 2 + column // 2 % 2].astype(
            np.int64
        )
        layer, block_row = entry >> _LAYER_BIT & 15, entry >> _ROW_BIT & 8191
        return (
            layer * self.cells[1] + BLOCK * block_row + row % 2,
            BLOCK * (entry & 8191) + column % 2,
        )

    def bind(self) -> None:
        """Bind what every shader of points reads."""
        self.point_groups.use(POINT_GROUPS["point_groups"])
        self.page_entries.use(PAGE_ENTRIES["page_entries"])


# From what is looked up of squares of 4 x 4 cells, in the order of ``GBUFFER``, and columns and
# rows of squares: over which of these light is smooth.
EvenLight = Callable[[Sequence[moderngl.Texture], tuple[int, int]], EvenSquares]


def blocks_of(cells: tuple[int, int]) -> tuple[int, int]:
    """Columns and rows of the blocks of so many cells."""
    return -(-cells[0] // BLOCK), -(-cells[1] // BLOCK)


# Depths of screens over the points of one spacecraft: over all of them, and over those of one
# reflection law or, at the opposite depth, over those of layered materials. The others' points are
# at the first depth, those of one law behind the second, those of layered materials before its
# opposite: even a renderer without real branches spends on a point only what it needs.
OTHERS, BY_MATERIAL, MARKED = 0.0, 0.4, 0.8
PointScreen = Screen | ComputeScreen
_ALL, _PLAIN, _LAYERED = (
    State(depth=True, depth_func=f, keep_depth=True) for f in ("!=", "<", ">")
)


def draw_marked(
    target: moderngl.Framebuffer, points: ShadingPoints, screen: PointScreen, first_row: int = 0
) -> None:
    """Draw all points of the spacecraft that was looked up last, with a screen at ``OTHERS``.

    first_row : of the textures; none before it is drawn
    """
    columns, rows = points.size
    screen.draw(_ALL, target, (0, first_row, columns, rows - first_row), points.depths)


def draw_by_material(
    target: moderngl.Framebuffer,
    points: ShadingPoints,
    plain: PointScreen,
    layered: PointScreen | None,
) -> None:
    """The same with two screens at ``BY_MATERIAL``.

    plain : for points of one reflection law
    layered : for those of layered materials, None where there are none
    """
    area = (0, 0, *points.size)
    plain.draw(_PLAIN, target, area, points.depths)
    if layered is not None:
        layered.draw(_LAYERED, target, area, points.depths, opposite=True)


def point_shader(
    ctx: moderngl.Context,
    name: str,
    depth: float,
    blocks: Sequence[Block],
    samplers: Mapping[str, int],
    defines: Mapping[str, float] | None = None,
) -> PointScreen:
    """A shader over the shading points of a tile, at a depth."""
    spare = [TILE, LAMPS, MATERIALS, JOINTS, JOINT_RATES]
    return screen(ctx, ScreenShader(name, depth, blocks, samplers, defines or {}, spare))
