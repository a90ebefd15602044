"""Relative places and attitudes in LVLH, each checked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.motion.orbits import KeplerianOrbit
from simgl.motion.trajectory import (
    Attitude,
    FixedAttitude,
    LvlhAttitude,
    Motion,
    PointingAttitude,
    RelativeUniformMotion,
    Trajectory,
    UniformMotion,
    poses,
)
from simgl.physics.frames import lvlh_from_icrf

EPOCH = 1_774_008_037_000_000_000
RADIUS = 6.778137e6
X, Y, Z = np.eye(3)
LVLH = LvlhAttitude(R_lvlh_from_body=np.eye(3))

ORBIT = KeplerianOrbit(
    semi_major_axis=RADIUS,
    eccentricity=0.0,
    inclination=0.9,
    raan=0.4,
    argument_of_perigee=0.0,
    true_anomaly=0.3,
    epoch_tai_ns=EPOCH,
)
# On +x, flying along +y: LVLH x is +y, y is -z, z is -x in ICRF.
SIMPLE = UniformMotion(position=RADIUS * X, velocity=7.6e3 * Y, epoch_tai_ns=EPOCH)
STILL = UniformMotion(position=RADIUS * X, velocity=np.zeros(3), epoch_tai_ns=EPOCH)
R_ICRF_FROM_LVLH = np.column_stack([Y, -Z, -X])

# Differences of places of 7e6 m: one unit of their last digit is 1e-9 m.
FAR = 5e-9

quick = settings(deadline=None, database=None, max_examples=60)
metres = st.floats(-1e4, 1e4)
triples = st.tuples(metres, metres, metres).map(np.array)


def motion(trajectory: Trajectory, attitude: Attitude = LVLH) -> Motion:
    return Motion(trajectory=trajectory, attitude=attitude)


def relative(
    reference: str, position: Array, velocity: Array | None = None
) -> RelativeUniformMotion:
    return RelativeUniformMotion(
        reference=reference,
        position_lvlh=position,
        velocity_lvlh=np.zeros(3) if velocity is None else velocity,
        epoch_tai_ns=EPOCH,
    )


@quick
@given(triples)
def test_a_relative_place_is_where_lvlh_says(place: Array) -> None:
    actual = poses({"chaser": motion(relative("target", place)), "target": motion(ORBIT)}, EPOCH)
    target = actual["target"]
    R_lvlh_from_icrf = lvlh_from_icrf(target.position, target.velocity)
    offset = R_lvlh_from_icrf @ (actual["chaser"].position - target.position)
    np.testing.assert_allclose(offset, place, rtol=0.0, atol=FAR)


def test_two_hundred_metres_behind_is_minus_x_of_lvlh() -> None:
    actual = poses(
        {"a": motion(SIMPLE), "b": motion(relative("a", np.array([-200.0, 0.0, 10.0])))}, EPOCH
    )
    np.testing.assert_allclose(
        actual["b"].position, [RADIUS - 10.0, -200.0, 0.0], rtol=0.0, atol=FAR
    )


def test_a_place_at_rest_in_lvlh_is_carried_round_with_it() -> None:
    # 100 m further out at the same angular speed: faster by 100/RADIUS.
    actual = poses(
        {"a": motion(SIMPLE), "b": motion(relative("a", np.array([0.0, 0.0, -100.0])))}, EPOCH
    )
    np.testing.assert_allclose(
        actual["b"].velocity, [0.0, 7.6e3 * (1.0 + 100.0 / RADIUS), 0.0], rtol=1e-14
    )


@pytest.mark.parametrize("velocity", [[0.0, 0.0, 0.0], [1.5, -0.7, 0.4]])
def test_relative_velocity_is_the_rate_of_the_lvlh_place(velocity: list[float]) -> None:
    place, rate = np.array([-200.0, 30.0, 40.0]), np.array(velocity)
    actual = poses(
        {"target": motion(ORBIT), "chaser": motion(relative("target", place, rate))}, EPOCH
    )
    step = 0.01  # [s]
    ends = []
    for sign in (-1, 1):
        r, v = ORBIT.state(EPOCH + sign * round(step * 1e9))
        chaser = actual["chaser"].position + sign * step * actual["chaser"].velocity
        ends.append(lvlh_from_icrf(r, v) @ (chaser - r))
    # Rounding of 1e-9 m over 0.02 s; the curvature of the target's path cancels between both ends.
    np.testing.assert_allclose((ends[1] - ends[0]) / (2.0 * step), rate, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("seconds", [-30.0, 0.5, 3600.0])
@pytest.mark.parametrize("law", [SIMPLE, relative("lead", X, np.array([0.05, -0.02, 0.01]))])
def test_a_velocity_is_the_rate_of_the_place_at_any_time(
    law: UniformMotion | RelativeUniformMotion, seconds: float
) -> None:
    """Central difference over 0.2 s; the LVLH frame turns at 1.1 mrad/s about orbits of 6.8e6 m."""
    motions = {"lead": motion(ORBIT), "a": motion(law)}
    middle, step = EPOCH + round(seconds * 1e9), 100_000_000
    before, now, after = (poses(motions, middle + n * step)["a"] for n in (-1, 0, 1))
    measured = (after.position - before.position) / 0.2
    # Third derivative 7.6e3 * (1.1e-3)^2 m/s^3 times 0.1^2 / 6: 2e-5 m/s; rounding 2e-9 / 0.2.
    np.testing.assert_allclose(measured, now.velocity, rtol=0.0, atol=4e-5)


@pytest.mark.parametrize("seconds", [-30.0, 0.5, 3600.0])
def test_a_place_with_a_velocity_moves_along_a_straight_line(seconds: float) -> None:
    rate = np.array([0.05, -0.02, 0.01])
    motions = {"lead": motion(ORBIT), "a": motion(SIMPLE), "b": motion(relative("lead", X, rate))}
    at = poses(motions, EPOCH + round(seconds * 1e9))
    np.testing.assert_allclose(
        at["a"].position, RADIUS * X + seconds * 7.6e3 * Y, rtol=0.0, atol=FAR
    )
    lead = at["lead"]
    R_lvlh_from_icrf = lvlh_from_icrf(lead.position, lead.velocity)
    place = R_lvlh_from_icrf @ (at["b"].position - lead.position)
    np.testing.assert_allclose(place, X + seconds * rate, rtol=0.0, atol=FAR)


def test_references_resolve_in_any_order_and_over_several_links() -> None:
    chain = {
        "c": motion(relative("b", np.array([0.0, 0.0, -5.0]))),
        "b": motion(relative("a", np.array([0.0, 0.0, -10.0]))),
        "a": motion(SIMPLE),
    }
    actual = poses(chain, EPOCH)
    assert list(actual) == ["c", "b", "a"]
    np.testing.assert_allclose(actual["c"].position, [RADIUS + 15.0, 0.0, 0.0], rtol=0.0, atol=FAR)


@pytest.mark.parametrize(
    ("links", "message"),
    [
        (
            {"a": "b", "b": "a"},
            "[spacecraft.a]: relative_to runs in a circle: a -> b -> a",
        ),
        ({"a": "a"}, "[spacecraft.a]: relative_to runs in a circle: a -> a"),
        (
            {"free": "a", "a": "b", "b": "c", "c": "a"},
            "[spacecraft.a]: relative_to runs in a circle: free -> a -> b -> c -> a",
        ),
    ],
)
def test_places_in_a_circle_are_refused(links: dict[str, str], message: str) -> None:
    motions = {name: motion(relative(other, X)) for name, other in links.items()}
    with pytest.raises(ConfigError) as caught:
        poses(motions, EPOCH)
    assert str(caught.value) == message


def test_lvlh_attitude_turns_body_axes_along_lvlh() -> None:
    actual = poses({"a": motion(SIMPLE)}, EPOCH)
    np.testing.assert_allclose(actual["a"].R_icrf_from_body, R_ICRF_FROM_LVLH, rtol=0.0, atol=1e-15)


def test_lvlh_attitude_puts_its_own_turn_first() -> None:
    # Body x towards LVLH y, body y towards LVLH z, body z towards LVLH x.
    R_lvlh_from_body = np.column_stack([Y, Z, X])
    actual = poses({"a": motion(SIMPLE, LvlhAttitude(R_lvlh_from_body=R_lvlh_from_body))}, EPOCH)
    # In ICRF these are -z, -x and y.
    np.testing.assert_allclose(
        actual["a"].R_icrf_from_body, np.column_stack([-Z, -X, Y]), rtol=0.0, atol=1e-15
    )


def test_fixed_attitude_stays_while_the_orbit_goes_on() -> None:
    fixed = FixedAttitude(R_icrf_from_body=np.column_stack([Y, Z, X]))
    for tai_ns in (EPOCH, EPOCH + 10**12):
        actual = poses({"a": motion(ORBIT, fixed)}, tai_ns)
        np.testing.assert_array_equal(actual["a"].R_icrf_from_body, fixed.R_icrf_from_body)


@quick
@given(triples.filter(lambda v: bool(np.linalg.norm(v) > 1.0)), st.sampled_from([X, -Y, Z]))
def test_a_pointing_body_turns_its_axis_to_the_target_and_no_further(
    place: Array, axis: Array
) -> None:
    pointing = PointingAttitude(target="target", axis_body=axis)
    actual = poses(
        {"target": motion(ORBIT), "chaser": motion(relative("target", place), pointing)}, EPOCH
    )
    chaser = actual["chaser"]
    line = actual["target"].position - chaser.position
    distance = np.linalg.norm(line)
    # The line's direction carries the rounding of places.
    np.testing.assert_allclose(
        chaser.R_icrf_from_body @ axis,
        line / distance,
        rtol=0.0,
        atol=1e-13 + FAR / float(distance),
    )
    # From LVLH it is turned by the angle between its axis and the line, not more.
    start = lvlh_from_icrf(chaser.position, chaser.velocity).T
    cosine = float(np.dot(start @ axis, line)) / float(distance)
    trace = float(np.trace(chaser.R_icrf_from_body @ start.T))
    assert abs(trace - (1.0 + 2.0 * cosine)) < 1e-12


@pytest.mark.parametrize(
    ("motions", "message"),
    [
        (
            {"a": motion(STILL)},
            '[spacecraft.a]: attitude needs LVLH axes, which "a" lacks: '
            "it does not move about the Earth",
        ),
        (
            {
                "still": motion(STILL, FixedAttitude(R_icrf_from_body=np.eye(3))),
                "b": motion(relative("still", X)),
            },
            '[spacecraft.b]: relative_to needs LVLH axes, which "still" lacks: '
            "it does not move about the Earth",
        ),
        (
            {
                "a": motion(SIMPLE),
                "b": motion(relative("a", np.zeros(3)), PointingAttitude(target="a", axis_body=X)),
            },
            '[spacecraft.b]: point_at cannot point at "a", which is at the same place',
        ),
    ],
)
def test_a_law_without_an_answer_is_refused(motions: dict[str, Motion], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        poses(motions, EPOCH)
    assert str(caught.value) == message
