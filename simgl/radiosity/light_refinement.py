"""Splitting triangles where light of other surfaces is not linear along their edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.gather_points import (
    LIFT,
    PLACES,
    QUARTERS,
    GatherPoints,
    cast,
    counts,
    face_normals,
    gather_points_of,
    unit_rows,
)
from simgl.radiosity.occlusion import moved_into_open
from simgl.radiosity.remesh import edges_of, halved
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Directions of the Sun, even over the sphere, under which light is compared.
_SUNS = 12
# What all surfaces reflect: materials are not known to a bake.
_ALBEDO = np.float32(0.5)
# Bounces after the first; what is left of light is a tenth then.
_BOUNCES = 2
# Rays of a vertex and of an edge's middle.
_RAYS = 128
# Of the Sun's irradiance: a difference counts relative to all light there, and at least to this.
_FLOOR = 0.01
# Relative differences that are not seen.
_TOLERANCE = 0.04
_ROUNDS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lights:
    """The light that leaves the triangles of a body, light by light.

    leaving : (m * sides, k) exitance over the Sun's irradiance, the last light a white sky
    suns : (k - 1, 3) unit, towards the Sun
    """

    mesh: Mesh
    tracer: RayTracer
    sides: int
    suns: Array
    leaving: Array32


def refined_by_light(mesh: Mesh, sides: int, added_triangles: int, shortest: float) -> Mesh:
    """About so many more triangles, where the light in the middle of an edge is not the mean of its
    ends.

    shortest : edges up to this length stay [m]
    """
    tracer = RayTracer(mesh)
    points = gather_points_of(mesh, sides)
    if sides == 1:
        points = moved_into_open(mesh, tracer, points)
    suns = _sphere(_SUNS)
    hits, open_share, _ = _cast(mesh, tracer, points, sides)
    corners = points.of_vertex[:, mesh.triangles.astype(np.int64)]

    def of_triangles(values: Array32) -> Array32:
        return np.concatenate([values[side].mean(axis=1) for side in corners])

    direct = np.concatenate([_sunlit(mesh, tracer, sides, suns), of_triangles(open_share)], axis=1)
    leaving: Array32 = _ALBEDO * direct
    for _ in range(_BOUNCES):
        leaving = _ALBEDO * (direct + of_triangles(hits @ leaving))
    lights = _Lights(mesh=mesh, tracer=tracer, sides=sides, suns=suns, leaving=leaving)
    at_points = hits @ leaving
    at_points[:, -1] += open_share[:, 0]
    values = np.moveaxis(at_points[points.of_vertex], 0, 1)
    return _split(lights, values, added_triangles, shortest)


def _sphere(count: int) -> Array:
    """(count, 3) unit directions, even over the sphere (a sunflower's seeds by height)."""
    i = np.arange(count)
    z = 1.0 - (2.0 * i + 1.0) / count
    turn = i * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def _cast(
    mesh: Mesh, tracer: RayTracer, points: GatherPoints, sides: int
) -> tuple[sparse.csr_matrix, Array32, Mask]:
    """(s, m * sides) share of each triangle's side in a hemisphere, (s, 1) share of the sky, and
    (s,) whether a point is inside another part."""
    seen = cast(mesh, tracer, points, sides, _RAYS, lambda _: None)
    quarters = np.arange(seen.hits.shape[1])
    to_sides = counts(quarters, quarters // QUARTERS, (len(quarters), len(quarters) // QUARTERS))
    hits = (seen.hits @ to_sides / np.float32(_RAYS)).tocsr().astype(np.float32)
    occluded = np.asarray(seen.occluded.sum(axis=1)).reshape(-1, 1) / np.float32(_RAYS)
    return hits, (1.0 - occluded).astype(np.float32), seen.buried


def _sunlit(mesh: Mesh, tracer: RayTracer, sides: int, suns: Array) -> Array32:
    """(m * sides, k) cosine of triangles' middles to each Sun that they see."""
    faces, _ = face_normals(mesh)
    middle = mesh.positions[mesh.triangles].astype(np.float64).mean(axis=1)
    return np.concatenate(
        [
            _cosines(tracer, middle + LIFT * mesh.radius * turn * faces, turn * faces, suns)
            for turn in (1.0, -1.0)[:sides]
        ]
    )


def _cosines(tracer: RayTracer, places: Array, normals: Array, suns: Array) -> Array32:
    """(n, k) cosine of places (n, 3) to each Sun that they see."""
    cosines = np.maximum(normals @ suns.T, 0.0).astype(np.float32)
    for k, sun in enumerate(suns):
        facing = np.flatnonzero(cosines[:, k])
        hidden = tracer.occluded(places[facing], np.broadcast_to(sun, (len(facing), 3)))
        cosines[facing[hidden], k] = 0.0
    return cosines


def _split(lights: _Lights, values: Array32, added: int, shortest: float) -> Mesh:
    mesh = lights.mesh
    final = len(mesh.triangles) + added
    # Of edges, by the indices of their ends, that have been looked at.
    known = np.empty(0, dtype=np.int64)
    middles = np.empty((0, *values.shape[1:]), dtype=np.float32)
    differences = np.empty(0)
    for _ in range(_ROUNDS):
        ends, edge = edges_of(mesh.triangles)
        keys = ends[:, 0] << 32 | ends[:, 1]
        fresh = np.flatnonzero(~np.isin(keys, known))
        light, different = _looked_at(lights, mesh, ends[fresh], values)
        known = np.concatenate([known, keys[fresh]])
        middles = np.concatenate([middles, light])
        differences = np.concatenate([differences, different])
        order = np.argsort(known)
        known, middles, differences = known[order], middles[order], differences[order]
        row = np.searchsorted(known, keys)
        chosen = _worst(mesh, ends, edge, differences[row], final, shortest)
        if not np.any(chosen):
            break
        mesh, pairs = halved(mesh, chosen[edge])
        row = np.searchsorted(known, pairs[:, 0] << 32 | pairs[:, 1])
        values = np.concatenate([values, middles[row]])
    return mesh


def _looked_at(
    lights: _Lights, mesh: Mesh, ends: IndexArray, values: Array32
) -> tuple[Array32, Array]:
    """(e, sides, k) light in the middle of edges, and (e,) how far the mean of their ends is from
    it, relative to all light there."""
    first, second = ends.T
    place = 0.5 * (mesh.positions[first].astype(np.float64) + mesh.positions[second])
    normals = unit_rows(mesh.normals[first].astype(np.float64) + mesh.normals[second])
    normals[np.linalg.norm(normals, axis=1) < 0.5] = (0.0, 0.0, 1.0)
    lift = LIFT * lights.mesh.radius
    middle_light = np.empty((len(ends), lights.sides, lights.leaving.shape[1]), dtype=np.float32)
    different = np.zeros(len(ends))
    for side, turn in enumerate((1.0, -1.0)[: lights.sides]):
        n = turn * normals
        starts = place + lift * n
        points = GatherPoints(
            origins=np.repeat(starts[:, None], PLACES, axis=1),
            normals=n,
            of_vertex=np.zeros((lights.sides, 0), dtype=np.int64),
        )
        hits, open_share, buried = _cast(lights.mesh, lights.tracer, points, lights.sides)
        light = hits @ lights.leaving
        light[:, -1:] += open_share
        mean = 0.5 * (values[first, side] + values[second, side])
        all_light = light.copy()
        all_light[:, :-1] += _cosines(lights.tracer, starts, n, lights.suns)
        error = np.abs(light - mean) / np.maximum(all_light, _FLOOR)
        middle_light[:, side] = np.where(buried[:, None], mean, light)
        different = np.maximum(different, np.where(buried, 0.0, error.mean(axis=1)))
    return middle_light, different


def _worst(
    mesh: Mesh,
    ends: IndexArray,
    edge: IndexArray,
    differences: Array,
    final: int,
    shortest: float,
) -> Mask:
    """(e,) edges to halve, those first that have most area about them times difference."""
    corners = mesh.positions[ends].astype(np.float64)
    length = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)
    _, areas = face_normals(mesh)
    around = np.bincount(edge.ravel(), np.repeat(areas, 3), minlength=len(ends))
    candidates = (differences > _TOLERANCE) & (length > shortest)
    weight = np.where(candidates, around * differences, 0.0)
    # Each halved edge makes about two more triangles, and their neighbours' ends of it one each.
    count = max(final - len(mesh.triangles), 0) // 2
    order = np.argsort(-weight, kind="stable")[:count]
    chosen = np.zeros(len(ends), dtype=np.bool_)
    chosen[order] = weight[order] > 0.0
    return chosen
