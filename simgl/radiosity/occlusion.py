"""Light for vertices that lie inside other parts: from the open places of their triangles."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.radiosity.gather_points import (
    BURIED,
    LIFT,
    PLACES,
    GatherPoints,
    face_normals,
    gather_points_of,
)
from simgl.radiosity.hemisphere import cosine_directions, frames
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Rays that tell whether a place is outside all other parts.
_LOOKS = 16
# Places tried on each triangle, and on all together shared out by area.
_TRIED_EACH = 16
_TRIED_BY_AREA = 60_000


def moved_into_open(mesh: Mesh, tracer: RayTracer, gather: GatherPoints) -> GatherPoints:
    """Gather points of closed bodies, whose rays start outside other parts wherever possible.

    A rib that stands on a wall, or a board under solar cells, has its vertices inside the other
    part while most of its surface is seen. What a hidden vertex hands to that surface is the light
    of places around it that are not hidden.
    """
    hidden = inside_others(mesh, tracer, gather.origins[:, 0], gather.normals)
    corners = gather.of_vertex[0][mesh.triangles.astype(np.int64)]
    places = _open_places(mesh, tracer, np.flatnonzero(np.any(hidden[corners], axis=1)))
    return _started_at(gather, corners, hidden, places)


def with_unshared_corners(mesh: Mesh, tracer: RayTracer) -> tuple[Mesh, GatherPoints]:
    """A closed body whose partly hidden triangles share no vertices with others, and its gather
    points.

    A wall on which a box stands is bright on one side of it and dark on the other, and the vertices
    under the box have no light of their own: each triangle gets that of its own open places.
    Triangles keep their order.
    """
    gather = gather_points_of(mesh, 1)
    hidden = inside_others(mesh, tracer, gather.origins[:, 0], gather.normals)
    triangles = mesh.triangles.astype(np.int64)
    partly = np.flatnonzero(np.any(hidden[gather.of_vertex[0][triangles]], axis=1))
    places = _open_places(mesh, tracer, partly)
    separate = np.unique(places.triangle)
    grown, group = _with_copies(mesh, separate)
    gather = gather_points_of(grown, 1, group)
    corners = gather.of_vertex[0][grown.triangles.astype(np.int64)]
    unshared = np.zeros(len(gather.origins), dtype=np.bool_)
    unshared[corners[separate]] = True
    return grown, _started_at(gather, corners, unshared, places)


def _with_copies(mesh: Mesh, chosen: IndexArray) -> tuple[Mesh, IndexArray]:
    """The mesh with vertices of their own for some triangles, and for each vertex (v,) the number
    of such a triangle, 0 for shared ones."""
    triangles = mesh.triangles.astype(np.int64)
    count = len(mesh.positions)
    origin = np.concatenate([np.arange(count), triangles[chosen].ravel()])
    group = np.zeros(len(origin), dtype=np.int64)
    group[count:] = np.repeat(1 + np.arange(len(chosen)), 3)
    triangles[chosen] = count + np.arange(3 * len(chosen)).reshape(-1, 3)
    used, corners = np.unique(triangles, return_inverse=True)
    arrays = {
        f.name: getattr(mesh, f.name)[origin[used]]
        for f in fields(mesh)
        if f.name != "triangles" and getattr(mesh, f.name) is not None
    }
    return replace(
        mesh, **arrays, triangles=np.asarray(corners.reshape(-1, 3), dtype=np.uint32)
    ), group[used]


@dataclass(frozen=True, kw_only=True, eq=False)
class _OpenPlaces:
    """Places on triangles that are outside all other parts.

    triangle : (n,); weights : (n, 3) of its corners; points : (n, 3) a little above it [m]
    """

    triangle: IndexArray
    weights: Array
    points: Array


def _open_places(mesh: Mesh, tracer: RayTracer, chosen: IndexArray) -> _OpenPlaces:
    """Those of some triangles."""
    triangle, weights = _places(mesh, chosen)
    faces, _ = face_normals(mesh)
    at = mesh.positions[mesh.triangles[triangle]].astype(np.float64)
    points = np.einsum("ij,ijk->ik", weights, at) + LIFT * mesh.radius * faces[triangle]
    free = ~inside_others(mesh, tracer, points, faces[triangle])
    return _OpenPlaces(triangle=triangle[free], weights=weights[free], points=points[free])


def _started_at(
    gather: GatherPoints, corners: IndexArray, chosen: Mask, places: _OpenPlaces
) -> GatherPoints:
    """Gather points some of which (s,) start their rays at open places of their triangles.

    corners : (m, 3) gather point of each triangle's corners
    """
    # Every place may serve the three corners of its triangle, best the one that it is nearest to.
    point, weight = corners[places.triangle].ravel(), places.weights.ravel()
    place = np.repeat(np.arange(len(places.points)), 3)
    useful = np.flatnonzero(chosen[point])
    if len(useful) == 0:
        return gather
    order = useful[np.lexsort((-weight[useful], point[useful]))]
    served, first, count = np.unique(point[order], return_index=True, return_counts=True)
    # A few spread over all places that are nearest to this corner: the foot of a frame does not see
    # what the gaps a metre away see. If there are fewer than rays start from, they take turns.
    nearest = np.bincount(point[order], weight[order] > 1.0 / 3.0, minlength=len(chosen))[served]
    among = np.minimum(np.maximum(nearest.astype(np.int64), PLACES), count)
    turn = np.arange(PLACES)[None, :] * among[:, None] // PLACES
    origins = gather.origins.copy()
    origins[served] = places.points[place[order[first[:, None] + turn]]]
    return replace(gather, origins=origins)


def inside_others(mesh: Mesh, tracer: RayTracer, points: Array, normals: Array) -> Mask:
    """(n,) whether more than ``BURIED`` of the directions above points (n, 3) meet surfaces from
    behind."""
    faces, _ = face_normals(mesh)
    pattern = cosine_directions(_LOOKS)
    behind = np.zeros(len(points), dtype=np.int64)
    open_ = np.arange(len(points))
    # Most are decided before all rays are traced: so many behind, or too few left to be so many.
    enough = int(BURIED * _LOOKS) + 1
    start = 0
    for stop in (enough, _LOOKS - enough + 1, _LOOKS):
        some = pattern[start:stop]
        rays = np.matmul(some[None], np.swapaxes(frames(normals[open_]), 1, 2)).reshape(-1, 3)
        triangle, _ = tracer.hits(np.repeat(points[open_], len(some), axis=0), rays)
        met = (triangle >= 0) & (np.einsum("ij,ij->i", faces[triangle], rays) > 0.0)
        behind[open_] += met.reshape(-1, len(some)).sum(axis=1)
        left, so_far = _LOOKS - stop, behind[open_]
        open_ = open_[(so_far < enough) & (so_far + left >= enough)]
        start = stop
    return behind >= enough


def _places(mesh: Mesh, chosen: IndexArray) -> tuple[IndexArray, Array]:
    """Triangle (n,) and weights of its corners (n, 3) of places spread over some triangles."""
    areas = face_normals(mesh)[1][chosen]
    number = _TRIED_EACH + (_TRIED_BY_AREA * areas / max(areas.sum(), 1e-30)).astype(np.int64)
    triangle = np.repeat(chosen, number)
    # The additive sequence of the plastic number (Roberts 2018), folded into a triangle.
    i = np.arange(len(triangle)) - np.repeat(np.cumsum(number) - number, number)
    u, v = (0.5 + 0.7548776662466927 * i) % 1.0, (0.5 + 0.5698402909980532 * i) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    return triangle, np.stack([1.0 - u - v, u, v], axis=1)
