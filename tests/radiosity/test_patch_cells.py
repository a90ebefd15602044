"""A wall that the Sun lights in part, and what a floor before it gets of the lit part."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.solver import reflectors
from simgl.radiosity.sunlit_patches import SunlitPatches, grid_corners
from tests.radiosity.boxes import white
from tests.radiosity.shapes import Quad, quads

FLOOR: Quad = ((0, -0.5, 0), (1, -0.5, 0), (1, 0.5, 0), (0, 0.5, 0))
WALL: Quad = ((0, -0.5, 0), (0, 0.5, 0), (0, 0.5, 1), (0, -0.5, 1))
SCREEN: Quad = ((1, -0.5, 0), (1, -0.5, 1), (1, 0.5, 1), (1, 0.5, 0))
# The screen's shadow covers the floor and the wall up to here [m].
SHADED = 0.4
SUN = np.array([1.0, 0.0, 1.0 - SHADED]) / np.hypot(1.0, 1.0 - SHADED)
# So little that light of two bounces is 1 % of that of one.
REFLECTANCE = 0.02


@lru_cache(maxsize=1)
def room() -> LightTransport:
    """Patches half as high as the wall: the shadow's edge crosses the lower ones."""
    settings = BakeSettings(
        patches=12, patch_rays=64, gather_rays=256, sun_rays=1280, added_triangles=0, grids=0
    )
    mesh = subdivided(quads((FLOOR, WALL, SCREEN)), 0.18)
    found = bake(mesh, open_sheets=True, settings=settings)
    assert found is not None
    return found


def of_wall(x: Array, y: Array, height: float) -> Array:
    """Form factors from places on the floor to a wall on it (Howell's catalogue, B-4)."""
    far = np.hypot(x, height)
    total = np.zeros_like(x)
    for b in (0.5 - y, 0.5 + y):
        total += (np.arctan(b / x) - x / far * np.arctan(b / far)) / (2.0 * np.pi)
    return total


def on_floor(transport: LightTransport) -> tuple[Array, Array]:
    """(n, 2) x, y of vertices, and (n,) the share of their hemisphere that a wall fills which sends
    as much light as they get."""
    surface = reflectors(transport, white(REFLECTANCE, 3))
    response = PrecomputedResponse(transport, surface, SunlitPatches(transport))
    light = response.of_sun_at_vertices(SUN, np.ones(4)).vertices.reshape(-1, 2, 4)[:, 0, 0]
    place, normal = transport.mesh.positions, transport.mesh.normals
    # Not those on the floor's rim, where the footprint of a vertex is one-sided.
    inner = (np.abs(place[:, 1]) < 0.45) & (place[:, 0] > 0.05) & (place[:, 0] < 0.95)
    chosen = inner & (place[:, 2] == 0.0) & (normal[:, 2] > 0.9)
    share = light[chosen] / (REFLECTANCE * SUN[0])
    return place[chosen, :2].astype(np.float64), share.astype(np.float64)


def test_a_floor_gets_light_of_the_lit_part_of_a_wall() -> None:
    place, share = on_floor(room())
    x, y = place.T
    expected = of_wall(x, y, 1.0) - of_wall(x, y, SHADED)
    # 1024 rays even over the disc: the outline of the lit part crosses some 100 of their cells,
    # each wrong by 0.3 of a ray: 3e-3. A cell of 6 cm is lit by one of its places: along the edge
    # of the shadow 16 of them, each wrong by a third of the 2e-3 that it fills: 3e-3. Light of two
    # bounces is 1 % of at most 0.2.
    assert np.sqrt(np.mean((share - expected) ** 2)) < 5e-3


def test_without_cells_the_wall_s_dark_part_lights_its_foot() -> None:
    with_cells, even = room(), replace(room(), cells=None)
    place, share = on_floor(with_cells)
    _, share_even = on_floor(even)
    x, y = place.T
    near = x < 0.2
    expected = (of_wall(x, y, 1.0) - of_wall(x, y, SHADED))[near]
    assert np.mean(share_even[near] - expected) > 5.0 * abs(np.mean(share[near] - expected))


def test_cells_count_only_where_the_sun_lights_a_part() -> None:
    transport = room()
    cells = transport.cells
    assert cells is not None
    sunlit, below = SunlitPatches(transport), np.array([0.0, 0.0, -1.0])
    for sun, some in ((SUN, True), (below, False)):
        node = grid_corners(sun)[0][0]
        asked, more = sunlit.more_on_cells(cells, node)
        assert (len(asked) > 0) == some
        assert len(more) == len(asked)
        assert np.all(sunlit.at(node).partly[cells.patch[asked]])


def test_cells_of_a_patch_cover_what_the_patch_does() -> None:
    """Of what is near: by the same rays, as far as those are in both matrices."""
    transport = room()
    cells = transport.cells
    assert cells is not None
    count = len(transport.areas)
    shares = np.zeros((count, cells.gather.shape[1]))
    np.add.at(shares, cells.patch, cells.gather.toarray())
    of_patches = transport.sun_gather.toarray().T
    near = shares > 0.0
    # 1024 of 1280 rays against all of them: the outline of a patch wrong by 0.3 of a ray for each
    # of 100 rays that it crosses.
    off = shares[near] - of_patches[near]
    assert np.sqrt(np.mean(off**2)) < 3e-3
