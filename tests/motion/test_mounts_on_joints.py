"""Cameras and lamps on an arm: they move and turn with the part that carries them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.physics.frames import Pose
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator

# Keypoint "grip" of the model "servicer" sits on its hand, at the end of five hinges.
GRIP = np.array([2.2, 0.065, -0.66])
ARM = {"arm_yaw": 20.0, "arm_shoulder": -35.0, "arm_elbow": 80.0, "arm_pitch": -25.0}
ROLL = {"arm_roll": 40.0}
ATTITUDE = Rotation.from_euler("xyz", [25.0, -40.0, 70.0], degrees=True)
PLACE = np.array([7.0e6, -2.0e5, 3.0e5])
# Places of 7e6 m: a few units of their last digit.
FAR = 5e-9


def wrist(joints_deg: Mapping[str, float], **camera: Any) -> Scenario:
    """A camera and a lamp at the grip; another camera that looks at the grip, one at a finger."""
    grip = {"on": "servicer", "keypoint": "grip"}
    ahead = {**grip, "boresight": [0.6, 0.0, 0.8], "up": [0, 1, 0]}
    size = {"width_px": 64, "height_px": 64, "focal_length_mm": 0.5}
    apart = PLACE + np.array([9.0, -4.0, 3.0])
    away = {"position_icrf_m": apart.tolist(), "up": [0, 0, 1], **size}
    q = ATTITUDE.as_quat().tolist()
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {"direction_icrf": [0.0, 0.0, 1.0]},
            "earth": {"shape": "none"},
            "spacecraft": {
                "servicer": {
                    "model": "servicer",
                    "position_icrf_m": PLACE.tolist(),
                    "quaternion_icrf_from_body_xyzw": q,
                    "joints_deg": dict(joints_deg),
                }
            },
            "camera": {
                "wrist": {**ahead, **size, **camera},
                "grip": {**away, "look_at": {"target": "servicer", "keypoint": "grip"}},
                "finger": {**away, "look_at": {"target": "servicer", "part": "finger_1"}},
            },
            "lamp": {
                "spot": {
                    **grip,
                    "boresight": [0.6, 0.0, 0.8],
                    "half_angle_deg": 20.0,
                    "power_w": [1.0, 1.0, 1.0, 1.0],
                }
            },
            "render": {"inter_reflection": False},
        }
    )


def hand(joints_deg: Mapping[str, float], stored: Array) -> tuple[Array, Array]:
    """Where the hinges take a stored point (3,) of the hand, and R_body_from_hand."""
    lines = {
        "arm_yaw": ([0, 0, 1], [0.34, 0.0, -0.555]),
        "arm_shoulder": ([0, 1, 0], [0.34, 0.0, -0.66]),
        "arm_elbow": ([0, 1, 0], [1.19, 0.0, -0.66]),
        "arm_pitch": ([0, 1, 0], [1.94, 0.0, -0.66]),
        "arm_roll": ([1, 0, 0], [2.04, 0.065, -0.66]),
    }
    place, turn = stored, np.eye(3)
    for name in reversed(lines):
        axis, origin = (np.array(values, dtype=np.float64) for values in lines[name])
        R = Rotation.from_rotvec(np.radians(joints_deg.get(name, 0.0)) * axis).as_matrix()
        place, turn = origin + R @ (place - origin), R @ turn
    return place, turn


def check(state: SceneState, joints_deg: Mapping[str, float]) -> None:
    place_body, R_body_from_hand = hand(joints_deg, GRIP)
    R_icrf_from_body = ATTITUDE.as_matrix()
    place = PLACE + R_icrf_from_body @ place_body
    R_icrf_from_hand = R_icrf_from_body @ R_body_from_hand
    ahead, top = R_icrf_from_hand @ [0.6, 0.0, 0.8], R_icrf_from_hand @ [0.0, 1.0, 0.0]
    camera, lamp = state.cameras["wrist"], state.lamps[0]
    for position in (camera.position, lamp.position):
        np.testing.assert_allclose(position, place, rtol=0.0, atol=FAR)
    for direction in (camera.R_camera_from_icrf[2], lamp.direction):
        np.testing.assert_allclose(direction, ahead, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(camera.R_camera_from_icrf[1], -top, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("joints", [{}, ROLL, ARM, {**ARM, **ROLL}])
def test_a_camera_and_a_lamp_at_a_keypoint_go_with_its_joint(joints: dict[str, float]) -> None:
    scenario = wrist(joints)
    check(scenario.at(scenario.epoch_tai_ns), joints)


def test_joints_that_a_client_sends_carry_them_too() -> None:
    scenario = wrist({})
    angles = {name: np.radians(angle) for name, angle in ARM.items()}
    state = scenario.with_poses(scenario.epoch_tai_ns, {}, joint_angles={"servicer": angles})
    check(state, ARM)
    check(scenario.at(scenario.epoch_tai_ns), {})


def test_a_camera_keeps_a_moved_keypoint_and_a_moved_part_in_the_centre() -> None:
    scenario = wrist({**ARM, **ROLL})
    state = scenario.at(scenario.epoch_tai_ns)
    model = scenario.models["servicer"]
    corners = model.mesh.positions[model.mesh.part == model.parts.index("finger_1")]
    finger = 0.5 * (corners.min(axis=0).astype(np.float64) + corners.max(axis=0))
    for name, stored in (("grip", GRIP), ("finger", finger)):
        camera = state.cameras[name]
        point = PLACE + ATTITUDE.as_matrix() @ hand({**ARM, **ROLL}, stored)[0]
        pixel = camera.camera.project(camera.R_camera_from_icrf @ (point - camera.position))
        np.testing.assert_allclose(pixel, [32.0, 32.0], rtol=0.0, atol=1e-6)


def test_a_level_camera_on_a_joint_goes_with_it_and_stays_level() -> None:
    scenario = wrist(ARM, axes="icrf", boresight=[0, 0, 1], up=[1, 0, 0])
    camera = scenario.at(scenario.epoch_tai_ns).cameras["wrist"]
    place = PLACE + ATTITUDE.as_matrix() @ hand(ARM, GRIP)[0]
    np.testing.assert_allclose(camera.position, place, rtol=0.0, atol=FAR)
    np.testing.assert_allclose(camera.R_camera_from_icrf[2], [0, 0, 1], rtol=0.0, atol=1e-15)


def test_a_camera_on_the_hand_sees_the_fingers_in_one_place(gl: moderngl.Context) -> None:
    """Whatever the joints before the hand do, fingers and camera do not move to each other."""
    scenario, seen = wrist({}, boresight=[1.0, 0.0, 0.0]), []
    with Simulator(scenario, gl) as simulator:
        for joints in ({}, {**ARM, **ROLL}):
            angles = {name: np.radians(angle) for name, angle in joints.items()}
            state = scenario.with_poses(
                scenario.epoch_tai_ns, {}, joint_angles={"servicer": angles}
            )
            truth = simulator.capture(state, "wrist", frozenset({Product.TRUTH})).truth
            assert truth is not None
            fingers = [i for i, name in truth.part_names.items() if "/finger" in name]
            assert len(fingers) == 2
            seen.append(np.where(np.isin(truth.part_id, fingers), truth.depth, 0.0))
    assert (seen[0] > 0.0).sum() > 100
    # Rounding moves an edge past the middle of a pixel here and there.
    assert (np.abs(seen[1] - seen[0]) > 1e-4).sum() <= 4


def test_a_camera_that_goes_with_a_joint_moves_with_its_spacecraft() -> None:
    scenario = wrist(ARM)
    pose = Pose(position=np.zeros(3), velocity=np.ones(3), R_icrf_from_body=np.eye(3))
    camera = scenario.with_poses(scenario.epoch_tai_ns, {"servicer": pose}).cameras["wrist"]
    np.testing.assert_allclose(camera.position, hand(ARM, GRIP)[0], rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(camera.velocity, np.ones(3))
