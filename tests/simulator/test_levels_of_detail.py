"""Pictures of far spacecraft from fewer triangles, against those from all."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.images import RadianceFrame
from simgl.scenario.scenario import Scenario
from simgl.simulator import Capture, Product, Simulator
from tests.scenes import scene

BOUND = 0.25  # pixels
PRODUCTS = frozenset({Product.RADIANCE, Product.TRUTH})


def before(
    distance: float,
    bound: float,
    sun: tuple[float, float, float],
    size: int,
    *,
    inter_reflection: bool = True,
) -> Scenario:
    """The shuttle with its bay towards the camera."""
    return scene(
        {"target": {"model": "space_rider", "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, -distance],
            "boresight": [0, 0, 1],
            "up": [0, 1, 0],
            "width_px": size,
            "height_px": size,
        },
        sun_direction=sun,
        render={"level_of_detail_error_px": bound, "inter_reflection": inter_reflection},
    )


def taken(gl: moderngl.Context, scenario: Scenario) -> Capture:
    """A picture and its truth."""
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", PRODUCTS)


def values(frame: RadianceFrame | None) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(height, width, 4)."""
    assert frame is not None
    return frame.radiance.astype(np.float64)


# Sun behind the camera, and from the side: most of what is lit is near its terminator.
@pytest.mark.parametrize("sun", [(0.3, 0.5, -0.8), (0.9, 0.4, 0.1)])
@pytest.mark.parametrize("distance", [200.0, 2000.0])
def test_far_pictures_keep_light_place_and_truth(
    gl: moderngl.Context, distance: float, sun: tuple[float, float, float]
) -> None:
    size = 256 if distance < 1000.0 else 48
    whole, fewer = (
        taken(gl, before(distance, bound, sun, size, inter_reflection=False))
        for bound in (0.0, BOUND)
    )
    a, b = values(whole.radiance), values(fewer.radiance)
    assert np.any(a != b)
    # Shadows of what is smaller than the bound, and of tubes that are narrower by up to 3 %.
    assert b.sum() == pytest.approx(a.sum(), rel=0.01)
    # Places that move by up to a quarter of a pixel; glints of gold foil move with them.
    assert np.abs(b - a).sum() < 0.05 * a.sum()
    y, x = np.mgrid[0:size, 0:size]
    centres = [((v.sum(axis=2) * [[x], [y]]).sum(axis=(2, 3)) / v.sum()).ravel() for v in (a, b)]
    # No place moves by more than the bound, nor does the middle of all light.
    np.testing.assert_allclose(centres[1], centres[0], atol=BOUND)
    assert whole.truth is not None
    assert fewer.truth is not None
    np.testing.assert_array_equal(fewer.truth.depth, whole.truth.depth)
    np.testing.assert_array_equal(fewer.truth.part_id, whole.truth.part_id)


def test_a_near_picture_is_the_same_bit_for_bit(gl: moderngl.Context) -> None:
    whole, fewer = (
        values(taken(gl, before(4.0, bound, (0.3, 0.5, -0.8), 96)).radiance)
        for bound in (0.0, BOUND)
    )
    np.testing.assert_array_equal(fewer, whole)


def test_what_was_drawn_before_does_not_matter(gl: moderngl.Context) -> None:
    """Far, near and far again: a choice of levels is not remembered."""
    scenario = before(200.0, BOUND, (0.3, 0.5, -0.8), 96)
    state = scenario.at(scenario.epoch_tai_ns)
    near = replace(state.cameras["cam"], position=np.array([0.0, 0.0, -20.0]))
    pictures = []
    with Simulator(scenario, gl) as simulator:
        for there in (state, replace(state, cameras={"cam": near}), state):
            pictures.append(values(simulator.capture(there, "cam", PRODUCTS).radiance))
    assert np.any(pictures[0] != pictures[1])
    np.testing.assert_array_equal(pictures[2], pictures[0])


def test_a_moved_joint_takes_its_level_along(gl: moderngl.Context) -> None:
    def picture(bound: float) -> np.ndarray[Any, np.dtype[np.float64]]:
        scenario = before(200.0, bound, (0.3, 0.5, -0.8), 256, inter_reflection=False)
        angles = {"target": {"panel_wing_left": 1.0, "panel_wing_right": -0.5}}
        poses = scenario.poses(scenario.epoch_tai_ns)
        state = scenario.with_poses(scenario.epoch_tai_ns, poses, joint_angles=angles)
        with Simulator(scenario, gl) as simulator:
            return values(simulator.capture(state, "cam", PRODUCTS).radiance)

    whole, fewer = picture(0.0), picture(BOUND)
    assert np.any(whole != fewer)
    assert np.abs(fewer - whole).sum() < 0.05 * whole.sum()
