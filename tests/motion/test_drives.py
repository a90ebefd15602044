"""Drives on drives: two axes turn a face to the Sun wherever it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.motion.drives import JointLaws, sun_angles
from simgl.motion.joints import Joint, body_from_stored
from simgl.physics.frames import unit

# Double precision through two turns.
EXACT = 1e-12


def drive(
    name: str, axis: Array, face: Array | None, parent: int | None = None, limit: float = np.pi
) -> Joint:
    return Joint(
        name=name,
        parts=(),
        axis_body=unit(axis),
        origin_body=np.array([0.1, -0.4, 0.3]),
        limits=(-limit, limit),
        sunward_body=None if face is None else unit(face),
        parent=parent,
    )


# A yoke that turns along the wing, and the wing that tilts across it.
YOKE = drive("yoke", np.array([0.0, 1.0, 0.0]), None)
WING = drive("wing", np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0]), 0)

vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)
directions = vectors.filter(lambda v: float(np.linalg.norm(v)) > 0.1).map(unit)


def faces(joints: tuple[Joint, ...], actual: dict[str, float], index: int = 1) -> Array:
    """Where the face of a joint points, by the chain of its turns."""
    values = [actual.get(joint.name, 0.0) for joint in joints]
    turn = body_from_stored(joints, values)[index + 1, :3, :3]
    face = joints[index].sunward_body
    assert face is not None
    return turn @ face


def between(a: Array, b: Array) -> float:
    """Angle of two directions, good for small ones [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


@settings(deadline=None, database=None, max_examples=300)
@given(directions)
@example(unit(np.array([1e-9, 1.0, -3e-9])))
@example(np.array([0.0, -1.0, 0.0]))
def test_two_square_axes_point_a_wing_at_any_sun(sun: Array) -> None:
    joints = (YOKE, WING)
    actual = sun_angles(joints, ("yoke", "wing"), {}, sun)
    assert between(faces(joints, actual), sun) < EXACT
    # The wing needs no more than a quarter turn, so that the yoke alone follows an orbit; swings
    # are told apart to a billionth of a radian.
    assert abs(actual["wing"]) <= np.pi / 2.0 + 1e-9


@settings(deadline=None, database=None, max_examples=300)
@given(directions, directions, directions, directions, st.floats(-3.0, 3.0))
# A cone of 1e-5 rad, whose cosine has five digits of it.
@example(
    np.array([0.0, 1.0, 0.0]),
    unit(np.array([1.0, 1e-5, 0.0])),
    np.array([1.0, 0.0, 0.0]),
    unit(np.array([0.625, 1e-5, 0.0])),
    0.0,
)
def test_any_two_axes_point_a_face_at_every_sun_that_they_can_reach(
    first: Array, second: Array, face: Array, sun: Array, mid: float
) -> None:
    """Within reach: the face's cone about the second axis, swept about the first."""
    joints = (
        drive("first", first, None),
        drive("mid", unit(np.array([0.3, -0.2, 0.9])), None, 0),
        drive("second", second, face, 1),
    )
    axis = body_from_stored(joints, (0.0, mid, 0.0))[2, :3, :3] @ joints[2].axis_body
    spread, half = between(joints[0].axis_body, axis), between(second, face)
    towards = between(joints[0].axis_body, sun)
    low, high = abs(spread - half), min(spread + half, 2.0 * np.pi - spread - half)
    assume(low + 1e-6 < towards < high - 1e-6)
    actual = sun_angles(joints, ("first", "second"), {"mid": mid}, sun)
    assert between(faces(joints, {**actual, "mid": mid}, 2), sun) < EXACT


def best_on_a_grid(joints: tuple[Joint, ...], sun: Array) -> float:
    """The least angle between face and Sun over a grid of 2 deg within the limits."""
    grids = [np.radians(np.arange(np.degrees(j.limits[0]), np.degrees(j.limits[1]) + 1e-9, 2.0))
             for j in joints]  # fmt: skip
    return min(
        between(faces(joints, {joints[0].name: float(a), joints[1].name: float(b)}), sun)
        for a in grids[0]
        for b in grids[1]
    )


@pytest.mark.parametrize(
    "sun",
    [(0.0, 0.0, 1.0), (0.2, 0.9, 0.3), (-0.6, -0.1, 0.7), (0.9, 0.3, -0.1), (0.0, 1.0, 0.0)],
)
@pytest.mark.parametrize(("one", "other"), [(40.0, 20.0), (10.0, 60.0), (60.0, 60.0)])
def test_within_limits_no_other_angles_point_nearer(
    sun: tuple[float, float, float], one: float, other: float
) -> None:
    joints = (
        replace(YOKE, limits=(-np.radians(one), np.radians(one))),
        replace(WING, limits=(-np.radians(other), np.radians(other)),
                axis_body=unit(np.array([1.0, 0.3, 0.1]))),
    )  # fmt: skip
    actual = sun_angles(joints, ("yoke", "wing"), {}, unit(np.array(sun)))
    miss = between(faces(joints, actual), unit(np.array(sun)))
    assert miss <= best_on_a_grid(joints, unit(np.array(sun))) + EXACT
    for joint in joints:
        assert joint.limits[0] <= actual[joint.name] <= joint.limits[1]


def test_with_the_sun_along_the_first_axis_that_one_rests() -> None:
    """Any angle of the yoke will do there; a face square to it is all that is wanted."""
    actual = sun_angles((YOKE, WING), ("yoke", "wing"), {}, np.array([0.0, 1.0, 0.0]))
    assert actual["yoke"] == 0.0
    assert abs(actual["wing"]) == pytest.approx(np.pi / 2.0)


def test_a_drive_on_a_joint_that_stands_reckons_with_where_it_stands() -> None:
    """Beside it in the scenario, or as a simulation sends it."""
    joints = (YOKE, WING)
    sun = unit(np.array([0.2, -0.5, -0.8]))
    for laws, given_angles in (
        (JointLaws(fixed={"yoke": 0.7}, sunward=("wing",)), {}),
        (JointLaws(sunward=("yoke", "wing")), {"yoke": 0.7}),
    ):
        actual = laws.angles(joints, 0, sun, given_angles)
        assert actual["yoke"] == 0.7
        best = between(faces(joints, actual), sun)
        # The wing's axis, turned: what is left is the Sun's height over the plane square to it.
        axis = np.array([np.cos(0.7), 0.0, -np.sin(0.7)])
        assert best == pytest.approx(np.arcsin(abs(np.dot(axis, sun))), abs=EXACT)


def test_a_yoke_turns_for_a_wing_that_a_simulation_holds() -> None:
    """It has no face of its own: the wing's, tilted as it is, comes as near as the yoke can."""
    joints = (YOKE, WING)
    sun = unit(np.array([0.5, -0.3, 0.6]))
    actual = JointLaws(sunward=("yoke", "wing")).angles(joints, 0, sun, {"wing": 0.4})
    assert actual["wing"] == 0.4
    face = faces(joints, actual)
    # Turning about y changes only the angle about y: what is left is the difference in height.
    expected = abs(np.arcsin(face[1]) - np.arcsin(sun[1]))
    assert between(face, sun) == pytest.approx(expected, abs=EXACT)


def test_several_wings_on_one_yoke_that_are_alike_all_face_the_sun() -> None:
    wings = tuple(replace(WING, name=f"wing_{k}") for k in range(3))
    joints = (YOKE, *wings)
    sun = unit(np.array([0.4, 0.5, 0.3]))
    actual = sun_angles(joints, ("wing_2", "yoke", "wing_0", "wing_1"), {}, sun)
    for index in (1, 2, 3):
        assert between(faces(joints, actual, index), sun) < EXACT


@pytest.mark.parametrize(("sun_deg", "angle_deg"), [(-30.0, 330.0), (170.0, 170.0), (10.0, 10.0)])
def test_a_drive_whose_range_goes_round_takes_the_way_that_it_has(
    sun_deg: float, angle_deg: float
) -> None:
    free = replace(YOKE, sunward_body=np.array([0.0, 0.0, -1.0]), limits=(0.0, 2.0 * np.pi))
    turn = np.radians(sun_deg)
    actual = sun_angles((free,), ("yoke",), {}, np.array([-np.sin(turn), 0.0, -np.cos(turn)]))
    assert np.degrees(actual["yoke"]) == pytest.approx(angle_deg)
