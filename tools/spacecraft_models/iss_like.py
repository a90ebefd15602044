"""A station after the ISS: a 100 m truss with eight pairs of thin solar wings, radiators, modules.

The body frame's origin is the middle of the truss, which lies along y. Modules hang below it along
x. Each side's outer truss with its four pairs of wings turns as one about the truss (the alpha
drive); the wings are stored with their cells up (-z).
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from tools.spacecraft_models.fittings import solar_cells
from tools.spacecraft_models.generated_model import GeneratedModel, Joint, Part, Vec3
from tools.spacecraft_models.shapes import Shape, box, lathe, rod, shell, tube
from tools.spacecraft_models.trusses import boom, chain

TRUSS_HALF = 50.0  # [m]
SECTION_HALF = 1.9  # of the truss [m]
DRIVE_Y = 22.4  # the alpha drive's plane [m]
WING_STATIONS = (30.4, 44.6)  # along y [m]
WING_REACH = (4.0, 37.0)  # from the truss along x [m]
BLANKET_Y = (0.7, 5.3)  # from the wing's mast [m]
FOLDS, FOLD_HEIGHT = 72, 0.03  # of a blanket; height of a fold's ridge [m]
RADIATOR_Y, RADIATOR_REACH = 13.5, 26.0  # [m]
MODULE_Z, MODULE_RADIUS = 4.6, 2.2  # [m]

DESCRIPTION = (
    "Space station: truss of 100 m along y, eight pairs of solar wings of 33 m on two alpha "
    "drives, two turning radiators, pressurised modules below the truss. Origin in the middle of "
    "the truss."
)
SOURCE = (
    "Shaped by hand after the publicly described layout of the International Space Station. "
    "Outline, numbers, details and finishes are our own approximation, not agency data. Apache-2.0."
)

_SQUARE = [(s * SECTION_HALF, t * SECTION_HALF) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
_MAST = [(0.30 * np.cos(a), 0.30 * np.sin(a)) for a in np.radians([90.0, 210.0, 330.0])]
_X_FROM_Y = Rotation.from_euler("z", -90.0, degrees=True)  # turns what lies along +y to +x


def _zigzag(
    materials: tuple[str, str, str],
    strip: str,
    x: tuple[float, float],
    y: tuple[float, float],
    folds: int,
    height: float,
    thickness: float,
) -> Shape:
    """A thin sheet folded across x, facing -z; a strip 8 % of a fold wide runs along each crease.

    height : of the folds' ridges [m]; thickness : of the sheet [m]
    """
    step = (x[1] - x[0]) / folds
    rows, strips = [], []
    for fold in range(folds):
        low, high = (0.0, -height) if fold % 2 else (-height, 0.0)
        for share in (0.0, 0.92):
            rows.append((x[0] + (fold + share) * step, low + share * (high - low)))
            strips.append(share > 0.0)
    rows.append((x[1], high))
    front = np.array([[[at, across, z] for across in y] for at, z in rows])
    sheet = shell(materials, front, front + np.array([0.0, 0.0, thickness]))
    # The face's triangles come first, two to a row.
    face = np.where(np.repeat(strips, 2), strip, materials[0])
    worn = np.concatenate([face, sheet.materials[len(face) :]])
    return replace(sheet, materials=worn)


def _wing(side: float) -> list[Shape]:
    """A pair of blankets about the x axis, rooted in the truss; side : +1 forward, -1 aft."""
    start, end = WING_REACH
    mast = boom("aluminium", _MAST, (SECTION_HALF - 0.3, end), 24, (0.035, 0.022))
    shapes = [shape.turned(_X_FROM_Y) for shape in mast]
    for lean in (-1.0, 1.0):
        near, far = sorted((lean * BLANKET_Y[0], lean * BLANKET_Y[1]))
        middle, width = 0.5 * (near + far), far - near
        shapes.append(
            _zigzag(
                ("solar_cell", "kapton", "kapton"), "blanket_seam",
                (start + 0.15, end - 0.15), (near, far), FOLDS, FOLD_HEIGHT, 0.006,
            )
        )  # fmt: skip
        shapes += [
            box("white_paint", (0.42, width + 0.16, 0.34), (start, middle, 0.0)),
            box("aluminium", (0.30, width + 0.16, 0.22), (end, middle, 0.0)),
        ]
    shapes += [
        box("aluminium", (0.30, 2.0 * BLANKET_Y[0], 0.24), (start, 0.0, 0.0)),
        box("aluminium", (0.20, 2.0 * BLANKET_Y[0], 0.16), (end, 0.0, 0.0)),
        rod("white_paint", (SECTION_HALF - 0.2, 0.0, 0.0), (start - 0.1, 0.0, 0.0), 0.45, 24),
    ]
    turn = Rotation.from_euler("z", 0.0 if side > 0.0 else 180.0, degrees=True)
    return [shape.turned(turn) for shape in shapes]


def _outer_truss(side: float) -> tuple[Part, Joint]:
    """One side beyond the alpha drive: truss, four pairs of wings, thin radiators."""
    ends = DRIVE_Y + 1.0, TRUSS_HALF - 0.1
    shapes = boom("aluminium", _SQUARE, ends, 7, (0.11, 0.07), 8)
    shapes += [rod("white_paint", (0, DRIVE_Y + 0.2, 0), (0, ends[0] + 0.3, 0), 1.9, 40)]
    for station in WING_STATIONS:
        shapes += [
            box("white_paint", (2.6, 2.4, 2.6), (0.0, station, 0.0)),
            box("gold_foil", (1.6, 1.2, 2.2), (0.0, station + 2.1, 0.2)),
            box("white_paint", (2.0, 1.3, 1.2), (0.2, station - 2.2, -0.9)),
            *(
                box("aluminium", (2.0 * SECTION_HALF, 0.4, 0.4), (0.0, station, z))
                for z in (-1.1, 1.1)
            ),
        ]
        for way in (1.0, -1.0):
            shapes += [shape.moved((0.0, station, 0.0)) for shape in _wing(way)]
        # The drives' own radiator: a thin accordion below the truss.
        hanging = _zigzag(
            ("radiator_white",) * 3, "radiator_white", (2.0, 12.0), (-1.5, 1.5), 8, 0.12, 0.03
        ).turned(Rotation.from_euler("y", -90.0, degrees=True))
        shapes += [hanging.moved((0.0, station, 0.0))]
    name = "right" if side > 0.0 else "left"
    if side < 0.0:
        shapes = [shape.mirrored() for shape in shapes]
    origin = (0.0, side * DRIVE_Y, 0.0)
    part = Part(
        name=f"outer_truss_{name}",
        shapes=tuple(shape.moved((0.0, -side * DRIVE_Y, 0.0)) for shape in shapes),
        origin_body=origin,
    )
    joint = Joint(
        name=f"alpha_{name}",
        part=part.name,
        axis_body=(0.0, 1.0, 0.0),
        origin_body=origin,
        angles=(-np.pi, np.pi),
        keypoints=(*(tip for tip in _wing_tips() if tip.endswith(name)), f"truss_end_{name}"),
        sunward_body=(0.0, 0.0, -1.0),
    )
    return part, joint


def _wing_tips() -> dict[str, Vec3]:
    """The middle of each wing's end bar, counted from the inner wings outward."""
    return {
        f"wing_tip_{number}_{end}_{side}": (way * (WING_REACH[1] + 0.10), sign * station, 0.0)
        for side, sign in (("left", -1.0), ("right", 1.0))
        for number, station in enumerate(WING_STATIONS, 1)
        for end, way in (("forward", 1.0), ("aft", -1.0))
    }  # fmt: skip


def _inner_truss() -> Part:
    """The fixed truss between the alpha drives, with the boxes it carries."""
    shapes = boom("aluminium", _SQUARE, (-DRIVE_Y + 1.0, DRIVE_Y - 1.0), 12, (0.11, 0.07), 8)
    for side in (-1.0, 1.0):
        along = Rotation.from_euler("z", side * 90.0, degrees=True)
        shapes += [
            tube("white_paint", (DRIVE_Y - 1.3, DRIVE_Y - 0.2), (1.2, 1.9), 40).turned(along),
            tube("anodised_dark", (DRIVE_Y - 0.9, DRIVE_Y + 0.1), (0.9, 1.5), 40).turned(along),
            box("white_paint", (2.4, 3.2, 2.4), (0.0, side * 4.2, 0.0)),
            box("gold_foil", (1.8, 2.2, 1.6), (0.1, side * 8.4, -0.4)),
            box("white_paint", (2.8, 2.6, 2.6), (-0.2, side * RADIATOR_Y, 0.0)),
            box("silver_foil", (1.6, 2.4, 1.8), (0.3, side * 18.0, 0.3)),
        ]  # fmt: skip
        # Antenna dishes and stowage on the upper face.
        dish = lathe(
            ["white_paint"] * 3 + ["grey_paint"] * 2,
            [(0.0, 0.0), (0.06, 0.45), (0.26, 0.90), (0.28, 0.88), (0.09, 0.44), (0.03, 0.0)], 40,
        ).turned(Rotation.from_euler("y", 90.0, degrees=True))  # fmt: skip
        shapes += [
            dish.moved((0.6, side * 2.3, -4.2)),
            rod("grey_paint", (0.6, side * 2.3, -4.215), (0.6, side * 2.3, -1.75), 0.06, 12),
        ]
    # A rail car and its arm.
    shapes += [
        box("white_paint", (0.8, 3.2, 2.6), (SECTION_HALF + 0.5, -6.0, 0.0)),
        *chain("white_paint",
               ((2.9, -6.0, 0.2), (4.4, -6.0, -1.2), (9.6, -7.4, -6.2), (15.0, -5.2, -2.4),
                (15.8, -5.0, -1.4)), 0.19, 16),
    ]  # fmt: skip
    return Part(name="inner_truss", shapes=tuple(shapes))


def _radiator(side: float) -> tuple[Part, Joint]:
    """Three accordions of panels aft of the truss, on a rotary joint; shapes about the joint."""
    shapes = [
        rod("white_paint", (0.0, -4.9, 0.0), (0.0, 4.9, 0.0), 0.22, 20),
        box("aluminium", (0.6, 1.0, 1.6), (0.7, 0.0, 0.0)),
    ]
    for lane in (-3.4, 0.0, 3.4):
        sheet = _zigzag(
            ("radiator_white",) * 3, "aluminium",
            (1.4, RADIATOR_REACH - SECTION_HALF - 0.9), (lane - 1.6, lane + 1.6), 8, 0.35, 0.05,
        )  # fmt: skip
        shapes += [
            sheet.turned(Rotation.from_euler("z", 180.0, degrees=True)),
            *(rod("aluminium", (-0.1, lane + y, 0.0), (-1.5, lane + y, -0.15), 0.05, 8)
              for y in (-1.2, 1.2)),
        ]  # fmt: skip
    name = "right" if side > 0.0 else "left"
    origin = (-SECTION_HALF - 0.9, side * RADIATOR_Y, 0.0)
    part = Part(name=f"radiator_{name}", shapes=tuple(shapes), origin_body=origin)
    joint = Joint(
        name=part.name,
        part=part.name,
        axis_body=(0.0, 1.0, 0.0),
        origin_body=origin,
        # Positive swings it down, where the modules and their wings are.
        angles=(-np.radians(105.0), np.radians(8.0)),
    )
    return part, joint


def _module(x: tuple[float, float], radius: float, material: str, ring: str) -> list[Shape]:
    """A pressurised module along x, ends tapered, with rings where it joins the next."""
    x0, x1 = x
    taper = min(0.9, 0.2 * (x1 - x0))
    neck = 0.62 * radius
    profile = [
        (x0, 0.0), (x0, neck), (x0 + 0.25, neck), (x0 + taper, radius), (x1 - taper, radius),
        (x1 - 0.25, neck), (x1, neck), (x1, 0.0),
    ]  # fmt: skip
    worn = [ring, ring, material, material, material, ring, ring]
    belts = [
        tube(ring, (at - 0.06, at + 0.06), (radius - 0.1, radius + 0.05), 48)
        for at in np.linspace(x0 + taper + 0.2, x1 - taper - 0.2, max(2, round((x1 - x0) / 2.2)))
    ]
    return [lathe(worn, profile, 48), *belts]


def _modules() -> list[Part]:
    """The pressurised modules, forward ones first."""
    spans = {
        "node_forward": ((5.3, 11.4), MODULE_RADIUS, "beta_cloth", "aluminium"),
        "laboratory": ((-3.6, 5.2), MODULE_RADIUS, "beta_cloth", "aluminium"),
        "node_aft": ((-9.6, -3.7), MODULE_RADIUS, "beta_cloth", "aluminium"),
        "cargo_block": ((-22.6, -10.9), 2.05, "felt_white_worn", "grey_paint"),
        "service_module": ((-35.8, -22.7), 2.05, "felt_white", "grey_paint"),
    }
    shapes = {name: _module(*given) for name, given in spans.items()}
    shapes["node_forward"] += [
        rod("anodised_dark", (11.38, 0, 0), (12.6, 0, 0), 0.95, 40),
        tube("aluminium", (12.5, 12.9), (0.70, 0.90), 40),
    ]
    shapes["node_aft"] += [rod("black_paint", (-9.58, 0, 0), (-10.92, 0, 0), 0.85, 40)]
    shapes["laboratory"] += [
        rod("aluminium", (x, y, -1.6), (x * 0.8, 1.2 * y, -3.2), 0.12, 12)
        for x in (-1.6, 1.6)
        for y in (-1.3, 1.3)
    ]
    shapes["service_module"] += _small_wings(-29.0)
    parts = [
        Part(name=name, shapes=tuple(held), origin_body=(0.0, 0.0, MODULE_Z))
        for name, held in shapes.items()
    ]
    outward = {"laboratory_left": (12.6, -1.0), "laboratory_right": (7.4, 1.0)}
    for name, (length, side) in outward.items():
        turn = Rotation.from_euler("z", side * 90.0, degrees=True)
        held = _module((1.9, 1.9 + length), 2.15, "felt_white", "aluminium")
        if side < 0.0:  # the porch for experiments in the open
            held += [
                box("grey_paint", (4.6, 4.4, 1.2), (17.0, 0.0, 0.5)),
                *(box(name_, (0.9, 0.9, 1.0), (x, y, -0.55))
                  for name_, x, y in (("gold_foil", 15.6, 1.4), ("white_paint", 17.0, -1.4),
                                      ("silver_foil", 18.4, 1.2), ("white_paint", 15.8, -1.3))),
            ]  # fmt: skip
        parts.append(
            Part(
                name=name,
                shapes=tuple(shape.turned(turn) for shape in held),
                origin_body=(8.3, 0.0, MODULE_Z),
            )
        )
    return parts


def _small_wings(x: float) -> list[Shape]:
    """The service module's own two wings, thin plates with cells up."""
    shapes: list[Shape] = []
    for side in (-1.0, 1.0):
        near, far = sorted((side * 3.6, side * 14.4))
        shapes += [
            box("panel_grid", (3.3, far - near, 0.03), (x, 0.5 * (near + far), 0.0)),
            solar_cells((x - 1.6, x + 1.6), (near + 0.06, far - 0.06), (4, 9), 0.06).moved(
                (0.0, 0.0, -0.017)
            ),
            rod("grey_paint", (x, side * 1.95, 0.0), (x, side * 3.7, 0.0), 0.09, 12),
        ]
    return shapes


def iss_like() -> GeneratedModel:
    """The whole station."""
    outer = [_outer_truss(side) for side in (-1.0, 1.0)]
    radiators = [_radiator(side) for side in (-1.0, 1.0)]
    moving = [*outer, *radiators]
    return GeneratedModel(
        name="iss_like",
        description=DESCRIPTION,
        source=SOURCE,
        parts=(_inner_truss(), *_modules(), *(part for part, _ in moving)),
        joints=tuple(joint for _, joint in moving),
        keypoints={
            "docking_port_forward": (12.9, 0.0, MODULE_Z),
            "aft_end": (-35.8, 0.0, MODULE_Z),
            "truss_end_left": (0.0, -(TRUSS_HALF - 0.1), 0.0),
            "truss_end_right": (0.0, TRUSS_HALF - 0.1, 0.0),
            **_wing_tips(),
        },
    )
