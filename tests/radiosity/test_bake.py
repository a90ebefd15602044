"""How surfaces see each other: conservation, symmetry, and patches of one kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.radiosity.bake import BakeSettings, bake, sees_itself
from simgl.radiosity.gather_points import cast, counts, gather_points_of
from simgl.radiosity.remesh import subdivided
from simgl.rays import RayTracer
from simgl.scene.mesh import box, cylinder, plate, sphere
from tests.radiosity.boxes import QUICK, inside, open_box
from tests.radiosity.shapes import FLOOR, OPEN_BOX, Quad, joined, moved, quads


def row_sums(matrix: object) -> Array:
    return np.asarray(matrix.sum(axis=1)).ravel()  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "mesh", [box((1.0, 2.0, 3.0)), plate(1.0, 2.0), sphere(1.0), cylinder(0.5, 2.0)]
)
def test_convex_bodies_exchange_nothing(mesh: object) -> None:
    assert not sees_itself(mesh, 1)  # type: ignore[arg-type]


def test_a_flat_sheet_sees_nothing_and_an_open_box_sees_itself() -> None:
    assert not sees_itself(quads([FLOOR]), 2)
    assert sees_itself(quads(OPEN_BOX), 2)
    assert bake(quads([FLOOR]), open_sheets=True) is None


def test_two_boxes_side_by_side_see_each_other() -> None:
    two = joined(box((1.0, 1.0, 1.0)), moved(box((1.0, 1.0, 1.0)), (3.0, 0.0, 0.0)))
    assert sees_itself(two, 1)


def test_all_light_of_a_patch_goes_to_other_patches_or_to_the_sky() -> None:
    transport = open_box()
    total = row_sums(transport.form_factors) + row_sums(transport.sky)
    # Sums of up to 384 float32 shares.
    np.testing.assert_allclose(total, 1.0, atol=1e-5)


def test_form_factors_are_reciprocal() -> None:
    """A_i F_ij = A_j F_ji between whole faces, where rays are many."""
    transport = open_box()
    faces = np.round(transport.normals[:, 0] * [1, 2, 3]).sum(axis=1).astype(int)
    kinds = [faces == k for k in np.unique(faces)]
    inner = inside(transport)
    flow = transport.areas[:, None] * transport.form_factors.toarray()
    for a in kinds:
        for b in kinds:
            there = flow[np.ix_(a & inner, b & inner)].sum()
            back = flow[np.ix_(b & inner, a & inner)].sum()
            # Faces of 0.5 m2 and more send some 100,000 rays each, 10 % of them to a face:
            # 1 % by chance, and stratified rays do better.
            np.testing.assert_allclose(there, back, rtol=0.02, atol=1e-3)


def test_the_same_body_gives_the_same_bits() -> None:
    settings = BakeSettings(patches=100, patch_rays=64, gather_rays=32, added_triangles=200)
    first, second = (bake(quads(OPEN_BOX), open_sheets=True, settings=settings) for _ in range(2))
    assert first is not None
    assert second is not None
    for name in ("form_factors", "sky", "gather", "sky_part"):
        a, b = getattr(first, name), getattr(second, name)
        assert a.data.tobytes() == b.data.tobytes()
        assert a.indices.tobytes() == b.indices.tobytes()
    assert first.mesh.digest == second.mesh.digest


def test_no_vertex_of_a_ball_lies_inside_it() -> None:
    """Rays start above the facets, also where these bend away below a vertex."""
    mesh = sphere(1.0, 24)
    found = cast(mesh, RayTracer(mesh), gather_points_of(mesh, 1), 1, 64, lambda _done: None)
    assert not np.any(found.buried)
    assert found.hit_share.max() == 0.0


def test_the_outside_of_a_smooth_two_sided_ball_sees_nothing_of_itself() -> None:
    mesh = sphere(1.0, 96)
    sites = gather_points_of(mesh, 2)
    found = cast(mesh, RayTracer(mesh), sites, 2, 256, lambda _done: None)
    front, back = (found.hit_share[row] for row in sites.of_vertex)
    assert front.max() == 0.0
    # Inside, every ray meets the ball, most of them far away.
    assert back.min() > 0.9


UP: Quad = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0))


def test_patches_do_not_mix_a_liner_with_the_wall_behind_it() -> None:
    """One lit and one dark, 1 cm apart: their mean would be the light of neither."""
    wall, liner = plate(1.0, 1.0), moved(plate(0.98, 0.98), (0.0, 0.0, 0.01))
    roof = quads([UP])
    roof = moved(replace(roof, triangles=roof.triangles[:, ::-1], normals=-roof.normals), (0, 0, 1))
    few = replace(QUICK, patches=24)
    transport = bake(joined(wall, liner, roof), open_sheets=False, settings=few)
    assert transport is not None
    upward = transport.normals[:, :, 2].min(axis=1) > 0.9
    height = transport.points[upward, :, 2]
    assert np.ptp(height, axis=1).max() < 0.005


def test_no_patch_has_two_materials() -> None:
    """A chequered floor under a roof: what is seen of a dark square is dark."""
    squares = [moved(plate(0.25, 0.25), (x, y, 0.0)) for x in (0.0, 0.25) for y in (0.0, 0.25)]
    floor = joined(*squares)
    chequered = (np.arange(len(floor.positions)) * 4 // len(floor.positions)) % 3 % 2
    floor = replace(floor, material=chequered.astype(np.uint32), part=np.zeros_like(floor.part))
    roof = quads([UP])
    roof = moved(replace(roof, triangles=roof.triangles[:, ::-1], normals=-roof.normals), (0, 0, 1))
    few = replace(QUICK, patches=8)
    transport = bake(joined(floor, roof), open_sheets=False, settings=few)
    assert transport is not None
    upward = transport.normals[:, 0, 2] > 0.9
    assert set(transport.materials[upward].argmax(axis=1)) == {0, 1}
    np.testing.assert_array_equal(transport.materials[upward].max(axis=1), 1.0)


def test_a_sheet_above_another_shows_it_its_back() -> None:
    above = tuple((x, y, 1.0) for x, y, _ in FLOOR)
    settings = BakeSettings(patches=60, patch_rays=64, gather_rays=32, added_triangles=50)
    transport = bake(quads((FLOOR, above)), open_sheets=True, settings=settings)  # type: ignore[arg-type]
    assert transport is not None
    up = transport.normals[:, 0, 2] > 0.0
    low = transport.points[:, 0, 2] < 0.5
    reached = transport.form_factors[np.flatnonzero(up & low)].sum(axis=0)
    reached = np.asarray(reached).ravel() > 0.0
    assert np.any(reached)
    assert not np.any(reached & (up | low))


def test_entries_of_a_matrix_are_counted_wherever_they_occur() -> None:
    rng = np.random.default_rng(1)
    rows, columns = rng.integers(0, 7, 500), rng.integers(0, 90, 500)
    rows[rows == 3] = 4  # an empty row
    expected = np.zeros((7, 90), dtype=np.float32)
    np.add.at(expected, (rows, columns), 1.0)
    found = counts(rows, columns, expected.shape)
    found.check_format(full_check=True)
    np.testing.assert_array_equal(found.toarray(), expected)
    weight = np.array([1.0, 8.0 / 7.0, 2.0, 5.0, 4.0, 1.0, 0.5])
    weighted = counts(rows, columns, expected.shape, weight).toarray()
    np.testing.assert_allclose(weighted, expected * weight[:, None], rtol=1e-6)
    none = counts(rows[:0], columns[:0], expected.shape)
    assert (none.shape, none.nnz) == (expected.shape, 0)


def test_rays_that_only_count_together_meet_what_all_others_meet() -> None:
    """Without the watertight test a ray along an edge may meet either of its triangles."""
    mesh, count = subdivided(sphere(1.0, 24), 0.05), 100_000
    rng = np.random.default_rng(1)
    starts = rng.uniform(-0.4, 0.4, (count, 3)).astype(np.float32)
    ways = rng.normal(size=(count, 3)).astype(np.float32)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    expected, far = RayTracer(mesh).hits(starts, ways)
    found, near = RayTracer(mesh, watertight=False).hits(starts, ways)
    assert np.all(expected >= 0)
    # Triangles have edges of 0.05 and areas of 0.001. Where float32 leaves a place unsure by 1e-7,
    # 3e-5 of them lie so close to an edge; on both sides, after some operations, ten times that.
    assert np.mean(found != expected) < 3e-4
    assert np.sum(found < 0) <= 1
    np.testing.assert_allclose(near[found >= 0], far[found >= 0], rtol=1e-4)
