"""A glossy panel beside a box, and what it shows of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from benchmarks.truth.light_scenes import joined
from simgl.arrays import Array, Mask, UIntArray
from simgl.motion.trajectory import FixedAttitude, Motion, UniformMotion
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from simgl.simulator import Capture, Product, Simulator
from tests.scenes import Table, scene
from tools.spacecraft_models.shapes import Shape, box

WHITE = Material(name="white", reflectance=(0.8, 0.8, 0.8, 0.8))
RED = Material(name="red", reflectance=(0.7, 0.1, 0.05, 0.6))
# Numbers of parts in images.
PANEL, BOX = 1, 2
# The box's face towards the panel is in sunlight, the panel is not.
SUN = (0.99, 0.15, -0.08)
_LENS: Table = {"up": [0.0, 0.0, 1.0], "focal_length_mm": 12.0, "pixel_pitch_um": 50.0}
# Across the panel to the box, which is seen in it; along the box's face.
ACROSS: Table = {
    **_LENS,
    "position_icrf_m": [4.5, 0.6, 3.0],
    "boresight": [-3.6, -0.6, -3.0],
}
ALONG: Table = {**_LENS, "position_icrf_m": [1.2, -4.2, 1.6], "boresight": [-0.2, 4.2, -1.5]}


def metal(alpha: float) -> Material:
    """Of a mean reflectance at normal incidence of 0.9."""
    return Material(
        name="metal", reflectance=(0.92, 0.9, 0.88, 0.9), metallic=1.0, roughness=alpha**0.5
    )


def dielectric(alpha: float) -> Material:
    """A black one: all that it turns to the viewer is of its lobe."""
    return Material(name="glass", reflectance=(0.0, 0.0, 0.0, 0.0), roughness=alpha**0.5)


def panel_and_box(
    glossy: Material,
    matt: Material = WHITE,
    *,
    sun: tuple[float, float, float] = SUN,
    shade: bool = False,
    panel: bool = True,
    camera: Table | None = None,
    **render: Any,
) -> Scenario:
    """A panel of 1.6 m in z = 0, from x = 0.55 on, and a box of 1 m on x = -0.5 to 0.5 that stands
    above it. With a shade, a wall keeps the sunlight from half of the box's face."""
    shapes = [(box("1", (1.0, 1.0, 1.0), (0.0, 0.0, 0.52)), 1)]
    if panel:
        shapes.insert(0, (box("0", (1.6, 1.6, 0.02), (1.35, 0.0, -0.01)), 0))
    if shade:
        shapes.append((box("2", (0.02, 1.0, 1.2), (1.6, 0.7, 1.3)), 1))
    return at_rest(shapes, (glossy, matt), sun, camera or ACROSS, render)


def at_rest(
    shapes: Sequence[tuple[Shape, int]],
    materials: tuple[Material, ...],
    sun: tuple[float, float, float],
    camera: Table,
    render: Table,
) -> Scenario:
    """A spacecraft at the origin, its parts shapes with the numbers of their materials."""
    settings = {"samples_per_pixel": 5, "glossy_reflections": True, **render}
    empty = scene({}, camera, sun_direction=sun, render=settings)
    parts = tuple(str(i) for i in range(len(shapes)))
    mesh = joined((shape, number, worn) for number, (shape, worn) in enumerate(shapes))
    model = SpacecraftModel(name="target", mesh=mesh, parts=parts, materials=materials)
    still = Motion(
        trajectory=UniformMotion(position=np.zeros(3), velocity=np.zeros(3), epoch_tai_ns=0),
        attitude=FixedAttitude(R_icrf_from_body=np.eye(3)),
    )
    return replace(empty, models={"target": model}, motions={"target": still})


def from_other_surfaces(gl: moderngl.Context, scenario: Scenario) -> tuple[Array, UIntArray]:
    """(height, width, 4) radiance of that light [W m-2 sr-1], and the number of the part."""
    capture = _captured(gl, scenario, Product.LAYERS)
    assert capture.layers is not None
    assert capture.truth is not None
    light = capture.layers.layers["inter_reflected"].astype(np.float64)
    return light, capture.truth.part_id % 65536


def radiance_and_parts(gl: moderngl.Context, scenario: Scenario) -> tuple[Array, UIntArray]:
    """The same of all light."""
    capture = _captured(gl, scenario, Product.RADIANCE)
    assert capture.radiance is not None
    assert capture.truth is not None
    return capture.radiance.radiance.astype(np.float64), capture.truth.part_id % 65536


def _captured(gl: moderngl.Context, scenario: Scenario, product: Product) -> Capture:
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        return simulator.capture(state, "cam", {product, Product.TRUTH})


def inside(seen: Mask) -> Mask:
    """Pixels whose four neighbours show the same."""
    inner = np.zeros_like(seen)
    inner[1:-1, 1:-1] = (
        seen[1:-1, 1:-1] & seen[:-2, 1:-1] & seen[2:, 1:-1] & seen[1:-1, :-2] & seen[1:-1, 2:]
    )
    return inner
