"""Triangles split where light is not linear, and light of triangles that are partly hidden."""

from __future__ import annotations

from collections import Counter

import numpy as np

from simgl.radiosity.gather_points import GatherPoints, face_normals
from simgl.radiosity.light_refinement import refined_by_light
from simgl.radiosity.occlusion import inside_others, with_unshared_corners
from simgl.radiosity.remesh import subdivided
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh, box, plate
from tests.radiosity.shapes import OPEN_BOX, joined, moved, quads


def on_the_floor() -> Mesh:
    """A box of 0.4 m that stands in the middle of a floor of 2 x 2 m, a little sunk into it."""
    floor = subdivided(moved(box((2.0, 2.0, 0.1)), (0.0, 0.0, -0.05)), 0.7)
    return joined(floor, moved(box((0.4, 0.4, 0.4)), (0.03, 0.02, 0.19)))


def test_surfaces_that_see_nothing_stay_as_they_are() -> None:
    far = joined(plate(1.0, 1.0), moved(plate(1.0, 1.0), (0.0, 0.0, 400.0)))
    assert refined_by_light(far, 2, 1000, 0.01).digest == far.digest


def test_more_triangles_go_where_a_box_stands() -> None:
    """They are about as many as asked for, stay closed, and are smallest about the box's foot."""
    mesh = on_the_floor()
    fine = refined_by_light(mesh, 1, 600, 0.02)
    added = len(fine.triangles) - len(mesh.triangles)
    # An edge makes two triangles, and one more where neighbours are cut along with it.
    assert 300 < added < 1200
    np.testing.assert_allclose(face_normals(fine)[1].sum(), face_normals(mesh)[1].sum(), rtol=1e-6)
    places = [p.tobytes() for p in fine.positions + np.float32(0.0)]
    runs = Counter((places[t[k]], places[t[(k + 1) % 3]]) for t in fine.triangles for k in range(3))
    assert all(runs[a, b] == runs[b, a] for a, b in runs)
    middles = fine.positions[fine.triangles].mean(axis=1)
    areas = face_normals(fine)[1]
    top = np.abs(middles[:, 2]) < 1e-6
    away = np.abs(middles[:, :2] - [0.03, 0.02]).max(axis=1)
    foot, rest = top & (away > 0.2) & (away < 0.3), top & (away > 0.3)
    assert foot.sum() / areas[foot].sum() > 2.0 * rest.sum() / areas[rest].sum()


def test_the_same_mesh_is_split_alike() -> None:
    mesh = quads(OPEN_BOX)
    assert (
        refined_by_light(mesh, 2, 300, 0.02).digest == refined_by_light(mesh, 2, 300, 0.02).digest
    )


def test_partly_hidden_triangles_see_from_their_own_open_places() -> None:
    mesh = on_the_floor()
    tracer = RayTracer(mesh)
    grown, points = with_unshared_corners(mesh, tracer)
    # The same triangles, in the same order.
    np.testing.assert_array_equal(grown.positions[grown.triangles], mesh.positions[mesh.triangles])
    corners = points.of_vertex[0][grown.triangles.astype(np.int64)]
    uses = np.bincount(corners.ravel(), minlength=len(points.origins))
    middles = grown.positions[grown.triangles].mean(axis=1)
    unshared = np.flatnonzero(np.all(uses[corners] == 1, axis=1))
    assert len(unshared) > 0
    assert np.all(hidden_places(mesh, tracer, points)[corners[unshared]] == 0)
    # Far from the box vertices have light together.
    rim = np.abs(middles[:, :2]).max(axis=1) > 0.9
    assert not np.any(rim[unshared])


def hidden_places(mesh: Mesh, tracer: RayTracer, points: GatherPoints) -> np.ndarray:
    """(s,) how many of the places of each gather point lie inside another part."""
    each = points.origins.shape[1]
    normals = np.repeat(points.normals, each, axis=0)
    inside = inside_others(mesh, tracer, points.origins.reshape(-1, 3), normals)
    return np.asarray(inside.reshape(-1, each).sum(axis=1))
