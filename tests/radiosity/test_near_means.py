"""Means over gather points near each other: less noise of what is far, contacts as they are."""

from __future__ import annotations

import numpy as np

from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.light_grids import NODES
from simgl.radiosity.near_means import TIMES
from simgl.radiosity.remesh import subdivided
from tests.radiosity.shapes import Quad, quads
from tests.radiosity.test_light_grids import baked, node_places, of_wall

FLOOR: Quad = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
# A square metre that faces the floor from 3 m above.
LAMP: Quad = ((-0.5, -0.5, 3), (-0.5, 0.5, 3), (0.5, 0.5, 3), (0.5, -0.5, 3))


def test_noise_evens_out_where_surfaces_are_far() -> None:
    settings = BakeSettings(
        patches=200, patch_rays=64, gather_rays=64, sun_rays=256, added_triangles=0, grids=0
    )
    transport = bake(subdivided(quads((FLOOR, LAMP)), 0.2), open_sheets=True, settings=settings)
    assert transport is not None
    assert transport.means is not None
    after = before = np.random.default_rng(1).normal(size=transport.means.shape[0])
    for _ in range(TIMES):
        after = transport.means @ after
    at = transport.mesh.positions
    inner = (at[:, 2] == 0.0) & (np.abs(at[:, :2]).max(axis=1) < 0.6)
    point = transport.gather_point_of_vertex[0][inner]
    # 3 % of the hemisphere are filled at 3 m: points 0.1 to 0.2 m apart have most of the weight.
    # One mean over five such points leaves 0.45 of independent noise, the next two less.
    assert after[point].std() < 0.45 * before[point].std()


def test_contacts_keep_their_light() -> None:
    transport = baked()
    assert transport.means is not None
    assert transport.grids is not None
    np.testing.assert_allclose(transport.means.sum(axis=1), 1.0, rtol=1e-6)
    # What the floor gets of the wall, exactly.
    place = np.zeros((transport.means.shape[0], 3))
    place[transport.gather_point_of_vertex[0]] = transport.mesh.positions
    held = transport.grids.point_of_node[:, :, 0] >= 0
    node = transport.sun_gather.shape[0] + transport.grids.point_of_node[:, :, 0][held]
    place[node] = node_places(transport)[held]
    up = np.zeros(len(place), dtype=np.bool_)
    front = transport.mesh.normals[:, 2] > 0.9
    up[transport.gather_point_of_vertex[0][front]] = True
    of_grid = transport.mesh.triangles[transport.grids.triangles, 0]
    up[node[np.repeat(front[of_grid][:, None], NODES, axis=1)[held]]] = True
    before = np.where(up, of_wall(np.maximum(place[:, 0], 1e-6), place[:, 1]), 0.0)
    after = before
    for _ in range(TIMES):
        after = transport.means @ after
    inner = up & (place[:, 0] > 0.01)
    assert transport.means[inner].nnz > 2 * np.count_nonzero(inner)
    # Where the wall fills much of the hemisphere, light changes by at most 4 / pi over the harmonic
    # mean distance (Ward et al. 1988): by 6.4 % at the end of the reach, where the weight is 0.
    # What a point's neighbours on one side differ from it by is half as much at most.
    near = inner & (before > 0.2)
    assert np.abs(after[near] / before[near] - 1.0).max() < TIMES * 0.032
