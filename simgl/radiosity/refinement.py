"""Smaller triangles where other surfaces are near, so that light at vertices can vary there."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.radiosity.gather_points import BURIED, GAP, LIFT, face_normals
from simgl.radiosity.hemisphere import cosine_directions, frames
from simgl.radiosity.remesh import subdivided
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Rays of one look around.
_LOOKS = 32
# Barycentric places at which a big triangle looks around.
_SPREAD = np.array(
    [
        [1 / 3, 1 / 3, 1 / 3],
        [0.9, 0.05, 0.05],
        [0.05, 0.9, 0.05],
        [0.05, 0.05, 0.9],
        [0.48, 0.48, 0.04],
        [0.04, 0.48, 0.48],
        [0.48, 0.04, 0.48],
    ]
)
# Of the distance to what is seen: over shorter edges light is linear to less than a thousandth.
_FINE = 0.05
# Of the search for what edges are a multiple of, between bounds that no body reaches.
_ROUNDS, _LOWEST, _HIGHEST = 40, 1e-4, 1e4


def refined(mesh: Mesh, sides: int, added_triangles: int, edge_share: float) -> Mesh:
    """A mesh with about so many more triangles, of edges down to a share of the body's radius.

    Irradiance from surfaces changes over their harmonic mean distance d (Ward et al. 1988): linear
    interpolation along edges of length e errs by (e / d)^2 of it. Of all choices that cost as many
    triangles, area / e^2, edges that go with d^(2/3) have the least squares of errors over the
    area.
    """
    lengths = edge_lengths(mesh)
    shortest = edge_share * mesh.radius
    faces, areas = face_normals(mesh)
    big = np.flatnonzero((lengths.max(axis=1) > shortest) & (areas > 0.0))
    nearness = np.maximum(_nearness(mesh, faces, big, sides, shortest), 1e-9 / mesh.radius)
    best = mesh.radius * (mesh.radius * nearness) ** (-2.0 / 3.0)
    fine = np.maximum(_FINE / nearness, shortest)

    def limits(multiple: float) -> Array:
        return np.maximum(multiple * best, fine)

    low, high = _LOWEST, _HIGHEST
    for _ in range(_ROUNDS):
        middle = np.sqrt(low * high)
        many = _pieces(lengths[big], limits(middle)) > added_triangles
        low, high = (middle, high) if many else (low, middle)
    wanted = np.full(len(lengths), np.inf)
    wanted[big] = limits(high)
    return subdivided(mesh, wanted)


def edge_lengths(mesh: Mesh) -> Array:
    """(m, 3) of the triangles [m]."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2))


def _pieces(lengths: Array, limits: Array) -> float:
    """How many triangles are added where edges (m, 3) are halved down to limits (m,) [m].

    A triangle falls into four where all its edges are halved, into three and two where fewer are.
    """
    times = np.ceil(np.log2(np.maximum(lengths / limits[:, None], 1.0)))
    of_shortest, of_middle, of_longest = np.sort(times, axis=1).T
    pieces = 4.0**of_shortest * 3.0 ** (of_middle - of_shortest) * 2.0 ** (of_longest - of_middle)
    return float(np.sum(pieces - 1.0))


def _nearness(mesh: Mesh, faces: Array, chosen: IndexArray, sides: int, shortest: float) -> Array:
    """(k,) mean of 1 / distance [m-1] over the directions above the chosen triangles.

    Across a narrow gap it counts little: little light comes in, and little is seen of it.
    """
    tracer = RayTracer(mesh)
    corners = mesh.positions[mesh.triangles[chosen]].astype(np.float64)
    pattern = cosine_directions(_LOOKS)
    gap = GAP * mesh.radius
    nearness = np.zeros(len(chosen))
    for weights in _SPREAD:
        for side in (1.0, -1.0)[:sides]:
            n = side * faces[chosen]
            origin = np.einsum("k,ikj->ij", weights, corners) + LIFT * mesh.radius * n
            rays = np.matmul(pattern[None], np.swapaxes(frames(n), 1, 2)).reshape(-1, 3)
            triangle, distance = tracer.hits(np.repeat(origin, _LOOKS, axis=0), rays)
            met = triangle >= 0
            behind = met & (np.einsum("ij,ij->i", faces[triangle], rays) > 0.0) & (sides == 1)
            outside = behind.reshape(-1, _LOOKS).mean(axis=1) <= BURIED
            open_ = distance / (distance + gap)
            near = np.where(met, open_ / np.maximum(distance, shortest), 0.0)
            nearness += near.reshape(-1, _LOOKS).mean(axis=1) * outside
    return nearness / (len(_SPREAD) * sides)
