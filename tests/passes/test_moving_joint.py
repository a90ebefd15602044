"""A joint that turns moves vertices on the GPU: nothing is made or uploaded for a pose."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import moderngl
import numpy as np
import pytest

import simgl.rays
from simgl.simulator import Product, Simulator
from tests.passes.test_nested_joints import bench

# Poses within 2 deg about a multiple of 5 deg, at which interreflection is baked.
YOKE_ANGLES = np.radians(35.0 + np.linspace(-1.0, 1.0, 8))
PRODUCTS = frozenset({Product.RADIANCE, Product.TRUTH})


@pytest.mark.parametrize("joint_light", [None, "exact", "quick"])
def test_a_turning_joint_makes_no_buffer_and_no_ray_structure(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    joint_light: Literal["exact", "quick"] | None,
) -> None:
    """The first frame uploads meshes and compiles programs; more poses make nothing.

    So close a view has a shadow map of its own, which rays fit to what the image shows.
    """
    made = {"buffers": 0, "vertex arrays": 0, "ray structures": 0}

    def counted(name: str, make: Any) -> Any:
        def counting(*args: Any, **named: Any) -> Any:
            made[name] += 1
            return make(*args, **named)

        return counting

    monkeypatch.setattr(moderngl.Context, "buffer", counted("buffers", moderngl.Context.buffer))
    arrays = counted("vertex arrays", moderngl.Context.vertex_array)
    monkeypatch.setattr(moderngl.Context, "vertex_array", arrays)
    structures = counted("ray structures", vars(simgl.rays)["EmbreeScene"])
    monkeypatch.setattr(simgl.rays, "EmbreeScene", structures)
    scenario, jointed, _ = bench(joint_light is not None, focal_length_mm=8.0)
    scenario = replace(scenario, models={"craft": jointed}, joint_light=joint_light or "exact")
    epoch = scenario.epoch_tai_ns
    poses = scenario.poses(epoch)
    with Simulator(scenario, gl) as simulator:
        for number, angle in enumerate([YOKE_ANGLES[0], *YOKE_ANGLES]):
            angles = {"craft": {"yoke": float(angle), "wing": np.radians(-50.0)}}
            state = scenario.with_poses(epoch, poses, joint_angles=angles)
            frame = simulator.capture(state, "cam", PRODUCTS)
            assert frame.info.interreflection == (joint_light or "off")
            if number == 0:
                assert min(made.values()) > 0
                made = dict.fromkeys(made, 0)
    assert made == {"buffers": 0, "vertex arrays": 0, "ray structures": 0}
