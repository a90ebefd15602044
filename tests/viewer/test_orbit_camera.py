"""The camera that circles a spacecraft: laws of dragging, zooming and its pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.motion.mounts import OrbitingMount
from simgl.physics.frames import Pose
from simgl.scenario.scenario import Scenario
from simgl.viewer.orbit_camera import OrbitCamera, orbit_axes
from tests.viewer.harness import orbit_camera


def random_cameras(count: int) -> list[OrbitCamera]:
    rng = np.random.default_rng(5)
    angles = rng.uniform(-np.pi, np.pi, (count, 2))
    return [orbit_camera(float(a), float(e), rng.uniform(5.0, 5000.0)) for a, e in angles]


@pytest.mark.parametrize("camera", random_cameras(5))
def test_dragging_keeps_the_range(camera: OrbitCamera) -> None:
    position, _ = camera.dragged(0.7, -1.9).pose(np.zeros(3), np.eye(3))
    # Two rotation matrices of float64: a few units in the last place.
    assert np.linalg.norm(position) == pytest.approx(camera.range, rel=1e-14)


@pytest.mark.parametrize("camera", random_cameras(5))
def test_dragging_to_the_right_by_a_whole_turn_returns(camera: OrbitCamera) -> None:
    turned = camera
    for _ in range(8):
        turned = turned.dragged(0.25 * np.pi, 0.0)
    assert turned.elevation == pytest.approx(camera.elevation, abs=1e-14)
    assert turned.azimuth == camera.azimuth


def test_zoom_steps_multiply_the_range() -> None:
    camera = orbit_camera(distance=100.0)
    assert camera.zoomed(1.0).range == pytest.approx(100.0 / 1.1)
    assert camera.zoomed(-2.0).range == pytest.approx(100.0 * 1.1**2)
    assert camera.zoomed(3.0).zoomed(-3.0).range == pytest.approx(100.0)


def test_zoom_stops_at_the_limits_of_the_range() -> None:
    assert orbit_camera().zoomed(1e3).range == 5.0
    assert orbit_camera().zoomed(-1e3).range == 5000.0


def test_a_range_outside_its_limits_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^range must lie in 5 to 5000 m, got 4$"):
        orbit_camera(distance=4.0)


@pytest.mark.parametrize("camera", random_cameras(20))
def test_the_boresight_runs_through_the_target(camera: OrbitCamera) -> None:
    position, R_camera_from_icrf = camera.pose(np.zeros(3), np.eye(3))
    target_camera = R_camera_from_icrf @ (np.zeros(3) - position)
    np.testing.assert_allclose(target_camera / camera.range, [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(R_camera_from_icrf @ R_camera_from_icrf.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R_camera_from_icrf) == pytest.approx(1.0)


@pytest.mark.parametrize("camera", random_cameras(5))
def test_the_pose_is_that_of_a_scenario_camera_with_the_same_angles(
    camera: OrbitCamera, scenario: Scenario
) -> None:
    mount = OrbitingMount(
        target="ball", azimuth=camera.azimuth, elevation=camera.elevation, range=camera.range
    )
    state = replace(scenario, mounts={"square": mount}).at(scenario.epoch_tai_ns)
    target, expected = state.bodies["ball"].pose, state.cameras["square"]
    position, R_camera_from_icrf = camera.pose(target.position, orbit_axes(target))
    # Positions of 7e6 m carry 1e-9 m.
    np.testing.assert_allclose(position, expected.position, rtol=0.0, atol=4e-9)
    np.testing.assert_allclose(R_camera_from_icrf, expected.R_camera_from_icrf, atol=1e-12)


@pytest.mark.parametrize("camera", random_cameras(20))
def test_the_target_follows_the_hand(camera: OrbitCamera) -> None:
    """A mark on the side that faces the camera moves right when dragged right, down when down."""
    mark = camera.pose(np.zeros(3), np.eye(3))[0] / camera.range

    def place(moved: OrbitCamera) -> Array:
        position, R_camera_from_icrf = moved.pose(np.zeros(3), np.eye(3))
        return R_camera_from_icrf @ (mark - position)

    right, down = place(camera.dragged(1e-3, 0.0)), place(camera.dragged(0.0, 1e-3))
    assert right[0] > 0.0
    assert abs(right[1]) < 1e-3 * right[0]
    assert down[1] > 0.0


def test_a_craft_at_rest_is_circled_with_celestial_north_up() -> None:
    place = np.array([1e7, 0.0, 0.0])
    rest = Pose(position=place, velocity=np.zeros(3), R_icrf_from_body=np.eye(3))
    _, R_camera_from_icrf = orbit_camera(0.0, 0.0).pose(rest.position, orbit_axes(rest))
    bottom_icrf = R_camera_from_icrf[1]
    np.testing.assert_allclose(bottom_icrf, [0.0, 0.0, -1.0], atol=1e-15)
