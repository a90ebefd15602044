"""Calibration targets: grey steps, circles with known centres, a wedge, a mirror.

The boards and the mirror face +x with their top towards -z, the origin in the middle of the face;
who looks at the face has +y on the left.
"""

import numpy as np

from tools.spacecraft_models.generated_model import GeneratedModel, Part, Vec3
from tools.spacecraft_models.materials import GREY_STEPS
from tools.spacecraft_models.shapes import Shape, box, lathe, prism, rod, tube

SOURCE = "Our own design. Apache-2.0."

STEP_COLUMNS, STEP_PITCH, STEP_SIDE = 4, 0.20, 0.18  # of the grey steps [m]
STEPS_PROUD = 0.004  # the steps stand this far before the board [m]

CIRCLE_ROWS, CIRCLE_COLUMNS, CIRCLE_PITCH = 5, 7, 0.12  # [m]
CIRCLE_RADIUS = 0.036  # [m]
CIRCLES_PROUD = 0.001  # [m]
# Rings instead of discs, row and column: they tell which way round the board is seen.
RINGS = ((0, 0), (0, 2), (4, 0))

WEDGE_HYPOTENUSE, WEDGE_WIDTH = 1.0, 1.0  # [m]
WEDGE_ANGLE = np.radians(30.0)  # of the long face to the base; the short one has 60 degrees

MIRROR_SIDE, MIRROR_THICKNESS = 1.0, 0.012  # [m]


def _facing(row: int, column: int, grid: tuple[int, int], pitch: float) -> tuple[float, float]:
    """y and z of a place on a board, rows from the top, columns from the onlooker's left [m]."""
    rows, columns = grid
    y = (0.5 * (columns - 1) - column) * pitch
    z = (row - 0.5 * (rows - 1)) * pitch
    return y, z


def _board(material: str, width: float, height: float) -> list[Shape]:
    """A board whose face lies in x = 0, 15 mm thick, on two bars [m]."""
    bars = [
        box("aluminium_machined", (0.03, 0.04, height - 0.06), (-0.028, side * 0.3 * width, 0.0))
        for side in (-1.0, 1.0)
    ]
    return [box(material, (0.015, width, height), (-0.0075, 0.0, 0.0)), *bars]


def _corners(width: float, height: float) -> dict[str, Vec3]:
    """The corners of a face in x = 0 as its onlooker names them [m]."""
    return {
        f"corner_{vertical}_{side}": (0.0, sign_y * 0.5 * width, sign_z * 0.5 * height)
        for vertical, sign_z in (("top", -1.0), ("bottom", 1.0))
        for side, sign_y in (("left", 1.0), ("right", -1.0))
    }


def calibration_board() -> GeneratedModel:
    """Twelve diffuse grey steps from 2 to 99 % on a black board."""
    grid = (len(GREY_STEPS) // STEP_COLUMNS, STEP_COLUMNS)
    width, height = 0.86, 0.66
    parts = [Part(name="board", shapes=tuple(_board("target_black", width, height)))]
    keypoints = _corners(width, height)
    for index, percent in enumerate(GREY_STEPS):
        y, z = _facing(*divmod(index, STEP_COLUMNS), grid, STEP_PITCH)
        depth = STEPS_PROUD + 0.002
        step = box(
            f"lambert_{percent:02d}",
            (depth, STEP_SIDE, STEP_SIDE),
            (STEPS_PROUD - 0.5 * depth, y, z),
        )
        parts.append(Part(name=f"step_{percent:02d}", shapes=(step,)))
        keypoints[f"step_{percent:02d}"] = (STEPS_PROUD, y, z)
    return GeneratedModel(
        name="calibration_board",
        description=(
            "Twelve ideal diffuse grey steps of 0.18 m, 2 to 99 % reflectance in all bands, rows "
            "from dark (top left) to bright (bottom right), on a black board of 0.86 x 0.66 m. "
            "Faces +x, top towards -z."
        ),
        source=SOURCE,
        parts=tuple(parts),
        joints=(),
        keypoints=keypoints,
    )


def marker_board() -> GeneratedModel:
    """Black discs and three rings on a white board."""
    grid = (CIRCLE_ROWS, CIRCLE_COLUMNS)
    width, height = 0.92, 0.68
    circles, keypoints = [], _corners(width, height)
    for row in range(CIRCLE_ROWS):
        for column in range(CIRCLE_COLUMNS):
            y, z = _facing(row, column, grid, CIRCLE_PITCH)
            if (row, column) in RINGS:
                inner = 0.45 * CIRCLE_RADIUS
                shape = tube("target_black", (-0.002, CIRCLES_PROUD), (inner, CIRCLE_RADIUS), 48)
                shape, front = shape.moved((0.0, y, z)), 0.0
            else:
                start, end = (-0.002, y, z), (CIRCLES_PROUD, y, z)
                shape, front = rod("target_black", start, end, CIRCLE_RADIUS, 48), CIRCLES_PROUD
            circles.append(shape)
            keypoints[f"circle_{row}_{column}"] = (front, y, z)
    return GeneratedModel(
        name="marker_board",
        description=(
            "Black circles of 72 mm on a white diffuse board of 0.92 x 0.68 m: 5 rows of 7, 0.12 m "
            "apart; three are rings, by which rows and columns are told. circle_ROW_COLUMN is the "
            "centre on the face, counted from the onlooker's top left. Faces +x, top towards -z."
        ),
        source=SOURCE,
        parts=(
            Part(name="board", shapes=tuple(_board("lambert_90", width, height))),
            Part(name="circles", shapes=tuple(circles)),
        ),
        joints=(),
        keypoints=keypoints,
    )


def wedge() -> GeneratedModel:
    """A right-angled wedge: base down, ridge along y, faces at 30 and 60 degrees to the base."""
    long, short = (WEDGE_HYPOTENUSE * f(WEDGE_ANGLE) for f in (np.cos, np.sin))
    ridge = long * np.cos(WEDGE_ANGLE), long * np.sin(WEDGE_ANGLE)  # behind the toe, above it
    toe, half = 0.5 * WEDGE_HYPOTENUSE, 0.5 * WEDGE_WIDTH
    base_z = 0.5 * ridge[1]
    top = (toe - ridge[0], base_z - ridge[1])
    outline = [(toe, base_z), top, (-toe, base_z)]
    faces = {
        "face_30": (0.5 * (toe + top[0]), 0.0, 0.5 * (base_z + top[1])),
        "face_60": (0.5 * (top[0] - toe), 0.0, 0.5 * (base_z + top[1])),
        "base": (0.0, 0.0, base_z),
    }
    edges = {
        f"{name}_{side}": (x, sign * half, z)
        for name, (x, z) in (("toe", outline[0]), ("ridge", top), ("heel", outline[2]))
        for side, sign in (("left", -1.0), ("right", 1.0))
    }
    return GeneratedModel(
        name="wedge",
        description=(
            "A diffuse grey wedge (45 %): base of 1 x 1 m towards +z, faces inclined by 30 deg "
            f"({long:.3f} m long, towards +x) and 60 deg ({short:.3f} m), which meet at a right "
            "angle in a ridge along y. Origin above the middle of the base at half height."
        ),
        source=SOURCE,
        parts=(Part(name="wedge", shapes=(prism("lambert_45", outline, WEDGE_WIDTH),)),),
        joints=(),
        keypoints=faces | edges,
    )


def mirror() -> GeneratedModel:
    """A square mirror in a black back shell."""
    half = 0.5 * MIRROR_SIDE
    sheet = box(
        "mirror", (MIRROR_THICKNESS, MIRROR_SIDE, MIRROR_SIDE), (-0.5 * MIRROR_THICKNESS, 0.0, 0.0)
    )
    rim = 0.02
    bars = [
        box("target_black", (0.03, rim, MIRROR_SIDE + 2.0 * rim),
            (-0.021, side * (half + 0.5 * rim - 0.002), 0.0))
        for side in (-1.0, 1.0)
    ] + [
        box("target_black", (0.029, MIRROR_SIDE - 0.01, rim),
            (-0.021, 0.0, side * (half + 0.5 * rim - 0.002)))
        for side in (-1.0, 1.0)
    ]  # fmt: skip
    back = box("target_black", (0.02, MIRROR_SIDE - 0.001, MIRROR_SIDE - 0.001), (-0.0225, 0, 0))
    hub = lathe("aluminium_machined", [(-0.08, 0.0), (-0.08, 0.1), (-0.03, 0.1), (-0.03, 0.0)], 48)
    return GeneratedModel(
        name="mirror",
        description=(
            "A plane silver mirror of 1 x 1 m (finish mirror), the source study's calibration "
            "plane, in a black frame behind its face. Faces +x, top towards -z."
        ),
        source=SOURCE,
        parts=(
            Part(name="mirror", shapes=(sheet,)),
            Part(name="mount", shapes=(*bars, back, hub)),
        ),
        joints=(),
        keypoints={"centre": (0.0, 0.0, 0.0), **_corners(MIRROR_SIDE, MIRROR_SIDE)},
    )
