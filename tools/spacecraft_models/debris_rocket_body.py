"""A spent upper stage: dented tank, scorched paint, bare engine. A tumbling target.

The body frame's origin lies on the axis midway between the front of the payload adapter
(x = +4.5 m) and the mouth of the nozzle (x = -4.5 m).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from tools.spacecraft_models.fittings import bell, patch_antenna, seated
from tools.spacecraft_models.generated_model import GeneratedModel, Joint, Part
from tools.spacecraft_models.shapes import Shape, box, lathe, loft, rod, sphere, tube
from tools.spacecraft_models.trusses import chain

AFT = Rotation.from_euler("z", 180.0, degrees=True)
FRONT_X, NOZZLE_EXIT_X = 4.5, -4.5
TANK_RADIUS = 1.20  # [m]
TANK_X = (2.9, -2.2)  # of its cylinder [m]
GIMBAL_X = -2.95

DESCRIPTION = (
    "Spent upper stage of 9.0 x 2.4 m: dented and scorched tank, payload adapter, engine. Origin "
    "on the axis midway between adapter and nozzle mouth. A tumbling target for debris removal."
)
SOURCE = (
    "Our own design after the common layout of storable and cryogenic upper stages; it copies no "
    "flown stage. Apache-2.0."
)


@dataclass(frozen=True, kw_only=True)
class Dent:
    """A smooth hollow in the tank's wall.

    x : station [m]; azimuth : 0 at the top, towards starboard [rad]
    radius : at which it has faded to 1/e [m]; depth : in its middle [m]
    """

    x: float
    azimuth: float
    radius: float
    depth: float

    def at(self, x: float, azimuth: Array) -> Array:
        """How deep the wall is pushed in [m]."""
        across = TANK_RADIUS * np.angle(np.exp(1j * (azimuth - self.azimuth)))
        return self.depth * np.exp(-((x - self.x) ** 2 + across**2) / self.radius**2)


DENTS = (
    Dent(x=1.5, azimuth=0.5, radius=0.42, depth=0.16),
    Dent(x=-0.6, azimuth=2.2, radius=0.60, depth=0.20),
    Dent(x=-1.3, azimuth=3.8, radius=0.30, depth=0.10),
    Dent(x=0.5, azimuth=5.4, radius=0.25, depth=0.12),
    Dent(x=2.2, azimuth=3.4, radius=0.33, depth=0.09),
)


def _weathering(x: Array, azimuth: Array) -> Array:
    """A field of streaks along x between -1 and 1 that decides where paint has gone."""
    return (
        0.45 * np.sin(5.0 * azimuth + 0.9 * np.sin(1.3 * x))
        + 0.30 * np.sin(13.0 * azimuth - 0.8 * x + 1.0)
        + 0.25 * np.sin(21.0 * azimuth + 1.1 * x + np.sin(6.0 * x))
    )


def _painted_tank() -> Shape:
    """The tank with its domes, dented, its paint weathered towards the engine."""
    around = 108
    azimuth = 2.0 * np.pi * np.arange(around) / around
    polar = np.linspace(0.0, 0.5 * np.pi, 9)[1:-1]
    front = [(TANK_X[0] + 0.45 * np.cos(p), TANK_RADIUS * np.sin(p)) for p in polar]
    wall = [(x, TANK_RADIUS) for x in np.linspace(*TANK_X, 64)]
    back = [(TANK_X[1] - 0.45 * np.cos(p), TANK_RADIUS * np.sin(p)) for p in polar[::-1]]
    rings = [np.array([[TANK_X[0] + 0.45, 0.0, 0.0]])]
    for x, radius in (*front, *wall, *back):
        pushed = np.sum([dent.at(float(x), azimuth) for dent in DENTS], axis=0)
        r = radius - pushed * (radius / TANK_RADIUS)
        rings.append(
            np.stack([np.full(around, x), r * np.sin(azimuth), -r * np.cos(azimuth)], axis=-1)
        )
    rings.append(np.array([[TANK_X[1] - 0.45, 0.0, 0.0]]))
    tank = loft("paint_aged", rings)
    centres = tank.vertices[tank.triangles].mean(axis=1)
    x = centres[:, 0]
    worn = _weathering(x, np.arctan2(centres[:, 1], -centres[:, 2]))
    # Soot lies thick above the engine and thins out half-way along the tank.
    scorch = np.clip((0.2 - x) / 2.4, -1.0, 1.0) + 0.55 * worn
    names = np.where(worn > 0.78, "aluminium_machined", "paint_aged")
    names = np.where(scorch > 0.35, "paint_scorched", names)
    names = np.where(scorch > 0.85, "soot", names)
    names = np.where((x > TANK_X[0]) | (x < TANK_X[1]), "aluminium_machined", names)
    return replace(tank, materials=names)


def _tank() -> Part:
    """Tank, seam rings, tunnel for cables, feed line."""
    rings = [
        tube("aluminium_machined", (x - 0.04, x + 0.04), (TANK_RADIUS - 0.05, 1.215), 96)
        for x in (TANK_X[0] - 0.02, TANK_X[1] + 0.02)
    ]  # fmt: skip
    tunnel = seated([box("paint_aged", (0.12, 0.22, 4.9))], 0.35, np.radians(96.0), 1.215)
    feed = [
        rod("aluminium_machined", (2.75, -1.27, 0.3), (-2.1, -1.27, 0.3), 0.06, 20),
        *(box("aluminium", (0.05, 0.22, 0.16), (x, -1.2, 0.3)) for x in (2.3, 1.1, -0.1, -1.3)),
    ]
    return Part(name="tank", shapes=(_painted_tank(), *rings, *tunnel, *feed))


def _adapter() -> Part:
    """The forward skirt and the open payload cone, clamp ring at its end."""
    skirt = tube("paint_aged", (2.95, 3.5), (TANK_RADIUS - 0.03, TANK_RADIUS), 96)
    outer = [(3.48, 1.19), (4.40, 0.60), (4.40, 0.64), (FRONT_X, 0.64)]
    inner = [(x, r - 0.03) for x, r in reversed(outer)]
    inner[0], inner[1] = (FRONT_X, 0.585), (4.40, 0.565)
    profile = [*outer, inner[0], inner[1], inner[3]]
    cone = lathe(
        ["black_paint", "aluminium_machined", "aluminium_machined", "aluminium_machined",
         "grey_paint", "grey_paint", "aluminium_machined"],
        profile, 96, torus=True,
    )  # fmt: skip
    deck = rod("anodised_dark", (3.44, 0.0, 0.0), (3.50, 0.0, 0.0), 1.18, 96)
    boxes = [
        piece
        for azimuth, size, name in (
            (0.3, 0.34, "gold_foil"), (1.5, 0.42, "black_paint"), (2.7, 0.30, "silver_foil"),
            (4.0, 0.38, "grey_paint"), (5.3, 0.26, "gold_foil"),
        )
        for piece in seated([box(name, (0.22, size, 0.32))], 3.22, azimuth, 1.26)
    ]  # fmt: skip
    antennas = [
        piece
        for azimuth in (0.9, 3.35)
        for piece in seated(patch_antenna(0.16), 3.22, azimuth, TANK_RADIUS + 0.01)
    ]
    return Part(name="payload_adapter", shapes=(skirt, deck, cone, *boxes, *antennas))


def _thrust_frame() -> Part:
    """Aft skirt, struts to the gimbal, pressure bottles, attitude jets."""
    skirt = lathe(
        ["soot", "soot", "aluminium_machined", "soot"],
        [(-2.24, 1.20), (-2.70, 1.20), (-2.70, 1.16), (-2.24, 1.16)], 96, torus=True,
    )  # fmt: skip
    struts = []
    for azimuth in np.radians(np.arange(22.5, 382.5, 45.0)):
        foot = (-2.45, 1.14 * np.sin(azimuth), -1.14 * np.cos(azimuth))
        head = (GIMBAL_X + 0.06, 0.10 * np.sin(azimuth), -0.10 * np.cos(azimuth))
        struts += chain("anodised_dark", (foot, head), 0.025)
    bottles = [
        sphere("titanium", 0.26, 24).moved((-2.72, 0.80 * np.sin(a), -0.80 * np.cos(a)))
        for a in np.radians([0.0, 90.0, 180.0, 270.0])
    ]
    jet = bell(0.12, 0.015, 0.045, 16, 3)
    pods = [
        piece
        for azimuth in np.radians([45.0, 135.0, 225.0, 315.0])
        for piece in seated(
            [
                box("black_paint", (0.16, 0.26, 0.18), (0.06, 0.0, 0.0)),
                jet.moved((0.135, 0.0, 0.0)),
            ],
            -2.50, float(azimuth), TANK_RADIUS,
        )
    ]  # fmt: skip
    block = rod("anodised_dark", (GIMBAL_X + 0.12, 0, 0), (GIMBAL_X - 0.02, 0, 0), 0.16, 32)
    return Part(name="thrust_frame", shapes=(skirt, *struts, *bottles, *pods, block))


def _nozzle() -> tuple[Part, Joint]:
    """Chamber and bell, on the gimbal."""
    reach = GIMBAL_X - NOZZLE_EXIT_X
    chamber = [
        (-0.06, 0.0), (-0.06, 0.10), (0.06, 0.19), (0.30, 0.19), (0.42, 0.10), (0.46, 0.10),
        (0.46, 0.0),
    ]  # fmt: skip
    shapes: list[Shape] = [
        lathe("titanium", chamber, 40),
        bell(reach - 0.40, 0.10, 0.58, 72, 14).moved((0.40, 0.0, 0.0)),
        *(tube("anodised_dark", (x - 0.012, x + 0.012), (r - 0.03, r + 0.015), 64)
          for x, r in ((0.80, 0.375), (1.10, 0.515))),
        rod("aluminium_machined", (0.10, 0.17, 0.14), (0.36, 0.26, 0.20), 0.09, 24),
        rod("aluminium_machined", (0.12, -0.17, -0.14), (0.32, -0.25, -0.18), 0.07, 24),
        *chain("titanium", ((0.15, 0.12, 0.15), (0.50, 0.30, 0.25), (0.80, 0.30, 0.20)), 0.025),
    ]  # fmt: skip
    origin = (GIMBAL_X, 0.0, 0.0)
    part = Part(
        name="nozzle", shapes=tuple(shape.turned(AFT) for shape in shapes), origin_body=origin
    )
    gimbal = Joint(
        name="nozzle_gimbal",
        part="nozzle",
        axis_body=(0.0, 1.0, 0.0),
        origin_body=origin,
        angles=(-np.radians(6.0), np.radians(6.0)),
        keypoints=("nozzle_exit",),
    )
    return part, gimbal


def debris_rocket_body() -> GeneratedModel:
    """The whole stage."""
    nozzle, gimbal = _nozzle()
    rim = 0.61
    return GeneratedModel(
        name="debris_rocket_body",
        description=DESCRIPTION,
        source=SOURCE,
        parts=(_tank(), _adapter(), _thrust_frame(), nozzle),
        joints=(gimbal,),
        keypoints={
            "adapter_centre": (FRONT_X, 0.0, 0.0),
            "adapter_top": (FRONT_X, 0.0, -rim),
            "adapter_bottom": (FRONT_X, 0.0, rim),
            "adapter_left": (FRONT_X, -rim, 0.0),
            "adapter_right": (FRONT_X, rim, 0.0),
            "nozzle_exit": (NOZZLE_EXIT_X, 0.0, 0.0),
            "skirt_top": (-2.70, 0.0, -1.18),
            "skirt_bottom": (-2.70, 0.0, 1.18),
            "skirt_left": (-2.70, -1.18, 0.0),
            "skirt_right": (-2.70, 1.18, 0.0),
        },
    )
