"""Splitting triangles: the surface stays, nothing opens."""

from __future__ import annotations

from collections import Counter

import numpy as np

from simgl.radiosity.remesh import subdivided
from simgl.scene.mesh import Mesh, box, cylinder
from tests.radiosity.shapes import doubled_areas


def edges(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def test_no_edge_is_longer_than_asked() -> None:
    fine = subdivided(cylinder(0.5, 2.0, 24), 0.1)
    # Middles are rounded to float32.
    assert edges(fine).max() <= 0.1 * (1.0 + 1e-6)


def test_area_and_labels_stay_and_short_edges_too() -> None:
    mesh = box((1.0, 2.0, 3.0))
    fine = subdivided(mesh, 0.25)
    area = 0.5 * np.linalg.norm(doubled_areas(fine), axis=1).sum()
    np.testing.assert_allclose(area, 22.0, rtol=1e-6)
    normals = doubled_areas(fine)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Each piece still faces as its vertices say.
    np.testing.assert_allclose(normals, fine.normals[fine.triangles[:, 0]], atol=1e-5)
    assert subdivided(mesh, 10.0).digest == mesh.digest


def test_a_split_surface_is_as_closed_as_before() -> None:
    """Every edge of a closed body runs once each way, also where vertices are doubled."""
    limits = np.full(12, 10.0)
    limits[3] = 0.3
    fine = subdivided(box((1.0, 2.0, 3.0)), limits)
    assert len(fine.triangles) > 30
    places = [p.tobytes() for p in fine.positions + np.float32(0.0)]
    runs = Counter((places[t[k]], places[t[(k + 1) % 3]]) for t in fine.triangles for k in range(3))
    assert all(runs[a, b] == 1 and runs[b, a] == 1 for a, b in runs)
