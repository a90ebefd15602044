"""Whether a mesh bounds a solid, so that no camera outside sees the back of a triangle."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from simgl.scene.mesh import Mesh, position_ids


def is_solid(mesh: Mesh) -> bool:
    """Whether all triangles make one closed surface of one part that faces outwards.

    Not for several: where they cross, corners of triangles lie inside other surfaces, and light
    between surfaces is better from both sides.
    """
    if np.any(mesh.part != mesh.part[:1]) or not mesh.is_closed():
        return False
    corners = position_ids(mesh.positions)[mesh.triangles]
    used, corners = np.unique(corners, return_inverse=True)
    corners = corners.reshape(-1, 3)
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    shape = len(used), len(used)
    links = sparse.coo_array((np.ones(len(starts), dtype=np.bool_), (starts, ends)), shape)
    surfaces, _ = connected_components(links, directed=False)
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64) - mesh.centre, 1, 0)
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)))
    return surfaces == 1 and volume > 0.0
