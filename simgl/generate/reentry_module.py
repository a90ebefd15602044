"""The lifting body of Space Rider: skin, cargo bay, bay doors and body flaps.

The skin is one bicubic B-spline through planar control rings. The rings around the bay share
their upper control points, which makes the top exactly straight there: hinges can be straight
and closed doors continue the skin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from simgl.generate.craft import Joint, Part
from simgl.generate.fittings import bell, hinge_line, patch_antenna
from simgl.generate.shapes import (
    Floats,
    Ints,
    Shape,
    boundary_edges,
    box,
    closed,
    grid_triangles,
    handrail,
    lathe,
    loft,
    prism,
    rod,
    shell,
    sphere,
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
LINER_OUTSIDE = (0.612, 0.512)
LINER_INSIDE = (0.60, 0.50)
FLOOR_Z = -0.2  # the bay's floor [m]: 0.8 below the top of the skin
DOOR_ANGLE = np.radians(110.0)
HINGE_Y = 0.538  # [m]

FLAP_HINGE = (-0.705, 0.50, 0.845)  # starboard [m]
FLAP_ANGLE = np.radians(8.0)


def _section_controls(half_width: float, top: float, belly: float, roundness: float) -> Floats:
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
def _control_net() -> Floats:
    """(rings, 16, 3) control points [m]."""
    sections = [
        np.column_stack([np.full(SECTION_CONTROLS, x), _section_controls(*shape)])
        for x, *shape in RINGS
    ]
    return np.stack(sections)


def skin(lengthwise: Floats, around: Floats) -> Floats:
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
    points: Floats = np.einsum("ri,cj,ijk->rck", along, wrapped, controls)
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


def upper_skin(x: float, y: float, depth: float = 0.0) -> Floats:
    """(3,) the point `depth` under the upper skin at (x, y) [m]."""
    point = skin(np.array([station(x)]), np.array([_around_at(x, abs(y))]))[0, 0]
    return np.array([point[0], np.copysign(point[1], y), point[2] + depth])


def _ruled(
    stops: Sequence[float], gaps: Sequence[float], cells: Sequence[int]
) -> tuple[Floats, Ints]:
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


def _parameter_gap(points: Floats, step: float) -> float:
    """A gap of 12 mm as a step of the parameter, from (k, 2, 3) points `step` apart in it."""
    lengths = np.linalg.norm(points[:, 1] - points[:, 0], axis=-1)
    return 0.012 * step / float(lengths.mean())


def _rows() -> tuple[Floats, Ints]:
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


def _columns() -> tuple[Floats, Ints]:
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


def _skin_materials(x: Floats, row_tiles: Ints, column_tiles: Ints) -> list[list[str]]:
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

    vertices: Floats
    base: Ints
    kept: Ints
    cut: Ints
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
    kept: list[Ints] = []
    cut: list[Ints] = []
    materials: list[str] = []
    for i, j in np.ndindex(open_cell.shape):
        cell = grid_triangles(index[i : i + 2, j : j + 2])
        if open_cell[i, j]:
            cut.append(cell)
        else:
            kept.append(cell)
            materials += [names[i][j]] * len(cell)
    return _SkinCells(
        points.reshape(-1, 3), index[-1], np.concatenate(kept), np.concatenate(cut), materials
    )


def _airframe() -> Shape:
    """The skin with the bay's cavity sunk into it, closed by the base: one surface."""
    cells = _skin_cells()
    count = len(cells.vertices)
    # The cells cut out of the skin, flattened, are the cavity's floor under the bay's liner.
    sunk = cells.vertices * [1.0, 1.0, 0.0] + np.array([0.0, 0.0, FLOOR_Z + 0.04])
    edges = boundary_edges(cells.kept)
    at_base = np.isin(edges, cells.base).all(axis=1)
    walls = wall_triangles(edges[~at_base], np.arange(count, 2 * count))
    base_centre = np.full(int(at_base.sum()), 2 * count)
    base = np.stack([edges[at_base, 1], edges[at_base, 0], base_centre], axis=-1)
    triangles = np.concatenate([cells.kept, cells.cut + count, walls, base])
    materials = [
        *cells.materials,
        *["grey_paint"] * (len(cells.cut) + len(walls)),
        *["ceramic_grey"] * len(base),
    ]
    vertices = np.concatenate([cells.vertices, sunk, [[BASE_X, 0.0, 0.0]]])
    used, renumbered = np.unique(triangles, return_inverse=True)
    return closed(vertices[used], renumbered.reshape(-1, 3), np.array(materials))


def _both(shapes: Sequence[Shape]) -> list[Shape]:
    """Starboard shapes and their port images."""
    return [*shapes, *(shape.mirrored() for shape in shapes)]


def _hinge(side: float) -> tuple[float, float, float]:
    """A door's hinge: just outside the skin beside the opening; side +1 is starboard [m]."""
    return BAY_X, side * HINGE_Y, float(upper_skin(BAY_X, HINGE_Y)[2]) - 0.014


def body() -> Part:
    """The airframe with what is fixed to its skin and base."""
    knuckles = [shape.moved(_hinge(1.0)) for shape in hinge_line((-0.5, -0.1, 0.3), 0.12, 0.014)]
    rails = [
        piece
        for y, front, rear in ((0.40, 1.85, 1.35), (0.45, -0.20, -0.60))
        for piece in handrail(
            "aluminium",
            upper_skin(front, y, 0.004),
            upper_skin(rear, y, 0.004),
            (0.0, 0.0, -0.07),
        )
    ]
    jets = [
        bell(0.09, 0.018, 0.045, 12, 3)
        .turned(Rotation.from_euler("z", 180.0, degrees=True))
        .moved((BASE_X + 0.005, y, z))
        for y, z in ((0.52, -0.62), (0.64, -0.58), (0.86, 0.10), (0.86, 0.24))
    ]
    feed = rod("aluminium", (BASE_X + 0.01, 0.34, 0.74), (-0.78, 0.34, 0.74), 0.03, 16)
    antennas = [
        shape.turned(Rotation.from_euler("y", 90.0, degrees=True)).moved(upper_skin(x, 0.0, 0.004))
        for x, side in ((1.66, 0.14), (-0.30, 0.16))
        for shape in patch_antenna(side)
    ]
    fixed = _both(
        [
            *knuckles,
            *rails,
            *jets,
            feed,
        ]
    )
    return Part(name="body", shapes=(_airframe(), *fixed, *antennas))


def _rectangle(half: tuple[float, float]) -> Floats:
    """(40, 2) points (x, y) round a rectangle about the bay's centre, corners included [m]."""
    ticks = np.linspace(-1.0, 1.0, 11)[:-1]
    side = np.column_stack([ticks, -np.ones(10)])
    sides = [side]
    for _ in range(3):
        side = side @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        sides.append(side)
    return np.concatenate(sides) * half + [BAY_X, 0.0]


def _liner() -> Shape:
    """The tub that lines the bay, its rim 40 mm under the skin as a seat for the doors."""
    rings = []
    for half, bottom in ((LINER_OUTSIDE, FLOOR_Z + 0.02), (LINER_INSIDE, FLOOR_Z)):
        flat = _rectangle(half)
        rim = [upper_skin(BAY_X, float(y), 0.04)[2] for _, y in flat]
        middle = np.array([[BAY_X, 0.0, bottom]])
        low = np.column_stack([flat, np.full(len(flat), bottom)])
        rings.append([middle, low, np.column_stack([flat, rim])])
    outside, inside = rings
    materials = ["grey_paint", "grey_paint", "aluminium", "beta_cloth", "white_paint"]
    return loft(materials, [*outside, *reversed(inside)])


def _on_floor(
    material: str, size: tuple[float, float, float], x: float, y: float, base: float = 0.0
) -> Shape:
    """A box on the bay's floor, or `base` above it, sunk by 4 mm; x from the bay's centre [m]."""
    return box(material, size, (BAY_X + x, y, FLOOR_Z - base + 0.004 - 0.5 * size[2]))


def cargo_bay() -> Part:
    """The lined bay and its payloads; the middle of the floor stays clear."""
    half_x, half_y = LINER_INSIDE
    frames = [
        box("aluminium", (0.035, 0.05, 0.64), (BAY_X + x, half_y - 0.02, FLOOR_Z - 0.316))
        for x in (-0.36, 0.0, 0.36)
    ]
    end_frames = [
        box("aluminium", (0.05, 0.035, 0.66), (BAY_X + side * (half_x - 0.02), 0.22, -0.526))
        for side in (-1.0, 1.0)
    ]
    stringer = box("anodised_dark", (1.204, 0.03, 0.045), (BAY_X, half_y - 0.012, -0.62))
    rails = [_on_floor("anodised_dark", (1.16, 0.04, 0.03), 0.0, 0.16)]
    tank = [
        sphere("silver_foil", 0.16, 32).moved((BAY_X - 0.36, 0.28, FLOOR_Z - 0.19)),
        rod(
            "aluminium",
            (BAY_X - 0.36, 0.28, FLOOR_Z + 0.004),
            (BAY_X - 0.36, 0.28, FLOOR_Z - 0.06),
            0.11,
            32,
        ),
    ]
    payloads = [
        _on_floor("gold_foil", (0.40, 0.30, 0.36), 0.32, 0.28),
        _on_floor("aluminium", (0.30, 0.20, 0.02), 0.32, 0.28, 0.36),
        _on_floor("white_paint", (0.44, 0.28, 0.24), 0.30, -0.30),
        _on_floor("signal_red", (0.10, 0.10, 0.05), 0.42, -0.30, 0.24),
        _on_floor("black_paint", (0.16, 0.18, 0.07), 0.24, -0.30, 0.24),
        _on_floor("anodised_dark", (0.34, 0.30, 0.30), -0.34, -0.28),
        _on_floor("circuit_green", (0.26, 0.22, 0.015), -0.34, -0.28, 0.30),
        *tank,
    ]
    fixed = _both([*frames, *end_frames, stringer, *rails])
    return Part(name="cargo_bay", shapes=(_liner(), *fixed, *payloads))


def _starboard_door() -> list[Shape]:
    """The starboard door closed, in body axes about the bay's middle hinge point."""
    x = BAY_X + np.linspace(-0.614, 0.614, 13)
    y = np.linspace(0.004, 0.514, 13)
    front = np.array([[upper_skin(float(a), float(b)) for b in y] for a in x])
    back = np.array([[upper_skin(float(a), float(b), 0.030) for b in y] for a in x])
    panel = shell(("felt_white", "silver_foil", "aluminium"), front, back)
    stiffeners = [_door_bar(BAY_X + at) for at in (-0.40, 0.0, 0.40)]
    hinge_z = _hinge(1.0)[2]
    arms = [
        box("aluminium", (0.06, 0.050, 0.014), (BAY_X + at, 0.515, hinge_z)) for at in (-0.3, 0.1)
    ]
    knuckles = [
        shape.moved((BAY_X, HINGE_Y, hinge_z)) for shape in hinge_line((-0.3, 0.1), 0.12, 0.013)
    ]
    return [panel, *stiffeners, *arms, *knuckles]


def _door_bar(x: float) -> Shape:
    """A bar 30 mm wide that follows the door's inner face and stands 26 mm proud of it."""
    section = np.array([[-0.015, 0.0], [0.015, 0.0], [0.015, 0.030], [-0.015, 0.030]])
    offsets = np.insert(section, 1, 0.0, axis=1)
    inner_face = [upper_skin(x, float(y), 0.026) for y in np.linspace(0.04, 0.46, 8)]
    rings = [point + offsets for point in inner_face]
    ends = rings[0].mean(axis=0, keepdims=True), rings[-1].mean(axis=0, keepdims=True)
    return loft("anodised_dark", [ends[0], *rings, ends[1]])


def bay_doors() -> tuple[list[Part], list[Joint]]:
    """Both doors, open, with their hinges."""
    parts, joints = [], []
    starboard = _starboard_door()
    for name, side in (("bay_door_left", -1.0), ("bay_door_right", 1.0)):
        hinge = _hinge(side)
        shapes = starboard if side > 0.0 else [shape.mirrored() for shape in starboard]
        parts.append(
            Part(
                name=name,
                shapes=tuple(shape.moved(-np.array(hinge)) for shape in shapes),
                origin_body=hinge,
                R_body_from_part=Rotation.from_rotvec([side * DOOR_ANGLE, 0.0, 0.0]),
            )
        )
        joints.append(
            Joint(
                name=name,
                part=name,
                axis_body=(side, 0.0, 0.0),  # positive opens
                origin_body=hinge,
                angles=(-DOOR_ANGLE, np.radians(40.0)),
            )
        )
    return parts, joints


def body_flaps() -> tuple[list[Part], list[Joint]]:
    """Both flaps under the tail, stored a little way down, with their hinges."""
    outline = [
        (0.0, -0.045), (-0.05, -0.05), (-0.70, -0.012), (-0.715, 0.02), (-0.70, 0.05),
        (-0.02, 0.05), (0.0, 0.04),
    ]  # fmt: skip
    surface = prism("ceramic_black", outline, 0.74)
    horns = [box("titanium", (0.10, 0.03, 0.06), (-0.08, y, -0.055)) for y in (-0.2, 0.2)]
    shaft = rod("titanium", (0.0, -0.40, 0.0), (0.0, 0.40, 0.0), 0.022, 16)
    parts, joints = [], []
    for name, side in (("body_flap_left", -1.0), ("body_flap_right", 1.0)):
        origin = FLAP_HINGE[0], side * FLAP_HINGE[1], FLAP_HINGE[2]
        parts.append(
            Part(
                name=name,
                shapes=(surface, shaft, *horns),
                origin_body=origin,
                R_body_from_part=Rotation.from_rotvec([0.0, FLAP_ANGLE, 0.0]),
            )
        )
        joints.append(
            Joint(
                name=name,
                part=name,
                axis_body=(0.0, 1.0, 0.0),  # positive lowers the trailing edge
                origin_body=origin,
                angles=(np.radians(-10.0), np.radians(20.0)),
            )
        )
    return parts, joints


def base_ring() -> Shape:
    """The separation ring on the base."""
    profile = [(-0.69, 0.60), (-0.69, 0.76), (-0.73, 0.76), (-0.73, 0.60)]
    return lathe("aluminium", profile, 96, torus=True)
