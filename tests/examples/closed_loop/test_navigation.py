"""The navigation filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from examples.closed_loop.navigation import (
    Estimate,
    Filter,
    Fix,
    after_push,
    far_fix,
    predict,
    update,
)
from examples.closed_loop.relative_motion import transition
from examples.closed_loop.spacecraft import wandering
from simgl.arrays import Array
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS

RADIUS = WGS84_EQUATORIAL_RADIUS + 400e3
MEAN_MOTION = float(np.sqrt(EARTH_MU / RADIUS**3))


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


def test_the_estimate_of_a_swinging_target_is_no_surer_than_it_is_right() -> None:
    # Fixes as good as at docking range: 1 mm and 0.026 deg about the board's axis.
    there, sigma = np.array([-1.6, 0.0, 0.0]), 4.5e-4
    covariance = np.diag([1e-6] * 3 + [sigma**2] * 3)
    known = Filter(estimate_at(there, sigma=1e-3), MEAN_MOTION)
    squares = []
    for time in np.arange(0.0, 1200.0, 8.0):
        turn = wandering(np.zeros(3), time)
        known.fix(time, Fix(point=np.zeros(3), position=there, turn=turn, covariance=covariance))
        error = known.at(time).mean[6:] - turn
        squares.append(float(error @ np.linalg.solve(known.at(time).covariance[6:, 6:], error)))
    # Of three components 3 is expected where fixes scatter. These do not: all that is left is how
    # far the estimate trails the swing.
    assert np.mean(squares[10:]) < 3.0
