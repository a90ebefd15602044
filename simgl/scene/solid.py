"""Whether a mesh bounds solids, so that no camera outside sees the back of a triangle."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from simgl.scene.mesh import Mesh, position_ids


def is_solid(mesh: Mesh) -> bool:
    """Whether every part consists of closed surfaces that face outwards.

    A part counts by itself: joints may move it away from those that it touches.
    """
    parts = int(mesh.part.max(initial=0)) + 1
    # Vertices at one place of one part are one.
    place = position_ids(mesh.positions) * parts + mesh.part
    _, vertex = np.unique(place, return_inverse=True)
    corners = vertex.reshape(-1)[mesh.triangles]
    count = int(corners.max(initial=0)) + 1
    starts, ends = corners, np.roll(corners, -1, axis=1)
    one_way, other_way = (
        np.sort((a * count + b).ravel()) for a, b in ((starts, ends), (ends, starts))
    )
    if not np.array_equal(one_way, other_way):
        return False
    links = sparse.coo_array(
        (np.ones(starts.size, dtype=np.bool_), (starts.ravel(), ends.ravel())), (count, count)
    )
    _, shell = connected_components(links, directed=False)
    of_triangle = shell[corners[:, 0]]
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64) - mesh.centre, 1, 0)
    volumes = np.bincount(of_triangle, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)
    # A sheet of two sides has no volume, and each side hides the other's back.
    return bool(volumes.min(initial=0.0) >= -_ROUNDING * mesh.radius**3)


# Volume of a shell over the cube of the body's radius that is rounding alone.
_ROUNDING = 1e-9
