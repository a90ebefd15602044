"""Scenes of Lambertian spacecraft that light themselves: shipped ones and two of simple shapes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.bench.peers.lambertian import as_lambertian, lambertian_scenario
from simgl.motion.trajectory import FixedAttitude, Motion, UniformMotion
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from tests.scenes import SUN
from tools.spacecraft_models.shapes import Shape, box, handrail, lathe, rod, shaded, tube

_BAYS = Path(__file__).parents[1] / "path_tracer"
_REFLECTANCES = {
    "white": (0.82, 0.80, 0.76, 0.78),
    "foil": (0.75, 0.56, 0.28, 0.85),
    "grey": (0.35, 0.35, 0.36, 0.40),
    "dark": (0.06, 0.06, 0.07, 0.10),
}
_MATERIALS = tuple(Material(name=name, reflectance=r) for name, r in _REFLECTANCES.items())
_NAMES = tuple(_REFLECTANCES)


def scenes() -> dict[str, Scenario]:
    """By name; each has one camera, "cam"."""
    return {
        "bay": lambertian_scenario(_BAYS / "bay.toml"),
        "Earth-lit bay": lambertian_scenario(_BAYS / "earth.toml"),
        "servicer": _servicer(),
        "crate": _at_rest(_crate(), (-0.45, -0.25, 0.85), (1.9, -2.3, 3.1), (0.0, 0.0, 0.35), 6.0),
        "relay": _at_rest(_relay(), (0.55, 0.6, 0.58), (4.2, 2.9, 3.6), (0.0, 0.0, 0.3), 6.5),
    }


def _camera(
    place: Sequence[float], at: Sequence[float], focal_length_mm: float
) -> dict[str, object]:
    return {
        "position_icrf_m": list(place),
        "boresight": [float(v) for v in np.subtract(at, place)],
        "up": [0.0, 0.0, 1.0],
        "width_px": 200,
        "height_px": 200,
        "pixel_pitch_um": 10.0,
        "focal_length_mm": focal_length_mm,
    }


def _servicer() -> Scenario:
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {**SUN, "direction_icrf": [0.35, 0.72, -0.6]},
            "earth": {"shape": "none"},
            "spacecraft": {"target": {"model": "servicer", "position_icrf_m": [0.0, 0.0, 0.0]}},
            "camera": {"cam": _camera((2.6, 3.4, -2.2), (0.3, 0.0, 0.0), 3.6)},
            "render": {"samples_per_pixel": 256},
        }
    )
    return as_lambertian(scenario)


def _at_rest(
    shapes: list[list[Shape]],
    sun: Sequence[float],
    place: Sequence[float],
    at: Sequence[float],
    focal_length_mm: float,
) -> Scenario:
    """A craft of parts that are shapes each, at rest at the origin."""
    empty = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {**SUN, "direction_icrf": list(sun)},
            "earth": {"shape": "none"},
            "spacecraft": {},
            "camera": {"cam": _camera(place, at, focal_length_mm)},
            "render": {"samples_per_pixel": 256},
        }
    )
    model = SpacecraftModel(
        name="target",
        mesh=_mesh(shapes),
        parts=tuple(str(i) for i in range(len(shapes))),
        materials=_MATERIALS,
    )
    still = Motion(
        trajectory=UniformMotion(position=np.zeros(3), velocity=np.zeros(3), epoch_tai_ns=0),
        attitude=FixedAttitude(R_icrf_from_body=np.eye(3)),
    )
    return replace(empty, models={"target": model}, motions={"target": still})


def _mesh(parts: list[list[Shape]]) -> Mesh:
    return joined(
        # Each shape wears one material.
        (shape, number, _NAMES.index(str(shaded(shape).materials[0])))
        for number, shapes in enumerate(parts)
        for shape in shapes
    )


def joined(shapes: Iterable[tuple[Shape, int, int]]) -> Mesh:
    """One mesh of shapes, each with the numbers of its part and of its material."""
    positions, normals, triangles, part, material = [], [], [], [], []
    start = 0
    for shape, number, worn in shapes:
        one = shaded(shape)
        positions.append(one.positions)
        normals.append(one.normals)
        triangles.append(one.triangles + start)
        part.append(np.full(len(one.positions), number))
        material.append(np.full(len(one.positions), worn))
        start += len(one.positions)
    return Mesh(
        positions=np.concatenate(positions).astype(np.float32),
        normals=np.concatenate(normals).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        part=np.concatenate(part).astype(np.uint32),
        material=np.concatenate(material).astype(np.uint32),
    )


def _crate() -> list[list[Shape]]:
    """An open box with a shelf, boxes, pipes and a rail in it."""
    walls = [
        box("grey", (1.6, 1.2, 0.03), (0.0, 0.0, -0.015)),
        box("foil", (0.03, 1.2, 0.8), (-0.785, 0.0, 0.4)),
        box("white", (0.03, 1.2, 0.8), (0.785, 0.0, 0.4)),
        box("foil", (1.54, 0.03, 0.8), (0.0, 0.585, 0.4)),
        box("white", (1.54, 0.03, 0.3), (0.0, -0.585, 0.15)),
    ]
    shelf = [box("white", (0.7, 0.35, 0.02), (-0.4, 0.39, 0.42))]
    boxes = [
        box("white", (0.3, 0.25, 0.22), (0.2, 0.1, 0.11)),
        box("dark", (0.18, 0.3, 0.12), (0.5, -0.3, 0.06)),
        box("foil", (0.25, 0.2, 0.3), (-0.45, -0.2, 0.15)),
        box("grey", (0.2, 0.2, 0.15), (-0.5, 0.4, 0.505)),
    ]
    pipes = [
        rod("white", (-0.77, -0.35, 0.08), (0.77, -0.45, 0.08), 0.03, 16),
        rod("foil", (0.6, 0.3, 0.0), (0.6, 0.3, 0.7), 0.06, 20),
        *handrail("white", (-0.1, 0.56, 0.2), (0.45, 0.56, 0.2), (0.0, -0.08, 0.0)),
    ]
    return [walls, shelf, boxes, pipes]


def _relay() -> list[list[Shape]]:
    """A bus with a dish, an array beside it, a nozzle, struts and boxes."""
    bus = [box("foil", (1.4, 1.2, 1.3))]
    profile = np.array([(0.0, 0.0), (0.02, 0.25), (0.09, 0.5), (0.2, 0.75), (0.36, 1.0)])
    back = profile[::-1] - [0.03, 0.0]
    back[-1, 1] = 0.0
    dish = [
        lathe("white", np.concatenate([profile[:1] * 0.0, profile[1:], back]), 48)
        .turned(Rotation.from_euler("y", -90.0, degrees=True))
        .moved((0.0, 0.0, 0.95))
    ]
    struts = [
        rod("grey", (0.5, 0.4, 0.65), (0.25, 0.2, 1.02), 0.02, 10),
        rod("grey", (-0.5, 0.4, 0.65), (-0.25, 0.2, 1.02), 0.02, 10),
        rod("grey", (0.0, -0.5, 0.65), (0.0, -0.25, 1.02), 0.02, 10),
        rod("white", (0.0, 0.0, 0.94), (0.0, 0.0, 1.6), 0.03, 12),
    ]
    array = [
        box("dark", (0.9, 2.2, 0.03), (0.0, 2.0, -0.2)),
        rod("grey", (0.0, 0.6, -0.2), (0.0, 0.95, -0.2), 0.04, 12),
    ]
    boxes = [
        box("white", (0.3, 0.5, 0.4), (0.85, -0.2, -0.25)),
        box("grey", (0.25, 0.3, 0.3), (0.825, 0.4, 0.3)),
        box("dark", (0.12, 0.2, 0.25), (0.76, 0.25, -0.4)),
        box("white", (0.4, 0.15, 0.5), (-0.3, 0.675, 0.25)),
        tube("grey", (0.69, 1.1), (0.16, 0.18), 28).moved((0.0, -0.25, 0.35)),
    ]
    return [bus, dish, struts, array, boxes]
