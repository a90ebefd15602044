"""Grids of gather points on triangles over which the Sun's reflected light is far from linear.

A grid holds what its nodes get more than is linear between the triangle's vertices. Only light that
is gathered once for many frames is found so finely: the mesh that is drawn stays as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.progress import ProgressCallback
from simgl.radiosity.gather_points import (
    Places,
    distinct_points,
    face_normals,
    gather_points_of,
    nearest_open,
    places_of,
)
from simgl.radiosity.light_transport import LightGrids, LightTransport, by_columns
from simgl.radiosity.occlusion import moved_into_open
from simgl.radiosity.patch_cells import CellIndex, SeenCells
from simgl.radiosity.solver import sun_cosines
from simgl.radiosity.sun_gather import cells_seen
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Parts of a triangle's edges, and nodes of its grid; as in shaders/gbuffer/light_grids.glsl.
CUTS = 4
NODES = (CUTS + 1) * (CUTS + 2) // 2
# (NODES, 3) weights of the corners at the nodes, in fourths.
STEPS = np.array(
    [(i, j, CUTS - i - j) for i in range(CUTS + 1) for j in range(CUTS + 1 - i)], dtype=np.int64
)
# Directions of the Sun, even over the sphere, under which triangles are compared.
_SUNS = 24
# What all surfaces reflect: materials are not known to a bake.
_ALBEDO = np.float32(0.5)
# Bounces after the first; what is left of light is a tenth then.
_BOUNCES = 3
# Of the Sun's irradiance: differences count relative to all light there, and at least to this.
_FLOOR = 0.003
# Of the body's radius: triangles with shorter edges have no grids.
_SHORTEST = 1.0 / 150.0
# Of the grids' matrix: a product with it takes 10 ms of one core, once for a direction of the Sun.
_MAX_ENTRIES = 2_500_000
# Entries of a grid in those of a vertex: 8 gather points, others being shared with neighbours, of
# half as many rays.
_ENTRIES_EACH = 5.5
# Places tried for hidden nodes on each of the small triangles between them.
_TRIED_EACH = 4
# Places are equal to this share of the body's radius, which float32 resolves.
_EQUAL = 1e-6


def light_grids(
    transport: LightTransport,
    tracer: RayTracer,
    index: CellIndex,
    count: int,
    rays: int,
    report: ProgressCallback,
) -> tuple[LightGrids, SeenCells, Places] | tuple[None, None, None]:
    """Grids on up to so many triangles, those where most light is uneven; the cells that their
    gather points see, and where rays of these start; nothing where light is even.

    rays : of each gather point
    """
    mesh, sides = transport.mesh, transport.sides
    worth = _unevenness(transport) * face_normals(mesh)[1]
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    worth[longest < _SHORTEST * mesh.radius] = 0.0
    order = np.argsort(-worth, kind="stable")[:count]
    chosen = np.sort(order[(worth[order] > 0.0) & _affordable(transport, order)])
    if len(chosen) == 0:
        return None, None, None
    fine = _cut(mesh, chosen)
    points = gather_points_of(fine, sides, mesh.radius)
    if sides == 1:
        points = moved_into_open(fine, transport.tracer, points, mesh, _TRIED_EACH)
    every = np.ones(len(points.origins), dtype=np.bool_)
    seen, open_ = cells_seen(
        mesh,
        tracer,
        points,
        every,
        sides,
        index,
        rays,
        True,
        lambda done: report(done, len(every)),
    )
    rows = nearest_open(fine, points, np.asarray(~open_.any(axis=1)))[points.of_vertex]
    used, of_node = np.unique(rows, return_inverse=True)
    of_node = np.moveaxis(of_node.reshape(sides, len(chosen), NODES), 0, 2)
    of_node[~_continuous(mesh, chosen)] = -1
    seen = seen.of_rows(used)
    grids = LightGrids(
        triangles=chosen,
        gather=by_columns(seen.of_patches(index)),
        point_of_node=of_node,
        row_of_node=_rows_of_nodes(transport, chosen, of_node),
    )
    at_nodes = _on_parent_triangles(places_of(points, used, open_, sides), chosen)
    return grids, seen, at_nodes


def _on_parent_triangles(places: Places, chosen: IndexArray) -> Places:
    """Places on the pieces of some triangles (t,), as places on these."""
    of_grid, piece = np.divmod(places.triangles, len(_PIECES))
    nowhere = places.triangles < 0
    corners = STEPS[_PIECES[np.where(nowhere, 0, piece)]] / CUTS
    return replace(
        places,
        triangles=np.where(nowhere, -1, chosen[np.where(nowhere, 0, of_grid)]),
        weights=np.einsum("npk,npkj->npj", places.weights, corners),
    )


def _corners_of_nodes(transport: LightTransport, chosen: IndexArray) -> IndexArray:
    """(t, NODES, sides, 3) the gather points of the vertices around each node; -1 for those that do
    not count there."""
    corners = transport.mesh.triangles[chosen].astype(np.int64)
    points = transport.gather_point_of_vertex[:, corners].transpose(1, 0, 2)[:, None]
    return np.where(STEPS[:, None] > 0, points, -1)


def _rows_of_nodes(
    transport: LightTransport, chosen: IndexArray, point_of_node: IndexArray
) -> IndexArray:
    """(t, NODES, sides) the same number for nodes that get the same: those of one gather point
    between the same vertices. 0 where what is linear holds, which has no row else."""
    share = np.sort(_corners_of_nodes(transport, chosen) * (CUTS + 1) + STEPS[:, None], axis=-1)
    keys = np.concatenate([point_of_node[..., None], share], axis=-1)
    held = point_of_node >= 0
    rows = np.zeros(point_of_node.shape, dtype=np.int64)
    rows[held] = 1 + np.unique(keys[held], axis=0, return_inverse=True)[1].ravel()
    return rows


def more_of_nodes(transport: LightTransport, grids: LightGrids) -> sparse.csc_matrix:
    """(n, s + g) of each row of the grids' table: the light of its gather point less what is linear
    between the triangle's vertices.

    Its columns are the gather points of vertices, then of grids.
    """
    count = transport.sun_gather.shape[0]
    row, node = np.unique(grids.row_of_node, return_index=True)
    triangle, step, side = np.unravel_index(node, grids.row_of_node.shape)
    corners = transport.mesh.triangles[grids.triangles[triangle]].astype(np.int64)
    columns = np.empty((len(node), 4), dtype=np.int64)
    columns[:, :3] = transport.gather_point_of_vertex[side[:, None], corners]
    columns[:, 3] = count + grids.point_of_node[triangle, step, side]
    values = np.ones(columns.shape, dtype=np.float32)
    values[:, :3] = STEPS[step] / -CUTS
    held = row > 0
    entries = values[held].ravel(), columns[held].ravel()
    ends = np.zeros(grids.rows + 1, dtype=np.int64)
    ends[1 + row[held]] = 4
    shape = grids.rows, count + grids.gather.shape[0]
    matrix = sparse.csr_matrix((*entries, np.cumsum(ends)), shape=shape)
    matrix.eliminate_zeros()
    return by_columns(matrix)


def _unevenness(transport: LightTransport) -> Array:
    """(m,) how much reflected sunlight differs between the corners of triangles, relative to all
    light there; the mean over directions of the Sun, on the side where that is more."""
    suns, form_factors = _sphere(_SUNS), transport.form_factors
    direct = np.stack([sun_cosines(transport, sun) for sun in suns], axis=1)
    leaving: Array32 = _ALBEDO * direct
    for _ in range(_BOUNCES):
        leaving = _ALBEDO * (direct + form_factors @ leaving)
    at_points = transport.sun_gather @ leaving
    triangles = transport.mesh.triangles.astype(np.int64)
    uneven = np.zeros(len(triangles))
    for side, of_vertex in enumerate(transport.gather_point_of_vertex):
        light = at_points[of_vertex][triangles]
        patch = transport.patch_of_side.reshape(transport.sides, -1)[side]
        all_light = np.maximum(light.mean(axis=1) + direct[patch], _FLOOR)
        spread = (light.max(axis=1) - light.min(axis=1)) / all_light
        uneven = np.maximum(uneven, np.minimum(spread, 1.0).mean(axis=1))
    return uneven


def _affordable(transport: LightTransport, triangles: IndexArray) -> Mask:
    """(t,) the first triangles, as many as gather from few enough patches."""
    gather = transport.gather
    entries = np.bincount(gather.indices, minlength=gather.shape[0])[
        transport.gather_point_of_vertex
    ]
    corners = transport.mesh.triangles[triangles].astype(np.int64)
    each = _ENTRIES_EACH * entries[:, corners].mean(axis=2).sum(axis=0)
    return np.asarray(np.cumsum(each) < _MAX_ENTRIES)


def _sphere(count: int) -> Array:
    """(count, 3) unit directions, even over the sphere (a sunflower's seeds by height)."""
    i = np.arange(count)
    z = 1.0 - (2.0 * i + 1.0) / count
    turn = i * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def _cut(mesh: Mesh, chosen: IndexArray) -> Mesh:
    """Some triangles of a mesh cut into ``CUTS``^2 each: their nodes, triangle by triangle."""
    corners = mesh.triangles[chosen].astype(np.int64)
    places = np.einsum("nk,tkj->tnj", STEPS / CUTS, mesh.positions[corners].astype(np.float64))
    normals = np.einsum("nk,tkj->tnj", STEPS / CUTS, mesh.normals[corners].astype(np.float64))
    # Nodes of an edge are at one place from both sides of it.
    step = _EQUAL * mesh.radius
    label = np.zeros(len(chosen) * NODES, dtype=np.uint32)
    first = NODES * np.arange(len(chosen))
    return Mesh(
        positions=(np.round(places / step) * step).reshape(-1, 3).astype(np.float32),
        normals=normals.reshape(-1, 3).astype(np.float32),
        triangles=(first[:, None, None] + _PIECES).reshape(-1, 3).astype(np.uint32),
        part=label,
        material=label,
    )


def _pieces() -> IndexArray:
    """(CUTS^2, 3) nodes of the parts of a triangle."""
    number = {(int(i), int(j)): k for k, (i, j, _) in enumerate(STEPS)}
    pieces = []
    for i, j in number:
        if i + j < CUTS:
            pieces.append((number[i + 1, j], number[i, j + 1], number[i, j]))
        if i + j < CUTS - 1:
            pieces.append((number[i + 1, j + 1], number[i, j + 1], number[i + 1, j]))
    return np.array(pieces)


_PIECES = _pieces()


def _continuous(mesh: Mesh, chosen: IndexArray) -> Mask:
    """(t, NODES) nodes about which all triangles have grids: on the rim the vertices' light holds,
    so that it has no step there."""
    corner = distinct_points(mesh)[0][mesh.triangles.astype(np.int64)]
    without = np.ones(len(corner), dtype=np.bool_)
    without[chosen] = False
    ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=2), axis=2)
    keys = ends[..., 0] * (int(corner.max()) + 1) + ends[..., 1]
    edge = np.unique(keys, return_inverse=True)[1].reshape(-1, 3)

    def full(of_triangle: IndexArray) -> Mask:
        lacks = np.bincount(of_triangle.ravel(), np.repeat(without, 3))
        return np.asarray(lacks[of_triangle[chosen]] == 0.0)

    full_corners, full_edges = full(corner), full(edge)
    continuous = np.ones((len(chosen), NODES), dtype=np.bool_)
    for k in range(3):
        # Edge k runs from corner k to k + 1; on it the third corner has no weight.
        continuous[:, STEPS[:, (k + 2) % 3] == 0] &= full_edges[:, k, None]
    for k in range(3):
        continuous[:, STEPS[:, k] == CUTS] = full_corners[:, k, None]
    return continuous
