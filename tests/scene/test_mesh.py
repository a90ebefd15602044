"""Calibration shapes: closed, turned outwards, and of the size that geometry gives them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.scene.mesh import Mesh, box, cylinder, plate, sphere

SHAPES = {
    "box": box((0.3, 2.0, 1.1)),
    "plate": plate(2.0, 0.5),
    "sphere": sphere(1.5),
    "cylinder": cylinder(0.4, 3.0),
}
# Half-sizes along the axes.
HALVES = {
    "box": (0.15, 1.0, 0.55),
    "plate": (1.0, 0.25, 2.5e-4),
    "sphere": (1.5, 1.5, 1.5),
    "cylinder": (0.4, 0.4, 1.5),
}
# One unit of a float32's last place, relative.
FLOAT32 = 2.0**-23

quick = settings(deadline=None, database=None, max_examples=40)
shapes = pytest.mark.parametrize("name", SHAPES)
turns = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).filter(
    lambda v: bool(np.linalg.norm(v) > 0.1)
)


def solid(mesh: Mesh) -> trimesh.Trimesh:
    """The mesh with equal corners joined, as trimesh needs it to see that edges meet."""
    joined = trimesh.Trimesh(mesh.positions.astype(np.float64), mesh.triangles, process=False)
    joined.merge_vertices(merge_norm=True, merge_tex=True, digits_vertex=5)
    return joined


@shapes
def test_a_shape_is_closed_and_its_triangles_face_outwards(name: str) -> None:
    joined = solid(SHAPES[name])
    assert joined.is_watertight
    assert joined.is_winding_consistent
    assert joined.volume > 0.0


@shapes
def test_vertex_normals_are_unit_and_side_with_their_facets(name: str) -> None:
    mesh = SHAPES[name]
    length = np.linalg.norm(mesh.normals.astype(np.float64), axis=1)
    np.testing.assert_allclose(length, 1.0, rtol=0.0, atol=4 * FLOAT32)
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    facet = np.cross(b - a, c - a)
    assert np.all(np.linalg.norm(facet, axis=1) > 0.0)
    facet /= np.linalg.norm(facet, axis=1, keepdims=True)
    agreement = np.einsum("ij,ikj->ik", facet, mesh.normals[mesh.triangles])
    # A facet of the finest circle spans 360/192 deg, so no corner is turned by more than that.
    assert agreement.min() > np.cos(np.radians(2.0 * 360.0 / 192.0))


def test_volume_and_area_of_a_box_and_a_plate_are_their_products() -> None:
    joined = solid(SHAPES["box"])
    assert joined.volume == pytest.approx(0.3 * 2.0 * 1.1, rel=4 * FLOAT32)
    assert joined.area == pytest.approx(2 * (0.3 * 2.0 + 2.0 * 1.1 + 1.1 * 0.3), rel=4 * FLOAT32)
    # The plate is a thousandth of its shorter side thick; one step of 2 m is 1e-4 of 0.5 mm.
    joined = solid(SHAPES["plate"])
    assert joined.volume == pytest.approx(2.0 * 0.5 * 5e-4, rel=1e-3)


def test_volume_and_area_of_a_cylinder_are_those_of_its_polygon() -> None:
    joined = solid(SHAPES["cylinder"])
    sides, r, length = 192, 0.4, 3.0
    polygon = 0.5 * sides * r * r * np.sin(2.0 * np.pi / sides)
    edge = 2.0 * r * np.sin(np.pi / sides)
    # Corners are rounded to float32, relative to an edge of 0.013 m.
    assert joined.volume == pytest.approx(polygon * length, rel=1e-5)
    assert joined.area == pytest.approx(2.0 * polygon + sides * edge * length, rel=1e-5)
    # And the polygon is close to the circle: 1 - (2 pi / n)^2 / 6.
    assert joined.volume == pytest.approx(np.pi * r * r * length, rel=1.8e-4)


def test_a_sphere_has_the_volume_of_the_ball_and_hardly_more_area() -> None:
    joined, r = solid(SHAPES["sphere"]), 1.5
    # Corners in float32.
    assert joined.volume / (4.0 / 3.0 * np.pi * r**3) == pytest.approx(1.0, abs=1e-6)
    # Of all bodies of a volume the ball has the least area. No point of a facet lies deeper below
    # its corners than the sag of both its arcs, (pi / 192)^2 / 2 each.
    sag = (np.pi / 192.0) ** 2
    assert 1.0 < joined.area / (4.0 * np.pi * r**2) < 1.0 + sag


def test_a_sphere_has_its_own_radial_normals() -> None:
    mesh = SHAPES["sphere"]
    radius = np.linalg.norm(mesh.positions, axis=1).max()
    # Corners stand out by what the facets between them lie deeper, (pi / 192)^2 / 2 each way.
    assert 1.5 < radius < 1.5 * (1.0 + 0.5 * (np.pi / 192.0) ** 2 * 2.0)
    np.testing.assert_allclose(mesh.positions, radius * mesh.normals, rtol=0.0, atol=4 * FLOAT32)


def test_a_plate_faces_plus_z_from_the_plane_z_0() -> None:
    mesh = SHAPES["plate"]
    front = mesh.normals[:, 2] == 1.0
    assert front.sum() == 4
    np.testing.assert_array_equal(mesh.positions[front, 2], 0.0)
    assert mesh.positions[:, 2].min() == pytest.approx(-5e-4, rel=1e-6)


@shapes
def test_a_point_inside_is_wound_once_and_one_outside_not_at_all(name: str) -> None:
    mesh, half = SHAPES[name], np.array(HALVES[name])
    rng = np.random.default_rng(3)
    for _ in range(20):
        # Within 1/sqrt(3) of the half-sizes, every shape holds the point.
        inside = mesh.centre + half * rng.uniform(-0.55, 0.55, 3)
        outside = mesh.centre + half * rng.choice([-1.0, 1.0], 3) * rng.uniform(1.1, 3.0, 3)
        # Float32 corners: each of the 4e4 triangles of a sphere within 1e-7 of its solid angle.
        assert abs(mesh.winding_number(inside) - 1.0) < 1e-5
        assert abs(mesh.winding_number(outside)) < 1e-5


def test_two_boxes_one_within_the_other_are_wound_twice() -> None:
    outer, inner = box((2.0, 2.0, 2.0)), box((1.0, 1.0, 1.0))
    both = replace(
        outer,
        positions=np.concatenate([outer.positions, inner.positions]),
        triangles=np.concatenate([outer.triangles, inner.triangles + len(outer.positions)]),
    )
    assert both.winding_number(np.array([0.1, 0.2, 0.3])) == pytest.approx(2.0, abs=1e-12)
    assert both.winding_number(np.array([0.7, 0.2, 0.3])) == pytest.approx(1.0, abs=1e-12)


@shapes
@quick
@given(towards=turns)
def test_the_hull_reaches_as_far_as_the_mesh_in_every_direction(
    name: str, towards: tuple[float, float, float]
) -> None:
    mesh = SHAPES[name]
    axis = np.array(towards)
    assert (mesh.hull @ axis).max() >= (mesh.positions.astype(np.float64) @ axis).max() - 1e-12


def test_a_flat_mesh_is_bounded_by_its_box() -> None:
    label = np.zeros(3, dtype=np.uint32)
    flat = Mesh(
        positions=np.array([[0, 0, 1], [2, 0, 1], [0, 3, 1]], dtype=np.float32),
        normals=np.tile(np.array([0, 0, 1], dtype=np.float32), (3, 1)),
        triangles=np.array([[0, 1, 2]], dtype=np.uint32),
        part=label,
        material=label,
    )
    corners = {tuple(corner) for corner in flat.hull.tolist()}
    assert corners == {(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (0.0, 3.0, 1.0), (2.0, 3.0, 1.0)}


@shapes
def test_the_bounding_sphere_holds_every_vertex_and_touches_one(name: str) -> None:
    mesh = SHAPES[name]
    distance = np.linalg.norm(mesh.positions.astype(np.float64) - mesh.centre, axis=1)
    assert distance.max() == pytest.approx(mesh.radius, rel=1e-12)
    assert mesh.radius <= np.linalg.norm(HALVES[name]) * (1.0 + 4 * FLOAT32)


def test_equal_meshes_have_equal_digests_and_others_have_not() -> None:
    assert box((1.0, 2.0, 3.0)).digest == box((1.0, 2.0, 3.0)).digest
    other = [
        box((1.0, 2.0, 3.001)),
        sphere(1.0),
        replace(box((1.0, 2.0, 3.0)), part=np.ones(24, dtype=np.uint32)),
        replace(box((1.0, 2.0, 3.0)), material=np.ones(24, dtype=np.uint32)),
    ]
    digests = {mesh.digest for mesh in [*other, box((1.0, 2.0, 3.0))]}
    assert len(digests) == 5


@pytest.mark.parametrize("name", ["box", "plate"])
def test_every_edge_of_a_shape_has_two_sides_until_a_triangle_is_taken_out(name: str) -> None:
    mesh = SHAPES[name]
    assert mesh.is_closed()
    assert not mesh.is_closed(np.arange(1, len(mesh.triangles)))


@pytest.mark.parametrize("name", ["box", "plate"])
def test_the_distance_to_a_box_is_that_to_its_faces_edges_and_corners(name: str) -> None:
    mesh, half = SHAPES[name], np.array(HALVES[name])
    for point in np.random.default_rng(6).uniform(-2.0, 2.0, (60, 3)):
        beyond = np.abs(point - mesh.centre) - half
        inside = -beyond.max() if beyond.max() < 0.0 else 0.0
        expected = inside + np.linalg.norm(np.maximum(beyond, 0.0))
        # Float32 corners of up to 2 m.
        assert mesh.distance(point) == pytest.approx(expected, abs=2.0 * FLOAT32)


def test_the_distance_to_a_sphere_is_that_from_its_middle_less_its_radius() -> None:
    mesh = SHAPES["sphere"]
    for point in np.random.default_rng(6).uniform(-3.0, 3.0, (30, 3)):
        expected = abs(np.linalg.norm(point - mesh.centre) - 1.5)
        # Facets of 192 along a meridian lie off the sphere by no more than their sagitta.
        sagitta = 1.5 * (np.pi / 192.0) ** 2
        assert mesh.distance(point) == pytest.approx(expected, abs=sagitta)
