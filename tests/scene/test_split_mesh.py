"""Meshes cut finely: no edge is long, nothing is lost, and neighbours still meet."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.scene.mesh import Mesh, box, plate
from simgl.scene.split_mesh import longest_edge, split_mesh


def areas(mesh: Mesh) -> Array:
    """(m, 3) twice the areas of triangles, along their normals."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    return np.cross(b - a, c - a)


@pytest.mark.parametrize("mesh", [box((1.0, 2.0, 0.3)), plate(3.0, 0.2)])
@pytest.mark.parametrize("longest", [0.25, 1.0])
def test_each_triangle_is_cut_into_parts_without_long_edges(mesh: Mesh, longest: float) -> None:
    split = split_mesh(mesh, longest)
    assert longest_edge(split.mesh) <= longest
    for axis in range(3):
        of_each = np.bincount(split.triangle, areas(split.mesh)[:, axis])
        # Midpoints are rounded to float32.
        np.testing.assert_allclose(of_each, areas(mesh)[:, axis], atol=1e-6)


def test_a_closed_surface_stays_closed() -> None:
    """Each edge is there once in either direction, told by the places of its ends."""
    split = split_mesh(box((1.0, 2.0, 0.3)), 0.2).mesh
    edges: Counter[tuple[bytes, bytes]] = Counter()
    for corners in split.positions[split.triangles]:
        ends = [(place + 0.0).tobytes() for place in corners]
        edges.update(zip(ends, ends[1:] + ends[:1], strict=True))
    assert all(edges[(b, a)] == count for (a, b), count in edges.items())


def test_short_edges_stay() -> None:
    mesh = box((1.0, 1.0, 1.0))
    split = split_mesh(mesh, 2.0)
    np.testing.assert_array_equal(split.mesh.triangles, mesh.triangles)
    np.testing.assert_array_equal(split.triangle, np.arange(12))
