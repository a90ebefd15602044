"""Light between vertices has the means that their rays found."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.interpolation import nodes_around
from simgl.radiosity.light_grids import CUTS, STEPS, more_of_nodes
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.precomputed_response import GatheredSunlight
from simgl.radiosity.remesh import subdivided
from tests.passes.thin_casters import thin_walls
from tests.radiosity.test_light_grids import baked, corner, interpolated, of_wall

SETTINGS = BakeSettings(
    patches=3000, patch_rays=64, gather_rays=1024, sun_rays=0, added_triangles=0, grids=0
)


@lru_cache(maxsize=1)
def through_a_floor() -> LightTransport:
    """A wall 1 m high that stands 11 cm deep in a floor: no vertex of its foot is outside."""
    walls = [((-0.3, -0.5, -0.2), (1.0, 0.5, 0.0)), ((-0.2, -0.5, -0.11), (0.0, 0.5, 1.0))]
    mesh = subdivided(thin_walls("foot", walls).mesh, 0.3)
    found = bake(mesh, open_sheets=False, settings=SETTINGS)
    assert found is not None
    return found


def places_on(
    transport: LightTransport, triangles: IndexArray, each: int
) -> tuple[Array, IndexArray, Array]:
    """(n, 3) places spread over some triangles [m], (n, 3) the gather points of the corners on
    their fronts, and (n, 3) weights of these."""
    i = np.arange(each * len(triangles))
    u, v = (0.7548776662466927 * i) % 1.0, (0.5698402909980532 * i) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    corners = np.repeat(transport.mesh.triangles[triangles].astype(np.int64), each, axis=0)
    at = np.einsum("nk,nkj->nj", weights, transport.mesh.positions[corners].astype(np.float64))
    return at, transport.gather_point_of_vertex[0][corners], weights


def facing_triangles(transport: LightTransport, axis: int) -> IndexArray:
    """In the plane where a coordinate is 0, facing its positive side."""
    at = transport.mesh.positions[transport.mesh.triangles]
    normal = transport.mesh.normals[transport.mesh.triangles, axis] > 0.9
    return np.flatnonzero(np.all((np.abs(at[:, :, axis]) < 1e-6) & normal, axis=1))


def errors(transport: LightTransport, lit: int, seen: int, reach: float) -> tuple[float, float]:
    """Mean error of the share of the hemisphere that one square fills at places on another, up to
    so far from their edge [m]: of what rays found as values, and of the values in use.

    lit, seen : the axes along which the squares' normals are
    """
    square = (transport.normals[:, 0, lit] > 0.9) & (
        np.abs(transport.points[:, :, lit]).max(axis=1) < 1e-3
    )
    found: Array32 = transport.gather @ square.astype(np.float32)
    at, corners, weights = places_on(transport, facing_triangles(transport, seen), 200)
    height, along = at[:, lit], at[:, 1]
    used = (height > 0.005) & (height < reach) & (np.abs(along) < 0.45)
    expected = of_wall(height[used], along[used])
    assert transport.sharpened is not None
    off = [
        np.abs(np.einsum("nk,nk->n", weights, light[corners])[used] - expected).mean()
        for light in (found, transport.sharpened @ found)
    ]
    return float(off[0]), float(off[1])


def test_light_that_falls_off_beside_a_wall_is_not_blurred_twice() -> None:
    transport = bake(corner(), open_sheets=True, settings=SETTINGS)
    assert transport is not None
    # Places lie a quarter of the way to the next vertex in the mean: what they find is off by about
    # a quarter of the difference to it. One step leaves a quarter of that, and what is not linear
    # within a triangle.
    before, after = errors(transport, lit=0, seen=2, reach=0.06)
    assert after < 0.5 * before
    assert after < 0.01


def test_light_falls_off_towards_a_vertex_inside_another_part() -> None:
    """It is that of the triangle's open part, and the vertex lies beyond its end."""
    before, after = errors(through_a_floor(), lit=2, seen=0, reach=0.05)
    assert after < 0.55 * before


def test_nodes_of_grids_take_part() -> None:
    transport = baked()
    grids = transport.grids
    assert grids is not None
    assert transport.sun_sharpened is not None
    facing = (transport.normals[:, 0, 0] > 0.9).astype(np.float32)
    found: Array32 = np.concatenate([transport.sun_gather @ facing, grids.gather @ facing])
    x, y = np.meshgrid(np.linspace(0.002, 0.02, 7), np.linspace(-0.4, 0.4, 13))
    at = np.stack([x.ravel(), y.ravel()], axis=1)
    off = []
    for light in (found, transport.sun_sharpened @ found):
        bands = np.tile(light[:, None], 4)
        nodes: Array32 = more_of_nodes(transport, grids) @ bands
        irradiance = GatheredSunlight(vertices=bands[transport.vertex_rows], nodes=nodes)
        off.append(np.abs(interpolated(transport, irradiance, at) - of_wall(*at.T)).mean())
    assert off[1] < 0.6 * off[0]


def test_even_light_stays_and_what_is_buried_keeps_its_light() -> None:
    for transport in (baked(), through_a_floor()):
        for matrix in (transport.sharpened, transport.sun_sharpened):
            assert matrix is not None
            np.testing.assert_array_equal(matrix @ np.ones(matrix.shape[1], dtype=np.float32), 1.0)


def test_what_is_linear_over_a_triangle_stays_so_between_the_nodes_of_its_grid() -> None:
    """At any place, on a node, and on the edges between these."""
    nodes = STEPS / CUTS
    places = np.random.default_rng(1).dirichlet(np.ones(3), 10_000)
    for weights in (places, nodes, 0.5 * (nodes[:-1] + nodes[1:])):
        around, shares = nodes_around(weights)
        at = np.einsum("nk,nkj->nj", shares, nodes[around])
        np.testing.assert_allclose(at, weights, atol=1e-14)
        np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-14)
        # Of the small triangle that a place lies in: no node is farther away than one step.
        away = CUTS * np.abs(nodes[around] - weights[:, None]).max(axis=2)
        assert away.max() < 1.0 + 1e-12
