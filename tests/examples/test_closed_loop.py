"""The closed-loop example: its parts obey their laws, and the loop arrives."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from simgl_bridge import BodyPose, Client
from simgl_bridge import Image as BridgeImage

from examples.closed_loop.attitude import Attitude, turned
from examples.closed_loop.camera import Image, Pinhole
from examples.closed_loop.exposure import ExposureControl, Light
from examples.closed_loop.guidance import Leg, Plan
from examples.closed_loop.loop import CAMERA as NAVCAM
from examples.closed_loop.loop import LAMP, Flight, Settings, fly
from examples.closed_loop.markers import Board, find_markers
from examples.closed_loop.navigation import (
    Estimate,
    Filter,
    Fix,
    after_push,
    far_fix,
    predict,
    update,
)
from examples.closed_loop.pose import locate, solve_pose
from examples.closed_loop.relative_motion import transition, velocity_to_reach
from examples.closed_loop.report import summarise, write_report
from examples.closed_loop.silhouette import (
    SPACE_RIDER_WING,
    TipPattern,
    find_target,
    fit_tip,
)
from examples.closed_loop.spacecraft import EARTH_J2, Orbit, gravity, relative_state
from simgl import load_scenario
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS
from simgl.scenario.library import load_model
from tests.bridge.harness import finish, start

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "examples" / "docking.toml"
RADIUS = WGS84_EQUATORIAL_RADIUS + 400e3
MEAN_MOTION = float(np.sqrt(EARTH_MU / RADIUS**3))
CAMERA = Pinhole(width=600, height=600, focal_length=1000.0, cx=300.0, cy=300.0, pedestal_dn=64.0)


def two_body(orbit: Orbit, duration: float) -> Orbit:
    """An orbit carried on by a general integrator under the Earth's mass alone."""

    def rate(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], -EARTH_MU * y[:3] / np.linalg.norm(y[:3]) ** 3])

    start = np.concatenate([orbit.position, orbit.velocity])
    end = solve_ivp(rate, (0.0, duration), start, rtol=1e-12, atol=1e-6).y[:, -1]
    return Orbit(position=end[:3], velocity=end[3:])


def circular() -> Orbit:
    """A circular equatorial orbit at 400 km."""
    return Orbit(
        position=np.array([RADIUS, 0.0, 0.0]), velocity=np.array([0.0, RADIUS * MEAN_MOTION, 0.0])
    )


def beside(target: Orbit, relative: Array) -> Orbit:
    """The craft with a relative state (6,) in the target's LVLH frame."""
    R_icrf_from_lvlh = target.R_lvlh_from_icrf.T
    turning = R_icrf_from_lvlh @ np.array([0.0, -target.mean_motion, 0.0])
    offset = R_icrf_from_lvlh @ relative[:3]
    return Orbit(
        position=target.position + offset,
        velocity=target.velocity + R_icrf_from_lvlh @ relative[3:] + np.cross(turning, offset),
    )


@pytest.mark.parametrize("axis", range(6))
def test_clohessy_wiltshire_transition_agrees_with_two_body_orbits(axis: int) -> None:
    duration, size = 600.0, np.array([100.0, 100.0, 100.0, 0.1, 0.1, 0.1])
    start = np.zeros(6)
    start[axis] = size[axis]
    target = circular()
    chaser = beside(target, start)
    np.testing.assert_allclose(relative_state(chaser, target), start, atol=1e-8)
    ended = relative_state(two_body(chaser, duration), two_body(target, duration))
    # The linear equations leave out gravity terms of second order, at most 3 n^2 d^2 / r for a
    # distance d; the farthest of these starts drifts to d = 300 m. Integrated twice over t, with a
    # factor 2 for the growth of the free motion: 3 n^2 d^2 t^2 / r = 0.018 m; once for the rate.
    bound = 3.0 * MEAN_MOTION**2 * 300.0**2 / RADIUS * duration
    predicted = transition(MEAN_MOTION, duration) @ start
    np.testing.assert_allclose(ended[:3], predicted[:3], atol=bound * duration)
    np.testing.assert_allclose(ended[3:], predicted[3:], atol=2.0 * bound)


def test_a_hop_with_the_computed_velocity_ends_at_its_aim() -> None:
    start, aim = np.array([-150.0, 3.0, -2.0]), np.array([-138.0, 0.0, 0.0])
    velocity = velocity_to_reach(MEAN_MOTION, 30.0, start, aim)
    target = circular()
    chaser = beside(target, np.concatenate([start, velocity]))
    ended = relative_state(two_body(chaser, 30.0), two_body(target, 30.0))
    # As above with d = 150 m, t = 30 s: 3 n^2 d^2 t^2 / r = 1.2e-5 m.
    np.testing.assert_allclose(ended[:3], aim, atol=1.2e-5)


def test_gravity_is_the_gradient_of_its_potential() -> None:
    place = np.array([3.1e6, -4.2e6, 4.3e6])

    def potential(p: Array) -> float:
        r = float(np.linalg.norm(p))
        legendre = 0.5 * (3.0 * (p[2] / r) ** 2 - 1.0)
        bulge = EARTH_J2 * (WGS84_EQUATORIAL_RADIUS / r) ** 2 * legendre
        return float(EARTH_MU / r * (1.0 - bulge))

    # Central difference with h = 100 m: h^2 r^-4 mu = 2e-9, and rounding of 6e7 eps / h = 1e-10.
    h = 100.0
    slope = [(potential(place + h * e) - potential(place - h * e)) / (2.0 * h) for e in np.eye(3)]
    np.testing.assert_allclose(gravity(place), slope, atol=1e-8)


def test_one_step_of_truth_is_a_small_part_of_a_millimetre_from_a_fine_integration() -> None:
    orbit = circular()
    fine = orbit
    for _ in range(30):
        fine = fine.advanced(0.1)
    np.testing.assert_allclose(orbit.advanced(3.0).position, fine.position, atol=1e-6)


def covered(begin: float, end: float, count: int) -> Array:
    """(count,) share of each pixel that an interval covers."""
    pixels = np.arange(count, dtype=np.float64)
    overlap = np.minimum(end, pixels + 1.0) - np.maximum(begin, pixels)
    return np.asarray(np.clip(overlap, 0.0, 1.0))


def rectangle(left: float, top: float, width: float, height: float, signal: float = 900.0) -> Image:
    """A bright rectangle on a dark sky with a noise of 1 DN, exact to a part of a pixel."""
    rng = np.random.default_rng(5)
    light = np.outer(covered(top, top + height, 600), covered(left, left + width, 600))
    return np.round(64.0 + signal * light + rng.standard_normal((600, 600))).astype(np.uint16)


PLAIN = TipPattern(span=10.0, bars=(), cells=((0.0, 5.0),), length=1.6)


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.25, 0.4, 0.5, 0.65, 0.8, 0.95])
def test_both_tips_follow_the_target_by_parts_of_a_pixel(shift: float) -> None:
    found = find_target(rectangle(200.0 + shift, 310.0 - shift, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    assert found.left_tip is not None
    assert found.right_tip is not None
    # Noise of 1 DN over 11 rows and 900 DN signal is 4e-4 px; the fit's grid is 0.01 px and the
    # threshold costs nothing: 0.05 px leaves room for rounding to whole DN.
    assert found.left_tip == pytest.approx((200.0 + shift, 315.5 - shift), abs=0.05)
    assert found.right_tip == pytest.approx((260.0 + shift, 315.5 - shift), abs=0.05)


@pytest.mark.parametrize("scale", [5.3, 11.0, 53.0])
@pytest.mark.parametrize("tip", [3.2, 3.5, 3.9])
def test_a_bright_frame_does_not_move_the_fitted_tip(scale: float, tip: float) -> None:
    def strips(pieces: tuple[tuple[float, float], ...]) -> Array:
        count = int(3 + 1.6 * scale)
        total = np.zeros(count)
        for begin, end in pieces:
            total += covered(tip + begin * scale, tip + end * scale, count)
        return total

    profile = 800.0 * strips(SPACE_RIDER_WING.bars) + 120.0 * strips(SPACE_RIDER_WING.cells)
    # No noise: the fit's grid of 0.01 px.
    assert fit_tip(profile, 3.0, scale, SPACE_RIDER_WING) == pytest.approx(tip, abs=0.0101)


def test_an_empty_image_has_no_target() -> None:
    assert find_target(rectangle(0.0, 0.0, 0.0, 0.0), CAMERA, PLAIN) is None


def test_the_largest_region_is_the_target() -> None:
    sky = rectangle(300.0, 300.0, 50.0, 10.0).astype(np.int64)
    sky += rectangle(100.0, 100.0, 5.0, 5.0, signal=3000.0) - 64
    found = find_target(sky.clip(0).astype(np.uint16), CAMERA, PLAIN)
    assert found is not None
    assert found.box == (300, 300, 350, 310)


def test_a_target_that_shadow_cuts_in_pieces_is_one_target() -> None:
    sky = rectangle(200.0, 300.0, 40.0, 20.0).astype(np.int64)
    sky += rectangle(245.0, 300.0, 30.0, 20.0) - 64
    sky += rectangle(210.0, 285.0, 10.0, 10.0) - 64
    sky += rectangle(280.0, 305.0, 2.0, 2.0, signal=3000.0) - 64  # a star
    found = find_target(sky.clip(0).astype(np.uint16), CAMERA, PLAIN)
    assert found is not None
    assert found.box == (200, 285, 275, 320)


def test_a_target_cut_by_the_border_has_no_tips_and_no_place() -> None:
    found = find_target(rectangle(-5.0, 300.0, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    assert found.left_tip is None
    assert found.right_tip is None
    assert locate(found, CAMERA, np.eye(3), (np.zeros(3), np.ones(3))) is None


def test_two_rays_give_the_position_that_they_come_from() -> None:
    camera_lvlh = np.array([-40.0, 0.7, -1.1])
    tips = np.array([0.0, -5.0, 2.6]), np.array([0.0, 5.0, 2.6])
    R_lvlh_from_camera = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    left, right = (CAMERA.project(R_lvlh_from_camera.T @ (tip - camera_lvlh)) for tip in tips)
    found = find_target(rectangle(200.0, 300.0, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    seen = replace(found, left_tip=left, right_tip=right)
    position = locate(seen, CAMERA, R_lvlh_from_camera, tips)
    assert position is not None
    np.testing.assert_allclose(position, camera_lvlh, atol=1e-9)
    # A tip 20 px too high fits no position.
    wrong = replace(seen, left_tip=(left[0], left[1] - 20.0))
    assert locate(wrong, CAMERA, R_lvlh_from_camera, tips) is None


BOARD = Board.from_keypoints(dict(load_model("marker_board").keypoints))
NEAR = Pinhole(width=360, height=360, focal_length=640.0, cx=180.0, cy=180.0, pedestal_dn=64.0)
# A camera that looks along minus x of the board sees +y on its left and +z, the board's foot, down.
FACING = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])


def board_picture(rotation: Array, position: Array, white: float = 2000.0) -> Image:
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


def estimate_at(position: Array, sigma: float, turn_sigma: float = 1e-3) -> Estimate:
    """A resting estimate with the same error along each axis, and 0.01 m/s."""
    return Estimate(
        mean=np.concatenate([position, np.zeros(6)]),
        covariance=np.diag([sigma**2] * 3 + [1e-4] * 3 + [turn_sigma**2] * 3),
    )


def fix_at(position: Array, point: Array | None = None) -> Fix:
    """Of the chaser from a point of the target, by its wings."""
    origin = np.zeros(3) if point is None else point
    return far_fix(position, origin, tip_error=3e-4, span=10.0, drawing_error=0.0)


def test_range_error_grows_with_the_square_and_lateral_error_with_the_range() -> None:
    near, far = (
        np.sqrt(np.diag(fix_at(np.array([-d, 0.0, 0.0])).covariance)) for d in (20.0, 200.0)
    )
    np.testing.assert_allclose(far / near, [100.0, 10.0, 10.0], rtol=1e-12)
    np.testing.assert_allclose(near, [np.sqrt(2.0) * 3e-4 * 40.0, 6e-3, 6e-3], rtol=1e-12)


def test_the_filter_rejects_an_outlier_and_takes_a_good_fix() -> None:
    there = np.array([-50.0, 0.0, 0.0])
    before = estimate_at(there, sigma=0.2)
    after, accepted = update(before, fix_at(there + np.array([0.3, 0.0, 0.1])))
    assert accepted
    assert np.all(after.position_sigma < before.position_sigma)
    # 5 m is 22 standard deviations of the innovation, hypot(0.2, 0.11) = 0.23 m.
    after, accepted = update(before, fix_at(there + np.array([5.0, 0.0, 0.0])))
    assert not accepted
    assert after is before


def test_a_fix_with_the_same_error_as_the_estimate_meets_it_half_way() -> None:
    there = np.array([-50.0, 0.0, 0.0])
    after, _ = update(
        estimate_at(there, sigma=3e-4 * 50.0), fix_at(there + np.array([0.0, 0.02, 0.0]))
    )
    # The fix lies 0.02 / 50 rad off the axis, which mixes range error into the mean at 1e-4.
    np.testing.assert_allclose(after.mean[1], 0.01, rtol=1e-2)


def test_a_point_of_a_turned_target_is_where_the_turn_puts_it() -> None:
    # The target stands 0.01 rad about z off its attitude: a point 2 m ahead moves 2 cm along y.
    point = np.array([2.0, 0.0, 0.0])
    chaser = np.array([-50.0, 0.0, 0.0])
    fix = Fix(
        point=point,
        position=chaser - point - np.array([0.0, 0.02, 0.0]),
        turn=None,
        covariance=1e-8 * np.eye(3),
    )
    knows_place = estimate_at(chaser, sigma=1e-4, turn_sigma=0.1)
    after, _ = update(knows_place, fix)
    np.testing.assert_allclose(after.mean[6:], [0.0, 0.0, 0.01], atol=2e-4)
    # Who knows of the turn learns nothing new.
    mean = np.concatenate([chaser, np.zeros(3), [0.0, 0.0, 0.01]])
    again, _ = update(replace(knows_place, mean=mean), fix)
    np.testing.assert_allclose(again.mean, mean, atol=1e-9)


def test_prediction_follows_the_transition_and_only_grows_in_error() -> None:
    before = estimate_at(np.array([-50.0, 1.0, 2.0]), sigma=0.2)
    after = predict(before, MEAN_MOTION, 3.0)
    np.testing.assert_allclose(after.mean[:6], transition(MEAN_MOTION, 3.0) @ before.mean[:6])
    assert np.all(after.position_sigma > before.position_sigma)
    assert np.all(after.turn_sigma > before.turn_sigma)
    pushed = after_push(after, np.array([0.3, 0.0, 0.0]))
    np.testing.assert_allclose(pushed.mean - after.mean, [0, 0, 0, 0.3, *[0] * 5], atol=1e-12)
    grown = np.diag(pushed.covariance - after.covariance)
    assert np.all(grown[3:6] == pytest.approx(0.006**2))
    assert np.all(grown[6:] == 0.0)


NEWS: tuple[tuple[float, Array | Fix], ...] = (
    (2.0, fix_at(np.array([-50.1, 0.1, 0.0]))),
    (4.0, np.array([0.2, 0.0, 0.01])),
    (6.0, fix_at(np.array([-49.7, 0.05, 0.02]))),
    (9.0, np.array([-0.1, 0.02, 0.0])),
)


def told(order: list[int]) -> Estimate:
    """The estimate at 12 s of a filter that was told of the same things in an order."""
    known = Filter(estimate_at(np.array([-50.0, 0.0, 0.0]), sigma=0.5), MEAN_MOTION)
    for index in order:
        time, event = NEWS[index]
        if isinstance(event, Fix):
            known.fix(time, event)
        else:
            known.push(time, event)
    return known.at(12.0)


@pytest.mark.parametrize("order", [[1, 3, 0, 2], [0, 1, 3, 2], [3, 2, 1, 0]])
def test_late_and_overtaken_fixes_give_the_estimate_of_fixes_in_time(order: list[int]) -> None:
    late, in_time = told(order), told([0, 1, 2, 3])
    np.testing.assert_allclose(late.mean, in_time.mean, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(late.covariance, in_time.covariance, rtol=1e-9, atol=1e-15)


def test_a_late_fix_taken_for_a_new_one_is_wrong_by_the_way_flown_meanwhile() -> None:
    # 0.4 m/s, 2 s late: a filter that forgets the delay is 0.8 m off where it could know 0.1 m.
    there = np.array([-50.0, 0.0, 0.0])
    moving = replace(
        estimate_at(there, sigma=5.0), mean=np.array([-50, 0, 0, 0.4, 0, 0, 0, 0, 0.0])
    )
    honest, naive = Filter(moving, MEAN_MOTION), Filter(moving, MEAN_MOTION)
    honest.fix(0.0, fix_at(there))
    naive.fix(2.0, fix_at(there))
    where = transition(MEAN_MOTION, 2.0) @ moving.mean[:6]
    assert abs(honest.at(2.0).mean[0] - where[0]) < 0.01
    assert naive.at(2.0).mean[0] - where[0] == pytest.approx(-0.8, abs=0.02)


def test_a_filter_forgets_what_is_too_old_and_takes_no_fix_from_before() -> None:
    known = Filter(estimate_at(np.array([-50.0, 0.0, 0.0]), sigma=0.5), MEAN_MOTION)
    for time in range(0, 400, 4):
        known.push(float(time), np.zeros(3))
    assert not known.fix(100.0, fix_at(np.array([-50.0, 0.0, 0.0])))
    assert known.fix(380.0, fix_at(known.at(380.0).mean[:3]))


def test_a_leg_bounds_its_speed_and_ends_at_its_aim() -> None:
    leg = Leg(distance=1.6, top_speed=0.4, time_constant=75.0, hop=30.0)
    np.testing.assert_allclose(leg.next(np.array([-180.0, 0.0, 0.0])), [-168.0, 0.0, 0.0])
    np.testing.assert_array_equal(leg.next(np.zeros(3)), np.zeros(3))
    at_rest = np.array([-20.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # V-bar: a place of rest
    push = Plan().push(leg, at_rest, at_rest[:3], MEAN_MOTION)
    np.testing.assert_array_equal(push, np.zeros(3))


CONTROL = ExposureControl()


def test_exposure_goes_to_its_goal_by_the_light_that_its_own_image_had() -> None:
    now, used = Light(exposure=1e-4, lamp=False), Light(exposure=5e-5, lamp=False)
    # An image of an older exposure at twice the goal: half of that exposure.
    assert CONTROL.after(now, used, 1.1 / 1.2).exposure == pytest.approx(5e-5 * 0.6, rel=1e-9)
    assert CONTROL.after(now, used, 1.0).exposure == pytest.approx(5e-5 / 4.0)
    assert CONTROL.after(now, used, 0.001).exposure == pytest.approx(5e-5 * 4.0)


def test_the_lamp_goes_on_in_the_dark_and_off_when_the_sun_is_back() -> None:
    light = Light(exposure=3e-5, lamp=False)
    seen = []
    for _ in range(4):
        light = CONTROL.after(light, light, 0.0)
        seen.append(light.lamp)
    # 0.12, 0.48, 1.92 ms: sunlight never asks for the third.
    assert seen == [False, False, True, True]
    # By lamplight at the nearest, 1 ms, it stays on; an older image from before says nothing.
    assert CONTROL.after(
        Light(exposure=1e-3, lamp=True), Light(exposure=1e-3, lamp=True), 0.55
    ).lamp
    before = CONTROL.after(light, replace(light, lamp=False), 0.0)
    assert before is light
    bright = Light(exposure=4e-4, lamp=True)
    assert not CONTROL.after(bright, bright, 1.0).lamp


def test_wheels_turn_the_chaser_to_where_it_should_look_and_keep_the_momentum() -> None:
    rng = np.random.default_rng(2)
    start_at = Attitude(R_icrf_from_body=np.eye(3), rate=np.zeros(3), wheels=np.zeros(3))
    wanted = Rotation.from_rotvec([0.1, -0.2, 0.15]).as_matrix()
    end = turned(start_at, wanted, np.zeros(3), 60.0, rng)
    off = Rotation.from_matrix(wanted.T @ end.R_icrf_from_body).magnitude()
    # The star tracker's noise of 0.005 deg passes through a law of 0.25 rad/s: below its own size.
    assert off < 4.0 * np.radians(0.005)
    # Nothing outside pushed: on the way the wheels hold the opposite of the body's momentum. Steps
    # of 0.25 s at 0.05 rad/s leave 0.25 * 0.05 = 1 % of it.
    inertia = np.array([0.26, 0.28, 0.31])
    midway = turned(start_at, wanted, np.zeros(3), 4.0, rng)
    body = np.linalg.norm(inertia * midway.rate)
    assert body > 0.005
    assert np.linalg.norm(inertia * midway.rate + midway.wheels) < 0.02 * body


@pytest.fixture(scope="module")
def flight() -> Flight:
    """The last four metres with small pictures, over the bridge, into the eclipse."""
    scenario = load_scenario(SCENARIO)
    navcam = scenario.cameras[NAVCAM]
    small = replace(
        navcam,
        detector=replace(navcam.detector, width=240, height=240),
        lens=replace(navcam.lens, focal_length=navcam.lens.focal_length * 240.0 / 360.0),
    )
    late = replace(
        scenario,
        epoch_tai_ns=scenario.epoch_tai_ns + 330 * 10**9,
        cameras={NAVCAM: small},
        inter_reflection=False,
    )
    plan = Plan(
        far=Leg(distance=4.0, top_speed=0.1, time_constant=20.0, hop=8.0),
        near=Leg(distance=1.6, top_speed=0.12, time_constant=14.0, hop=8.0),
        held_fixes=2,
    )
    settings = Settings(
        seed=5, settle=12.0, offset=(114.6, 0.0, -0.5), spread=(0.1, 0.1, 0.1, 0, 0, 0), plan=plan
    )
    running = start(late)
    try:
        with Client(running.address, timeout_s=60.0) as client:

            def take_image(
                tai_ns: int, bodies: Mapping[str, BodyPose], light: Light, moving: bool
            ) -> BridgeImage:
                lamps = {LAMP: float(light.lamp)}
                return client.render(
                    tai_ns, NAVCAM, bodies, light.exposure, lamps=lamps, moving=moving
                )

            return fly(late, Pinhole.from_card(client.welcome.cameras[0]), take_image, settings)
    finally:
        finish(running)


def test_the_chaser_arrives_at_docking_range_by_lamplight(flight: Flight) -> None:
    assert flight.arrived
    # On the axis, within what guidance calls arrived; its push is good to 2 % and a tenth of a
    # millimetre per second.
    assert abs(flight.final[0] - 1.6) < 0.15
    assert np.hypot(*flight.final[1:]) < 0.03
    assert np.degrees(flight.misalignment) < 2.0
    lit = [f.look.light.lamp for f in flight.frames]
    assert not lit[0]
    assert lit[-1]
    assert flight.frames[-1].sunlit < 1e-3


def test_images_are_as_old_as_the_camera_says_when_they_arrive(flight: Flight) -> None:
    # Half an exposure, 0.04 s of read-out and 1.5 s of transport; software looks once a second.
    for frame in flight.frames:
        assert frame.look.age == 2.0


def test_the_estimate_lies_within_what_the_filter_claims(flight: Flight) -> None:
    # 9 numbers of some 30 frames, highly correlated: none beyond 4 sigma once markers are held.
    held = [f for f in flight.frames if f.look.pose is not None]
    assert len(held) > 0.6 * len(flight.frames)
    for frame in held:
        assert np.all(np.abs(frame.error) < 4.0 * frame.sigma)


def test_a_report_needs_no_other_file(flight: Flight, tmp_path: Path) -> None:
    paths = write_report(flight, summarise(flight, 10.0, "none"), tmp_path)
    page = paths[0].read_text()
    assert page.count("data:image/png;base64,") == 2
    assert 'src="http' not in page
    assert len((tmp_path / "docking.csv").read_text().splitlines()) == len(flight.frames) + 1


def demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The example as a user starts it."""
    command = [sys.executable, "-m", "examples.closed_loop", *arguments]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )


def test_two_processes_leave_pictures_plot_table_and_summary(tmp_path: Path) -> None:
    done = demo("--out", str(tmp_path), "--frames", "4", "--seed", "4", "--runs", "2")
    assert done.returncode == 0, done.stderr
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "docking.csv",
        "docking.html",
        "docking_plot.png",
        "docking_strip.png",
        "docking_summary.json",
        "monte_carlo.html",
        "monte_carlo.json",
        "monte_carlo.png",
    }
    summary = json.loads((tmp_path / "docking_summary.json").read_text())
    assert summary["frames"] == 4
    assert summary["frames_per_second"] > 0.0
    assert not summary["arrived"]
    assert len((tmp_path / "docking.csv").read_text().splitlines()) == 5
    many = json.loads((tmp_path / "monte_carlo.json").read_text())
    assert [run["seed"] for run in many["runs"]] == [4, 5]
    assert "is still on its way" in done.stdout


def test_a_folder_that_cannot_be_written_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = demo("--out", str(tmp_path / "file" / "out"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("closed_loop: ")
    assert "cannot be written" in done.stderr


def test_the_first_image_writes_an_exr(tmp_path: Path) -> None:
    script = ROOT / "examples" / "first_image.py"
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out" / "first_image").glob("navcam*.exr"))
