"""Small equipment that more than one craft carries: nozzles, star trackers, antennas, panels."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from tools.spacecraft_models.shapes import Shape, box, closed, lathe, rod, slab, tube


def bell(length: float, throat: float, mouth: float, segments: int, rings: int) -> Shape:
    """A thruster's bell from its root at the origin to its mouth at x = `length`, all [m].

    segments, rings : of the mesh, around and along
    It is hollow down to a tenth of its length; the wall is a twelfth of the mouth's radius.
    """
    wall = mouth / 12.0
    rise = np.linspace(0.0, 1.0, rings + 1)[1:]
    # A quarter sine from throat to mouth: steep at the root, flat at the lip, as bells are.
    radius = throat + (mouth - throat) * np.sin(0.5 * np.pi * rise)
    outside = [(length * s, r) for s, r in zip(rise, radius, strict=True)]
    inside = [(x, r - wall) for x, r in reversed(outside)]
    floor = [(0.1 * length, 0.5 * throat), (0.1 * length, 0.0)]
    profile = [(0.0, 0.0), (0.0, throat), *outside, *inside, *floor]
    outer_bands = 1 + len(outside)
    materials = ["titanium"] * outer_bands + ["nozzle_inside"] * (len(profile) - 1 - outer_bands)
    return lathe(materials, profile, segments)


def star_tracker() -> list[Shape]:
    """A star tracker that looks along +x from a foot at the origin, 0.33 m tall."""
    cup = [(0.17, 0.0), (0.17, 0.035), (0.33, 0.075), (0.33, 0.070), (0.19, 0.030), (0.19, 0.0)]
    materials = ["grey_paint", "grey_paint", "black_paint", "black_paint", "lens_glass"]
    return [
        box("white_paint", (0.18, 0.16, 0.16), (0.085, 0.0, 0.0)),
        lathe(materials, cup, 24),
    ]


def helix_antenna(length: float = 0.24, radius: float = 0.035) -> list[Shape]:
    """A helix antenna under a white radome, along +x from a foot at the origin [m]."""
    polar = np.linspace(0.0, 0.5 * np.pi, 6)
    dome = [(length - radius + radius * np.sin(p), radius * np.cos(p)) for p in polar[:-1]]
    return [
        rod("aluminium", (-0.02, 0.0, 0.0), (0.015, 0.0, 0.0), 2.0 * radius, 24),
        lathe("white_paint", [(0.0, 0.0), (0.0, radius), *dome, (length, 0.0)], 24),
    ]


def patch_antenna(side: float) -> list[Shape]:
    """A square patch antenna facing +x, its foot at the origin [m]."""
    return [
        box("aluminium", (0.03, side, side), (0.0, 0.0, 0.0)),
        box("white_paint", (0.012, 0.86 * side, 0.86 * side), (0.017, 0.0, 0.0)),
    ]


def seated(shapes: Sequence[Shape], x: float, azimuth: float, radius: float) -> list[Shape]:
    """Shapes that stand along +x from the origin, put upright on a cylinder about the x axis.

    x : station [m]; radius : of the cylinder [m]
    azimuth : 0 at the top (-z), positive towards starboard (+y) [rad]
    Their +z comes to lie along the body's +x.
    """
    outward = np.array([0.0, np.sin(azimuth), -np.cos(azimuth)])
    forward = np.array([1.0, 0.0, 0.0])
    turn = Rotation.from_matrix(np.stack([outward, np.cross(forward, outward), forward], axis=1))
    return [shape.turned(turn).moved([x, 0.0, 0.0] + radius * outward) for shape in shapes]


def solar_cells(
    x: tuple[float, float], y: tuple[float, float], grid: tuple[int, int], gap: float
) -> Shape:
    """Cells as thin blocks on a plate whose sunward face is z = 0; they stand 3 mm proud of it.

    x, y : extent of the field [m]; grid : cells along x and along y
    gap : width of the strip of bare plate between cells [m]
    """
    (rows, columns), proud, sunk = grid, -0.003, 0.002
    pitch_x, pitch_y = (x[1] - x[0]) / rows, (y[1] - y[0]) / columns
    cell = box("solar_cell", (pitch_x - gap, pitch_y - gap, sunk - proud))
    centres = np.array(
        [
            [x[0] + (i + 0.5) * pitch_x, y[0] + (j + 0.5) * pitch_y, 0.5 * (sunk + proud)]
            for i in range(rows)
            for j in range(columns)
        ]
    )
    vertices = (centres[:, None] + cell.vertices).reshape(-1, 3)
    first = len(cell.vertices) * np.arange(len(centres))
    triangles = (first[:, None, None] + cell.triangles).reshape(-1, 3)
    return closed(vertices, triangles, "solar_cell")


def framed_panel(
    x: tuple[float, float], y: tuple[float, float], grid: tuple[int, int], thickness: float
) -> list[Shape]:
    """A solar panel in the plane z = 0, cells towards -z, a raised frame around them.

    x, y : outer extent [m]; grid : cells along x and y; thickness : of the plate [m]
    """
    width = min(0.02, 0.03 * (y[1] - y[0]))
    size_x, size_y = x[1] - x[0], y[1] - y[0]
    centre_x, centre_y = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])
    bar_z, bar_height = 0.5 * thickness, thickness + 0.5 * width
    # The plate ends inside its frame, so that no two faces lie in one plane.
    inset = 0.5 * width
    shapes = [
        slab(
            ("panel_grid", "white_paint", "white_paint"),
            (x[0] + inset, x[1] - inset),
            (y[0] + inset, y[1] - inset),
            thickness,
        )
    ]
    for side in (-1.0, 1.0):
        shapes += [
            box(
                "aluminium",
                (size_x, width, bar_height),
                (centre_x, centre_y + side * 0.5 * (size_y - width), bar_z),
            ),
            box(
                "aluminium",
                (width, size_y - 2.0 * width, 0.9 * bar_height),
                (centre_x + side * 0.5 * (size_x - width), centre_y, bar_z),
            ),
        ]
    margin = 1.6 * width
    field_x, field_y = (x[0] + margin, x[1] - margin), (y[0] + margin, y[1] - margin)
    gap = 0.05 * (field_y[1] - field_y[0]) / grid[1]
    return [*shapes, solar_cells(field_x, field_y, grid, gap)]


def panel_row(
    x: tuple[float, float],
    starts: Sequence[float],
    width: float,
    grid: tuple[int, int],
    thickness: float,
) -> list[Shape]:
    """Framed panels side by side along y, the middle of their plates in the plane z = 0.

    x : outer extent of all [m]; starts : of each along y [m]; width : of each [m]
    grid, thickness : as of ``framed_panel``
    """
    lift = (0.0, 0.0, -0.5 * thickness)
    return [
        shape.moved(lift)
        for start in starts
        for shape in framed_panel(x, (start, start + width), grid, thickness)
    ]


def hinge_line(x: Sequence[float], length: float, radius: float) -> list[Shape]:
    """Hinge knuckles about the x axis, centred at each `x` [m]."""
    return [
        tube("aluminium", (at - 0.5 * length, at + 0.5 * length), (0.4 * radius, radius), 12)
        for at in x
    ]
