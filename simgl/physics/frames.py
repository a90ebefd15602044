"""Rotations and poses; every quaternion formula of simgl is here.

Conventions: column vectors, ``v_a = R_a_from_b @ v_b``, so adjacent names cancel. Quaternions are
Hamilton, scalar last; ``q_a_from_b_xyzw`` turns components in b into components in a. Camera axes:
z along the boresight, x right, y down. LVLH: z to nadir, y along minus the orbit normal, x to
complete (along the velocity of a circular orbit).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

# A quaternion typed with four decimals is off by at most 1e-4; anything worse is a mistake.
QUATERNION_NORM_TOLERANCE = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Pose:
    """Where a body is and how it is turned.

    position : (3,) origin of the body frame in Earth-centred ICRF axes [m]
    velocity : (3,) [m s-1]
    R_icrf_from_body : (3, 3) rotation
    """

    position: Array
    velocity: Array
    R_icrf_from_body: Array


def unit(vector: ArrayLike) -> Array:
    """The vector scaled to length one; a zero or non-finite vector is a ValueError."""
    v = np.asarray(vector, dtype=np.float64)
    norm = float(np.linalg.norm(v))
    if not np.isfinite(norm) or norm == 0.0:
        raise ValueError(f"needs a direction, got {v.tolist()}")
    return np.asarray(v / norm)


def matrix_from_quaternion(q_a_from_b_xyzw: ArrayLike) -> Array:
    """R_a_from_b of a unit quaternion; the ValueError says how far off a non-unit one is."""
    q = np.asarray(q_a_from_b_xyzw, dtype=np.float64)
    if q.shape != (4,) or not np.all(np.isfinite(q)):
        raise ValueError(f"must be four finite numbers x y z w, got {q.tolist()}")
    norm = float(np.linalg.norm(q))
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        raise ValueError(
            f"must be a unit quaternion, got norm {norm:.6g} "
            f"(off by {norm - 1.0:+.2g}, allowed {QUATERNION_NORM_TOLERANCE:g})"
        )
    return np.asarray(Rotation.from_quat(q).as_matrix())


def quaternion_from_matrix(R_a_from_b: Array) -> Array:
    """q_a_from_b_xyzw of a rotation matrix, with w >= 0.

    From the largest of its four squares (Shepperd, J. Guidance and Control 1, 223, 1978), in plain
    numbers: a general routine takes thirty times as long, and every picture needs a few.
    """
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
    """R_lvlh_from_icrf of an orbit state, position [m] and velocity [m s-1] in ICRF."""
    z = -unit(position)
    y = -unit(np.cross(position, velocity))
    return np.stack([np.cross(y, z), y, z])


def lvlh_angular_velocity(position: Array, velocity: Array) -> Array:
    """(3,) rate of the LVLH frame against ICRF, in ICRF axes [rad s-1]."""
    return np.asarray(np.cross(position, velocity) / np.dot(position, position))


def camera_from_directions(boresight: ArrayLike, up: ArrayLike) -> Array:
    """R_camera_from_x for a camera that looks along ``boresight`` with ``up`` towards its top.

    Both are given in frame x. ``up`` need not be perpendicular; where it is parallel to the
    boresight the axis of x least aligned with it serves instead.
    """
    z = unit(boresight)
    hint = unit(up)
    right = np.cross(z, hint)
    if np.linalg.norm(right) < 1e-9:
        right = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x = unit(right)
    return np.stack([x, np.cross(z, x), z])


def rotation_between(source: ArrayLike, target: ArrayLike) -> Array:
    """The smallest rotation R with ``R @ source`` along ``target``."""
    a, b = unit(source), unit(target)
    axis = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(axis)), float(np.dot(a, b))
    if sine < 1e-15:
        if cosine > 0.0:
            return np.eye(3)
        axis = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    # Of nearly opposite vectors the cross product is rounding; only what is square to a turns
    # a into b.
    axis = axis - np.dot(axis, a) * a
    return np.asarray(Rotation.from_rotvec(unit(axis) * np.arctan2(sine, cosine)).as_matrix())
