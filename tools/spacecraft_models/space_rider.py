"""Space Rider: the lifting body with its orbital module behind it, wings out and bay open.

The body frame's origin lies on the axis of the orbital module, midway between the tip of the
nose (x = +3.9 m) and the mouth of the main nozzle (x = -3.9 m).
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tools.spacecraft_models.fittings import (
    bell,
    helix_antenna,
    panel_row,
    patch_antenna,
    seated,
    star_tracker,
)
from tools.spacecraft_models.generated_model import GeneratedModel, Joint, Part, Vec3, both_sides
from tools.spacecraft_models.reentry_module import (
    FLAP_ANGLE,
    FLAP_HINGE,
    base_ring,
    bay_doors,
    body,
    body_flaps,
    cargo_bay,
)
from tools.spacecraft_models.reentry_skin import BAY_X, BELLY_Z, FLOOR_Z, NOSE_X, TOP_Z
from tools.spacecraft_models.shapes import (
    Shape,
    box,
    handrail,
    lathe,
    loft,
    pointing,
    rod,
    shell,
    sphere,
    tube,
)

AFT = Rotation.from_euler("z", 180.0, degrees=True)
MODULE_RADIUS = 1.10  # [m]
WING_ROOT = (-2.62, 1.17, 0.0)  # starboard solar drive [m]
WING_TIP_Y = 5.0
NOZZLE_EXIT_X = -3.9

DESCRIPTION = (
    "Lifting body re-entry module with an orbital module behind it, solar wings deployed, "
    "cargo bay open. Origin on the axis midway between nose tip and nozzle mouth."
)
SOURCE = (
    "Shaped by hand after the publicly described layout of ESA's Space Rider: a re-entry module "
    "of about 4.6 m derived from IXV and an expendable orbital module of about 3.2 m with two "
    "solar wings. Outline, details and finishes are our own approximation, not manufacturer "
    "data. Apache-2.0."
)


def _tail_cone() -> Part:
    """The adapter between the re-entry module's base and the orbital module."""
    profile = [
        (-0.68, 0.0), (-0.68, 0.70), (-0.80, 0.70), (-0.80, 0.73), (-0.86, 0.73), (-0.86, 0.70),
        (-1.10, 0.70), (-1.33, 0.70), (-1.33, 0.722), (-1.38, 0.730), (-1.38, 0.717),
        (-1.50, 0.785), (-1.65, 0.87), (-1.80, 0.955), (-1.96, 1.045), (-2.05, 1.045),
        (-2.05, 0.0),
    ]  # fmt: skip
    materials = [
        "anodised_dark", "anodised_dark", "aluminium", "aluminium", "aluminium", "white_paint",
        "white_paint", "aluminium", "aluminium", "aluminium", "beta_cloth", "beta_cloth",
        "beta_cloth", "beta_cloth", "beta_cloth", "beta_cloth",
    ]  # fmt: skip
    ribs = []
    for azimuth in np.radians(np.arange(15.0, 375.0, 30.0)):
        foot = np.array([-1.36, 0.703 * np.sin(azimuth), -0.703 * np.cos(azimuth)])
        head = np.array([-1.955, 1.043 * np.sin(azimuth), -1.043 * np.cos(azimuth)])
        ribs.append(rod("aluminium", foot, head, 0.016, 12))
    boxes = [
        piece
        for azimuth in (-0.6, 0.6)
        for piece in seated([box("gold_foil", (0.20, 0.30, 0.26))], -1.10, azimuth, 0.75)
    ]
    return Part(
        name="tail_cone", shapes=(base_ring(), lathe(materials, profile, 96), *ribs, *boxes)
    )


def _quilted_drum() -> Shape:
    """The drum under its blanket: pillows 20 mm high, some 0.35 m wide, sewn down between."""
    around, pillows_around, pillows_along = 120, 20, 4
    azimuth = 2.0 * np.pi * np.arange(around) / around
    x = np.linspace(-1.99, -3.21, 1 + 6 * pillows_along)
    rings = [np.array([[x[0], 0.0, 0.0]])]
    for at in x:
        across = np.abs(np.sin(np.pi * pillows_along * (at - x[0]) / (x[-1] - x[0])))
        # The square root makes pillows: steep at the seam, flat on top.
        puff = np.sqrt(across * np.abs(np.sin(0.5 * pillows_around * azimuth)))
        radius = MODULE_RADIUS - 0.020 + 0.020 * puff
        rings.append(
            np.stack([np.full(around, at), radius * np.sin(azimuth), -radius * np.cos(azimuth)], -1)
        )
    rings.append(np.array([[x[-1], 0.0, 0.0]]))
    return loft("gold_foil", rings)


def _drum_patch(azimuth: tuple[float, float], x: tuple[float, float]) -> Shape:
    """A white radiator that follows the drum, 35 mm thick."""
    angles = np.linspace(*azimuth, 13)
    faces = []
    for radius in (MODULE_RADIUS + 0.025, MODULE_RADIUS - 0.010):
        across = np.stack([radius * np.sin(angles), -radius * np.cos(angles)], axis=-1)
        faces.append(np.stack([np.column_stack([np.full(len(angles), at), across]) for at in x]))
    return shell(("white_paint", "white_paint", "aluminium"), faces[0], faces[1])


def _service_module() -> Part:
    """Drum, end rings, radiators, aft skirt and propellant tanks."""
    rings = [
        tube("aluminium", x, (1.0, MODULE_RADIUS + 0.018), 96)
        for x in ((-1.96, -2.04), (-3.16, -3.24))
    ]
    skirt_profile = [
        (-3.20, 0.0), (-3.20, 1.07), (-3.30, 1.07), (-3.36, 1.03), (-3.50, 0.89), (-3.50, 0.82),
        (-3.47, 0.80), (-3.47, 0.0),
    ]  # fmt: skip
    skirt_materials = ["white_paint"] * 4 + ["aluminium"] * 2 + ["black_paint"]
    tanks = [
        sphere("silver_foil", 0.25, 26).moved((-3.50, 0.62 * np.cos(a), 0.62 * np.sin(a)))
        for a in np.radians([45.0, 135.0, 225.0, 315.0])
    ]
    bottles = [
        sphere("titanium", 0.13, 16).moved((-3.48, 0.64 * np.cos(a), 0.64 * np.sin(a)))
        for a in np.radians([0.0, 90.0, 180.0, 270.0])
    ]
    radiators = [
        _drum_patch((centre - 0.30, centre + 0.30), (-2.14, -3.06))
        for centre in np.radians([38.0, 142.0, 218.0, 322.0])
    ]
    avionics = [
        piece
        for azimuth, size in ((np.pi, 0.36), (0.0, 0.30))
        for piece in seated([box("beta_cloth", (0.16, size, 0.44))], -2.86, azimuth, 1.12)
    ]
    rails = [
        piece
        for azimuth in np.radians([62.0, 298.0])
        for piece in seated(
            handrail("aluminium", (0.0, 0.0, -0.35), (0.0, 0.0, 0.35), (0.11, 0.0, 0.0)),
            -2.60,
            float(azimuth),
            MODULE_RADIUS - 0.01,
        )
    ]
    drives = [
        rod("anodised_dark", (-2.62, side * 1.06, 0.0), (-2.62, side * 1.165, 0.0), 0.14, 48)
        for side in (-1.0, 1.0)
    ]
    skirt = lathe(skirt_materials, skirt_profile, 96)
    shapes = (
        _quilted_drum(), *rings, skirt, *tanks, *bottles, *radiators, *avionics, *rails, *drives,
    )  # fmt: skip
    return Part(name="service_module", shapes=shapes)


def _nozzle() -> Part:
    """The main engine: chamber, gimbal ring and bell."""
    root = -3.56
    engine = [
        rod("anodised_dark", (-3.46, 0.0, 0.0), (root - 0.01, 0.0, 0.0), 0.13, 48),
        tube("aluminium", (root + 0.03, root), (0.10, 0.16), 48),
        bell(root - NOZZLE_EXIT_X, 0.09, 0.29, 56, 8).turned(AFT).moved((root, 0.0, 0.0)),
    ]
    return Part(name="nozzle", shapes=tuple(engine))


def _thrusters() -> Part:
    """Four pods of four attitude thrusters around the aft end of the drum."""
    jet = bell(0.10, 0.015, 0.042, 12, 3)
    pod = [
        box("white_paint", (0.15, 0.24, 0.20), (0.055, 0.0, 0.0)),
        jet.moved((0.125, 0.0, 0.0)),
        jet.turned(pointing((0.0, 1.0, 0.0))).moved((0.07, 0.115, 0.0)),
        jet.turned(pointing((0.0, -1.0, 0.0))).moved((0.07, -0.115, 0.0)),
        jet.turned(pointing((0.0, 0.0, -1.0))).moved((0.07, 0.0, -0.095)),
    ]
    shapes = [
        piece
        for azimuth in np.radians([18.0, 162.0, 198.0, 342.0])
        for piece in seated(pod, -3.02, float(azimuth), MODULE_RADIUS)
    ]
    return Part(name="thrusters", shapes=tuple(shapes))


def _sensors() -> Part:
    """Star trackers and antennas of the orbital module."""
    shapes = []
    for side in (-1.0, 1.0):
        lean = Rotation.from_euler("z", side * 15.0, degrees=True)
        tracker = [shape.turned(lean) for shape in star_tracker()]
        shapes += seated(tracker, -2.26, side * 0.16, MODULE_RADIUS)
    for azimuth in (0.5 * np.pi + 0.35, 1.5 * np.pi - 0.35):
        shapes += seated(helix_antenna(), -2.30, azimuth, MODULE_RADIUS)
    shapes += seated(patch_antenna(0.24), -2.35, np.pi, MODULE_RADIUS)
    return Part(name="sensors", shapes=tuple(shapes))


def _starboard_wing() -> list[Shape]:
    """Yoke and three panels along +y, about the solar drive, cells towards -z."""
    chord, first, gap = 1.5, 0.62, 0.05
    reach = WING_TIP_Y - WING_ROOT[1]
    width = (reach - first - 2.0 * gap) / 3.0
    half = 0.5 * chord
    shapes = [
        rod("aluminium", (0.0, -0.015, 0.0), (0.0, 0.16, 0.0), 0.055, 24),
        box("anodised_dark", (0.16, 0.09, 0.09), (0.0, 0.17, 0.0)),
        rod("white_paint", (0.03, 0.17, 0.0), (0.50, first + 0.004, 0.0), 0.022, 16),
        rod("white_paint", (-0.03, 0.17, 0.0), (-0.50, first + 0.004, 0.0), 0.022, 16),
        rod("white_paint", (-0.32, 0.42, 0.0), (0.32, 0.42, 0.0), 0.016, 12),
    ]
    starts = [first + panel * (width + gap) for panel in range(3)]
    shapes += panel_row((-half, half), starts, width, (9, 8), 0.022)
    shapes += [
        box("grey_paint", (0.05, width - 0.08, 0.05), (x, start + 0.5 * width, 0.032))
        for start in starts
        for x in (-0.42, 0.42)
    ]
    shapes += [
        rod("anodised_dark", (x - 0.05, y, 0.0), (x + 0.05, y, 0.0), 0.028, 16)
        for y in (start - 0.5 * gap for start in starts[1:])
        for x in (-0.5, 0.5)
    ]
    return shapes


def _wings() -> tuple[list[Part], list[Joint]]:
    """Both wings with their drives."""
    wing = Part(name="panel_wing_right", shapes=tuple(_starboard_wing()), origin_body=WING_ROOT)
    drive = Joint(
        name=wing.name,
        part=wing.name,
        axis_body=(0.0, 1.0, 0.0),  # positive raises the leading edge
        origin_body=WING_ROOT,
        angles=(-np.pi, np.pi),
        keypoints=("wing_tip_right",),
        sunward_body=(0.0, 0.0, -1.0),
    )
    return both_sides(wing, drive)


def _keypoints() -> dict[str, Vec3]:
    flap_reach = 0.715
    flap_x = FLAP_HINGE[0] - flap_reach * np.cos(FLAP_ANGLE) + 0.02 * np.sin(FLAP_ANGLE)
    flap_z = FLAP_HINGE[2] + flap_reach * np.sin(FLAP_ANGLE) + 0.02 * np.cos(FLAP_ANGLE)
    return {
        "nose": (NOSE_X, 0.0, 0.30),
        "nozzle_exit": (NOZZLE_EXIT_X, 0.0, 0.0),
        "belly": (BAY_X, 0.0, BELLY_Z),
        "bay_centre": (BAY_X, 0.0, 0.5 * (FLOOR_Z + TOP_Z)),
        "bay_floor": (BAY_X, 0.0, FLOOR_Z),
        "bay_mouth": (BAY_X, 0.0, TOP_Z),
        "wing_tip_left": (WING_ROOT[0], -WING_TIP_Y, WING_ROOT[2]),
        "wing_tip_right": (WING_ROOT[0], WING_TIP_Y, WING_ROOT[2]),
        "flap_tip_left": (flap_x, -FLAP_HINGE[1], flap_z),
        "flap_tip_right": (flap_x, FLAP_HINGE[1], flap_z),
    }


def space_rider() -> GeneratedModel:
    """The whole craft."""
    doors, door_joints = bay_doors()
    flaps, flap_joints = body_flaps()
    wings, wing_joints = _wings()
    fixed = [_tail_cone(), _service_module(), _nozzle(), _thrusters(), _sensors()]
    return GeneratedModel(
        name="space_rider",
        description=DESCRIPTION,
        source=SOURCE,
        parts=(body(), cargo_bay(), *doors, *flaps, *fixed, *wings),
        joints=(*door_joints, *flap_joints, *wing_joints),
        keypoints=_keypoints(),
    )
