"""Pieces of a mesh over which its normals change little: what one look into a pixel may average."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from simgl.arrays import Array, IndexArray
from simgl.scene.mesh import Mesh

# Directions fall into so many cells along the edge of a cube's face, 3 degrees or less across.
_CELLS = 31
# Turns the cube so that the faces of boxes, and chamfers between them, lie well inside cells.
_TURN = (0.31, 0.23, 0.17)


def smooth_surfaces(mesh: Mesh) -> IndexArray:
    """(m,) number of the surface of each triangle, from 0 on.

    The triangles of one surface hang together, have one part and material, continuous normals, and
    planes within some 3 degrees of each other.
    """
    corners = _welded(mesh)[mesh.triangles]
    direction = _directions(mesh)
    keys = corners * (6 * _CELLS**2) + direction[:, None]
    nodes = np.unique(keys, return_inverse=True)[1].reshape(keys.shape)
    count = int(nodes.max(initial=-1)) + 1
    one, other = nodes[:, [0, 1]].ravel(), nodes[:, [1, 2]].ravel()
    links = coo_matrix((np.ones(len(one), dtype=bool), (one, other)), shape=(count, count))
    of_node = connected_components(links, directed=False)[1]
    return np.asarray(of_node[nodes[:, 0]], dtype=np.int64)


def curvatures(mesh: Mesh) -> Array:
    """(m,) how fast the normals turn over each triangle [rad/m], along the edge where fastest."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    normals = mesh.normals[mesh.triangles].astype(np.float64)
    turn = np.linalg.norm(normals - np.roll(normals, 1, axis=1), axis=2)
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return np.asarray(np.max(turn / np.maximum(length, 1e-9), axis=1))


def _welded(mesh: Mesh) -> IndexArray:
    """(n,) the same number for vertices that differ at most in the place in their images."""
    labels = np.stack([mesh.part, mesh.material], axis=1).astype(np.float32)
    # 0.0 makes -0.0 the same.
    rows = np.ascontiguousarray(np.hstack([mesh.positions, mesh.normals, labels]) + np.float32(0.0))
    records = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
    return np.unique(records, return_inverse=True)[1].ravel()


def _directions(mesh: Mesh) -> IndexArray:
    """(m,) the cell of directions that each triangle's normal falls into."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    normals = np.cross(b - a, c - a) @ _turn().T
    axis = np.argmax(np.abs(normals), axis=1)
    rows = np.arange(len(normals))
    largest = normals[rows, axis]
    tangents = np.stack([normals[rows, (axis + k) % 3] for k in (1, 2)], axis=1)
    tangents /= np.maximum(np.abs(largest), 1e-300)[:, None]
    # Equal angles, rather than tangents.
    place = np.clip(0.5 + np.arctan(tangents) / (0.5 * np.pi), 0.0, 1.0 - 1e-9)
    column, row = np.floor(_CELLS * place).astype(np.int64).T
    face = 2 * axis + (largest < 0.0)
    return np.asarray((face * _CELLS + row) * _CELLS + column, dtype=np.int64)


def _turn() -> Array:
    """(3, 3) rotation."""
    a, b, c = _TURN
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return z @ y @ x
