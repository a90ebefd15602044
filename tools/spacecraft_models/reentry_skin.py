"""The skin of Space Rider's lifting body, with the hole over the cargo bay.

It is one bicubic B-spline through planar control rings. The rings around the bay share their upper
control points, which makes the top exactly straight there: hinges can be straight and closed doors
continue the skin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import brentq

from simgl.arrays import Array, IndexArray
from tools.spacecraft_models.shapes import (
    Shape,
    boundary_edges,
    closed,
    grid_triangles,
    wall_triangles,
)

NOSE_X, BASE_X = 3.9, -0.7  # [m]
TOP_Z, BELLY_Z = -1.0, 0.9  # [m]

# Control rings from nose to base: x, half width, top z, belly z [m], and how round the section is
# (1 an oval, 0 a flat belly under sides that lean in). Two rings at the nose's x, the first shrunk
# to a point, make the nose smooth.
RINGS = np.array(
    [
        [3.90, 0.00, 0.34, 0.34, 1.00],
        [3.90, 0.34, 0.02, 0.62, 1.00],
        [3.64, 0.62, -0.27, 0.78, 0.80],
        [3.10, 0.77, -0.56, 0.87, 0.45],
        [2.60, 0.85, -0.79, 0.90, 0.20],
        [2.10, 0.91, -0.94, 0.90, 0.05],
        [1.60, 0.98, -1.00, 0.90, 0.00],
        [1.10, 1.03, -1.00, 0.90, 0.00],
        [0.50, 1.07, -1.00, 0.90, 0.00],
        [-0.10, 1.11, -1.00, 0.90, 0.00],
        [-0.45, 1.13, -1.00, 0.90, 0.00],
        [-0.70, 1.14, -1.00, 0.90, 0.00],
    ]
)
# Half of an oval's control points: share of the half width, share of the height from the top.
OVAL = np.array(
    [
        [0.00, 0.00],
        [0.38, 0.00],
        [0.76, 0.09],
        [0.97, 0.30],
        [1.03, 0.58],
        [0.90, 0.86],
        [0.60, 1.00],
        [0.30, 1.00],
        [0.00, 1.00],
    ]
)
SECTION_CONTROLS = 16  # around a ring; the section parameter runs from 0 (top) to this number

BAY_X = 0.5  # centre of the cargo bay [m]
OPENING = (0.62, 0.52)  # half length and half width of the hole in the skin [m]
FLOOR_Z = -0.2  # the bay's floor [m]: 0.8 below the top of the skin


def _section_controls(half_width: float, top: float, belly: float, roundness: float) -> Array:
    """(16, 2) control points (y, z) of one section, from the top round by starboard [m]."""
    height = belly - top
    crown = min(1.0, half_width / 0.95)  # the crown stops widening ahead of the bay
    angular = np.array(
        [
            [0.0, top],
            [0.30 * crown, top],
            [0.64 * crown, top + 0.04 * height],
            [0.81 * crown, top + 0.32 * height],
            [0.91 * half_width, top + 0.64 * height],
            [1.00 * half_width, belly - 0.12 * height],
            [0.88 * half_width, belly],
            [0.45 * half_width, belly],
            [0.0, belly],
        ]
    )
    oval = OVAL * [half_width, height] + [0.0, top]
    half = roundness * oval + (1.0 - roundness) * angular
    return np.concatenate([half, half[-2:0:-1] * [-1.0, 1.0]])


@cache
def _control_net() -> Array:
    """(rings, 16, 3) control points [m]."""
    sections = [
        np.column_stack([np.full(SECTION_CONTROLS, x), _section_controls(*shape)])
        for x, *shape in RINGS
    ]
    return np.stack(sections)


def skin(lengthwise: Array, around: Array) -> Array:
    """Points of the skin.

    lengthwise : (r,) parameter from 0 at the nose to 1 at the base
    around : (c,) section parameter, periodic in SECTION_CONTROLS, 0 at the top, starboard first
    returns : (r, c, 3) [m]
    """
    rings = len(RINGS)
    clamped = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, rings - 2), np.ones(3)])
    along = BSpline.design_matrix(np.asarray(lengthwise), clamped, 3).toarray()
    uniform = np.arange(-3.0, SECTION_CONTROLS + 4.0)
    wrapped = BSpline.design_matrix(np.mod(around, SECTION_CONTROLS), uniform, 3).toarray()
    # Column j of the periodic basis peaks at parameter j - 1, which belongs to control j - 1.
    controls = np.take(_control_net(), np.arange(-1, SECTION_CONTROLS + 2), axis=1, mode="wrap")
    points: Array = np.einsum("ri,cj,ijk->rck", along, wrapped, controls)
    return points


@cache
def station(x: float) -> float:
    """The lengthwise parameter of the plane at x [m]."""
    if x <= BASE_X:
        return 1.0
    return float(brentq(lambda v: skin(np.array([v]), np.zeros(1))[0, 0, 0] - x, 0.0, 1.0))


@cache
def _around_at(x: float, y: float) -> float:
    """The section parameter where the upper skin at x passes over y >= 0 [m]."""
    row = np.array([station(x)])
    return float(brentq(lambda s: skin(row, np.array([s]))[0, 0, 1] - y, 0.0, 4.0))


def upper_skin(x: float, y: float, depth: float = 0.0) -> Array:
    """(3,) the point `depth` under the upper skin at (x, y) [m]."""
    point = skin(np.array([station(x)]), np.array([_around_at(x, abs(y))]))[0, 0]
    return np.array([point[0], np.copysign(point[1], y), point[2] + depth])


def _ruled(
    stops: Sequence[float], gaps: Sequence[float], cells: Sequence[int]
) -> tuple[Array, IndexArray]:
    """Grid lines of a row of tiles with gaps between them.

    stops : (k + 1,) borders of the tiles, in parameter space
    gaps : (k + 1,) width of the gap at each border; 0 for none
    cells : (k,) cells in each tile
    returns : (n,) lines, and (n - 1,) the tile of each cell or -1 for a gap
    """
    lines: list[float] = []
    tiles: list[int] = []
    for tile, count in enumerate(cells):
        start, end = stops[tile] + 0.5 * gaps[tile], stops[tile + 1] - 0.5 * gaps[tile + 1]
        inner = np.linspace(start, end, count + 1)
        if not lines:
            lines = [float(inner[0])]
        elif gaps[tile] > 0.0:
            lines.append(float(inner[0]))
            tiles.append(-1)
        lines += [float(v) for v in inner[1:]]
        tiles += [tile] * count
    return np.array(lines), np.array(tiles)


def _parameter_gap(points: Array, step: float) -> float:
    """A gap of 12 mm as a step of the parameter, from (k, 2, 3) points `step` apart in it."""
    lengths = np.linalg.norm(points[:, 1] - points[:, 0], axis=-1)
    return 0.012 * step / float(lengths.mean())


def _rows() -> tuple[Array, IndexArray]:
    """Lengthwise lines of the skin's grid, with a gap at every border but the bay's ends."""
    bay = BAY_X + OPENING[0], BAY_X - OPENING[0]
    borders = [3.70, 3.35, 2.97, 2.58, 2.19, 1.82, 1.47, bay[0], 0.70, 0.29, bay[1], -0.40]
    cells = [10, 6, 5, 5, 5, 5, 4, 4, 4, 4, 4, 3, 3]
    around = np.arange(0.5, SECTION_CONTROLS, 1.0)
    stops, gaps, step = [0.0], [0.0], 1e-3
    for x in borders:
        stops.append(station(x))
        near = np.array([stops[-1] - 0.5 * step, stops[-1] + 0.5 * step])
        pairs = np.moveaxis(skin(near, around), 0, 1)
        gaps.append(0.0 if x in bay else _parameter_gap(pairs, step))
    return _ruled([*stops, 1.0], [*gaps, 0.0], cells)


def _columns() -> tuple[Array, IndexArray]:
    """Lines around the skin's grid, from the bay's starboard edge round to the same edge."""
    edge = _around_at(BAY_X, OPENING[1])
    borders = [2.02, 2.6, 3.2, 3.8, 4.4, 5.0, 5.6, 6.2, 6.8, 7.4]
    middle, step = np.array([station(BAY_X)]), 0.02
    gaps = [
        _parameter_gap(skin(middle, np.array([s - 0.5 * step, s + 0.5 * step])), step)
        for s in borders
    ]
    cells = [1, 4, 4, 4, 4, 4, 4, 4, 3, 3]
    port = [SECTION_CONTROLS - s for s in reversed(borders)]
    around = [edge, *borders, *port, SECTION_CONTROLS - edge, SECTION_CONTROLS + edge]
    widths = [0.0, *gaps, *reversed(gaps), 0.0, 0.0]
    return _ruled(around, widths, [*cells, 6, *reversed(cells), 12])


def _tile_material(x: float, row: int, column: int, columns: int) -> str:
    """The finish of one tile: black ceramic where the entry heats, pale felt in the lee.

    x : the tile's middle [m]; columns : tiles around, the last of them over the bay
    """
    if row == 0:
        return "ceramic_black"  # the nose cap is one piece
    scatter = (7 * row + 13 * column + row * column) % 5
    # Tiles counted down from the bay's edge on either side; the black rises towards the nose.
    below_edge = min(column, columns - 2 - column)
    first_black = 2 if x > 3.35 else 3 if x > 2.58 else 4 if x > 1.47 else 5
    if column != columns - 1 and below_edge >= first_black:
        return "ceramic_black_worn" if scatter in (1, 3) else "ceramic_black"
    if column != columns - 1 and below_edge == first_black - 1:
        return "ceramic_grey"
    if abs(x - BAY_X) < 0.90 and below_edge <= 0:
        return "felt_grey"
    return "felt_white_worn" if scatter in (0, 2) else "felt_white"


def _skin_materials(x: Array, row_tiles: IndexArray, column_tiles: IndexArray) -> list[list[str]]:
    """Rows by columns of material names for the cells of the skin's grid.

    x : (r,) middle of each row of cells [m]
    """
    columns = int(column_tiles.max()) + 1
    middles = {int(row): float(x[row_tiles == row].mean()) for row in np.unique(row_tiles)}

    def name(row: int, column: int) -> str:
        if row < 0 or (column < 0 and row > 0):
            return "tile_gap"
        return _tile_material(middles[row], row, column, columns)

    return [[name(int(row), int(column)) for column in column_tiles] for row in row_tiles]


@dataclass(frozen=True, eq=False)
class _SkinCells:
    """The skin's grid, its cells sorted into those that stay and those cut out over the bay.

    vertices : (n, 3) [m]; base : (c,) the vertices of the last row, at the base
    kept, cut : (m, 3) triangles; materials : of the kept ones
    """

    vertices: Array
    base: IndexArray
    retained: IndexArray
    cut: IndexArray
    materials: list[str]


def _skin_cells() -> _SkinCells:
    rows, row_tiles = _rows()
    columns, column_tiles = _columns()
    points = skin(rows, columns[:-1])
    index = np.arange(points[:, :, 0].size).reshape(points.shape[:2])
    index[0] = 0  # the nose is one point
    index = np.concatenate([index, index[:, :1]], axis=1)
    middle = 0.5 * (points[1:, 0, 0] + points[:-1, 0, 0])
    names = _skin_materials(middle, row_tiles, column_tiles)
    over_bay = np.ix_(np.abs(middle - BAY_X) < OPENING[0], column_tiles == column_tiles.max())
    open_cell = np.zeros((len(row_tiles), len(column_tiles)), dtype=bool)
    open_cell[over_bay] = True
    retained: list[IndexArray] = []
    cut: list[IndexArray] = []
    materials: list[str] = []
    for i, j in np.ndindex(open_cell.shape):
        cell = grid_triangles(index[i : i + 2, j : j + 2])
        if open_cell[i, j]:
            cut.append(cell)
        else:
            retained.append(cell)
            materials += [names[i][j]] * len(cell)
    return _SkinCells(
        points.reshape(-1, 3), index[-1], np.concatenate(retained), np.concatenate(cut), materials
    )


def airframe() -> Shape:
    """The skin with the bay's cavity sunk into it, closed by the base: one surface."""
    cells = _skin_cells()
    count = len(cells.vertices)
    # The cells cut out of the skin, flattened, are the cavity's floor under the bay's liner.
    sunk = cells.vertices * [1.0, 1.0, 0.0] + np.array([0.0, 0.0, FLOOR_Z + 0.04])
    edges = boundary_edges(cells.retained)
    at_base = np.isin(edges, cells.base).all(axis=1)
    walls = wall_triangles(edges[~at_base], np.arange(count, 2 * count))
    base_centre = np.full(int(at_base.sum()), 2 * count)
    base = np.stack([edges[at_base, 1], edges[at_base, 0], base_centre], axis=-1)
    triangles = np.concatenate([cells.retained, cells.cut + count, walls, base])
    materials = [
        *cells.materials,
        *["grey_paint"] * (len(cells.cut) + len(walls)),
        *["ceramic_grey"] * len(base),
    ]
    vertices = np.concatenate([cells.vertices, sunk, [[BASE_X, 0.0, 0.0]]])
    used, renumbered = np.unique(triangles, return_inverse=True)
    return closed(vertices[used], renumbered.reshape(-1, 3), np.array(materials))
