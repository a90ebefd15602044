"""Arithmetic of many triangles at once: nearest places, and lists of lists."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, IndexArray


class Lists:
    """For each of ``count`` keys the places at which it stands in ``keys``, in their order."""

    def __init__(self, keys: IndexArray, count: int) -> None:
        self._members = np.argsort(keys, kind="stable")
        self._starts = np.concatenate([[0], np.cumsum(np.bincount(keys, minlength=count))])

    def counts(self, keys: IndexArray) -> IndexArray:
        """(k,) lengths of the lists of some keys."""
        return self._starts[keys + 1] - self._starts[keys]

    def of(self, keys: IndexArray) -> tuple[IndexArray, IndexArray]:
        """The lists of some keys one after the other: which of ``keys``, and the member."""
        lengths = self.counts(keys)
        owner = np.repeat(np.arange(len(keys)), lengths)
        within = np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        return owner, self._members[self._starts[keys][owner] + within]


def nearest_place(points: Array, corners: Array) -> tuple[Array, Array]:
    """The place on a triangle that is nearest to a point.

    points : (n, 3)
    corners : (n, 3, 3) of the triangle for each point
    returns : (n, 3) barycentric coordinates of the place, (n,) its distance
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, ac, ap = b - a, c - a, points - a
    d1, d2 = _dot(ab, ab), _dot(ac, ac)
    cross = _dot(ab, ac)
    p1, p2 = _dot(ab, ap), _dot(ac, ap)
    area = np.maximum(d1 * d2 - cross * cross, 1e-300)
    v, w = (d2 * p1 - cross * p2) / area, (d1 * p2 - cross * p1) / area
    best = np.stack([1.0 - v - w, v, w], axis=1)
    inside = np.all(best >= 0.0, axis=1)
    best_d2 = np.where(inside, _squared(points, corners, best), np.inf)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, second] - corners[:, first]
        along = _dot(points - corners[:, first], edge) / np.maximum(_dot(edge, edge), 1e-300)
        share = np.clip(along, 0.0, 1.0)
        place = np.zeros_like(best)
        place[:, first], place[:, second] = 1.0 - share, share
        d2_edge = _squared(points, corners, place)
        closer = d2_edge < best_d2
        best[closer], best_d2[closer] = place[closer], d2_edge[closer]
    return best, np.sqrt(best_d2)


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("ij,ij->i", a, b)


def _squared(points: Array, corners: Array, place: Array) -> Array:
    offset = np.einsum("ij,ijk->ik", place, corners) - points
    return _dot(offset, offset)


def first_least(values: Array, owner: IndexArray) -> IndexArray:
    """Of rows that stand together by owner, the place of the first least value of each owner."""
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    least = np.minimum.reduceat(values, starts)
    group = np.cumsum(np.diff(owner, prepend=owner[0]) != 0)
    hits = np.flatnonzero(values == least[group])
    return hits[np.unique(group[hits], return_index=True)[1]]


def doubled_areas(corners: Array) -> Array:
    """(m, 3) normals of triangles (m, 3, 3), as long as twice their area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
