"""Directions over a hemisphere, and the cells of the sky that they reach."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.environment_map import cube_cell

# Cells of a body's sky: 4 x 4 on each face of the cube of simgl/environment_map.py, in its order.
CELLS_ACROSS = 4
SKY_CELLS = 6 * CELLS_ACROSS**2

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
# Components of a unit normal are rounded to this, 2 deg, where only its directions' cells matter.
_NORMAL_STEP = 1.0 / 32.0


def cosine_directions(count: int) -> Array:
    """(count, 3) unit directions about +z whose density follows the cosine to it.

    A sunflower's seeds on the unit disc (Vogel 1979), raised to the hemisphere: the density on the
    disc is even, so that on the hemisphere it is the cosine (Malley's method).
    """
    i = np.arange(count)
    r2 = (i + 0.5) / count
    radius, turn = np.sqrt(r2), i * _GOLDEN_ANGLE
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - r2)], axis=1)


def frames(normals: Array) -> Array:
    """(n, 3, 3) rotations whose third column is the unit normal (n, 3) (Duff et al. 2017)."""
    x, y, z = normals.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    t = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    s = np.stack([b, sign + y * y * a, -y], axis=1)
    return np.stack([t, s, normals], axis=2)


def spins(count: int) -> Array:
    """(count, 3, 3) rotations about +z by steps of the golden ratio: even among neighbours."""
    angle = 2.0 * np.pi * ((0.6180339887498949 * np.arange(count)) % 1.0)
    c, s, zero = np.cos(angle), np.sin(angle), np.zeros(count)
    rows = (c, -s, zero), (s, c, zero), (zero, zero, zero + 1.0)
    return np.moveaxis(np.array(rows), 2, 0)


def rounded_normals(normals: Array) -> tuple[Array, IndexArray]:
    """(b, 3) unit normals and, for each of the (n, 3) given, the row (n,) of one within 2 deg."""
    steps = np.round(normals / _NORMAL_STEP).astype(np.int64) + 64
    keys = (steps[:, 0] * 128 + steps[:, 1]) * 128 + steps[:, 2]
    unique, row = np.unique(keys, return_inverse=True)
    corners = np.stack([unique // 16384, unique // 128 % 128, unique % 128], axis=1) - 64.0
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), row.ravel()


def sky_cell(directions: Array, cells_across: int = CELLS_ACROSS) -> IndexArray:
    """(...) cell of the sky that each direction (..., 3) in body axes points to.

    One of 0..95, or of 0..6 n^2 - 1 with n x n cells on each face.
    """
    return cube_cell(directions, cells_across)
