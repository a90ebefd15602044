"""Two spacecraft near each other, and the light that one gets from the other."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import Table, lambert, scene

WHITE = 0.8
BOX: Table = {"box": {"size_m": [1.0, 1.0, 1.0], "material": lambert(WHITE)}}
FLAT_BOX: Table = {"box": {"size_m": [1.0, 1.0, 0.5], "material": lambert(WHITE)}}
# Seen from the side where the boxes face each other.
BESIDE: Table = {"position_icrf_m": [2.0, 4.0, 0.0], "boresight": [-1.5, -4.0, 0.0]}
# From within the bay, past its rim.
IN_THE_BAY: Table = {
    "position_icrf_m": [0.3, 0.5, -1.0],
    "boresight": [-0.3, 0.12, -1.8],
    "up": [0.0, 1.0, 0.0],
}
# From before the bay.
INTO_THE_BAY: Table = {
    "position_icrf_m": [0.5, 0.3, -5.0],
    "boresight": [-0.1, 0.05, 1.0],
    "up": [0.0, 1.0, 0.0],
}


def two_boxes(gap: float, sun: tuple[float, float, float], **render: Any) -> Scenario:
    """A box at the origin and another one beyond a gap along +x [m]."""
    return near(BOX, {"model": BOX, "position_icrf_m": [1.0 + gap, 0.0, 0.0]}, BESIDE, sun, render)


def box_over_bay(sun: tuple[float, float, float], **render: Any) -> Scenario:
    """A box 2 m before the open bay of Space Rider."""
    box = {
        "model": FLAT_BOX,
        "position_icrf_m": [0.0, 0.62, -2.8],
        "quaternion_icrf_from_body_xyzw": [0.0, 0.0, 0.5, 0.8660254],
    }
    return near("space_rider", box, IN_THE_BAY, sun, render)


def box_behind_bay(**render: Any) -> Scenario:
    """A box behind the back of the sunlit bay of Space Rider."""
    box = {"model": FLAT_BOX, "position_icrf_m": [0.0, 0.62, 4.0]}
    return near("space_rider", box, INTO_THE_BAY, (-0.3, 0.25, -0.92), render)


def large_and_small(apart: float) -> Scenario:
    """Boxes of 4 m and of 0.4 m so far from each other [m]."""
    large: Table = {"box": {"size_m": [4.0, 4.0, 4.0], "material": lambert(WHITE)}}
    small: Table = {"box": {"size_m": [0.4, 0.4, 0.4], "material": lambert(WHITE)}}
    box = {"model": small, "position_icrf_m": [apart, 0.0, 0.0]}
    return near(large, box, BESIDE, (-0.8, 0.0, 0.6), {})


def near(
    target: Table | str,
    chaser: Table,
    camera: Table,
    sun: tuple[float, float, float],
    render: Table,
) -> Scenario:
    """A target at the origin and a chaser."""
    return scene(
        {"target": {"model": target, "position_icrf_m": [0.0, 0.0, 0.0]}, "chaser": chaser},
        {"up": [0.0, 0.0, 1.0], "focal_length_mm": 10.0, "pixel_pitch_um": 40.0, **camera},
        sun_direction=sun,
        render={"samples_per_pixel": 5, "between_spacecraft": True, **render},
    )


def from_other_surfaces(gl: moderngl.Context, scenario: Scenario) -> tuple[Array, Array]:
    """(height, width) radiance of that light, bands together, and the number of the spacecraft."""
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        capture = simulator.capture(state, "cam", {Product.LAYERS, Product.TRUTH})
    assert capture.layers is not None
    assert capture.truth is not None
    light = capture.layers.layers["inter_reflected"].astype(np.float64).sum(axis=2)
    return light, np.asarray(capture.truth.instance)


def square_seen(x: float, y: float) -> float:
    """Share of a hemisphere, weighted by the cosine, of a parallel rectangle whose corner stands
    over the place, its edges x and y times its distance long."""
    first, second = np.sqrt(1.0 + x * x), np.sqrt(1.0 + y * y)
    angles = x / first * np.arctan(y / first) + y / second * np.arctan(x / second)
    return float(angles / (2.0 * np.pi))
