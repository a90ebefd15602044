"""Curves between samples: exact for polynomials, within their stated error for orbits, no gaps."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.motion.samples import Path, SampledRotations, SampledStates
from tests.motion.motion_files import EPOCH, ORBIT, SECOND


def sampled(seconds: Array, *, velocities: bool = True, gap_s: float = 1e4) -> SampledStates:
    times = EPOCH + np.round(seconds * SECOND).astype(np.int64)
    states = [ORBIT.state(int(t)) for t in times]
    return SampledStates(
        source="test",
        tai_ns=times,
        positions=np.stack([r for r, _ in states]),
        velocities=np.stack([v for _, v in states]) if velocities else None,
        longest_gap_ns=round(gap_s * SECOND),
        span_ns=(int(times[0]), int(times[-1])),
    )


@pytest.mark.parametrize("velocities", [True, False])
def test_a_polynomial_of_degree_seven_is_met_exactly(velocities: bool) -> None:
    rng = np.random.default_rng(3)
    coefficients = rng.normal(size=(8, 3))
    seconds = np.arange(9.0)
    powers = seconds[:, None] ** np.arange(8)
    rates = np.arange(1, 8) * seconds[:, None] ** np.arange(7)
    curve = SampledStates(
        source="test",
        tai_ns=(EPOCH + seconds * SECOND).astype(np.int64),
        positions=powers @ coefficients,
        velocities=rates @ coefficients[1:] if velocities else None,
        longest_gap_ns=10 * SECOND,
        span_ns=(EPOCH, EPOCH + 8 * SECOND),
    )
    for when in (0.0, 0.3, 1.0, 3.7, 7.9, 8.0):
        place, rate = curve.state(EPOCH + round(when * SECOND))
        scale = np.abs(coefficients).sum() * max(when, 1.0) ** 7
        np.testing.assert_allclose(place, when ** np.arange(8) @ coefficients, atol=1e-9 * scale)
        slope = np.arange(1, 8) * when ** np.arange(7) @ coefficients[1:]
        np.testing.assert_allclose(rate, slope, atol=1e-8 * scale)


@pytest.mark.parametrize(
    ("step_s", "velocities", "limit_m"),
    [(60.0, True, 1e-5), (180.0, True, 1e-3), (60.0, False, 1e-4)],
)
def test_an_orbit_is_met_far_within_the_stated_error(
    step_s: float, velocities: bool, limit_m: float
) -> None:
    """Error of degree 7: w^8 r / 8! times the product of the distances to the nodes, squared for
    those given twice; limit_m is that at the ends, where it is largest."""
    curve = sampled(np.arange(0.0, 5400.0, step_s), velocities=velocities)
    misses = []
    for when in np.linspace(0.0, 5400.0 - step_s, 997):
        tai_ns = EPOCH + round(when * SECOND)
        misses.append(np.linalg.norm(curve.state(tai_ns)[0] - ORBIT.state(tai_ns)[0]))
    assert max(misses) < limit_m
    assert max(misses) < curve.interpolation_error + 2e-9 * 7e6


def test_velocity_is_the_rate_of_the_place_to_a_part_in_a_million() -> None:
    curve = sampled(np.arange(0.0, 1200.0, 60.0), velocities=False)
    for when in (31.0, 600.0, 1111.0):
        tai_ns = EPOCH + round(when * SECOND)
        np.testing.assert_allclose(curve.state(tai_ns)[1], ORBIT.state(tai_ns)[1], atol=7.6e-3)


def test_two_samples_with_velocities_are_a_curve_and_one_is_a_place() -> None:
    pair = sampled(np.array([0.0, 10.0]))
    # The error of a cubic: w^4 r h^4 / 384 = 0.3 mm.
    place, _ = pair.state(EPOCH + 5 * SECOND)
    assert np.linalg.norm(place - ORBIT.state(EPOCH + 5 * SECOND)[0]) < 4e-4
    alone = sampled(np.array([0.0]))
    np.testing.assert_array_equal(alone.state(EPOCH)[0], ORBIT.state(EPOCH)[0])


def test_no_sample_from_beyond_a_gap_bends_the_curve() -> None:
    """A manoeuvre during the gap: the curve before it must not know."""
    before = np.arange(0.0, 600.0, 60.0)
    whole = sampled(np.concatenate([before, before + 3600.0]), gap_s=100.0)
    kicked = whole.positions.copy()
    kicked[len(before) :] += 1e5
    moved = SampledStates(
        source="test",
        tai_ns=whole.tai_ns,
        positions=kicked,
        velocities=whole.velocities,
        longest_gap_ns=whole.longest_gap_ns,
        span_ns=whole.span_ns,
    )
    for when in (0.0, 500.0, 539.0, 540.0):
        tai_ns = EPOCH + round(when * SECOND)
        np.testing.assert_array_equal(moved.state(tai_ns)[0], whole.state(tai_ns)[0])


def test_a_gap_and_the_outside_are_refused_with_times() -> None:
    curve = sampled(np.array([0.0, 60.0, 120.0, 720.0, 780.0]), gap_s=300.0)
    message = (
        "test: has a gap from 2026-03-20T12:02:00 to 2026-03-20T12:12:00 "
        "(600 s; longest_gap_s allows 300 s)"
    )
    with pytest.raises(ConfigError, match=re.escape(message)):
        curve.state(EPOCH + 300 * SECOND)
    curve.state(EPOCH + 120 * SECOND)
    curve.state(EPOCH + 720 * SECOND)
    message = (
        "test: covers 2026-03-20T12:00:00 to 2026-03-20T12:13:00, not 2026-03-20T12:13:00.000000001"
    )
    with pytest.raises(ConfigError, match=re.escape(message)):
        curve.state(EPOCH + 780 * SECOND + 1)


def test_where_segments_meet_the_later_one_counts() -> None:
    first, second = sampled(np.arange(0.0, 601.0, 60.0)), sampled(np.arange(600.0, 1201.0, 60.0))
    shifted = SampledStates(
        source="test",
        tai_ns=second.tai_ns,
        positions=second.positions + 1.0,
        velocities=second.velocities,
        longest_gap_ns=second.longest_gap_ns,
        span_ns=second.span_ns,
    )
    path = Path(source="test", segments=(first, shifted))
    meeting = EPOCH + 600 * SECOND
    offset = path.state(meeting)[0] - ORBIT.state(meeting)[0]
    np.testing.assert_allclose(offset, 1.0, atol=1e-6)
    before = path.state(meeting - 1)[0] - ORBIT.state(meeting - 1)[0]
    np.testing.assert_allclose(before, 0.0, atol=1e-6)
    apart = Path(source="test", segments=(first, sampled(np.arange(900.0, 1201.0, 60.0))))
    with pytest.raises(ConfigError, match="gap between its segments"):
        apart.state(EPOCH + 700 * SECOND)


def rotations(
    angles_deg: list[float], step_s: float = 60.0, gap_s: float = 300.0
) -> SampledRotations:
    times = EPOCH + (np.arange(len(angles_deg)) * step_s * SECOND).astype(np.int64)
    turns = Rotation.from_euler("z", np.array(angles_deg)[:, None], degrees=True)
    return SampledRotations(
        source="test",
        tai_ns=times,
        q_reference_from_body_xyzw=turns.as_quat(),
        longest_gap_ns=round(gap_s * SECOND),
    )


@pytest.mark.parametrize(
    ("when_s", "angle_deg"), [(0.0, 0.0), (15.0, 10.0), (60.0, 40.0), (90.0, 50.0)]
)
def test_an_attitude_turns_steadily_between_samples(when_s: float, angle_deg: float) -> None:
    R = rotations([0.0, 40.0, 60.0]).matrix(EPOCH + round(when_s * SECOND))
    expected = Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()
    np.testing.assert_allclose(R, expected, atol=1e-12)


def test_the_sign_of_a_quaternion_makes_no_difference() -> None:
    plain = rotations([0.0, 40.0, 60.0])
    flipped = SampledRotations(
        source="test",
        tai_ns=plain.tai_ns,
        q_reference_from_body_xyzw=plain.q_reference_from_body_xyzw * [[1.0], [-1.0], [1.0]],
        longest_gap_ns=plain.longest_gap_ns,
    )
    when = EPOCH + 33 * SECOND
    np.testing.assert_allclose(flipped.matrix(when), plain.matrix(when), atol=1e-14)


def test_a_turn_without_one_clear_way_is_refused() -> None:
    message = (
        "test: turns by 170 deg in the step after 2026-03-20T12:01:00; "
        "at most 150 deg has one clear way"
    )
    with pytest.raises(ConfigError, match=re.escape(message)):
        rotations([0.0, 40.0, 210.0]).check_turns(np.radians(150.0))
    rotations([0.0, 40.0, 180.0]).check_turns(np.radians(150.0))
