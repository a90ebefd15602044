"""Rotations, LVLH and camera axes, each against an answer worked out by hand."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simgl.arrays import Array
from simgl.physics.frames import (
    camera_from_directions,
    lvlh_angular_velocity,
    lvlh_from_icrf,
    matrix_from_quaternion,
    quaternion_from_matrix,
    rotation_about,
    rotation_between,
    rotation_zxz,
    unit,
)

X, Y, Z = np.eye(3)
HALF = np.sqrt(0.5)

# A few products of numbers near one: 1e-15 each, an order of magnitude spare.
ROUNDING = 1e-14

# Components on a grid of 1e-3 keep lengths and angles away from zero without hiding special cases.
vectors = arrays(np.float64, 3, elements=st.integers(-1000, 1000).map(lambda i: i / 1000.0)).filter(
    lambda v: bool(np.linalg.norm(v) > 0.0)
)
quaternions = (
    arrays(np.float64, 4, elements=st.integers(-1000, 1000).map(lambda i: i / 1000.0))
    .filter(lambda q: bool(np.linalg.norm(q) > 0.01))
    .map(lambda q: q / np.linalg.norm(q))
)
quick = settings(deadline=None, database=None, max_examples=60)


def is_rotation(R: Array) -> bool:
    """Orthonormal and right-handed."""
    return bool(np.allclose(R @ R.T, np.eye(3), atol=ROUNDING, rtol=0.0) and np.linalg.det(R) > 0)


def hamilton(p: Array, q: Array) -> Array:
    """p times q, scalar last, from i j = k and its cycle."""
    a, b, s, t = p[:3], q[:3], p[3], q[3]
    return np.append(s * b + t * a + np.cross(a, b), s * t - np.dot(a, b))


def test_quarter_turn_about_z_takes_body_x_to_icrf_y() -> None:
    R_icrf_from_body = matrix_from_quaternion([0.0, 0.0, HALF, HALF])
    np.testing.assert_allclose(R_icrf_from_body @ X, Y, rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(R_icrf_from_body @ Y, -X, rtol=0.0, atol=ROUNDING)


def test_the_scalar_comes_last() -> None:
    # Scalar first, these four numbers would be no rotation at all.
    np.testing.assert_allclose(
        matrix_from_quaternion([1.0, 0.0, 0.0, 0.0]),
        np.diag([1.0, -1.0, -1.0]),
        rtol=0.0,
        atol=ROUNDING,
    )


@quick
@given(quaternions)
def test_quaternion_to_matrix_and_back_is_the_same_rotation_with_positive_scalar(q: Array) -> None:
    back = quaternion_from_matrix(matrix_from_quaternion(q))
    assert back[3] >= 0.0
    # Equal up to sign, which is the same rotation; a half-turn may take either sign.
    assert abs(abs(np.dot(back, q)) - 1.0) < ROUNDING


@quick
@given(quaternions, quaternions)
def test_matrices_multiply_like_hamilton_quaternions(p: Array, q: Array) -> None:
    R_a_from_b, R_b_from_c = matrix_from_quaternion(p), matrix_from_quaternion(q)
    product = hamilton(p, q)
    np.testing.assert_allclose(
        matrix_from_quaternion(product / np.linalg.norm(product)),
        R_a_from_b @ R_b_from_c,
        rtol=0.0,
        atol=ROUNDING,
    )


@quick
@given(quaternions, vectors)
def test_there_and_back_cancels(q: Array, v: Array) -> None:
    R_a_from_b = matrix_from_quaternion(q)
    assert is_rotation(R_a_from_b)
    np.testing.assert_allclose(R_a_from_b.T @ (R_a_from_b @ v), v, rtol=0.0, atol=ROUNDING * 10.0)


@pytest.mark.parametrize(
    ("quaternion", "message"),
    [
        (
            [0.0, 0.0, 0.0, 0.9],
            "must be a unit quaternion, got norm 0.9 (off by -0.1, allowed 0.0001)",
        ),
        (
            [0.6, 0.0, 0.0, 0.801],
            "must be a unit quaternion, got norm 1.0008 (off by +0.0008, allowed 0.0001)",
        ),
        (
            [0.0, 0.0, 0.0, 0.0],
            "must be a unit quaternion, got norm 0 (off by -1, allowed 0.0001)",
        ),
        (
            [0.0, 0.0, 1.0],
            "must be four finite numbers x y z w, got [0.0, 0.0, 1.0]",
        ),
        (
            [np.nan, 0.0, 0.0, 1.0],
            "must be four finite numbers x y z w, got [nan, 0.0, 0.0, 1.0]",
        ),
    ],
)
def test_an_impossible_quaternion_is_refused_with_its_error(
    quaternion: list[float], message: str
) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        matrix_from_quaternion(quaternion)


def test_a_quaternion_typed_with_four_decimals_is_accepted_and_normalised() -> None:
    # Norm 0.99998: 0.7071 squared twice.
    R = matrix_from_quaternion([0.0, 0.0, 0.7071, 0.7071])
    assert is_rotation(R)
    np.testing.assert_allclose(R @ X, Y, rtol=0.0, atol=ROUNDING)


def test_lvlh_axes_of_a_known_orbit() -> None:
    # At the point of an equatorial orbit on +x, flying along +y: the orbit normal is +z.
    R_lvlh_from_icrf = lvlh_from_icrf(np.array([7.0e6, 0.0, 0.0]), np.array([0.0, 7.5e3, 0.0]))
    np.testing.assert_allclose(R_lvlh_from_icrf.T @ Z, -X, rtol=0.0, atol=ROUNDING)  # z to nadir
    np.testing.assert_allclose(
        R_lvlh_from_icrf.T @ Y, -Z, rtol=0.0, atol=ROUNDING
    )  # y to minus the normal
    np.testing.assert_allclose(
        R_lvlh_from_icrf.T @ X, Y, rtol=0.0, atol=ROUNDING
    )  # x along the velocity
    assert is_rotation(R_lvlh_from_icrf)


def test_lvlh_x_is_horizontal_even_where_the_orbit_climbs() -> None:
    position, velocity = np.array([7.0e6, 0.0, 0.0]), np.array([1.0e3, 7.5e3, 0.0])
    np.testing.assert_allclose(lvlh_from_icrf(position, velocity).T @ X, Y, rtol=0.0, atol=ROUNDING)


@quick
@given(vectors, vectors)
def test_lvlh_is_a_rotation_with_z_to_nadir(position: Array, velocity: Array) -> None:
    assume(np.linalg.norm(np.cross(position, velocity)) > 1e-3)
    R_lvlh_from_icrf = lvlh_from_icrf(position, velocity)
    assert is_rotation(R_lvlh_from_icrf)
    np.testing.assert_allclose(
        R_lvlh_from_icrf @ position, -Z * np.linalg.norm(position), rtol=0.0, atol=1e-12
    )


def test_lvlh_turns_at_speed_over_radius_about_the_orbit_normal() -> None:
    rate = lvlh_angular_velocity(np.array([7.0e6, 0.0, 0.0]), np.array([0.0, 7.5e3, 0.0]))
    np.testing.assert_allclose(rate, [0.0, 0.0, 7.5e3 / 7.0e6], rtol=ROUNDING)


def test_a_camera_that_looks_along_x_with_z_up_has_minus_y_to_its_right() -> None:
    R_camera_from_icrf = camera_from_directions(X, Z)
    np.testing.assert_allclose(R_camera_from_icrf.T @ X, -Y, rtol=0.0, atol=ROUNDING)  # right
    np.testing.assert_allclose(R_camera_from_icrf.T @ Y, -Z, rtol=0.0, atol=ROUNDING)  # down
    np.testing.assert_allclose(R_camera_from_icrf.T @ Z, X, rtol=0.0, atol=ROUNDING)  # boresight


@quick
@given(vectors, vectors)
def test_camera_axes_are_right_handed_whatever_is_called_up(boresight: Array, up: Array) -> None:
    R_camera_from_icrf = camera_from_directions(boresight, up)
    assert is_rotation(R_camera_from_icrf)
    np.testing.assert_allclose(
        R_camera_from_icrf @ boresight,
        Z * np.linalg.norm(boresight),
        rtol=0.0,
        atol=ROUNDING * 10.0,
    )
    # Up lies in the upper half of the picture: its y, which counts downwards, is not positive.
    assert (R_camera_from_icrf @ up)[1] <= ROUNDING * 10.0


@pytest.mark.parametrize("boresight", [X, -X, Y, Z, np.array([1.0, 1.0, 1.0])])
def test_a_camera_with_up_along_its_boresight_still_has_axes(boresight: Array) -> None:
    assert is_rotation(camera_from_directions(boresight, -boresight))


@quick
@given(vectors, vectors)
def test_rotation_between_takes_one_to_the_other_by_the_angle_between_them(
    source: Array, target: Array
) -> None:
    R = rotation_between(source, target)
    assert is_rotation(R)
    a, b = unit(source), unit(target)
    np.testing.assert_allclose(R @ a, b, rtol=0.0, atol=ROUNDING * 10.0)
    # The trace of a rotation is 1 + 2 cos(angle); no smaller turn exists.
    assert abs(np.trace(R) - (1.0 + 2.0 * np.dot(a, b))) < ROUNDING * 10.0


@pytest.mark.parametrize("off", [1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16])
def test_rotation_between_nearly_opposite_vectors_loses_no_digits(off: float) -> None:
    source = unit([0.3, -0.5, 0.8])
    target = -source + off * np.array([0.2, 0.9, -0.4])
    np.testing.assert_allclose(
        rotation_between(source, target) @ source, unit(target), rtol=0.0, atol=1e-15
    )


def test_rotation_between_opposite_vectors_is_a_half_turn() -> None:
    R = rotation_between(Y, -Y)
    assert is_rotation(R)
    np.testing.assert_allclose(R @ Y, -Y, rtol=0.0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("vector", "message"),
    [
        ([0.0, 0.0, 0.0], "needs a direction, got [0.0, 0.0, 0.0]"),
        ([np.inf, 0.0, 0.0], "needs a direction, got [inf, 0.0, 0.0]"),
    ],
)
def test_a_direction_without_length_is_refused(vector: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        unit(vector)


@quick
@given(vectors, st.floats(-10.0, 10.0))
def test_a_rotation_about_an_axis_keeps_it_and_turns_what_is_across_right_handed(
    axis: Array, angle: float
) -> None:
    a = unit(axis)
    R = rotation_about(a, angle)
    across = unit(np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))]))
    np.testing.assert_allclose(R @ a, a, atol=ROUNDING)
    turned = np.cos(angle) * across + np.sin(angle) * np.cross(a, across)
    np.testing.assert_allclose(R @ across, turned, atol=ROUNDING)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=ROUNDING)


def test_a_small_rotation_keeps_its_digits() -> None:
    np.testing.assert_allclose(rotation_about(Z, 1e-9) @ X, [1.0, 1e-9, 0.0], rtol=1e-15)
    np.testing.assert_array_equal(rotation_about(Z, 0.0), np.eye(3))


@pytest.mark.parametrize("tilt", [-2.9, 0.0, 0.7, 1.6])
def test_turns_about_z_x_and_z_follow_one_another(tilt: float) -> None:
    """Each about an axis that those before have turned: they are multiplied from the left."""
    R = rotation_about(Z, 2.1) @ rotation_about(X, tilt) @ rotation_about(Z, -0.4)
    np.testing.assert_allclose(rotation_zxz(2.1, tilt, -0.4), R, atol=1e-15)
