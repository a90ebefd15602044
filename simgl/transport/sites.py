"""The places at which light reaches vertices: one for all vertices that see the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh
from simgl.transport.directions import (
    SKY_CELLS,
    cosine_directions,
    frames,
    rounded_normals,
    sky_cell,
)
from simgl.transport.remesh import position_ids

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Rays start above the surface by this share of the body's radius, ten times what float32 resolves,
# and as far again and again inwards from the edges, so that a corner does not begin inside its
# other wall.
LIFT = 2e-5
INWARDS = 5.0 * LIFT
# A site where this share of the rays meets surfaces from behind lies inside another part.
BURIED = 0.25
# What lies closer than this share of the body's radius sends little of its light anywhere else.
GAP = 0.005
# A site's rays start in turn at so many places.
PLACES = 8

_SITES_AT_ONCE = 4096


@dataclass(frozen=True, kw_only=True, eq=False)
class Sites:
    """Distinct (place, normal) pairs of a mesh's vertices.

    origins : (s, PLACES, 3) where rays start [m]
    normals : (s, 3) unit, towards the side that is lit
    of_vertex : (sides, v) the site of each vertex, on its front and, with two sides, its back
    """

    origins: Array
    normals: Array
    of_vertex: Indices


@dataclass(frozen=True, kw_only=True, eq=False)
class SiteRays:
    """What the rays of all sites met.

    hit_share : (s,) of the rays, that met the body; across a narrow gap they count little
    hits : (s, t) csr, counts of rays to each (triangle, side): column = triangle + side * triangles
    occluded : (s, 96) csr, counts of rays that met the body on their way to a cell of the sky
    whole : (b, 96) counts of all rays to a cell, by the rounded normal
    whole_row : (s,) the row of ``whole`` of each site
    buried : (s,) inside another part
    """

    hit_share: Array
    hits: sparse.csr_matrix
    occluded: sparse.csr_matrix
    whole: NDArray[np.float32]
    whole_row: Indices
    buried: NDArray[np.bool_]


def unit_rows(vectors: Array) -> Array:
    """(n, 3) vectors of length 1; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


def face_normals(mesh: Mesh) -> tuple[Array, Array]:
    """(m, 3) unit normals of the triangles and (m,) their areas [m2]."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    cross = np.cross(b - a, c - a)
    return unit_rows(cross), 0.5 * np.linalg.norm(cross, axis=1)


def sites_of(mesh: Mesh, sides: int) -> Sites:
    """The sites of a mesh's vertices; ``sides`` is 2 where surfaces are seen from both."""
    count = len(mesh.positions)
    triangles = mesh.triangles.astype(np.int64)
    faces, areas = face_normals(mesh)
    normals = mesh.normals.astype(np.float64)
    length = np.linalg.norm(normals, axis=1)
    # Where interpolated normals cancel, the facets decide.
    flat = np.zeros((count, 3))
    for k in range(3):
        np.add.at(flat, triangles[:, k], faces * areas[:, None])
    normals = unit_rows(np.where(length[:, None] > 0.1, normals, flat))
    normals[np.linalg.norm(normals, axis=1) < 0.5] = (0.0, 0.0, 1.0)
    bins = np.round(normals * 512.0).astype(np.int64) + 1024
    keys = np.stack([position_ids(mesh.positions), *bins.T], axis=1)
    row = np.unique(keys @ _KEY_WEIGHTS, return_inverse=True)[1].ravel()
    sites = int(row.max()) + 1
    total = np.zeros((sites, 3))
    weight = np.zeros(sites)
    centroids = mesh.positions[triangles].astype(np.float64).mean(axis=1)
    for k in range(3):
        at = row[triangles[:, k]]
        np.add.at(total, at, centroids * areas[:, None])
        np.add.at(weight, at, areas)
    first = np.zeros(sites, dtype=np.int64)
    first[row] = np.arange(count)
    place = mesh.positions[first].astype(np.float64)
    used = weight > 0.0
    total[used] /= weight[used, None]
    total[~used] = place[~used]
    n = normals[first]
    towards = total - place
    # Along the surface only: the middle of a dome lies below its vertices.
    towards -= np.einsum("ij,ij->i", towards, n)[:, None] * n
    reach = np.linalg.norm(towards, axis=1)
    inwards = np.minimum(INWARDS * mesh.radius, 0.2 * reach)
    place += unit_rows(towards) * inwards[:, None]
    both = [1.0, -1.0][:sides]
    origins = np.concatenate([place + sign * LIFT * mesh.radius * n for sign in both])
    return Sites(
        origins=np.repeat(origins[:, None], PLACES, axis=1),
        normals=np.concatenate([sign * n for sign in both]),
        of_vertex=np.stack([row + side * sites for side in range(sides)]),
    )


_KEY_WEIGHTS = np.array([2**33, 2**22, 2**11, 1], dtype=np.int64)


def cast(
    mesh: Mesh, tracer: RayTracer, sites: Sites, sides: int, rays: int, tick: Callable[[int], None]
) -> SiteRays:
    """Cosine-weighted rays from every site; ``tick`` is told how many sites are done.

    rays : of a site, a multiple of ``PLACES``
    """
    pattern = cosine_directions(rays)
    faces, _ = face_normals(mesh)
    rounded, whole_row = rounded_normals(sites.normals)
    cells = sky_cell(_turned(rounded, pattern))
    count, columns = len(sites.origins), len(mesh.triangles)
    hit_share, behind_share = np.zeros(count), np.zeros(count)
    rows, targets, skies = [], [], []
    for start in range(0, count, _SITES_AT_ONCE):
        stop = min(start + _SITES_AT_ONCE, count)
        directions = _turned(rounded[whole_row[start:stop]], pattern)
        # Ray i starts at place i modulo their number: each has its own part of the sunflower.
        origins = np.tile(sites.origins[start:stop], (1, rays // PLACES, 1)).reshape(-1, 3)
        triangle, distance = tracer.hits(origins, directions.reshape(-1, 3))
        met = np.flatnonzero(triangle >= 0)
        triangle = triangle[met].astype(np.int64)
        site = start + met // rays
        along = np.einsum("ij,ij->i", faces[triangle], directions.reshape(-1, 3)[met])
        behind = along > 0.0
        reach = distance[met].astype(np.float64)
        hit_share += np.bincount(site, reach / (reach + GAP * mesh.radius), minlength=count)
        behind_share += np.bincount(site[behind], minlength=count)
        if sides == 1:
            counted = ~behind
            rows.append(site[counted])
            targets.append(triangle[counted])
        else:
            rows.append(site)
            targets.append(triangle + columns * behind)
        skies.append(site * SKY_CELLS + cells[whole_row[site], met % rays])
        tick(stop)
    sky_row = np.concatenate(skies)
    whole = np.zeros((len(rounded), SKY_CELLS), dtype=np.float32)
    np.add.at(whole, (np.arange(len(rounded))[:, None], cells), 1.0)
    return SiteRays(
        hit_share=hit_share / rays,
        hits=counts(np.concatenate(rows), np.concatenate(targets), (count, columns * sides)),
        occluded=counts(sky_row // SKY_CELLS, sky_row % SKY_CELLS, (count, SKY_CELLS)),
        whole=whole,
        whole_row=whole_row,
        buried=(behind_share > BURIED * rays) if sides == 1 else np.zeros(count, dtype=np.bool_),
    )


def _turned(normals: Array, pattern: Array) -> Array:
    """(n, k, 3) the pattern (k, 3) about each normal (n, 3)."""
    return np.asarray(np.matmul(pattern[None], np.swapaxes(frames(normals), 1, 2)))


def counts(rows: Indices, columns: Indices, shape: tuple[int, int]) -> sparse.csr_matrix:
    """How often each (row, column) occurs, as float32."""
    ones = np.ones(len(rows), dtype=np.float32)
    return sparse.coo_matrix((ones, (rows, columns)), shape=shape).tocsr()


def nearest_open(mesh: Mesh, sites: Sites, buried: NDArray[np.bool_]) -> Indices:
    """(s,) each site itself, or for a buried one the site beside it along the surface.

    What an inner vertex would see is not seen by anybody, but its value is interpolated into the
    part of a triangle that sticks out.
    """
    instead = np.arange(len(buried))
    open_ = ~buried
    triangles = mesh.triangles.astype(np.int64)
    links = np.concatenate(
        [side[triangles[:, [k, (k + 1) % 3]]] for side in sites.of_vertex for k in range(3)]
    )
    links = np.concatenate([links, links[:, ::-1]])
    place = sites.origins[:, 0]
    distance = np.linalg.norm(place[links[:, 0]] - place[links[:, 1]], axis=1)
    links = links[np.argsort(-distance, kind="stable")]
    while True:
        usable = links[open_[links[:, 0]] & ~open_[links[:, 1]]]
        if len(usable) == 0:
            return instead
        # The last writer of a place wins: the shortest link.
        instead[usable[:, 1]] = instead[usable[:, 0]]
        open_[usable[:, 1]] = True
