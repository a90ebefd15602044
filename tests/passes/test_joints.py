"""A part that a joint has turned looks as if its body had turned."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.motion.joints import Joint
from simgl.physics.frames import Pose
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import scene

HINGE = Joint(
    name="hinge",
    parts=(0,),
    axis_body=np.array([0.0, 0.6, 0.8]),
    origin_body=np.zeros(3),
    limits=(-np.pi, np.pi),
)


def panel(material: str) -> Scenario:
    """A slab before a camera 3 m away, sunlit from the side."""
    scenario = scene(
        {
            "panel": {
                "model": {"box": {"size_m": [1.0, 0.8, 0.05], "material": material}},
                "position_icrf_m": [7.0e6, 0.0, 0.0],
            }
        },
        {
            "position_icrf_m": [7.0e6, 0.0, 3.0],
            "look_at": "panel",
            "width_px": 96,
            "height_px": 96,
            "focal_length_mm": 0.9,
        },
        sun_direction=(0.5, 0.2, 1.0),
        render={"samples_per_pixel": 8},
    )
    models = {n: replace(m, joints=(HINGE,)) for n, m in scenario.models.items()}
    return replace(scenario, models=models)


@pytest.mark.parametrize("material", ["solar_cell", "mli_gold", "white_paint"])
def test_a_turned_part_is_a_turned_body(gl: moderngl.Context, material: str) -> None:
    """To rounding of places in float32, which moves a few samples across a pattern's lines."""
    angle = 0.7
    scenario = panel(material)
    epoch = scenario.epoch_tai_ns
    poses = scenario.poses(epoch)
    turn = Rotation.from_rotvec(angle * HINGE.axis_body).as_matrix()
    pose = poses["panel"]
    turned = Pose(position=pose.position, velocity=pose.velocity, R_icrf_from_body=turn)
    with Simulator(scenario, gl) as simulator:
        products = {Product.RADIANCE}
        by_joint = scenario.with_poses(epoch, poses, joint_angles={"panel": {"hinge": angle}})
        by_body = scenario.with_poses(epoch, {"panel": turned})
        one, other = (simulator.capture(s, "cam", products).radiance for s in (by_joint, by_body))
        as_stored = simulator.capture(scenario.at(epoch), "cam", products).radiance
    assert one is not None
    assert other is not None
    assert as_stored is not None
    difference = np.abs(one.radiance - other.radiance).max(axis=-1)
    scale = np.percentile(other.radiance, 99)
    assert np.percentile(difference, 98) < 1e-3 * scale
    assert difference.mean() < 1e-3 * scale
    # And it is another picture than the stored one, so the comparison says something.
    assert np.abs(as_stored.radiance - other.radiance).mean() > 0.05 * scale


@pytest.mark.parametrize("material", ["solar_cell", "mli_gold"])
def test_a_part_on_two_joints_is_a_body_turned_twice(gl: moderngl.Context, material: str) -> None:
    """Its pattern too, which lies where the surface is stored; to rounding as above."""
    first = Joint(
        name="first",
        parts=(),
        axis_body=np.array([0.6, 0.8, 0.0]),
        origin_body=np.array([0.3, -0.2, 0.1]),
        limits=(-np.pi, np.pi),
    )
    scenario = panel(material)
    models = {n: replace(m, joints=(first, replace(HINGE, parent=0)))
              for n, m in scenario.models.items()}  # fmt: skip
    scenario = replace(scenario, models=models)
    epoch = scenario.epoch_tai_ns
    poses = scenario.poses(epoch)
    angles = {"first": -0.4, "hinge": 0.7}
    carrier = Rotation.from_rotvec(-0.4 * first.axis_body)
    turn = (carrier * Rotation.from_rotvec(0.7 * HINGE.axis_body)).as_matrix()
    shift = first.origin_body - carrier.apply(first.origin_body)
    pose = poses["panel"]
    turned = Pose(position=pose.position + shift, velocity=pose.velocity, R_icrf_from_body=turn)
    cameras = {"cam": scenario.at(epoch).cameras["cam"]}
    with Simulator(scenario, gl) as simulator:
        by_joint = scenario.with_poses(epoch, poses, joint_angles={"panel": angles})
        by_body = scenario.with_poses(epoch, {"panel": turned})
        one, other = (
            simulator.capture(replace(s, cameras=cameras), "cam", {Product.RADIANCE}).radiance
            for s in (by_joint, by_body)
        )
    assert one is not None
    assert other is not None
    difference = np.abs(one.radiance - other.radiance).max(axis=-1)
    scale = np.percentile(other.radiance, 99)
    assert np.percentile(difference, 98) < 1e-3 * scale
    assert difference.mean() < 1e-3 * scale
