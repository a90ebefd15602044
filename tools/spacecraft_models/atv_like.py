"""A cargo craft after the ATV: a drum 4.5 m across with an X of four solar wings.

The body frame's origin lies on the axis midway between the tip of the docking probe (x = +5.1 m)
and the mouths of the main engines (x = -5.1 m).
"""

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from tools.spacecraft_models.fittings import (
    bell,
    helix_antenna,
    panel_row,
    patch_antenna,
    seated,
    star_tracker,
)
from tools.spacecraft_models.generated_model import GeneratedModel, Joint, Part, Vec3
from tools.spacecraft_models.shapes import (
    Shape,
    box,
    handrail,
    lathe,
    loft,
    rod,
    shell,
    sphere,
    tube,
)

AFT = Rotation.from_euler("z", 180.0, degrees=True)
RADIUS = 2.24  # [m]
PROBE_X, ENGINE_EXIT_X = 5.1, -5.1
WING_X, WING_ROOT, WING_TIP = -2.6, 2.36, 11.15  # station, and distances from the axis [m]
WINGS = {"upper_right": 45.0, "lower_right": 135.0, "lower_left": 225.0, "upper_left": 315.0}

DESCRIPTION = (
    "Uncrewed cargo craft: drum of 4.5 x 10.2 m, four solar wings in an X that span 22.3 m, "
    "docking probe ahead, four main engines aft. Origin on the axis midway between probe tip and "
    "engine mouths."
)
SOURCE = (
    "Shaped by hand after the publicly described layout of ESA's Automated Transfer Vehicle (10.3 "
    "m long, 4.48 m wide, four wings spanning 22.3 m). Outline, details and finishes are our own "
    "approximation, not manufacturer data. Apache-2.0."
)


def _round(azimuth: float, radius: float, x: float) -> Vec3:
    """A place on a cylinder about the x axis; azimuth 0 at the top, towards starboard."""
    return (x, radius * float(np.sin(azimuth)), -radius * float(np.cos(azimuth)))


def _blanketed(
    material: str, x: tuple[float, float], radius: float, pillows: tuple[int, int]
) -> Shape:
    """A drum under a quilted blanket: pillows around and along, 25 mm high."""
    around = 6 * pillows[0]
    azimuth = 2.0 * np.pi * np.arange(around) / around
    rings = [np.array([[x[0], 0.0, 0.0]])]
    for at in np.linspace(*x, 1 + 6 * pillows[1]):
        across = np.abs(np.sin(np.pi * pillows[1] * (at - x[0]) / (x[1] - x[0])))
        puff = np.sqrt(across * np.abs(np.sin(0.5 * pillows[0] * azimuth)))
        r = radius - 0.025 + 0.025 * puff
        rings.append(
            np.stack([np.full(around, at), r * np.sin(azimuth), -r * np.cos(azimuth)], axis=-1)
        )
    rings.append(np.array([[x[1], 0.0, 0.0]]))
    return loft(material, rings)


def _patch(
    materials: tuple[str, str, str], azimuth: tuple[float, float], x: tuple[float, float]
) -> Shape:
    """A plate that follows the drum, its face 30 mm above the blanket."""
    angles = np.linspace(*azimuth, 17)
    faces: list[Array] = []
    for radius in (RADIUS + 0.030, RADIUS - 0.015):
        across = np.stack([radius * np.sin(angles), -radius * np.cos(angles)], axis=-1)
        faces.append(np.stack([np.column_stack([np.full(len(angles), at), across]) for at in x]))
    return shell(materials, faces[0], faces[1])


def _cargo_carrier() -> Part:
    """The pressurised front: drum, shoulder cone, blanket, handrails."""
    shoulder = lathe(
        ["aluminium", "white_paint", "beta_cloth", "beta_cloth", "white_paint", "aluminium"],
        [(3.05, 0.0), (3.05, 2.22), (3.20, 2.22), (3.72, 1.72), (4.20, 1.12), (4.32, 1.00),
         (4.32, 0.0)],
        96,
    )  # fmt: skip
    rings = [tube("white_paint", (x, x + 0.10), (2.1, RADIUS + 0.03), 96) for x in (-0.72, 3.02)]
    rails = [
        piece
        for azimuth in np.radians([0.0, 90.0, 180.0, 270.0])
        for station in (0.2, 2.0)
        for piece in seated(
            handrail("aluminium", (0.0, 0.0, -0.45), (0.0, 0.0, 0.45), (0.14, 0.0, 0.0)),
            station, float(azimuth), RADIUS - 0.02,
        )
    ]  # fmt: skip
    pods = [
        piece
        for azimuth in np.radians([45.0, 135.0, 225.0, 315.0])
        for piece in seated(_front_pod(), 3.20, float(azimuth), RADIUS - 0.06)
    ]
    blanket = _blanketed("beta_cloth", (-0.66, 3.06), RADIUS, (20, 5))
    return Part(name="cargo_carrier", shapes=(blanket, shoulder, *rings, *rails, *pods))


def _front_pod() -> list[Shape]:
    """Two braking thrusters on a block, standing along +x with +z forward."""
    jet = bell(0.14, 0.018, 0.055, 16, 3)
    forward = Rotation.from_euler("y", -90.0, degrees=True)
    return [
        box("white_paint", (0.26, 0.42, 0.26), (0.06, 0.0, 0.0)),
        *(jet.turned(forward).moved((0.08, y, 0.11)) for y in (-0.11, 0.11)),
    ]


def _docking() -> Part:
    """The rim of the docking system, its cone and probe, targets and rendezvous sensors."""
    rim = lathe(
        ["aluminium", "aluminium_machined", "anodised_dark", "anodised_dark", "aluminium"],
        [(4.28, 0.92), (4.62, 0.80), (4.62, 0.68), (4.36, 0.66), (4.28, 0.66)], 72, torus=True,
    )  # fmt: skip
    latches = [
        box("anodised_dark", (0.05, 0.09, 0.06)).turned(
            Rotation.from_euler("x", float(azimuth))
        ).moved(_round(float(azimuth), 0.74, 4.64))
        for azimuth in np.radians(np.arange(22.5, 382.5, 45.0))
    ]  # fmt: skip
    probe = lathe(
        ["anodised_dark", "titanium", "titanium", "titanium", "titanium", "titanium"],
        [(4.34, 0.0), (4.34, 0.40), (4.60, 0.12), (4.98, 0.06), (5.04, 0.06), (5.09, 0.03),
         (PROBE_X, 0.0)],
        40,
    )  # fmt: skip
    sensors: list[Shape] = []
    for y in (-0.26, 0.26):
        for z in (-1.22, 1.22):
            sensors += [
                box("black_paint", (0.46, 0.30, 0.28), (4.12, y, z)),
                rod("lens_glass", (4.34, y, z), (4.362, y, z), 0.08, 24),
                tube("anodised_dark", (4.33, 4.42), (0.085, 0.10), 24).moved((0.0, y, z)),
            ]
    retroreflectors = [
        rod("mirror", _round(a, 0.96, 4.30), _round(a, 0.96, 4.345), 0.028, 16)
        for a in np.radians([60.0, 120.0, 240.0, 300.0])
    ]
    target = [
        rod("white_paint", (4.30, 1.30, 0.0), (4.34, 1.30, 0.0), 0.16, 32),
        box("black_paint", (0.02, 0.26, 0.03), (4.34, 1.30, 0.0)),
        box("black_paint", (0.021, 0.03, 0.26), (4.34, 1.30, 0.0)),
        box("aluminium", (0.62, 0.10, 0.10), (4.01, 1.30, 0.0)),
    ]
    shapes = (rim, *latches, probe, *sensors, *retroreflectors, *target)
    return Part(name="docking_port", shapes=shapes)


def _avionics_bay() -> Part:
    """The short ring behind the cargo carrier, star trackers and antennas on it."""
    ring = lathe(
        ["black_paint", "grey_paint", "black_paint"],
        [(-0.70, 0.0), (-0.70, 2.16), (-1.62, 2.16), (-1.62, 0.0)], 96,
    )  # fmt: skip
    boxes = [
        piece
        for azimuth in np.radians(np.arange(15.0, 375.0, 30.0))
        for piece in seated([box("gold_foil", (0.14, 0.62, 0.58))], -1.16, float(azimuth), 2.15)
    ]
    trackers: list[Shape] = []
    for side in (-1.0, 1.0):
        lean = Rotation.from_euler("z", side * 20.0, degrees=True)
        tracker = [shape.turned(lean) for shape in star_tracker()]
        trackers += seated(tracker, -1.16, side * 0.12, 2.17)
    antennas = seated(patch_antenna(0.30), -1.16, np.pi, 2.17)
    for azimuth in (0.5 * np.pi, 1.5 * np.pi):
        antennas += seated(helix_antenna(0.36, 0.05), -1.16, azimuth, 2.17)
    return Part(name="avionics_bay", shapes=(ring, *boxes, *trackers, *antennas))


def _propulsion() -> Part:
    """The unpressurised rear: blanket, radiators, skirt, attitude thrusters."""
    rings = [tube("white_paint", (x - 0.10, x), (2.1, RADIUS + 0.03), 96) for x in (-1.58, -4.28)]
    radiators = [
        _patch(("radiator_white", "aluminium", "aluminium"), (c - 0.27, c + 0.27), (-1.80, -4.15))
        for c in np.radians([0.0, 90.0, 180.0, 270.0])
    ]
    profile = [
        (-4.30, 0.0), (-4.30, 2.20), (-4.52, 2.20), (-4.62, 2.08), (-4.62, 1.96), (-4.50, 1.94),
        (-4.50, 0.0),
    ]  # fmt: skip
    skirt = lathe(["white_paint"] * 3 + ["aluminium"] * 2 + ["gold_foil"], profile, 96)
    jet = bell(0.16, 0.018, 0.055, 16, 3)
    pod = [
        box("white_paint", (0.34, 0.60, 0.30), (0.06, 0.0, 0.0)),
        *(jet.turned(Rotation.from_euler("z", s * 90.0, degrees=True)).moved((0.12, s * 0.28, 0.0))
          for s in (-1.0, 1.0)),
        *(jet.turned(Rotation.from_euler("y", 90.0, degrees=True)).moved((0.12, y, -0.13))
          for y in (-0.16, 0.16)),
        jet.moved((0.21, 0.0, 0.0)),
    ]  # fmt: skip
    pods = [
        piece
        for azimuth in np.radians([22.0, 112.0, 202.0, 292.0])
        for piece in seated(pod, -4.36, float(azimuth), RADIUS)
    ]
    drives = [
        rod(
            "anodised_dark", _round(a, 2.12, WING_X), _round(a, WING_ROOT - 0.005, WING_X), 0.16, 40
        )
        for a in np.radians(list(WINGS.values()))
    ]
    blanket = _blanketed("gold_foil", (-1.62, -4.34), RADIUS, (24, 4))
    shapes = (blanket, *rings, *radiators, skirt, *pods, *drives)
    return Part(name="propulsion_module", shapes=shapes)


def _engines() -> Part:
    """Four main engines and the tanks that show between them."""
    engines: list[Shape] = []
    for azimuth in np.radians([45.0, 135.0, 225.0, 315.0]):
        _, y, z = _round(float(azimuth), 0.62, 0.0)
        engines += [
            rod("anodised_dark", (-4.46, y, z), (-4.64, y, z), 0.12, 32),
            bell(-4.60 - ENGINE_EXIT_X, 0.07, 0.21, 32, 6).turned(AFT).moved((-4.60, y, z)),
        ]
    tanks = [
        sphere("silver_foil", 0.30, 24).moved(_round(float(a), 1.38, -4.50))
        for a in np.radians([0.0, 60.0, 120.0, 180.0, 240.0, 300.0])
    ]
    return Part(name="main_engines", shapes=(*engines, *tanks))


def _wing() -> list[Shape]:
    """Yoke and four panels along +y from the drive, cells towards -z."""
    chord, first, gap = 1.82, 1.25, 0.06
    reach = WING_TIP - WING_ROOT
    width = (reach - first - 3.0 * gap) / 4.0
    shapes = [
        rod("aluminium", (0.0, 0.0, 0.0), (0.0, 0.30, 0.0), 0.09, 28),
        box("anodised_dark", (0.26, 0.14, 0.14), (0.0, 0.32, 0.0)),
        *(rod("grey_paint", (s * 0.05, 0.32, 0.0), (s * 0.66, first + 0.006, 0.0), 0.03, 16)
          for s in (-1.0, 1.0)),
    ]  # fmt: skip
    starts = [first + panel * (width + gap) for panel in range(4)]
    shapes += panel_row((-0.5 * chord, 0.5 * chord), starts, width, (6, 12), 0.026)
    shapes += [
        rod("anodised_dark", (x - 0.06, y, 0.0), (x + 0.06, y, 0.0), 0.033, 16)
        for y in (start - 0.5 * gap for start in starts[1:])
        for x in (-0.6, 0.6)
    ]
    return shapes


def _wings() -> tuple[list[Part], list[Joint]]:
    """The four wings, each on its drive, cells stored towards +x."""
    parts, joints = [], []
    for where, degrees in WINGS.items():
        azimuth = float(np.radians(degrees))
        outward = np.array(_round(azimuth, 1.0, 0.0))
        aft = np.array([-1.0, 0.0, 0.0])
        axes = np.stack([np.cross(outward, aft), outward, aft], axis=1)
        origin = _round(azimuth, WING_ROOT, WING_X)
        name = f"wing_{where}"
        parts.append(
            Part(
                name=name,
                shapes=tuple(_wing()),
                origin_body=origin,
                R_body_from_part=Rotation.from_matrix(axes),
            )
        )
        joints.append(
            Joint(
                name=name,
                part=name,
                axis_body=(0.0, float(outward[1]), float(outward[2])),
                origin_body=origin,
                angles=(-np.pi, np.pi),
                keypoints=(f"wing_tip_{where}",),
                sunward_body=(1.0, 0.0, 0.0),
            )
        )
    return parts, joints


def atv_like() -> GeneratedModel:
    """The whole craft."""
    wings, joints = _wings()
    tips = {
        f"wing_tip_{where}": _round(float(np.radians(degrees)), WING_TIP, WING_X)
        for where, degrees in WINGS.items()
    }
    engines = {
        f"engine_{where}": _round(float(np.radians(degrees)), 0.62, ENGINE_EXIT_X)
        for where, degrees in WINGS.items()
    }
    fixed = (_cargo_carrier(), _docking(), _avionics_bay(), _propulsion(), _engines())
    return GeneratedModel(
        name="atv_like",
        description=DESCRIPTION,
        source=SOURCE,
        parts=(*fixed, *wings),
        joints=tuple(joints),
        keypoints={
            "docking_probe": (PROBE_X, 0.0, 0.0),
            "docking_rim_top": (4.62, 0.0, -0.74),
            "docking_rim_bottom": (4.62, 0.0, 0.74),
            "docking_rim_left": (4.62, -0.74, 0.0),
            "docking_rim_right": (4.62, 0.74, 0.0),
            **engines,
            **tips,
        },
    )
