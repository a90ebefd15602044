"""Light between surfaces: conservation, symmetry, and the open box of C6."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from simgl.rays import RayTracer
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.mesh import box, cylinder, plate, sphere
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.trajectory import FixedAttitude, FixedPosition, Motion
from simgl.transport.bake import BakeSettings, bake, sees_itself
from simgl.transport.directions import SKY_CELLS
from simgl.transport.response import Response
from simgl.transport.rows import vertex_rows
from simgl.transport.sites import cast, sites_of
from simgl.transport.solve import (
    SpotLight,
    earth_share,
    lamp_irradiance,
    radiosity,
    reflectors,
    vertex_irradiance,
)
from simgl.transport.sunlit import SunlitPatches
from simgl.transport.transport import Floats, Transport
from tests.scenes import IN_BANDS, radiance, scene
from tests.transport.shapes import FLOOR, LID, OPEN_BOX, Quad, joined, moved, quads

Array = NDArray[np.float64]

SUN = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
QUICK = BakeSettings(patches=200, patch_rays=128, site_rays=128, added_triangles=300)


def white(reflectance: float, count: int = 6, emission: float = 0.0) -> list[Material]:
    return [
        Material(name="white", reflectance=(reflectance,) * 4, emission=(emission,) * 4)
    ] * count


@lru_cache(maxsize=1)
def open_box() -> Transport:
    found = bake(quads(OPEN_BOX), open_sheets=True)
    assert found is not None
    return found


@lru_cache(maxsize=1)
def closed_box() -> Transport:
    settings = BakeSettings(patches=300, patch_rays=256, site_rays=64, added_triangles=500)
    found = bake(quads((*OPEN_BOX, LID)), open_sheets=True, settings=settings)
    assert found is not None
    return found


def row_sums(matrix: object) -> Array:
    return np.asarray(matrix.sum(axis=1)).ravel()  # type: ignore[attr-defined]


def sunlight(transport: Transport) -> Floats:
    """(p, 4) irradiance of the patches by a Sun of 1367 W/m2 in each band."""
    cosines = SunlitPatches(transport).cosines(SUN)
    return np.asarray(cosines[:, None] * np.full(4, 1367.0, dtype=np.float32))


def vertex_light(transport: Transport, exitance: Floats) -> Floats:
    """(v, sides, 4) irradiance of the vertices from the body's own surfaces."""
    values = np.full((*transport.site_of_vertex.shape[::-1], 4), np.nan, dtype=np.float32)
    vertex_irradiance(vertex_rows(transport), exitance, values)
    return values


def inside(transport: Transport) -> NDArray[np.bool_]:
    """Patches on the inner faces of the box."""
    centre = transport.points.mean(axis=1) - np.array([1.0, 0.5, 0.5])
    return np.asarray(np.einsum("ij,ij->i", transport.normals[:, 0], centre) < 0.0)


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
    settings = BakeSettings(patches=100, patch_rays=64, site_rays=32, added_triangles=200)
    first, second = (bake(quads(OPEN_BOX), open_sheets=True, settings=settings) for _ in range(2))
    assert first is not None
    assert second is not None
    for name in ("form_factors", "sky", "gather", "sky_part"):
        a, b = getattr(first, name), getattr(second, name)
        assert a.data.tobytes() == b.data.tobytes()
        assert a.indices.tobytes() == b.indices.tobytes()
    assert first.mesh.digest == second.mesh.digest


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.8, 0.95])
def test_a_closed_cavity_fills_with_its_emission_over_one_minus_albedo(albedo: float) -> None:
    transport = closed_box()
    surface = reflectors(transport, white(albedo, emission=2.0))
    inner = radiosity(transport, surface, surface.exitance)[inside(transport)]
    # The iteration stops at 1e-3 of what one bounce leaves; float32 rounds far below.
    np.testing.assert_allclose(inner, np.pi * 2.0 / (1.0 - albedo), rtol=2e-3)


def box_faces(transport: Transport) -> dict[str, NDArray[np.bool_]]:
    x = transport.points.mean(axis=1)[:, 0]
    n, inner = transport.normals[:, 0], inside(transport)
    floor = inner & (n[:, 2] > 0.9)
    return {
        "floor": floor,
        "shadow": floor & (x > 0.0625) & (x < 0.9375),
        "lit": floor & (x > 1.0625) & (x < 1.9375),
        "x=0": inner & (n[:, 0] > 0.9),
        "x=2": inner & (n[:, 0] < -0.9),
        "y=0": inner & (n[:, 1] > 0.9),
    }


C6 = {
    1: {"floor": 123.08, "shadow": 0.0, "lit": 246.14, "x=0": 0.0, "x=2": 246.14, "y=0": 0.0},
    2: {"floor": 146.0, "shadow": 6.29, "lit": 283.79, "x=0": 19.98, "x=2": 285.56, "y=0": 46.59},
    3: {"floor": 171.89, "shadow": 18.09, "lit": 323.21, "x=0": 30.79, "x=2": 325.37, "y=0": 66.54},
    0: {
        "floor": 207.53,
        "shadow": 44.19,
        "lit": 367.36,
        "x=0": 59.62,
        "x=2": 370.89,
        "y=0": 102.77,
    },
}


@pytest.mark.parametrize("bounces", [1, 2, 3, 0], ids=["direct", "two", "three", "all"])
def test_the_open_box_has_the_radiance_of_every_bounce(bounces: int) -> None:
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    irradiance = sunlight(transport)
    if bounces:
        first = exitance = surface.albedo * irradiance
        for _ in range(bounces - 1):
            exitance = first + surface.albedo * (transport.form_factors @ exitance)
    else:
        exitance = radiosity(transport, surface, surface.albedo * irradiance)
    for name, patches in box_faces(transport).items():
        area = transport.areas[patches]
        found = float((area * exitance[patches, 0]).sum() / area.sum() / np.pi)
        # The table is good to 0.2 %; faces send 100,000 rays, and 8 sample points a patch place the
        # shadow's edge to a tenth of a patch, 4 mm of the 2 m floor: below 1 %.
        np.testing.assert_allclose(found, C6[bounces][name], rtol=0.02, atol=0.3, err_msg=name)


def test_vertices_get_the_light_that_the_patches_around_them_get() -> None:
    """Two ways from exitance to irradiance: the vertices' own rays, and the form factors."""
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    irradiance = sunlight(transport)
    exitance = radiosity(transport, surface, surface.albedo * irradiance)
    light = vertex_light(transport, exitance)
    patch = transport.form_factors @ exitance
    floor = box_faces(transport)["floor"]
    area = transport.areas[floor]
    mean = float((area * patch[floor, 0]).sum() / area.sum())
    corners = transport.mesh.positions[transport.mesh.triangles]
    flat = np.all(corners[:, :, 2] == 0.0, axis=1)
    a, b, c = np.moveaxis(corners[flat].astype(np.float64), 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    values = light[transport.mesh.triangles[flat], 0, 0].mean(axis=1)
    # 256 rays a vertex and light that is linear between vertices 4 cm apart: some percent at the
    # walls' feet, 1 % in the mean.
    np.testing.assert_allclose((areas * values).sum() / areas.sum(), mean, rtol=0.02)


def test_some_vertices_get_what_they_get_among_all() -> None:
    """On both sides: from surfaces, and of the Earth's light."""
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    exitance = radiosity(transport, surface, surface.albedo * sunlight(transport))
    sky = np.random.default_rng(8).uniform(1.0, 9.0, (SKY_CELLS, 4)).astype(np.float32)
    some = np.arange(3, len(transport.mesh.positions), 7)
    rows = vertex_rows(transport, some)
    values = np.empty((*rows.shape, 4), dtype=np.float32)
    vertex_irradiance(rows, exitance, values)
    np.testing.assert_array_equal(values, vertex_light(transport, exitance)[some])
    whole = earth_share(vertex_rows(transport), sky)
    np.testing.assert_array_equal(earth_share(rows, sky), whole[some])


def test_the_back_of_a_sheet_gets_nothing_of_the_light_before_it() -> None:
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    irradiance = sunlight(transport)
    exitance = radiosity(transport, surface, surface.albedo * irradiance)
    light = vertex_light(transport, exitance)
    assert light[:, 0].max() > 100.0
    # The outside of a convex box sees nothing of it.
    assert light[:, 1].max() == 0.0


def test_a_plate_behind_a_big_plate_gets_no_light_of_the_earth() -> None:
    shield = moved(plate(4.0, 4.0), (0.0, 0.0, 0.0))
    small = moved(plate(0.2, 0.2), (0.0, 0.0, 0.05))
    transport = bake(joined(shield, small), open_sheets=False)
    assert transport is not None
    mesh = transport.mesh
    # An Earth that fills the half space below.
    below = np.zeros((SKY_CELLS, 4), dtype=np.float32)
    below[5 * 16 : 6 * 16] = 100.0
    share = earth_share(vertex_rows(transport), below)[:, 0]
    lower = mesh.normals[:, 2] < -0.9
    near = np.abs(mesh.positions[:, :2]).max(axis=1) < 0.11
    hidden = lower & near & (mesh.positions[:, 2] > 0.01)
    assert np.count_nonzero(hidden) >= 4
    assert share[hidden].max() == 0.0
    # The shield itself is free below.
    free = lower & ~near
    assert share[free].min() == 1.0


def test_a_lamp_lights_patches_by_the_inverse_square_within_its_cone() -> None:
    transport = open_box()
    lamp = SpotLight(
        place=np.array([1.0, 0.5, 0.9]),
        axis=np.array([0.0, 0.0, -1.0]),
        half_angle=0.2,
        edge=0.01,
        intensity=np.full(4, 10.0),
    )
    found = lamp_irradiance(transport, lamp)
    # Every second sample point of a patch stands for it.
    points = transport.points[:, ::2]
    offset = np.linalg.norm(points[..., :2] - [1.0, 0.5], axis=2)
    floor = inside(transport) & (transport.normals[:, 0, 2] > 0.9)
    lit = floor & (offset.max(axis=1) < 0.15)
    assert np.count_nonzero(lit) >= 4
    height = 0.9 - points[..., 2]
    expected = (10.0 * height / np.hypot(height, offset) ** 3).mean(axis=1)
    # float32 places: 1e-7 of 1 m, three powers of it.
    np.testing.assert_allclose(found[lit, 0], expected[lit], rtol=1e-5)
    distance = offset.min(axis=1)
    assert found[floor & (distance > 0.30)].max() == 0.0


def c6_scene(reflectance: float, *, on: bool) -> Scenario:
    """The open box before a camera on high, Sun from -x."""
    empty = scene(
        {},
        {
            "position_icrf_m": [1.0, 0.5, 6.0],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "focal_length_mm": 8.0,
            "pixel_pitch_um": 20.0,
        },
        sun_direction=(-(0.5**0.5), 0.0, 0.5**0.5),
        render={"inter_reflection": on, "samples_per_pixel": 16},
    )
    model = SpacecraftModel(
        name="box",
        mesh=quads(OPEN_BOX),
        parts=("box",),
        materials=tuple(white(reflectance, 5)),
        open_sheets=True,
    )
    still = Motion(
        trajectory=FixedPosition(position=np.zeros(3), velocity=np.zeros(3)),
        attitude=FixedAttitude(R_icrf_from_body=np.eye(3)),
    )
    return replace(empty, models={"box": model}, motions={"box": still})


def floor_means(gl: moderngl.Context, *, on: bool) -> dict[str, float]:
    image = radiance(gl, c6_scene(0.8, on=on))
    # All bands have one reflectance: their sum scales with the irradiance in them.
    total = image.sum(axis=2) * (1367.0 / IN_BANDS)
    pixels_per_metre = 400.0 / 6.0
    # Centre of the picture is x = 1, y = 0.5; columns along +x, rows down along -y.
    x = (np.arange(128) - 63.5) / pixels_per_metre + 1.0
    rows = slice(64 - 28, 64 + 28)
    return {
        "shadow": float(total[rows, (x > 0.0625) & (x < 0.9375)].mean()),
        "lit": float(total[rows, (x > 1.0625) & (x < 1.9375)].mean()),
    }


def test_the_picture_of_the_open_box_has_the_floor_of_all_bounces(gl: moderngl.Context) -> None:
    found = floor_means(gl, on=True)
    # The rows leave out 8 cm at both walls' feet, where it is up to 10 % brighter: 1 % of the mean.
    np.testing.assert_allclose(found["shadow"], C6[0]["shadow"], rtol=0.05)
    np.testing.assert_allclose(found["lit"], C6[0]["lit"], rtol=0.05)


def test_without_inter_reflection_the_shadow_is_black(gl: moderngl.Context) -> None:
    found = floor_means(gl, on=False)
    assert found["shadow"] == 0.0
    np.testing.assert_allclose(found["lit"], C6[1]["lit"], rtol=1e-3)


def test_no_vertex_of_a_ball_lies_inside_it() -> None:
    """Rays start above the facets, also where these bend away below a vertex."""
    mesh = sphere(1.0, 24)
    found = cast(mesh, RayTracer(mesh), sites_of(mesh, 1), 1, 64, lambda _done: None)
    assert not np.any(found.buried)
    assert found.hit_share.max() == 0.0


def test_the_outside_of_a_smooth_two_sided_ball_sees_nothing_of_itself() -> None:
    mesh = sphere(1.0, 96)
    sites = sites_of(mesh, 2)
    found = cast(mesh, RayTracer(mesh), sites, 2, 256, lambda _done: None)
    front, back = (found.hit_share[row] for row in sites.of_vertex)
    assert front.max() == 0.0
    # Inside, every ray meets the ball, most of them far away.
    assert back.min() > 0.9


def two_sided_ball(*, on: bool) -> Scenario:
    """A ball of double-sided facets, seen from behind the Sun's side but for a crescent."""
    empty = scene(
        {},
        {
            "position_icrf_m": [0.0, 0.0, 6.0],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "focal_length_mm": 8.0,
            "pixel_pitch_um": 20.0,
        },
        sun_direction=(0.8, 0.0, -0.6),
        render={"inter_reflection": on, "samples_per_pixel": 16},
    )
    model = SpacecraftModel(
        name="ball",
        mesh=sphere(1.0, 96),
        parts=("ball",),
        materials=tuple(white(0.8, 1)),
        open_sheets=True,
    )
    still = Motion(
        trajectory=FixedPosition(position=np.zeros(3), velocity=np.zeros(3)),
        attitude=FixedAttitude(R_icrf_from_body=np.eye(3)),
    )
    return replace(empty, models={"ball": model}, motions={"ball": still})


def test_the_shadow_side_of_a_two_sided_ball_is_dark(gl: moderngl.Context) -> None:
    found, plain = (radiance(gl, two_sided_ball(on=on)) for on in (True, False))
    assert plain.max() > 1.0
    assert found[:, :64].max() == 0.0
    np.testing.assert_array_equal(found, plain)


UP: Quad = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0))


def test_a_board_whose_corners_are_inside_blocks_is_lit_between_them() -> None:
    """Solar cells on a panel: all that is seen of the panel are the gaps."""
    board = moved(plate(1.0, 1.0), (0.0, 0.0, 0.0))
    blocks = [
        moved(box((0.3, 0.3, 0.02)), (x, y, 0.0)) for x in (-0.45, 0.45) for y in (-0.45, 0.45)
    ]
    transport = bake(joined(board, *blocks), open_sheets=False, settings=QUICK)
    assert transport is not None
    above = np.zeros((SKY_CELLS, 4), dtype=np.float32)
    above[4 * 16 : 5 * 16] = 100.0
    share = earth_share(vertex_rows(transport), above)[:, 0]
    mesh = transport.mesh
    corner = (mesh.normals[:, 2] > 0.9) & (mesh.positions[:, 2] == 0.0)
    assert np.count_nonzero(corner) >= 4
    # The foot of one wall sees half of the sky; a place in a gap is at most that near to a block.
    assert share[corner].min() > 0.45


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


def test_a_free_surface_under_a_uniform_sky_gets_pi_times_its_radiance() -> None:
    transport = open_box()
    sky = np.full((SKY_CELLS, 4), 3.0, dtype=np.float32)
    outer = ~inside(transport)
    response = Response(transport, reflectors(transport, white(0.5)), SunlitPatches(transport))
    # The outside of the box sees the sky with every ray; float32 sums.
    found = response.of_sky(sky)[outer]
    np.testing.assert_allclose(found, 0.5 * 3.0 * np.pi, rtol=1e-5)


def test_a_sheet_above_another_shows_it_its_back() -> None:
    above = tuple((x, y, 1.0) for x, y, _ in FLOOR)
    settings = BakeSettings(patches=60, patch_rays=64, site_rays=32, added_triangles=50)
    transport = bake(quads((FLOOR, above)), open_sheets=True, settings=settings)  # type: ignore[arg-type]
    assert transport is not None
    up = transport.normals[:, 0, 2] > 0.0
    low = transport.points[:, 0, 2] < 0.5
    reached = transport.form_factors[np.flatnonzero(up & low)].sum(axis=0)
    reached = np.asarray(reached).ravel() > 0.0
    assert np.any(reached)
    assert not np.any(reached & (up | low))
