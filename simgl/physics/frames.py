"""Rotations and poses; all quaternion formulas of simgl.

Conventions: column vectors, ``v_a = R_a_from_b @ v_b``, so adjacent names cancel. Quaternions are
Hamilton, scalar last; ``q_a_from_b_xyzw`` turns components in b into components in a. Camera axes:
z along the boresight, x right, y down. LVLH: z to nadir, y along minus the orbit normal, x to
complete (along the velocity of a circular orbit).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array

# Rounding to four decimals changes the norm by at most 1e-4; a larger error is a mistake.
QUATERNION_NORM_TOLERANCE = 1e-4

# Of the entries of R R^T from those of the identity: as far off as a quaternion whose norm is 1e-4
# off makes them.
_ROTATION_SLACK = 2e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Pose:
    """Position, velocity and attitude of a body.

    position : (3,) origin of the body frame in GCRF [m]
    velocity : (3,) in GCRF [m s-1]
    R_icrf_from_body : (3, 3) rotation
    """

    position: Array
    velocity: Array
    R_icrf_from_body: Array


def unit(vector: ArrayLike) -> Array:
    """The vector scaled to unit length; ValueError for a zero or non-finite vector."""
    v = np.asarray(vector, dtype=np.float64)
    norm = math.sqrt(v.dot(v))
    if not math.isfinite(norm) or norm == 0.0:
        raise ValueError(f"needs a direction, got {v.tolist()}")
    return v / norm


def norm(vector: Array) -> float:
    """Length of a vector (3,); ten times as fast as numpy's for single vectors."""
    return math.sqrt(vector.dot(vector))


def moved(points: Array, R: Array, offset: Array) -> Array:
    """Points (n, 3) turned by R (3, 3) and moved by an offset (3,).

    Coordinate by coordinate in memory: along rows of three, numpy takes fifty times as long to find
    the least and the most.
    """
    return np.asarray(R @ points.T + offset[:, None]).T


def cross(a: Array, b: Array) -> Array:
    """Cross product of two vectors (3,); ten times as fast as numpy's for single vectors."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def angle_between(a: Array, b: Array) -> float:
    """Angle between two vectors (3,) of any length [rad]; accurate for small angles."""
    across = cross(a, b)
    return math.atan2(math.sqrt(across.dot(across)), a.dot(b))


def direction_icrf(right_ascension: float, declination: float) -> Array:
    """(3,) unit vector in ICRF axes of two angles [rad]."""
    across = math.cos(declination)
    return np.array(
        [
            across * math.cos(right_ascension),
            across * math.sin(right_ascension),
            math.sin(declination),
        ]
    )


def matrix_from_quaternion(q_a_from_b_xyzw: ArrayLike) -> Array:
    """(3, 3) matrix R_a_from_b of a unit quaternion.

    q_a_from_b_xyzw : (4,) Hamilton, scalar last

    Raises ValueError for quaternions of another norm.

    Python floats: every frame needs a few, and scipy's Rotation takes five times as long.
    """
    q = np.asarray(q_a_from_b_xyzw, dtype=np.float64)
    if q.shape != (4,) or not all(map(math.isfinite, q.tolist())):
        raise ValueError(f"must be four finite numbers x y z w, got {q.tolist()}")
    x, y, z, w = q.tolist()
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        raise ValueError(
            f"must be a unit quaternion, got norm {norm:.6g} "
            f"(off by {norm - 1.0:+.2g}, allowed {QUATERNION_NORM_TOLERANCE:g})"
        )
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    xy, xz, xw, yz, yw, zw = x * y, x * z, x * w, y * z, y * w, z * w
    return np.array(
        [
            [xx - yy - zz + ww, 2.0 * (xy - zw), 2.0 * (xz + yw)],
            [2.0 * (xy + zw), -xx + yy - zz + ww, 2.0 * (yz - xw)],
            [2.0 * (xz - yw), 2.0 * (yz + xw), -xx - yy + zz + ww],
        ]
    )


def is_rotation(R: Array) -> bool:
    """Whether a matrix is (3, 3) with unit, perpendicular and right-handed rows.

    In Python's floats: a tenth of numpy's time for so few of them.
    """
    if np.shape(R) != (3, 3):
        return False
    x, y, z = np.asarray(R, dtype=np.float64).tolist()
    products = ((x, x, 1.0), (y, y, 1.0), (z, z, 1.0), (x, y, 0.0), (y, z, 0.0), (z, x, 0.0))
    # Numbers that are not finite fail every comparison.
    if not all(abs(_dot(a, b) - expected) <= _ROTATION_SLACK for a, b, expected in products):
        return False
    across = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
    return _dot(x, across) > 0.0


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def quaternion_from_matrix(R_a_from_b: Array) -> Array:
    """(4,) quaternion q_a_from_b_xyzw of a rotation matrix, Hamilton, scalar last, with w >= 0.

    R_a_from_b : (3, 3)

    From the largest of its four squares (Shepperd, J. Guidance and Control 1, 223, 1978). Python
    floats: every frame needs a few, and scipy's Rotation takes thirty times as long.

    Raises ValueError for a matrix that mirrors or scales, or is not finite.
    """
    if not is_rotation(R_a_from_b):
        raise ValueError(f"must be a rotation, got {np.asarray(R_a_from_b).tolist()}")
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(R_a_from_b, dtype=np.float64).tolist()
    trace = a + e + i
    largest = max(a, e, i, trace)
    if largest == trace:
        q = (h - f, c - g, d - b, 1.0 + trace)
    elif largest == a:
        q = (1.0 + a - e - i, b + d, c + g, h - f)
    elif largest == e:
        q = (b + d, 1.0 - a + e - i, f + h, c - g)
    else:
        q = (c + g, f + h, 1.0 - a - e + i, d - b)
    size = math.copysign(math.sqrt(sum(v * v for v in q)), q[3])
    return np.array([v / size for v in q])


def lvlh_from_icrf(position: Array, velocity: Array) -> Array:
    """(3, 3) matrix R_lvlh_from_icrf: x completes, along the velocity; y against the orbit's
    angular momentum, z to the Earth's centre.

    position : (3,) in GCRF [m]
    velocity : (3,) in GCRF [m s-1]
    """
    z = -unit(position)
    y = -unit(cross(position, velocity))
    return np.array([cross(y, z), y, z])


def lvlh_angular_velocity(position: Array, velocity: Array) -> Array:
    """(3,) angular velocity of the LVLH frame relative to ICRF, in ICRF axes [rad s-1]."""
    return cross(position, velocity) / np.dot(position, position)


def camera_from_directions(boresight: ArrayLike, up: ArrayLike) -> Array:
    """R_camera_from_x for a camera that looks along ``boresight``, ``up`` towards the image's top.

    Both are given in frame x. ``up`` need not be perpendicular to the boresight; if it is parallel,
    the axis of x that is least aligned with the boresight replaces it.
    """
    z = unit(boresight)
    hint = unit(up)
    right = cross(z, hint)
    if right.dot(right) < 1e-18:
        right = cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x = unit(right)
    return np.array([x, cross(z, x), z])


def rotation_about(axis: Array, angle: float) -> Array:
    """The right-handed rotation by an angle [rad] about a unit vector (3,), by Rodrigues.

    Twenty times as fast as scipy's for a single one.
    """
    x, y, z = axis.tolist()
    s, c = math.sin(angle), math.cos(angle)
    # 1 - cos without the cancellation of small angles.
    v = 2.0 * math.sin(0.5 * angle) ** 2
    return np.array(
        [
            [c + v * x * x, v * x * y - s * z, v * x * z + s * y],
            [v * x * y + s * z, c + v * y * y, v * y * z - s * x],
            [v * x * z - s * y, v * y * z + s * x, c + v * z * z],
        ]
    )


def rotation_zxz(first: float, tilt: float, last: float) -> Array:
    """The right-handed rotations by angles [rad] about z, then the new x, then the new z.

    Twenty times as fast as scipy's for a single one.
    """
    (s, c), (t, d), (u, e) = ((math.sin(a), math.cos(a)) for a in (first, tilt, last))
    return np.array(
        [
            [c * e - s * d * u, -c * u - s * d * e, s * t],
            [s * e + c * d * u, -s * u + c * d * e, -c * t],
            [t * u, t * e, d],
        ]
    )


def rotation_between(source: ArrayLike, target: ArrayLike) -> Array:
    """The smallest rotation R with ``R @ source`` along ``target``."""
    a, b = unit(source), unit(target)
    axis = cross(a, b)
    sine, cosine = float(np.linalg.norm(axis)), float(np.dot(a, b))
    if sine < 1e-15:
        if cosine > 0.0:
            return np.eye(3)
        axis = cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    # For nearly opposite vectors the cross product is mostly rounding error; only its component
    # perpendicular to a is a valid axis.
    axis = axis - np.dot(axis, a) * a
    # Here, since it takes a second, and clients of the image service never turn a vector.
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(unit(axis) * np.arctan2(sine, cosine)).as_matrix()
