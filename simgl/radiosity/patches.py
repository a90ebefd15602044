"""Patches: neighbouring triangles that exchange light as one surface."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from simgl.arrays import Array, IndexArray
from simgl.radiosity.gather_points import LIFT, face_normals
from simgl.scene.mesh import Mesh, position_ids

# Sample points of a patch, spread evenly over its area.
SAMPLES = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Patches:
    """Clusters of triangle sides.

    of_side : (m * sides,) patch of each triangle's front, then of each one's back
    areas : (p,) [m2]
    materials : (p, k) share of the area that each material covers
    points : (p, SAMPLES, 3) just above the surface [m]
    normals : (p, SAMPLES, 3) of the triangles there, towards the patch's side
    """

    of_side: IndexArray
    areas: Array
    materials: Array
    points: Array
    normals: Array


def cluster(mesh: Mesh, sides: int, exposure: Array, count: int) -> Patches:
    """About ``count`` patches, small where much light is exchanged.

    exposure : (m * sides,) share of the directions above each triangle's side in which it sees the
        body

    Triangles of one part and material that face alike and touch start as one patch, but the small
    ones of a part that face alike as one together: a liner and the wall behind it, one lit and one
    dark, stay apart. The patch that gives most light to others (area times exposure) is halved
    along its longest extent until there are enough.
    """
    faces, areas = face_normals(mesh)
    triangles = mesh.triangles.astype(np.int64)
    centroids = mesh.positions[triangles].astype(np.float64).mean(axis=1)
    part = mesh.part[triangles[:, 0]].astype(np.int64)
    material = mesh.material[triangles[:, 0]].astype(np.int64)
    # 26 directions: the neighbours of a cube's cell.
    facing = np.round(faces * 1.3).astype(np.int64) + 1
    kind = ((part * 3 + facing[:, 0]) * 3 + facing[:, 1]) * 3 + facing[:, 2]
    kind = kind * (int(material.max()) + 1) + material
    kinds = np.concatenate([kind + side * (int(kind.max()) + 1) for side in range(sides)])
    weight = np.tile(areas, sides) * exposure
    piece = np.tile(_pieces(mesh, kind), sides) + kinds.max() + 1
    piece = piece + np.repeat(np.arange(sides), len(areas)) * (int(piece.max()) + 1)
    share = np.bincount(piece, weight)[piece] / weight.sum()
    places = np.tile(centroids, (sides, 1))
    start = _grouped(np.where(share * count > 1.0, piece, kinds))
    groups = _halved(start, places, weight, count)
    of_side = _numbered(groups, len(kinds))
    patch_areas = np.asarray(
        np.bincount(of_side, np.tile(areas, sides), minlength=len(groups)), dtype=np.float64
    )
    shares = np.zeros((len(groups), int(material.max()) + 1))
    np.add.at(shares, (of_side, np.tile(material, sides)), np.tile(areas, sides))
    shares /= np.where(patch_areas > 0.0, patch_areas, 1.0)[:, None]
    points, normals = _samples(mesh, groups, faces, areas)
    return Patches(
        of_side=of_side,
        areas=patch_areas,
        materials=shares,
        points=points,
        normals=normals,
    )


def _pieces(mesh: Mesh, kind: IndexArray) -> IndexArray:
    """(m,) a number for each set of triangles of one kind that hang together by their corners."""
    triangles = mesh.triangles.astype(np.int64)
    place = position_ids(mesh.positions)[triangles]
    corner = np.unique(kind[:, None] * (int(place.max()) + 1) + place, return_inverse=True)[1]
    corner = corner.reshape(-1, 3)
    number = int(corner.max()) + 1
    links = np.concatenate([corner[:, :2], corner[:, 1:]])
    graph = sparse.coo_matrix((np.ones(len(links)), links.T), shape=(number, number))
    return np.asarray(connected_components(graph, directed=False)[1][corner[:, 0]], dtype=np.int64)


def _grouped(kinds: IndexArray) -> list[IndexArray]:
    order = np.argsort(kinds, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(kinds[order])) + 1)


def _numbered(groups: list[IndexArray], count: int) -> IndexArray:
    """(count,) the group that each member is in."""
    number = np.empty(count, dtype=np.int64)
    for group, members in enumerate(groups):
        number[members] = group
    return number


def _halved(groups: list[IndexArray], places: Array, weight: Array, count: int) -> list[IndexArray]:
    queue = [(-float(weight[g].sum()), i, g) for i, g in enumerate(groups)]
    heapq.heapify(queue)
    number = len(queue)
    finished: list[tuple[int, IndexArray]] = []
    while queue and len(queue) + len(finished) < count:
        total, i, members = heapq.heappop(queue)
        if total == 0.0:
            finished.append((i, members))
            break
        inside = places[members]
        low, high = inside.min(axis=0), inside.max(axis=0)
        axis = int(np.argmax(high - low))
        first = inside[:, axis] < 0.5 * (low[axis] + high[axis])
        if not np.any(first):
            finished.append((i, members))
            continue
        for half in (members[first], members[~first]):
            heapq.heappush(queue, (-float(weight[half].sum()), number, half))
            number += 1
    rest = [(i, members) for _, i, members in queue]
    return [members for _, members in sorted(finished + rest, key=lambda item: item[0])]


def _samples(
    mesh: Mesh, groups: list[IndexArray], faces: Array, areas: Array
) -> tuple[Array, Array]:
    """Points spread by area over the triangles of each patch, a little inside their edges."""
    count = len(areas)
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    steps = (np.arange(SAMPLES) + 0.5) / SAMPLES
    chosen = np.empty((len(groups), SAMPLES), dtype=np.int64)
    for number, members in enumerate(groups):
        reach = np.cumsum(areas[members % count])
        at = np.searchsorted(reach, steps * reach[-1])
        chosen[number] = members[np.minimum(at, len(members) - 1)]
    # The additive sequence of the plastic number (Roberts 2018), folded into a triangle.
    i = np.arange(len(groups) * SAMPLES)
    u, v = (0.5 + 0.7548776662466927 * i) % 1.0, (0.5 + 0.5698402909980532 * i) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    u, v = (0.98 * w + 0.02 / 3.0 for w in (u, v))
    triangle = chosen.ravel() % count
    a, b, c = np.moveaxis(corners[triangle], 1, 0)
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    normals = faces[triangle] * np.where(chosen.ravel() < count, 1.0, -1.0)[:, None]
    points += LIFT * mesh.radius * normals
    shape = (len(groups), SAMPLES, 3)
    return points.reshape(shape), normals.reshape(shape)
