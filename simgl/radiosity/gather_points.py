"""Gather points: where vertices collect light, one for all vertices at one place and normal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.hemisphere import (
    SKY_CELLS,
    cosine_directions,
    frames,
    rounded_normals,
    sky_cell,
)
from simgl.radiosity.in_turn import in_turn
from simgl.radiosity.shared_points import shared_points
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh, position_ids

# Rays start above the surface by this share of the body's radius, ten times what float32 resolves.
LIFT = 2e-5
# Of the way to a triangle's other edge, over which the rays of a corner start.
REACH = 0.35
# A gather point where this share of the rays meets surfaces from behind lies inside another part.
BURIED = 0.25
# What lies closer than this share of the body's radius sends little of its light anywhere else.
GAP = 0.005
# A gather point's rays start in turn at so many places.
PLACES = 8

_Vectors = TypeVar("_Vectors", Array, Array32)

# Rays into the open for each that meets a surface, in a mean over both.
_FREE = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class GatherPoints:
    """Distinct (place, normal) pairs of a mesh's vertices.

    origins : (s, PLACES, 3) where rays start [m]
    triangles : (s, PLACES) on which those places are; -1 for a vertex without any
    weights : (s, PLACES, 3) of the corners of these, there
    normals : (s, 3) unit, towards the side that is lit
    of_vertex : (sides, v) the gather point of each vertex, on its front and back (one or two sides)
    """

    origins: Array
    triangles: IndexArray
    weights: Array
    normals: Array
    of_vertex: IndexArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Places:
    """Where the rays of gather points start, k places each.

    triangles : (n, k) of the mesh that they are on; -1 for a vertex without triangles
    weights : (n, k, 3) of the corners there
    normals : (n, 3) unit, of the gather point, towards the side that is lit
    back : (n,) whether the gather point is on the back of the triangles
    open : (n, k) whether the rays of a place count: it is outside other parts
    """

    triangles: IndexArray
    weights: Array
    normals: Array
    back: Mask
    open: Mask

    def where_open(self, mesh: Mesh) -> Array:
        """(n, k, 3) the places, those that are open in turn for those that are not [m]."""
        on_mesh = self.triangles >= 0
        corners = mesh.positions[mesh.triangles[np.where(on_mesh, self.triangles, 0)]]
        places = np.einsum("nkc,nkci->nki", self.weights, corners)
        return open_in_turn(places, self.open & on_mesh)


@dataclass(frozen=True, kw_only=True, eq=False)
class GatherRays:
    """What the rays of all gather points met.

    hit_share : (s,) of the rays, that met the body; across a narrow gap they count little
    nearness : (s,) as of ``mean_nearness`` [m-1]
    hits : (s, t) csr, rays to each (triangle, side): column = triangle + side * triangles
    occluded : (s, 96) csr, numbers of rays that met the body on their way to a cell of the sky
    sky_rays : (b, 96) counts of all rays to a cell, by the rounded normal
    sky_rays_row : (s,) the row of ``sky_rays`` of each gather point
    open : (s, PLACES) whether rays of each place count: it is outside other parts
    """

    hit_share: Array
    nearness: Array32
    hits: sparse.csr_matrix
    occluded: sparse.csr_matrix
    open: Mask
    sky_rays: Array32
    sky_rays_row: IndexArray

    @property
    def buried(self) -> Mask:
        """(s,) which gather points are inside another part."""
        return np.asarray(~self.open.any(axis=1))


class _Part(NamedTuple):
    """Of some gather points, as of ``GatherRays``, but ``hit_share`` in rays."""

    hit_share: Array
    nearness: Array32
    hits: sparse.csr_matrix
    occluded: sparse.csr_matrix
    open: Mask


def places_of(points: GatherPoints, used: IndexArray, open_: Mask, sides: int) -> Places:
    """Those of some gather points.

    open_ : (s, k) of all gather points, as of ``Places``
    """
    return Places(
        triangles=points.triangles[used],
        weights=points.weights[used],
        normals=points.normals[used],
        back=used >= len(points.origins) // sides,
        open=open_[used],
    )


def open_in_turn(places: _Vectors, open_: Mask) -> _Vectors:
    """(n, k, 3) places, those that are open (n, k) in turn for those that are not."""
    order = np.argsort(~open_, axis=1, kind="stable")
    turn = np.arange(open_.shape[1]) % np.maximum(open_.sum(axis=1), 1)[:, None]
    chosen = np.take_along_axis(order, turn, axis=1)
    return np.asarray(np.take_along_axis(places, chosen[:, :, None], axis=1))


def middle_and_radius(places: _Vectors) -> tuple[_Vectors, _Vectors]:
    """(n, 3) the mean of places (n, k, 3), and (n,) how far they lie from it, rms."""
    middle = places.mean(axis=1)
    away2 = np.sum((places - middle[:, None]) ** 2, axis=2)
    return np.asarray(middle), np.asarray(np.sqrt(away2.mean(axis=1)))


def unit_rows(vectors: Array) -> Array:
    """(n, 3) vectors of length 1; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def face_normals(mesh: Mesh) -> tuple[Array, Array]:
    """(m, 3) unit normals of the triangles and (m,) their areas [m2]."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    cross = np.cross(b - a, c - a)
    return unit_rows(cross), 0.5 * np.linalg.norm(cross, axis=1)


def distinct_points(mesh: Mesh) -> tuple[IndexArray, Array]:
    """(v,) a number for each (place, normal) of a mesh's vertices, and (v, 3) these normals."""
    count = len(mesh.positions)
    triangles = mesh.triangles.astype(np.int64)
    normals = mesh.normals.astype(np.float64)
    length = np.linalg.norm(normals, axis=1)
    # Where interpolated normals cancel, the facets decide.
    flat = np.zeros((count, 3))
    faces, areas = face_normals(mesh)
    for k in range(3):
        np.add.at(flat, triangles[:, k], faces * areas[:, None])
    normals = unit_rows(np.where(length[:, None] > 0.1, normals, flat))
    normals[np.linalg.norm(normals, axis=1) < 0.5] = (0.0, 0.0, 1.0)
    bins = np.round(normals * 512.0).astype(np.int64) + 1024
    keys = np.stack([position_ids(mesh.positions), *bins.T], axis=1)
    return np.unique(keys @ _KEY_WEIGHTS, return_inverse=True)[1].ravel(), normals


def gather_points_of(
    mesh: Mesh, sides: int, radius: float | None = None, limit: int | None = None
) -> GatherPoints:
    """The gather points of a mesh's vertices; ``sides`` is 2 where surfaces are seen from both.

    radius : of the body that the mesh is a part of [m]; None where it is all of it
    limit : of their number, above which vertices next to each other share one; None for no limit
    """
    row, normals = distinct_points(mesh)
    if limit is not None:
        row = shared_points(mesh, row, normals, limit // sides, face_normals(mesh)[1].sum())
    count_of_side = int(row.max()) + 1
    first = np.zeros(count_of_side, dtype=np.int64)
    first[row] = np.arange(len(row))
    place, n = mesh.positions[first].astype(np.float64), normals[first]
    outwards = [n, -n][:sides]
    lift = LIFT * (mesh.radius if radius is None else radius)
    corners, areas = row[mesh.triangles.astype(np.int64)], face_normals(mesh)[1]
    around = [_around(mesh, corners, areas, place, n) for n in outwards]
    return GatherPoints(
        origins=np.concatenate(
            [at + lift * n[:, None] for (at, _, _), n in zip(around, outwards, strict=True)]
        ),
        triangles=np.concatenate([triangle for _, triangle, _ in around]),
        weights=np.concatenate([weights for _, _, weights in around]),
        normals=np.concatenate(outwards),
        of_vertex=np.stack([row + side * count_of_side for side in range(sides)]),
    )


def _around(
    mesh: Mesh, corners: IndexArray, areas: Array, place: Array, normals: Array
) -> tuple[Array, IndexArray, Array]:
    """(s, PLACES, 3) places on the triangles about each gather point, more on bigger ones; those
    triangles and the weights of their corners there, as of ``GatherPoints``.

    corners : (m, 3) gather point of each triangle's corner

    Light that falls off within a finger's breadth of an edge is not that of the next triangle:
    a corner speaks for the part of its triangles that is nearer to it than to their other corners.
    """
    flat = corners.ravel()
    order = np.argsort(flat, kind="stable")
    point, triangle = flat[order], order // 3
    weight = np.maximum(areas[triangle], 1e-30)
    total = np.bincount(point, weight, minlength=len(place))
    reach = np.cumsum(weight)
    before = np.concatenate([[0.0], np.cumsum(total)])[:-1]
    steps = (np.arange(PLACES) + 0.5) / PLACES
    wanted = (before[:, None] + steps * total[:, None]).ravel()
    chosen = order[np.minimum(np.searchsorted(reach, wanted), len(order) - 1)]
    chosen = np.where(np.repeat(total > 0.0, PLACES), chosen, order[0])
    of = np.repeat(np.arange(len(place)), PLACES)
    chosen = np.where(flat[chosen] == of, chosen, -1)
    # The additive sequence of the plastic number (Roberts 2018), folded into a triangle.
    i = np.arange(len(of))
    u, v = (0.5 + 0.7548776662466927 * i) % 1.0, (0.5 + 0.5698402909980532 * i) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    at = mesh.positions[mesh.triangles.astype(np.int64)].astype(np.float64)
    t, k = chosen // 3, chosen % 3
    a, b, c = at[t, k], at[t, (k + 1) % 3], at[t, (k + 2) % 3]
    a = np.where(chosen[:, None] < 0, place[of], a)
    u, v = REACH * np.where(chosen < 0, 0.0, u), REACH * np.where(chosen < 0, 0.0, v)
    away = u[:, None] * (b - a) + v[:, None] * (c - a)
    weights = np.empty((len(of), 3))
    each = np.arange(len(of))
    weights[each, k], weights[each, (k + 1) % 3], weights[each, (k + 2) % 3] = 1.0 - u - v, u, v
    # Never below the plane of the vertex: the middle of a dome's facet lies there.
    down = np.minimum(np.einsum("ij,ij->i", away, normals[of]), 0.0)
    away -= down[:, None] * normals[of]
    return (
        (a + away).reshape(-1, PLACES, 3),
        np.where(chosen < 0, -1, t).reshape(-1, PLACES),
        weights.reshape(-1, PLACES, 3),
    )


_KEY_WEIGHTS = np.array([2**33, 2**22, 2**11, 1], dtype=np.int64)


def cast(
    mesh: Mesh,
    tracer: RayTracer,
    points: GatherPoints,
    sides: int,
    rays: int,
    tick: Callable[[int], None],
) -> GatherRays:
    """Cosine-weighted rays from every gather point; ``tick`` gets how many of these are done.

    rays : of each, a multiple of ``PLACES``
    """
    pattern = cosine_directions(rays)
    faces = face_normals(mesh)[0].astype(np.float32)
    rounded, sky_rays_row = rounded_normals(points.normals)
    # float64: a few directions are on the edges of cells.
    cells = sky_cell(_turned(rounded, pattern)).astype(np.uint8)
    frame, pattern = frames(rounded).astype(np.float32), pattern.astype(np.float32)
    columns, gap = len(mesh.triangles), GAP * mesh.radius

    def traced(part: IndexArray) -> _Part:
        count, row = len(part), sky_rays_row[part]
        directions = np.matmul(pattern[None], np.swapaxes(frame[row], 1, 2)).reshape(-1, 3)
        # Ray i starts at place i modulo their number: each has its own part of the sunflower.
        origins = np.tile(points.origins[part].astype(np.float32), (1, rays // PLACES, 1))
        triangle, distance = tracer.hits(origins.reshape(-1, 3), directions)
        met = np.flatnonzero(triangle >= 0)
        side = triangle.take(met).astype(np.int64)
        towards = faces.take(side, axis=0), directions.take(met, axis=0)
        behind = np.einsum("ij,ij->i", *towards) > 0.0
        point, place = point_and_place(met, rays)
        usable, weight = open_places(place[behind & (sides == 1)], count, rays)
        each = np.where(usable, weight[:, None], 0.0).ravel()
        share: Array = each.take(place)
        reach: Array = distance.take(met).astype(np.float64)
        near = np.bincount(point, share * reach / (reach + gap), minlength=count)
        occluded = np.flatnonzero(share > 0.0)
        cell = cells[row].ravel().take(met[occluded]).astype(np.int64)
        to_body = np.flatnonzero((share > 0.0) & ~(behind & (sides == 1)))
        side += columns * (behind & (sides == 2))
        return _Part(
            hit_share=np.asarray(near, dtype=np.float64),
            nearness=mean_nearness(point, reach + gap, count, rays),
            hits=counts(point[to_body], side[to_body], (count, columns * sides), weight),
            occluded=counts(point[occluded], cell, (count, SKY_CELLS), weight),
            open=usable,
        )

    parts = in_turn(traced, np.arange(len(points.origins)), rays, tick)
    sky_rays = np.zeros((len(rounded), SKY_CELLS), dtype=np.float32)
    np.add.at(sky_rays, (np.arange(len(rounded))[:, None], cells), 1.0)
    return GatherRays(
        hit_share=np.concatenate([part.hit_share for part in parts]) / rays,
        nearness=np.concatenate([part.nearness for part in parts]),
        hits=sparse.vstack([part.hits for part in parts], format="csr"),
        occluded=sparse.vstack([part.occluded for part in parts], format="csr"),
        open=np.concatenate([part.open for part in parts]),
        sky_rays=sky_rays,
        sky_rays_row=sky_rays_row,
    )


def point_and_place(ray: IndexArray, rays: int) -> tuple[IndexArray, IndexArray]:
    """(n,) which point and which of all places (points, PLACES) rays start from.

    ray : (n,) their numbers; rays : of each point
    """
    point: IndexArray = ray // rays
    return point, point * PLACES + ray % PLACES


def open_places(behind: IndexArray, points: int, rays: int) -> tuple[Mask, Array]:
    """(points, PLACES) which places are outside other parts, and (points,) what a ray of these
    counts: those of a place inside another part count for nothing, and the others of its point
    stand for them.

    behind : the places of rays that met a closed body from behind; rays : of each point
    """
    inside = np.bincount(behind, minlength=points * PLACES)
    usable = (inside <= BURIED * rays / PLACES).reshape(-1, PLACES)
    number = usable.sum(axis=1)
    return usable, np.where(number > 0, PLACES / np.maximum(number, 1), 0.0)


def mean_nearness(point: IndexArray, distance: Array | Array32, count: int, rays: int) -> Array32:
    """(count,) mean of 1 / distance over the rays of each point [m-1].

    Rays that meet nothing count as well, but at most ``_FREE`` for each that meets something: where
    little is in sight its light still changes with the distance to it.

    point, distance : of the rays that meet something; rays : of each point
    """
    number = np.bincount(point, minlength=count)
    among = np.clip((1 + _FREE) * number, 1, rays)
    return (np.bincount(point, 1.0 / distance, minlength=count) / among).astype(np.float32)


def _turned(normals: Array, pattern: Array) -> Array:
    """(n, k, 3) the pattern (k, 3) about each normal (n, 3)."""
    return np.matmul(pattern[None], np.swapaxes(frames(normals), 1, 2))


def counts(
    rows: IndexArray, columns: IndexArray, shape: tuple[int, int], weight: Array | None = None
) -> sparse.csr_matrix:
    """How often each (row, column) occurs, as float32; times a weight of each row (n,)."""
    keys = rows.astype(np.int64) * shape[1] + columns
    # Numbers are sorted several times as fast as the rows of a matrix.
    keys.sort()
    first = np.flatnonzero(np.diff(keys, prepend=-1))
    number = np.diff(first, append=len(keys)).astype(np.float32)
    row, column = np.divmod(keys[first], shape[1])
    if weight is not None:
        number *= weight.astype(np.float32).take(row)
    ends = np.zeros(shape[0] + 1, dtype=np.int32)
    np.cumsum(np.bincount(row, minlength=shape[0]), out=ends[1:])
    return sparse.csr_matrix((number, column.astype(np.int32), ends), shape=shape)


def nearest_open(mesh: Mesh, points: GatherPoints, buried: Mask) -> IndexArray:
    """(s,) each gather point itself, or for a buried one its nearest neighbour along the surface.

    Nobody sees what an inner vertex would see, but its value is interpolated into the part of a
    triangle that sticks out.
    """
    instead = np.arange(len(buried))
    open_ = ~buried
    triangles = mesh.triangles.astype(np.int64)
    links = np.concatenate(
        [side[triangles[:, [k, (k + 1) % 3]]] for side in points.of_vertex for k in range(3)]
    )
    links = links[buried[links].any(axis=1)]
    links = np.concatenate([links, links[:, ::-1]])
    place = points.origins[:, 0]
    distance = np.linalg.norm(place[links[:, 0]] - place[links[:, 1]], axis=1)
    links = links[np.argsort(-distance, kind="stable")]
    while True:
        usable = links[open_[links[:, 0]] & ~open_[links[:, 1]]]
        if len(usable) == 0:
            return instead
        # The last writer of a place wins: the shortest link.
        instead[usable[:, 1]] = instead[usable[:, 0]]
        open_[usable[:, 1]] = True
