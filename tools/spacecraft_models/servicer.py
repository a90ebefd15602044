"""A small servicing craft: two-axis solar arrays, a gimballed dish, and an arm with a gripper.

The hull measures 1.2 m along x, 1.0 m along y and z; the body frame's origin is its centre. Each
moving part carries the next one: the file's nodes hang under each other in that order.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tools.spacecraft_models.fittings import bell, framed_panel, patch_antenna, star_tracker
from tools.spacecraft_models.generated_model import GeneratedModel, Joint, Part, Vec3
from tools.spacecraft_models.shapes import Shape, box, lathe, rod, tube

LENGTH, WIDTH, HEIGHT = 1.2, 1.0, 1.0  # of the hull along x, y, z [m]

ROLL = 0.56  # y of an array's first hinge, just off the hull's side [m]
TILT = 1.02  # y of its second hinge, at the yoke's end [m]
ROOT, TIP = 0.10, 2.50  # of a wing along y, from its hinge [m]
CHORD = 1.0  # of a wing along x [m]

MAST = (-0.38, 0.0)  # x, y of the dish's azimuth axis [m]
CRADLE = -0.83  # z of its elevation axis [m]
DISH, BOWL, SHEET = 0.30, 0.075, 0.008  # radius, depth and thickness of the dish [m]
FRONT = 0.06  # from the elevation axis to the bowl's vertex [m]
HORN = 0.03  # of the feed beyond the focus [m]

SHOULDER = (0.34, 0.0, -0.66)  # where the arm's two shoulder axes meet [m]
UPPER, LOWER = 0.85, 0.75  # from shoulder to elbow, and from there to the wrist [m]
ARM_OFFSET = 0.065  # the upper arm lies so far to port of the middle, the lower to starboard [m]
WRIST = 0.16  # from the wrist's axis to the palm [m]
FINGER = 0.13  # length of a finger beyond the palm [m]
GRIP = 0.05  # how far a finger opens [m]

DESCRIPTION = (
    "Servicing craft with solar arrays on two axes each, a dish on two and an arm of five axes "
    "with a gripper. Hull 1.2 x 1.0 x 1.0 m along x, y, z; origin at its centre."
)
SOURCE = "Our own design; it copies no flown spacecraft. Apache-2.0."


def _hull() -> Part:
    """Foil over a box, radiators at the sides, a capture ring in front and nozzles behind."""
    up = Rotation.from_euler("y", 90.0, degrees=True)  # +x to -z
    aft = Rotation.from_euler("z", 180.0, degrees=True)
    x, y, z = 0.5 * LENGTH, 0.5 * WIDTH, 0.5 * HEIGHT
    shapes = [box("gold_foil", (LENGTH, WIDTH, HEIGHT))]
    # Frames along the edges, proud of the foil.
    for one in (-1.0, 1.0):
        for other in (-1.0, 1.0):
            shapes += [
                box("aluminium", (LENGTH + 0.02, 0.04, 0.04), (0.0, one * y, other * z)),
                box("aluminium", (0.038, WIDTH - 0.05, 0.038), (one * x, 0.0, other * z)),
                box("aluminium", (0.036, 0.036, HEIGHT - 0.05), (one * x, other * y, 0.0)),
            ]
    for side in (-1.0, 1.0):
        # Radiators below, and the housings of the array drives.
        shapes += [
            box("radiator_white", (0.80, 0.024, 0.34), (0.0, side * (y + 0.004), 0.26)),
            box("anodised_dark", (0.20, 0.05, 0.20), (0.0, side * (y + 0.02), 0.0)),
            rod("aluminium", (0.0, side * (y + 0.03), 0.0),
                (0.0, side * (ROLL - 0.005), 0.0), 0.07, 24),
        ]  # fmt: skip
    ring = tube("aluminium", (x - 0.01, x + 0.10), (0.26, 0.30), 48)
    lip = tube("anodised_dark", (x + 0.07, x + 0.112), (0.27, 0.32), 48)
    camera = [(0.0, 0.0), (0.0, 0.04), (0.10, 0.045), (0.10, 0.038), (0.03, 0.03), (0.03, 0.0)]
    lens = lathe(["black_paint"] * 4 + ["lens_glass"], camera, 24)
    shapes += [ring, lip]
    shapes += [lens.moved((x - 0.01, y_camera, -0.40)) for y_camera in (-0.34, 0.34)]
    shapes += [
        bell(0.16, 0.02, 0.07, 24, 5).turned(aft).moved((-x + 0.005, b, c))
        for b in (-0.22, 0.22)
        for c in (-0.22, 0.22)
    ]
    # On top: the foot of the dish, the arm's pedestal, a star tracker. Below: a patch antenna.
    shapes += [
        rod("white_paint", (*MAST, -z + 0.01), (*MAST, -z - 0.06), 0.09, 32),
        rod("white_paint", (SHOULDER[0], 0.0, -z + 0.01), (SHOULDER[0], 0.0, -z - 0.05), 0.12, 32),
    ]
    shapes += [s.turned(up).moved((-0.05, 0.36, -z)) for s in star_tracker()]
    below = Rotation.from_euler("y", -90.0, degrees=True)
    shapes += [s.turned(below).moved((0.2, 0.0, z)) for s in patch_antenna(0.16)]
    return Part(name="hull", shapes=tuple(shapes))


def _array(side: float, hand: str) -> tuple[list[Part], list[Joint]]:
    """A yoke that turns along the wing, and the wing that tilts on the yoke's fork."""
    reach = TILT - ROLL
    yoke = [
        rod("aluminium", (0.0, 0.0, 0.0), (0.0, side * 0.05, 0.0), 0.062, 24),
        rod("white_paint", (0.0, side * 0.03, 0.0), (0.0, side * 0.20, 0.0), 0.028, 20),
        box("white_paint", (0.64, 0.05, 0.05), (0.0, side * 0.21, 0.0)),
    ]
    for end in (-1.0, 1.0):
        yoke += [
            box("white_paint", (0.03, reach - 0.18, 0.042), (end * 0.29, side * 0.32, 0.0)),
            rod("anodised_dark", (end * 0.27, side * reach, 0.0),
                (end * 0.315, side * reach, 0.0), 0.032, 20),
        ]  # fmt: skip
    panel = framed_panel((-0.5 * CHORD, 0.5 * CHORD), (ROOT, TIP), (8, 18), 0.022)
    wing = panel if side > 0.0 else [shape.mirrored() for shape in panel]
    # The axle lies in the plane of the panel's back, on two brackets.
    wing.append(rod("aluminium", (-0.36, 0.0, 0.0), (0.36, 0.0, 0.0), 0.016, 16))
    wing += [
        box("aluminium", (0.05, ROOT + 0.10, 0.02), (end * 0.21, side * 0.07, 0.022))
        for end in (-1.0, 1.0)
    ]
    origins = (0.0, side * ROLL, 0.0), (0.0, side * TILT, 0.0)
    names = f"yoke_{hand}", f"wing_{hand}"
    parts = [
        Part(name=names[0], shapes=tuple(yoke), origin_body=origins[0], parent="hull"),
        Part(name=names[1], shapes=tuple(wing), origin_body=origins[1], parent=names[0]),
    ]
    joints = [
        Joint(
            name=f"array_roll_{hand}",
            part=names[0],
            axis_body=(0.0, 1.0, 0.0),
            origin_body=origins[0],
            angles=(-np.pi, np.pi),
        ),
        Joint(
            name=f"array_tilt_{hand}",
            part=names[1],
            axis_body=(1.0, 0.0, 0.0),
            origin_body=origins[1],
            angles=(np.radians(-80.0), np.radians(80.0)),
            keypoints=(f"wing_tip_{hand}",),
            sunward_body=(0.0, 0.0, -1.0),
        ),
    ]
    return parts, joints


def _dish() -> tuple[list[Part], list[Joint]]:
    """A fork that turns about the vertical, and a dish that tips within it, stored looking up."""
    up = Rotation.from_euler("y", 90.0, degrees=True)
    foot = -0.5 * HEIGHT - 0.065
    height = foot - CRADLE
    fork = [
        rod("anodised_dark", (0.0, 0.0, 0.0), (0.0, 0.0, -0.05), 0.075, 28),
        box("aluminium", (0.06, 0.30, 0.03), (0.0, 0.0, -0.06)),
    ]
    for side in (-1.0, 1.0):
        fork += [
            box("aluminium", (0.05, 0.022, height - 0.02),
                (0.0, side * 0.13, -0.05 - 0.5 * (height - 0.02))),
            rod("anodised_dark", (0.0, side * 0.112, -height), (0.0, side * 0.15, -height),
                0.036, 20),
        ]  # fmt: skip
    radius = np.linspace(0.0, DISH, 9)[1:]
    bowl = BOWL * (radius / DISH) ** 2
    back_side = [(FRONT - SHEET + b, r) for b, r in zip(bowl, radius, strict=True)]
    inside = [(FRONT + b, r) for b, r in zip(bowl[::-1], radius[::-1], strict=True)]
    profile = [(FRONT - SHEET, 0.0), *back_side, *inside, (FRONT, 0.0)]
    focus = FRONT + DISH**2 / (4.0 * BOWL)
    shapes = [
        lathe("white_paint", profile, 48),
        rod("aluminium", (-0.03, 0.0, 0.0), (FRONT - 0.002, 0.0, 0.0), 0.06, 24),
        rod("aluminium", (0.0, -0.105, 0.0), (0.0, 0.105, 0.0), 0.022, 16),
        lathe("aluminium", [(focus - 0.05, 0.0), (focus - 0.05, 0.035), (focus, 0.02),
                            (focus + HORN, 0.02), (focus + HORN, 0.0)], 20),
    ]  # fmt: skip
    for turn in (0.0, 120.0, 240.0):
        about = Rotation.from_euler("x", turn, degrees=True)
        rim = FRONT + BOWL * 0.75**2
        strut = rod("white_paint", (rim - 0.003, 0.75 * DISH, 0.0), (focus, 0.015, 0.0), 0.006, 8)
        shapes.append(strut.turned(about))
    stands = (*MAST, foot), (*MAST, CRADLE)
    parts = [
        Part(name="dish_fork", shapes=tuple(fork), origin_body=stands[0], parent="hull"),
        Part(
            name="dish",
            shapes=tuple(shape.turned(up) for shape in shapes),
            origin_body=stands[1],
            parent="dish_fork",
        ),
    ]
    joints = [
        Joint(
            name="dish_azimuth",
            part="dish_fork",
            axis_body=(0.0, 0.0, 1.0),
            origin_body=stands[0],
            angles=(-np.pi, np.pi),
        ),
        Joint(
            name="dish_elevation",
            part="dish",
            axis_body=(0.0, 1.0, 0.0),
            origin_body=stands[1],
            angles=(np.radians(-70.0), np.radians(70.0)),
            keypoints=("dish_feed",),
        ),
    ]
    return parts, joints


def _link(length: float, y: float, radius: float) -> list[Shape]:
    """A round boom along x between the hubs of two axes that run along y; y of the boom [m]."""
    return [
        rod("white_paint", (0.05, y, 0.0), (length - 0.05, y, 0.0), radius, 24),
        *(
            rod("anodised_dark", (x, y - 0.055, 0.0), (x, y + 0.055, 0.0), 1.5 * radius, 24)
            for x in (0.0, length)
        ),
        *(
            tube("aluminium", (x - 0.02, x + 0.02), (0.6 * radius, 1.15 * radius), 24)
            .moved((0.0, y, 0.0))
            for x in (0.13, length - 0.13)
        ),
    ]  # fmt: skip


def _arm() -> tuple[list[Part], list[Joint]]:
    """Turntable, upper and lower arm, wrist, hand, and two fingers that slide apart; stored
    stretched out ahead."""
    x, _, z = SHOULDER
    elbow, wrist = (x + UPPER, 0.0, z), (x + UPPER + LOWER, 0.0, z)
    hand = (wrist[0] + WRIST - 0.06, ARM_OFFSET, z)
    base = (x, 0.0, -0.5 * HEIGHT - 0.055)
    lift = z - base[2]
    table = [
        rod("anodised_dark", (0.0, 0.0, 0.0), (0.0, 0.0, -0.045), 0.10, 32),
        box("white_paint", (0.12, 0.05, -lift + 0.04), (0.0, 0.045, 0.5 * lift - 0.02)),
        rod("white_paint", (0.0, 0.012, lift), (0.0, 0.075, lift), 0.07, 28),
    ]
    wrist_block = [
        rod("anodised_dark", (0.0, -0.005, 0.0), (0.0, 0.004, 0.0), 0.05, 24),
        box("white_paint", (WRIST - 0.07, 0.07, 0.06), (0.5 * (WRIST - 0.07), 0.065, 0.0)),
    ]
    palm = [
        rod("anodised_dark", (0.0, 0.0, 0.0), (0.05, 0.0, 0.0), 0.042, 24),
        box("aluminium", (0.025, 0.17, 0.05), (0.058, 0.0, 0.0)),
        lathe(["black_paint"] * 2 + ["lens_glass"], [(0.0, 0.0), (0.0, 0.016), (0.045, 0.018),
              (0.045, 0.0)], 16).moved((0.02, 0.0, -0.052)),
    ]  # fmt: skip
    parts = [
        Part(name="arm_turntable", shapes=tuple(table), origin_body=base, parent="hull"),
        Part(name="arm_upper", shapes=tuple(_link(UPPER, -ARM_OFFSET, 0.042)), origin_body=SHOULDER,
             parent="arm_turntable"),
        Part(name="arm_lower", shapes=tuple(_link(LOWER, ARM_OFFSET, 0.036)), origin_body=elbow,
             parent="arm_upper"),
        Part(name="arm_wrist", shapes=tuple(wrist_block), origin_body=wrist, parent="arm_lower"),
        Part(name="arm_hand", shapes=tuple(palm), origin_body=hand, parent="arm_wrist"),
    ]  # fmt: skip
    axes = {
        "arm_yaw": ("arm_turntable", (0.0, 0.0, 1.0), base, 170.0),
        "arm_shoulder": ("arm_upper", (0.0, 1.0, 0.0), SHOULDER, 120.0),
        "arm_elbow": ("arm_lower", (0.0, 1.0, 0.0), elbow, 160.0),
        "arm_pitch": ("arm_wrist", (0.0, 1.0, 0.0), wrist, 110.0),
        "arm_roll": ("arm_hand", (1.0, 0.0, 0.0), hand, 180.0),
    }
    joints = [
        Joint(
            name=name,
            part=part,
            axis_body=axis,
            origin_body=origin,
            angles=(-np.radians(reach), np.radians(reach)),
            keypoints=("grip",) if name == "arm_roll" else (),
        )
        for name, (part, axis, origin, reach) in axes.items()
    ]
    for number, side in ((1, -1.0), (2, 1.0)):
        part = f"finger_{number}"
        shapes = [
            box("anodised_dark", (FINGER, 0.014, 0.03), (0.5 * FINGER, side * 0.006, 0.0)),
            box("black_paint", (0.05, 0.006, 0.024), (FINGER - 0.03, -side * 0.002, 0.0)),
        ]
        origin = (hand[0] + 0.068, ARM_OFFSET + side * 0.012, z)
        parts.append(Part(name=part, shapes=tuple(shapes), origin_body=origin, parent="arm_hand"))
        joints.append(
            Joint(
                name=part,
                part=part,
                axis_body=(0.0, side, 0.0),  # positive opens
                origin_body=origin,
                angles=(0.0, GRIP),
                slides=True,
            )
        )
    return parts, joints


def _keypoints() -> dict[str, Vec3]:
    half = 0.5 * LENGTH, 0.5 * WIDTH, 0.5 * HEIGHT
    corners: dict[str, Vec3] = {}
    for end, x in (("front", half[0]), ("rear", -half[0])):
        for level, z in (("top", -half[2]), ("bottom", half[2])):
            for hand, y in (("left", -half[1]), ("right", half[1])):
                corners[f"corner_{end}_{level}_{hand}"] = (x, y, z)
    feed = CRADLE - FRONT - DISH**2 / (4.0 * BOWL) - HORN
    return {
        "capture_ring": (0.5 * LENGTH + 0.112, 0.0, 0.0),
        "wing_tip_left": (0.0, -(TILT + TIP), 0.0),
        "wing_tip_right": (0.0, TILT + TIP, 0.0),
        "dish_feed": (*MAST, feed),
        "grip": (SHOULDER[0] + UPPER + LOWER + WRIST + 0.1, ARM_OFFSET, SHOULDER[2]),
        **corners,
    }


def servicer() -> GeneratedModel:
    """The whole craft."""
    moving = [_array(-1.0, "left"), _array(1.0, "right"), _dish(), _arm()]
    return GeneratedModel(
        name="servicer",
        description=DESCRIPTION,
        source=SOURCE,
        parts=(_hull(), *(part for parts, _ in moving for part in parts)),
        joints=tuple(joint for _, joints in moving for joint in joints),
        keypoints=_keypoints(),
    )
