"""Light for vertices that lie inside other parts: from the open places of their triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.radiosity.gather_points import BURIED, LIFT, PLACES, GatherPoints, face_normals
from simgl.radiosity.hemisphere import cosine_directions, frames
from simgl.radiosity.in_turn import in_turn
from simgl.rays import AnyRayTracer
from simgl.scene.mesh import Mesh

# Rays that tell whether a place is outside all other parts.
_LOOKS = 16
# Places tried on each triangle, and on all together shared out by area.
_TRIED_EACH = 16
_TRIED_BY_AREA = 60_000


def moved_into_open(
    mesh: Mesh,
    tracer: AnyRayTracer,
    gather: GatherPoints,
    body: Mesh | None = None,
    tried_each: int = _TRIED_EACH,
) -> GatherPoints:
    """Gather points of closed bodies, whose rays start outside other parts wherever possible.

    body : which the mesh is a part of, and which the rays meet; None where the mesh is all of it
    tried_each : places on each triangle, more on bigger ones

    A rib that stands on a wall, or a board under solar cells, has its vertices inside the other
    part while most of its surface is seen. What a hidden vertex hands to that surface is the light
    of places around it that are not hidden.
    """
    body = mesh if body is None else body
    hidden = inside_others(body, tracer, gather.origins[:, 0], gather.normals)
    corners = gather.of_vertex[0][mesh.triangles.astype(np.int64)]
    chosen = np.flatnonzero(np.any(hidden[corners], axis=1))
    if len(chosen) == 0:
        return gather
    triangle, weights = _places(mesh, chosen, tried_each)
    faces, _ = face_normals(mesh)
    at = mesh.positions[mesh.triangles[triangle]].astype(np.float64)
    points = np.einsum("ij,ijk->ik", weights, at) + LIFT * body.radius * faces[triangle]
    free = ~inside_others(body, tracer, points, faces[triangle])
    triangle, weights, points = triangle[free], weights[free], points[free]
    # Every place may serve the three corners of its triangle, best the one that it is nearest to.
    point, weight = corners[triangle].ravel(), weights.ravel()
    place = np.repeat(np.arange(len(points)), 3)
    useful = np.flatnonzero(hidden[point])
    order = useful[np.lexsort((-weight[useful], point[useful]))]
    served, first, count = np.unique(point[order], return_index=True, return_counts=True)
    # A few spread over all places that are nearest to this corner: the foot of a frame does not see
    # what the gaps a metre away see. If there are fewer than rays start from, they take turns.
    nearest = np.bincount(point[order], weight[order] > 1.0 / 3.0, minlength=len(hidden))[served]
    among = np.minimum(np.maximum(nearest.astype(np.int64), PLACES), count)
    turn = np.arange(PLACES)[None, :] * among[:, None] // PLACES
    origins = gather.origins.copy()
    chosen = place[order[first[:, None] + turn]]
    origins[served] = points[chosen]
    of_place, shares = gather.triangles.copy(), gather.weights.copy()
    of_place[served], shares[served] = triangle[chosen], weights[chosen]
    return replace(gather, origins=origins, triangles=of_place, weights=shares)


def inside_others(mesh: Mesh, tracer: AnyRayTracer, points: Array, normals: Array) -> Mask:
    """(n,) whether more than ``BURIED`` of the directions above points (n, 3) meet surfaces from
    behind."""
    faces = face_normals(mesh)[0].astype(np.float32)
    pattern = cosine_directions(_LOOKS).astype(np.float32)
    # Most are decided before all rays are traced: so many behind, or too few left to be so many.
    enough = int(BURIED * _LOOKS) + 1

    def of_part(part: IndexArray) -> Mask:
        turns = np.swapaxes(frames(normals[part]), 1, 2).astype(np.float32)
        places = points[part].astype(np.float32)
        behind = np.zeros(len(part), dtype=np.int64)
        open_ = np.arange(len(part))
        start = 0
        for stop in (enough, _LOOKS - enough + 1, _LOOKS):
            some = pattern[start:stop]
            rays = np.matmul(some[None], turns[open_]).reshape(-1, 3)
            triangle, _ = tracer.hits(np.repeat(places[open_], len(some), axis=0), rays)
            met = np.flatnonzero(triangle >= 0)
            from_behind = np.einsum("ij,ij->i", faces[triangle[met]], rays[met]) > 0.0
            behind[open_] += np.bincount(met[from_behind] // len(some), minlength=len(open_))
            left, so_far = _LOOKS - stop, behind[open_]
            open_ = open_[(so_far < enough) & (so_far + left >= enough)]
            start = stop
        return behind >= enough

    if len(points) == 0:
        return np.zeros(0, dtype=np.bool_)
    return np.concatenate(in_turn(of_part, np.arange(len(points)), _LOOKS))


def _places(mesh: Mesh, chosen: IndexArray, each: int) -> tuple[IndexArray, Array]:
    """Triangle (n,) and weights of its corners (n, 3) of places spread over some triangles."""
    areas = face_normals(mesh)[1][chosen]
    number = each + (_TRIED_BY_AREA * areas / max(areas.sum(), 1e-30)).astype(np.int64)
    triangle = np.repeat(chosen, number)
    # The additive sequence of the plastic number (Roberts 2018), folded into a triangle.
    i = np.arange(len(triangle)) - np.repeat(np.cumsum(number) - number, number)
    u, v = (0.5 + 0.7548776662466927 * i) % 1.0, (0.5 + 0.5698402909980532 * i) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    return triangle, np.stack([1.0 - u - v, u, v], axis=1)
