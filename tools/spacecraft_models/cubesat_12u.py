"""A 12U CubeSat with a docking port and a navigation camera on its front face.

The body measures 0.30 m along x, 0.29 m along y and 0.20 m along z, rails included; the body
frame's origin is its centre.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tools.spacecraft_models.fittings import bell, hinge_line, panel_row, solar_cells
from tools.spacecraft_models.generated_model import GeneratedModel, Joint, Part, Vec3, both_sides
from tools.spacecraft_models.shapes import Shape, box, lathe, rod, slab, sphere, tube

LENGTH, WIDTH, HEIGHT = 0.30, 0.29, 0.20  # along x, y, z [m]
RAIL = 0.010  # side of a corner rail [m]
SKIN = 0.004  # the side plates lie this far inside the rails' outer faces [m]
CAMERA = (-0.085, -0.035)  # y, z of the optical axis [m]
HOOD_X = 0.216  # the outermost point of the camera's hood [m]
PORT_Y = 0.060  # y of the docking port's axis, at z = 0 [m]
PANEL_WIDTH = 0.185  # of one leaf [m]
HINGE = (0.0, 0.5 * WIDTH + 0.006, -0.5 * HEIGHT + 0.008)  # starboard panel [m]

DESCRIPTION = (
    "12U CubeSat chaser: two deployed solar panels, camera and docking port on the front face. "
    "Body 0.30 x 0.29 x 0.20 m along x, y, z; origin at its centre."
)
SOURCE = (
    "Our own design with the volume and the corner rails that the public CubeSat Design "
    "Specification describes for the 12U class; it copies no flown satellite. Apache-2.0."
)


def _plate_with_cells(size: tuple[float, float], grid: tuple[int, int]) -> list[Shape]:
    """A board in the plane z = 0 with cells towards -z; size along x and y [m]."""
    half_x, half_y = 0.5 * size[0], 0.5 * size[1]
    edge = 0.006
    return [
        slab(("panel_grid",) * 3, (-half_x, half_x), (-half_y, half_y), 0.003),
        solar_cells((edge - half_x, half_x - edge), (edge - half_y, half_y - edge), grid, 0.003),
    ]


def _structure() -> list[Shape]:
    """The box, its corner rails and the frames round its ends."""
    core = (LENGTH - 0.016, WIDTH - 2.0 * SKIN, HEIGHT - 2.0 * SKIN)
    rail_y, rail_z = 0.5 * (WIDTH - RAIL), 0.5 * (HEIGHT - RAIL)
    shapes = [box("grey_paint", core)]
    shapes += [
        box("aluminium", (LENGTH, RAIL, RAIL), (0.0, y, z))
        for y in (-rail_y, rail_y)
        for z in (-rail_z, rail_z)
    ]
    for x in (-0.5 * LENGTH + 0.007, 0.5 * LENGTH - 0.007):
        shapes += [
            box("aluminium", (0.008, WIDTH - 2.0 * RAIL + 0.008, 0.012), (x, 0.0, side * 0.086))
            for side in (-1.0, 1.0)
        ]
        shapes += [
            box("aluminium", (0.004, 0.012, 0.164), (x, side * 0.131, 0.0)) for side in (-1.0, 1.0)
        ]
    return shapes


def _faces() -> list[Shape]:
    """Body-mounted cells above and below, equipment on the sides."""
    surface_z = 0.5 * HEIGHT - SKIN
    top = _plate_with_cells((0.26, 0.25), (5, 3))
    shapes = [shape.moved((0.0, 0.0, -surface_z - 0.002)) for shape in top]
    underside = Rotation.from_euler("x", 180.0, degrees=True)
    below = _plate_with_cells((0.15, 0.25), (3, 3))
    shapes += [shape.turned(underside).moved((-0.05, 0.0, surface_z + 0.002)) for shape in below]
    shapes += [
        box("aluminium", (0.084, 0.084, 0.008), (0.085, 0.055, surface_z + 0.002)),
        box("white_paint", (0.074, 0.074, 0.006), (0.085, 0.055, surface_z + 0.007)),
        box("black_paint", (0.03, 0.03, 0.01), (0.08, -0.06, surface_z + 0.003)),
    ]
    for side in (-1.0, 1.0):
        y = side * (0.5 * WIDTH - SKIN + 0.001)
        shapes += [
            box("gold_foil", (0.12, 0.008, 0.13), (-0.07, y, 0.012)),
            box("white_paint", (0.11, 0.006, 0.13), (0.065, y, 0.012)),
            box("anodised_dark", (0.03, 0.010, 0.03), (0.065, y, 0.012)),
        ]
    return shapes


def _front_fittings() -> list[Shape]:
    """A star tracker, a laser ranger and two lamps on the front face."""
    face = 0.5 * LENGTH - 0.008
    tracker = [(0.0, 0.0), (0.0, 0.020), (0.04, 0.024), (0.04, 0.021), (0.01, 0.016), (0.01, 0.0)]
    materials = ["black_paint"] * 4 + ["lens_glass"]
    shapes = [
        lathe(materials, tracker, 16).moved((face - 0.002, CAMERA[0], 0.048)),
        box("anodised_dark", (0.024, 0.030, 0.022), (face + 0.010, -0.030, 0.062)),
        rod(
            "lens_glass",
            (face + 0.010, -0.030, 0.062),
            (face + 0.024, -0.030, 0.062),
            0.008,
            16,
        ),
    ]
    shapes += [
        sphere("white_paint", 0.009, 10).moved((face + 0.002, y, -0.078)) for y in (-0.02, 0.12)
    ]
    return shapes


def _rear_fittings() -> list[Shape]:
    """Four cold-gas nozzles on a plate and the radio whips."""
    aft = Rotation.from_euler("z", 180.0, degrees=True)
    face = -0.5 * LENGTH + 0.008
    shapes = [box("anodised_dark", (0.014, 0.16, 0.10), (face - 0.004, 0.0, 0.0))]
    shapes += [
        bell(0.022, 0.004, 0.010, 10, 3).turned(aft).moved((face - 0.0108, y, z))
        for y in (-0.06, 0.06)
        for z in (-0.032, 0.032)
    ]
    for side in (-1.0, 1.0):
        root = np.array([face - 0.004, side * 0.115, 0.070])
        shapes += [
            box("white_paint", (0.014, 0.024, 0.024), root),
            rod("aluminium", root, root + np.array([-0.09, side * 0.02, 0.15]), 0.0016, 10),
        ]
    return shapes


def _body() -> Part:
    """Structure, side faces and the equipment that is neither camera nor port."""
    blocks = [
        rod("aluminium", (x - 0.018, side * 0.142, HINGE[2]),
            (x + 0.018, side * 0.142, HINGE[2]), 0.0055, 12)
        for side in (-1.0, 1.0)
        for x in (-0.09, 0.09)
    ]  # fmt: skip
    shapes = (*_structure(), *_faces(), *_front_fittings(), *_rear_fittings(), *blocks)
    return Part(name="body", shapes=shapes)


def _camera() -> Part:
    """A black lens barrel behind a conical hood, looking along +x."""
    foot = 0.5 * LENGTH - 0.010
    barrel = [
        (foot, 0.0), (foot, 0.030), (0.180, 0.030), (0.180, 0.033), (HOOD_X, 0.039),
        (HOOD_X, 0.0365), (0.184, 0.026), (0.184, 0.022), (0.1855, 0.018), (0.1875, 0.009),
        (0.188, 0.0),
    ]  # fmt: skip
    materials = ["black_paint"] * 7 + ["lens_glass"] * 3
    ring = tube("anodised_dark", (foot, 0.158), (0.028, 0.036), 28)
    place = (0.0, *CAMERA)
    shapes = (lathe(materials, barrel, 28).moved(place), ring.moved(place))
    return Part(name="camera", shapes=shapes)


def _docking_port() -> Part:
    """A soft-docking ring with three guide petals and a black target plate."""
    foot, rim = 0.5 * LENGTH - 0.010, 0.176
    petal = box("anodised_dark", (0.030, 0.022, 0.005), (0.185, 0.0, -0.0465))
    shapes = [
        tube("aluminium", (foot, rim), (0.046, 0.056), 30),
        tube("anodised_dark", (foot, 0.156), (0.052, 0.066), 30),
        rod("black_paint", (foot, 0.0, 0.0), (0.150, 0.0, 0.0), 0.047, 30),
        rod("white_paint", (0.148, 0.0, 0.0), (0.1525, 0.0, 0.0), 0.012, 16),
        rod("titanium", (0.148, 0.0, 0.0), (0.170, 0.0, 0.0), 0.004, 12),
    ]
    shapes += [
        petal.turned(Rotation.from_euler("x", angle, degrees=True)) for angle in (0, 120, 240)
    ]
    return Part(name="docking_port", shapes=tuple(s.moved((0.0, PORT_Y, 0.0)) for s in shapes))


def _starboard_panel() -> list[Shape]:
    """Two leaves along +y from the hinge line, cells towards -z."""
    half, thickness, gap, first = 0.146, 0.004, 0.010, 0.012
    shapes = hinge_line((-0.05, 0.05), 0.04, 0.005)
    arm = box("aluminium", (0.030, 0.014, 0.003), (0.0, 0.0095, 0.0))
    shapes += [arm.moved((x, 0.0, 0.0)) for x in (-0.05, 0.05)]
    starts = [first + leaf * (PANEL_WIDTH + gap) for leaf in range(2)]
    shapes += panel_row((-half, half), starts, PANEL_WIDTH, (6, 3), thickness)
    middle = first + PANEL_WIDTH + 0.5 * gap
    bridge = box("anodised_dark", (0.024, gap + 0.006, 0.004), (0.0, middle, 0.0))
    shapes += [bridge.moved((x, 0.0, 0.0)) for x in (-0.10, 0.10)]
    return shapes


def _panels() -> tuple[list[Part], list[Joint]]:
    """Both panels with their hinges."""
    starboard = Part(name="panel_right", shapes=tuple(_starboard_panel()), origin_body=HINGE)
    hinge = Joint(
        name=starboard.name,
        part=starboard.name,
        axis_body=(1.0, 0.0, 0.0),  # positive folds the panel down to the side
        origin_body=HINGE,
        angles=(np.radians(-45.0), np.radians(90.0)),
        keypoints=("panel_tip_right",),
    )
    return both_sides(starboard, hinge)


def _keypoints() -> dict[str, Vec3]:
    half = 0.5 * LENGTH, 0.5 * WIDTH, 0.5 * HEIGHT
    corners: dict[str, Vec3] = {}
    for end, x in (("front", half[0]), ("rear", -half[0])):
        for level, z in (("top", -half[2]), ("bottom", half[2])):
            for hand, y in (("left", -half[1]), ("right", half[1])):
                corners[f"corner_{end}_{level}_{hand}"] = (x, y, z)
    tip = HINGE[1] + 0.012 + 2.0 * PANEL_WIDTH + 0.010
    return {
        "camera_aperture": (HOOD_X + 0.005, *CAMERA),
        "docking_port": (0.176, PORT_Y, 0.0),
        "panel_tip_left": (0.0, -tip, HINGE[2]),
        "panel_tip_right": (0.0, tip, HINGE[2]),
        **corners,
    }


def cubesat_12u() -> GeneratedModel:
    """The whole craft."""
    panels, joints = _panels()
    return GeneratedModel(
        name="cubesat_12u",
        description=DESCRIPTION,
        source=SOURCE,
        parts=(_body(), _camera(), _docking_port(), *panels),
        joints=tuple(joints),
        keypoints=_keypoints(),
    )
