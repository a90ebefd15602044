"""The lifting body of Space Rider: airframe, cargo bay, bay doors and body flaps."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from tools.spacecraft_models.fittings import bell, hinge_line, patch_antenna
from tools.spacecraft_models.generated_model import Joint, Part, both_sides
from tools.spacecraft_models.reentry_skin import BASE_X, BAY_X, FLOOR_Z, airframe, upper_skin
from tools.spacecraft_models.shapes import (
    Shape,
    box,
    handrail,
    lathe,
    loft,
    prism,
    rod,
    shell,
    sphere,
)

LINER_OUTSIDE = (0.612, 0.512)
LINER_INSIDE = (0.60, 0.50)
DOOR_ANGLE = np.radians(110.0)
HINGE_Y = 0.538  # [m]

FLAP_HINGE = (-0.705, 0.50, 0.845)  # starboard [m]
FLAP_ANGLE = np.radians(8.0)


def _both(shapes: Sequence[Shape]) -> list[Shape]:
    """Starboard shapes and their port images."""
    return [*shapes, *(shape.mirrored() for shape in shapes)]


def _hinge() -> tuple[float, float, float]:
    """The starboard door's hinge: just outside the skin beside the opening [m]."""
    return BAY_X, HINGE_Y, float(upper_skin(BAY_X, HINGE_Y)[2]) - 0.014


def body() -> Part:
    """The airframe with what is fixed to its skin and base."""
    knuckles = [shape.moved(_hinge()) for shape in hinge_line((-0.5, -0.1, 0.3), 0.12, 0.014)]
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
    return Part(name="body", shapes=(airframe(), *fixed, *antennas))


def _rectangle(half: tuple[float, float]) -> Array:
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
    hinge_z = _hinge()[2]
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
    place = _hinge()
    door = Part(
        name="bay_door_right",
        shapes=tuple(shape.moved(-np.array(place)) for shape in _starboard_door()),
        origin_body=place,
        R_body_from_part=Rotation.from_rotvec([DOOR_ANGLE, 0.0, 0.0]),
    )
    hinge = Joint(
        name=door.name,
        part=door.name,
        axis_body=(1.0, 0.0, 0.0),  # positive opens
        origin_body=place,
        angles=(-DOOR_ANGLE, np.radians(40.0)),
    )
    return both_sides(door, hinge)


def body_flaps() -> tuple[list[Part], list[Joint]]:
    """Both flaps under the tail, stored a little way down, with their hinges."""
    outline = [
        (0.0, -0.045), (-0.05, -0.05), (-0.70, -0.012), (-0.715, 0.02), (-0.70, 0.05),
        (-0.02, 0.05), (0.0, 0.04),
    ]  # fmt: skip
    surface = prism("ceramic_black", outline, 0.74)
    horns = [box("titanium", (0.10, 0.03, 0.06), (-0.08, y, -0.055)) for y in (-0.2, 0.2)]
    shaft = rod("titanium", (0.0, -0.40, 0.0), (0.0, 0.40, 0.0), 0.022, 16)
    flap = Part(
        name="body_flap_right",
        shapes=(surface, shaft, *horns),
        origin_body=FLAP_HINGE,
        R_body_from_part=Rotation.from_rotvec([0.0, FLAP_ANGLE, 0.0]),
    )
    hinge = Joint(
        name=flap.name,
        part=flap.name,
        axis_body=(0.0, 1.0, 0.0),  # positive lowers the trailing edge
        origin_body=FLAP_HINGE,
        angles=(np.radians(-10.0), np.radians(20.0)),
        keypoints=("flap_tip_right",),
    )
    (port, starboard), joints = both_sides(flap, hinge)
    # A flap is its own mirror image.
    return [replace(port, shapes=flap.shapes), starboard], joints


def base_ring() -> Shape:
    """The separation ring on the base."""
    profile = [(-0.69, 0.60), (-0.69, 0.76), (-0.73, 0.76), (-0.73, 0.60)]
    return lathe("aluminium", profile, 96, torus=True)
