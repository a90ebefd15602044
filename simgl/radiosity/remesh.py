"""Splitting big triangles, so that light computed at vertices can vary across them."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from simgl.arrays import AnyArray, Array, IndexArray, Mask
from simgl.scene.mesh import Mesh, position_ids


def subdivided(mesh: Mesh, longest_edge: float | Array) -> Mesh:
    """The same surface in smaller triangles; every triangle stays in its plane.

    longest_edge : [m], for all triangles or (m,) for each and what becomes of it; an edge keeps to
        the stricter limit of the triangles that share it

    Whether an edge is halved depends on the places of its ends, so that triangles which meet there
    without sharing vertices stay closed. A new vertex has the mean of its neighbours' values: mean
    normals are left shorter than 1, which keeps the shading between the old vertices as it was.
    """
    limit = np.broadcast_to(np.asarray(longest_edge, dtype=np.float64), len(mesh.triangles))
    arrays = {
        f.name: getattr(mesh, f.name)
        for f in fields(mesh)
        if f.name != "triangles" and getattr(mesh, f.name) is not None
    }
    triangles = mesh.triangles.astype(np.int64)
    halved = True
    while halved:
        arrays, triangles, limit, halved = _halve_once(arrays, triangles, limit)
    return replace(mesh, **arrays, triangles=triangles.astype(np.uint32))


def _halve_once(
    arrays: dict[str, AnyArray], triangles: IndexArray, limit: Array
) -> tuple[dict[str, AnyArray], IndexArray, Array, bool]:
    """One round: every edge that is too long gets a vertex in its middle."""
    positions = arrays["positions"]
    corners = positions[triangles].astype(np.float64)
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    place = position_ids(positions)
    edges = np.sort(place[ends], axis=2)
    shared = np.unique(edges[..., 0] * len(positions) + edges[..., 1], return_inverse=True)[1]
    shared = shared.reshape(-1, 3)
    wanted = np.full(int(shared.max()) + 1, np.inf)
    np.minimum.at(wanted, shared, np.broadcast_to(limit[:, None], shared.shape))
    split = lengths > wanted[shared]
    if not np.any(split):
        return arrays, triangles, limit, False
    pairs = np.sort(ends[split], axis=1)
    unique, number = np.unique(pairs, axis=0, return_inverse=True)
    middle = np.full(split.shape, -1, dtype=np.int64)
    middle[split] = len(positions) + number.ravel()
    grown = {name: np.concatenate([a, _means(a, unique)]) for name, a in arrays.items()}
    pieces, parent = _cut(triangles, split, middle)
    return grown, pieces, limit[parent], True


def _means(values: AnyArray, pairs: IndexArray) -> AnyArray:
    first, second = values[pairs[:, 0]], values[pairs[:, 1]]
    if not np.issubdtype(values.dtype, np.floating):
        return first  # labels, the same at all corners of a triangle
    return (0.5 * (first + second)).astype(values.dtype)


def _cut(triangles: IndexArray, split: Mask, middle: IndexArray) -> tuple[IndexArray, IndexArray]:
    """The triangles that remain when edges get a middle, and which one each was cut from.

    Edge k runs from corner k to k + 1.
    """
    count = split.sum(axis=1)
    # Turn the corners: a single cut is edge 0; of two cuts the whole edge is edge 2.
    first = np.where(count == 1, np.argmax(split, axis=1), 0)
    first = np.where(count == 2, (np.argmin(split, axis=1) + 1) % 3, first)
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, turn, axis=1).T
    pieces = {
        0: [(a, b, c)],
        1: [(a, ab, c), (ab, b, c)],
        2: [(ab, b, bc), (a, ab, bc), (a, bc, c)],
        3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
    }
    out, parents = [], []
    for cuts, parts in pieces.items():
        chosen = count == cuts
        parents += [np.flatnonzero(chosen)] * len(parts)
        out += [np.stack([p[chosen] for p in part], axis=1) for part in parts]
    return np.concatenate(out), np.concatenate(parents)
