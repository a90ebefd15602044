"""In meshes finer than the light between surfaces needs, neighbouring vertices share its points."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.radiosity.gather_points import cast, distinct_points, face_normals, gather_points_of
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.shared_points import shared_points
from simgl.rays import RayTracer
from simgl.scene.mesh import plate
from tests.radiosity.shapes import FLOOR, Quad, joined, moved, quads, view_at_right_angles

WALL: Quad = ((0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1))
LIMIT = 1000
# Of a square cell that holds one of so many points: the floor has 2 m2, the wall 1.
CELL_M = float(np.sqrt(3.0 / LIMIT))


def test_each_vertex_gets_the_light_of_a_place_within_its_cell() -> None:
    mesh = subdivided(quads((FLOOR, WALL)), 0.02)
    points = gather_points_of(mesh, 1, limit=LIMIT)
    assert len(points.origins) <= LIMIT < int(distinct_points(mesh)[0].max()) / 5
    rays = cast(mesh, RayTracer(mesh), points, 1, 512, lambda _: None)
    seen = np.asarray(rays.hits.sum(axis=1)).ravel()[points.of_vertex[0]] / 512
    floor = (mesh.normals[:, 2] > 0.5) & (mesh.positions[:, 0] > 0.2)
    x, y = mesh.positions[floor, :2].astype(np.float64).T
    steps = np.array([-CELL_M, 0.0, CELL_M])
    around = [
        view_at_right_angles(x + along, np.clip(y + across, 0.0, 1.0), 1.0, 1.0)
        for along in steps
        for across in steps
    ]
    # A share of 512 rays is stratified; at random it had a deviation of 0.02.
    assert np.all(seen[floor] > np.min(around, axis=0) - 0.02)
    assert np.all(seen[floor] < np.max(around, axis=0) + 0.02)
    assert np.mean(seen[floor] - view_at_right_angles(x, y, 1.0, 1.0)) == pytest.approx(
        0.0, abs=0.003
    )


def test_sides_and_sheets_that_do_not_touch_share_none() -> None:
    """Plates of 1 mm, 1 mm apart, in cells of 9 cm: what lies behind a plate is dark."""
    sheet = plate(1.0, 1.0)
    mesh = subdivided(joined(sheet, moved(sheet, (0.0, 0.0, 2e-3))), 0.04)
    row, normals = distinct_points(mesh)
    row = shared_points(mesh, row, normals, 500, float(face_normals(mesh)[1].sum()))
    assert row.max() < 500
    wide = np.abs(normals[:, 2]) > 0.9
    height, upward = mesh.positions[wide, 2], normals[wide, 2] > 0.0
    for values in (height > 5e-4, upward):
        low, high = (np.full(500, bound) for bound in (2, -1))
        np.minimum.at(low, row[wide], values)
        np.maximum.at(high, row[wide], values)
        assert np.all(low >= high)
