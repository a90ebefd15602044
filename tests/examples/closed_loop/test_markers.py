"""Markers in an image, and the pose that they give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from examples.closed_loop.camera import Pinhole
from examples.closed_loop.markers import Board, find_markers
from examples.closed_loop.pose import solve_pose
from simgl.arrays import Array, Image16
from simgl.model_files.model_library import load_model

BOARD = Board.from_keypoints(dict(load_model("marker_board").keypoints))
NEAR = Pinhole(width=360, height=360, focal_length=640.0, cx=180.0, cy=180.0, pedestal_dn=64.0)
# A camera that looks along minus x of the board sees +y on its left and +z, the board's foot, down.
FACING = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])


def board_picture(rotation: Array, position: Array, white: float = 2000.0) -> Image16:
    """The board as drawn: rays through 5 x 5 points of each pixel, noise of 2 DN."""
    fine = 5
    at = (np.arange(NEAR.width * fine) + 0.5) / fine
    u, v = np.meshgrid((at - NEAR.cx) / NEAR.focal_length, (at - NEAR.cy) / NEAR.focal_length)
    x, y, z = (rotation[0, i] * u + rotation[1, i] * v + rotation[2, i] for i in range(3))
    origin = -rotation.T @ position
    along = (0.001 - origin[0]) / x
    y, z = origin[1] + along * y, origin[2] + along * z
    # The nearest disc of the grid: columns from +y to -y, rows from -z to +z, 0.12 m apart.
    column = np.clip(np.round(3.0 - y / 0.12), 0, 6).astype(int)
    row = np.clip(np.round(2.0 + z / 0.12), 0, 4).astype(int)
    away = np.hypot(y - (3 - column) * 0.12, z - (row - 2) * 0.12)
    light = np.where((np.abs(y) < 0.46) & (np.abs(z) < 0.34), 1.0, 0.1)
    ring = ((row == 0) & ((column == 0) | (column == 2))) | ((row == 4) & (column == 0))
    light[(away < 0.036) & ~(ring & (away < 0.45 * 0.036))] = 0.04
    light = light.reshape(NEAR.height, fine, NEAR.width, fine).mean(axis=(1, 3))
    noise = 2.0 * np.random.default_rng(3).standard_normal(light.shape)
    return np.asarray(np.round(64.0 + white * light + noise), dtype=np.uint16)


@pytest.mark.parametrize("distance", [1.7, 4.0, 10.0, 15.0])
def test_markers_give_the_pose_of_the_board(distance: float) -> None:
    rotation = Rotation.from_rotvec([0.02, -0.03, 0.015]).as_matrix() @ FACING
    position = np.array([0.01, -0.02, 1.0]) * distance
    dn = board_picture(rotation, position)
    # What the filter would predict: off by 2 % in distance, 4 px, a degree.
    wrong = Rotation.from_rotvec([-0.01, 0.01, 0.017]).as_matrix() @ rotation
    guess = position * 1.02 + np.array([4.0, -3.0, 0.0]) * distance / NEAR.focal_length
    predicted = NEAR.project_all(BOARD.centres @ wrong.T + guess)
    scale = NEAR.focal_length / float(guess[2])
    seen = find_markers(dn, NEAR, BOARD, predicted, scale, search=0.08 * scale + 5.0)
    assert seen is not None
    # Rings of 3 px may be too pale to be discs.
    assert len(seen.index) >= (35 if distance < 12.0 else 32)
    # Every disc is the one that it is taken for, and lies where it was drawn: noise of 2 in 1900 DN
    # is 1e-3 px, what partly covered pixels leave is a few hundredths.
    truth = NEAR.project_all(BOARD.centres[seen.index] @ rotation.T + position)
    assert np.abs(seen.points - truth).max() < 0.1
    pose = solve_pose(NEAR, BOARD.centres[seen.index], seen.points, (wrong, guess))
    assert pose is not None
    error = pose.position - position
    turn = Rotation.from_matrix(pose.R_camera_from_board @ rotation.T).as_rotvec()
    sigma = np.sqrt(np.diag(pose.covariance))
    assert np.all(np.abs(np.concatenate([error, turn])) < 4.0 * sigma)
    # The error of a place is that of a few hundredths of a pixel.
    assert np.abs(error[:2]).max() < 0.1 * distance / NEAR.focal_length


def test_a_board_seen_from_elsewhere_is_not_mistaken_for_the_one_expected() -> None:
    position = np.array([0.0, 0.0, 4.0])
    dn = board_picture(FACING, position)
    # Upside down: the same grid of discs, the rings in other corners.
    upside_down = Rotation.from_rotvec([0.0, 0.0, np.pi]).as_matrix() @ FACING
    predicted = NEAR.project_all(BOARD.centres @ upside_down.T + position)
    assert find_markers(dn, NEAR, BOARD, predicted, 160.0, search=10.0) is None


def test_no_markers_are_found_in_the_dark_or_where_the_board_is_not() -> None:
    dark = np.random.default_rng(1).poisson(66.0, (360, 360)).astype(np.uint16)
    predicted = NEAR.project_all(BOARD.centres @ FACING.T + [0.0, 0.0, 4.0])
    assert find_markers(dark, NEAR, BOARD, predicted, 160.0, search=30.0) is None
    seen = board_picture(FACING, np.array([0.0, 0.0, 4.0]))
    assert find_markers(seen, NEAR, BOARD, predicted + 2000.0, 160.0, search=30.0) is None


def test_the_covariance_of_a_pose_is_that_of_many_noisy_ones() -> None:
    rng = np.random.default_rng(8)
    position = np.array([0.1, 0.05, 2.0])
    rotation = Rotation.from_rotvec([0.1, 0.2, 0.0]).as_matrix() @ FACING
    exact = NEAR.project_all(BOARD.centres @ rotation.T + position)
    noise, errors, expected = 0.8, [], np.zeros(6)
    for _ in range(300):
        points = exact + noise * rng.standard_normal(exact.shape)
        pose = solve_pose(NEAR, BOARD.centres, points, (rotation, position))
        assert pose is not None
        turn = Rotation.from_matrix(pose.R_camera_from_board @ rotation.T).as_rotvec()
        errors.append(np.concatenate([pose.position - position, turn]))
        expected += np.diag(pose.covariance) / 300.0
    # Standard deviation of a variance from 300 samples: sqrt(2 / 300) = 8 %; 4 of those. The common
    # error of 0.03 px adds (0.03 / 0.8)^2 35 = 5 % at most.
    np.testing.assert_allclose(np.var(errors, axis=0), expected, rtol=0.37)
