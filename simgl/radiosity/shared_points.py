"""Gather points of meshes that are finer than the light between surfaces needs."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from simgl.arrays import Array, IndexArray
from simgl.scene.mesh import Mesh, position_ids

# Gather points of a body at most. The shipped models have up to 190,000.
GATHER_POINTS = 200_000


def shared_points(
    mesh: Mesh, row: IndexArray, normals: Array, limit: int, area: float
) -> IndexArray:
    """(v,) gather points of vertices, no more than a limit if possible: vertices of one
    surface in one cell of space, whose normals are alike, share one. Kinds of normals and surfaces
    may be more than the limit.

    row, normals : of each vertex, as of ``distinct_points``
    area : of the surface [m2]

    The cells are as small as the limit allows, at 200,000 points a hundredth of a body's size.
    """
    if int(row.max()) < limit:
        return row
    surface = _surfaces(mesh, limit)
    away = mesh.positions.astype(np.float64) - mesh.positions.min(axis=0)
    direction = np.round(normals * _DIRECTIONS).astype(np.int64) + _DIRECTIONS
    length = np.sqrt(area / limit)
    while True:
        cell = (away / max(length, away.max() / (_CELLS - 1))).astype(np.int64)
        keys = np.zeros(len(away), dtype=np.int64)
        for values, many in (
            *((axis, _CELLS) for axis in cell.T),
            *((axis, 2 * _DIRECTIONS + 1) for axis in direction.T),
        ):
            keys = keys * many + values
        shared = np.unique(keys * _SURFACES + surface % _SURFACES, return_inverse=True)[1]
        if int(shared.max()) < limit or length > away.max():
            return np.asarray(shared.reshape(-1), dtype=np.int64)
        length *= 1.2


def _surfaces(mesh: Mesh, limit: int) -> IndexArray:
    """(v,) a number for each connected surface of a mesh; the same for all where triangles do not
    share corners."""
    place = position_ids(mesh.positions)
    corners = place[mesh.triangles.astype(np.int64)]
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    count = int(place.max()) + 1
    links = sparse.coo_array((np.ones(len(starts), dtype=np.bool_), (starts, ends)), (count, count))
    number, surface = connected_components(links, directed=False)
    if number > limit // 10:
        return np.zeros(len(place), dtype=np.int64)
    return np.asarray(surface[place], dtype=np.int64)


# Cells along a body, and of the components of normals from -1 to 1 on each side of 0; their numbers
# and those of surfaces make keys of 63 bits.
_CELLS = 1 << 11
_DIRECTIONS = 4
_SURFACES = 1 << 20
