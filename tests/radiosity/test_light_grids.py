"""Grids of finer light on triangles: closed form, no steps at their rims, as in the image."""

from __future__ import annotations

from functools import lru_cache

import moderngl
import numpy as np
import pytest

from simgl import Product, Simulator
from simgl.arrays import Array, IndexArray
from simgl.radiosity import transport_store
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.light_grids import CUTS, NODES, STEPS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.precomputed_response import GatheredSunlight, PrecomputedResponse
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.solver import reflectors
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.boxes import at_rest, white
from tests.radiosity.shapes import Quad, quads

FLOOR: Quad = ((0, -0.5, 0), (1, -0.5, 0), (1, 0.5, 0), (0, 0.5, 0))
WALL: Quad = ((0, -0.5, 0), (0, 0.5, 0), (0, 0.5, 1), (0, -0.5, 1))
# The wall alone is lit: the floor turns away.
SUN = (1.0, 0.0, -0.01)
SETTINGS = BakeSettings(
    patches=3000,
    patch_rays=64,
    gather_rays=1024,
    added_triangles=0,
    grids=10_000,
    grid_rays=1024,
)


def corner() -> Mesh:
    """A wall on a floor, vertices up to 12.5 cm apart."""
    return subdivided(quads((FLOOR, WALL)), 0.18)


@lru_cache(maxsize=1)
def baked() -> LightTransport:
    found = bake(corner(), open_sheets=True, settings=SETTINGS)
    assert found is not None
    return found


def of_wall(x: Array, y: Array) -> Array:
    """Form factors from places on the floor to the wall (Howell's catalogue, B-4)."""
    far = np.hypot(x, 1.0)
    total = np.zeros_like(x)
    for b in (0.5 - y, 0.5 + y):
        total += (np.arctan(b / x) - x / far * np.arctan(b / far)) / (2.0 * np.pi)
    return total


def node_places(transport: LightTransport) -> Array:
    """(t, NODES, 3) [m]."""
    assert transport.grids is not None
    corners = transport.mesh.triangles[transport.grids.triangles].astype(np.int64)
    return np.einsum("nk,tkj->tnj", STEPS / CUTS, transport.mesh.positions[corners])


def test_nodes_have_the_form_factor_of_a_wall_beside_them() -> None:
    transport = baked()
    grids = transport.grids
    assert grids is not None
    facing = transport.normals[:, 0, 0] > 0.9
    at_nodes = (grids.gather @ facing.astype(np.float32))[grids.point_of_node[:, :, 0]]
    at_vertices = transport.sun_gather @ facing.astype(np.float32)
    corners = transport.mesh.triangles[grids.triangles].astype(np.int64)
    linear = at_vertices[transport.gather_point_of_vertex[0, corners]] @ (STEPS / CUTS).T
    place = node_places(transport)
    x, y, z = np.moveaxis(place, 2, 0)
    # Of the footprints of nodes on the wall's foot and the floor's rim no closed form is known.
    known = (z == 0.0) & (x > 0.02) & (x < 0.98) & (np.abs(y) < 0.48)
    known &= (grids.point_of_node[:, :, 0] >= 0) & (transport.mesh.normals[corners[:, :1], 2] > 0.9)
    expected = of_wall(x[known], y[known])
    # 1024 rays even over the disc: the wall's outline crosses some 100 of their cells, each wrong
    # by 0.3 of a ray: 3e-3. Rays start up to 1 cm from the node, where light differs by 1 %.
    assert np.sqrt(np.mean((at_nodes[known] - expected) ** 2)) < 5e-3
    # Vertices 12.5 cm apart miss more where light falls off within as much.
    near = x[known] < 0.125
    off_grid = np.abs(at_nodes[known] - expected)[near].mean()
    assert np.abs(linear[known] - expected)[near].mean() > 3.0 * off_grid


def test_more_rays_of_vertices_have_the_earlier_ones_among_them() -> None:
    settings = BakeSettings(
        patches=3000, patch_rays=64, gather_rays=256, sun_rays=1024, added_triangles=0, grids=0
    )
    transport = bake(corner(), open_sheets=True, settings=settings)
    assert transport is not None
    fewer, more = transport.gather, transport.sun_gather
    changed = np.abs(more - fewer).max(axis=1).toarray().ravel() > 0.0
    # Of all light 2 % goes to the points that keep their 256 rays.
    assert changed.mean() > 0.3
    assert (more[changed] - 0.25 * fewer[changed]).min() > -1e-6

    def from_wall(transport: LightTransport) -> Array:
        facing = (transport.normals[:, 0, 0] > 0.9).astype(np.float32)
        return (transport.sun_gather @ facing)[transport.gather_point_of_vertex[0]]

    # As good as 1024 rays at once: either misses 3e-3, both together 4.3e-3.
    known = changed[transport.gather_point_of_vertex[0]] & (transport.mesh.positions[:, 2] == 0.0)
    off = (from_wall(transport) - from_wall(baked()))[known]
    assert np.sqrt(np.mean(off**2)) < 4.5e-3


def test_grids_have_no_step_to_triangles_without_one() -> None:
    few = BakeSettings(patches=3000, patch_rays=64, gather_rays=256, added_triangles=0, grids=30)
    transport = bake(corner(), open_sheets=True, settings=few)
    assert transport is not None
    grids = transport.grids
    assert grids is not None
    assert len(grids.triangles) == 30
    mesh = transport.mesh

    def nodes_of(triangles: IndexArray) -> list[list[tuple[float, ...]]]:
        """Places and normals."""
        of_corners = np.concatenate([mesh.positions, mesh.normals], axis=1)[mesh.triangles]
        nodes = np.einsum("nk,tkj->tnj", STEPS / CUTS, of_corners[triangles]).round(5)
        return [list(map(tuple, grid)) for grid in nodes.tolist()]

    without = np.setdiff1d(np.arange(len(mesh.triangles)), grids.triangles)
    others = {node for grid in nodes_of(without) for node in grid}
    rim = np.array([[node in others for node in grid] for grid in nodes_of(grids.triangles)])
    assert rim.any()
    assert np.all(grids.point_of_node[rim] == -1)
    assert np.any(grids.point_of_node >= 0)


def test_neighbours_share_the_rows_of_their_edge() -> None:
    """What nodes on it get more than is linear between its ends is the same from both sides."""
    transport = baked()
    grids = transport.grids
    assert grids is not None
    row, held = grids.row_of_node[:, :, 0], grids.point_of_node[:, :, 0] >= 0
    assert np.array_equal(row > 0, held)
    place = node_places(transport)[held].round(5)
    up = transport.mesh.normals[transport.mesh.triangles[grids.triangles, 0], 2] > 0.9
    surface = np.repeat(up[:, None], NODES, axis=1)[held]
    where = np.concatenate([place, surface[:, None]], axis=1)
    assert len(np.unique(where, axis=0)) == len(np.unique(row[held])) < 0.7 * np.count_nonzero(held)


def interpolated(transport: LightTransport, light: GatheredSunlight, at: Array) -> Array:
    """(n,) irradiance of places (n, 2) on the floor, linear over the parts of each triangle."""
    assert transport.grids is not None
    triangles = transport.mesh.triangles.astype(np.int64)
    corners = transport.mesh.positions[triangles].astype(np.float64)
    vertex = light.vertices.reshape(-1, transport.sides, 4)[:, 0, 0]
    node = light.nodes[transport.grids.row_of_node[:, :, 0], 0]
    grid = np.full(len(triangles), -1)
    grid[transport.grids.triangles] = np.arange(len(node))
    found = np.full(len(at), np.nan)
    for t in np.flatnonzero(np.all(corners[..., 2] == 0.0, axis=1)):
        a, b, c = corners[t, :, :2]
        rest = np.linalg.solve(np.stack([a - c, b - c], axis=1), (at - c).T).T
        w = np.column_stack([rest, 1.0 - rest.sum(axis=1)])
        for p in np.flatnonzero(np.all(w > -1e-9, axis=1)):
            more = 0.0
            if grid[t] >= 0:
                # Hats on a triangular lattice: 1 less the largest step along its three axes.
                away = STEPS - CUTS * w[p]
                hat = np.maximum(1.0 - np.abs(away).max(axis=1), 0.0)
                more = float(hat @ node[grid[t]])
            found[p] = w[p] @ vertex[triangles[t]] + more
    return found


def test_the_image_has_the_light_of_grids(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport_store, "BakeSettings", lambda: SETTINGS)
    model = SpacecraftModel(
        name="corner",
        mesh=corner(),
        parts=("corner",),
        materials=tuple(white(0.5, 2)),
        open_sheets=True,
    )
    scenario = at_rest(model, 0.5, 0.0, SUN, on=True)
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        frame = simulator.capture(state, "cam", frozenset({Product.RADIANCE})).radiance
    assert frame is not None
    transport = baked()
    response = PrecomputedResponse(
        transport, reflectors(transport, white(0.5, 2)), SunlitPatches(transport)
    )
    sun = np.asarray(SUN) / np.linalg.norm(SUN)
    light = response.of_sun_at_vertices(
        sun, np.asarray(state.sun.seen_from(np.zeros(3)).irradiance)
    )
    # Columns along +x, rows down along -y, 400 / 6 pixels to a metre.
    columns, rows = np.meshgrid(np.arange(36, 92, 3), np.arange(36, 92, 5))
    at = np.stack([(columns - 63.5) * 6.0 / 400.0 + 0.5, (63.5 - rows) * 6.0 / 400.0], axis=2)
    expected = interpolated(transport, light, at.reshape(-1, 2)) * 0.5 / np.pi
    found = frame.radiance[rows.ravel(), columns.ravel(), 0]
    # A pixel is half a part of an edge: across a bend it is off by an eighth of what the bend gives
    # over its width.
    np.testing.assert_allclose(found, expected, atol=0.02 * expected.max())
    assert np.median(np.abs(found - expected)) < 2e-3 * expected.max()
