"""Fewer triangles over the same vertices: edges are collapsed onto one of their ends.

Rounds of collapses that do not touch each other, the cheapest of each neighbourhood first, ordered
by quadrics (Garland & Heckbert 1997). What a collapse may do is decided by the vertices that it has
taken away, now and before: each must lie near what is left, with nearly its normal, its place in
the images and its other values there. Vertices of one place but another normal or material stay
apart: a crease or the border of a material collapses only along itself, on both of its sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from simgl.arrays import Array, IndexArray, Mask
from simgl.levels.triangles import Lists, doubled_areas, first_least, nearest_place

# Root mean square of the angle by which normals may turn where their vertex has gone [rad].
NORMALS_TURN = 0.04
# Means of values over what a vertex stands for keep to this: a chord over a hollow curve adds up.
MEANS_SHIFT = 0.15
# A triangle turns by less than this at a time: cosine.
_LEAST_COSINE = 0.5
# What quadrics and planes tell of an error is larger than it: the end of a chord lies four times as
# far from the other end's tangent as its middle from the arc.
_SLACK = 4.0
# Rounds end where they decide on less than this share of the triangles.
_LEAST_PROGRESS = 1e-2


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """What is simplified, by vertex.

    positions : (n, 3) [m]
    normals : (n, 3)
    triangles : (m, 3)
    labels : (n,) vertices with different ones never stand for each other
    groups : (n,) vertices of different ones are apart even at one place
    values : (n, k) what must stay the same to within 1, root mean square, and ``MEANS_SHIFT``
    places : (n, j) what must stay the same to within the allowed error; in metres along the surface
    """

    positions: Array
    normals: Array
    triangles: IndexArray
    labels: IndexArray
    groups: IndexArray
    values: Array
    places: Array


class Collapser:
    """A surface that gets coarser with each call; ``triangles`` are those of now.

    home : (n,) vertex that stands for each
    frozen : (shells,) connected pieces that stay as they are
    held : (points,) places that stay
    """

    def __init__(self, surface: Surface) -> None:
        self._s = s = surface
        self.point = _numbers(s.positions, s.groups[:, None])
        # Vertices that are the same in all stand for one another.
        whole = (s.positions, s.normals, s.values, s.places, s.labels[:, None], s.groups[:, None])
        same = _numbers(*whole)
        first = np.unique(same, return_index=True)[1]
        self.original = first[same][s.triangles]
        self.count = int(self.point.max()) + 1
        corners = s.positions[self.original]
        self.original = self.original[np.linalg.norm(doubled_areas(corners), axis=1) > 0.0]
        self.shell = self._shells()
        self.triangles = self.original
        self.home = first[same]
        self.frozen = np.zeros(int(self.shell.max()) + 1, dtype=np.bool_)
        self.held = np.zeros(self.count, dtype=np.bool_)
        self._place = np.zeros((self.count, 3))
        self._place[self.point] = s.positions
        self._weight = self._vertex_areas()
        self._quadric, self._quadric_weight = self._quadrics()

    def _shells(self) -> IndexArray:
        """(points,) number of the connected piece that each is part of."""
        w = self.point[self.original]
        pairs = np.concatenate([w[:, :2], w[:, 1:]])
        graph = sparse.coo_matrix((np.ones(len(pairs)), pairs.T), shape=(self.count,) * 2)
        return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)

    def _vertex_areas(self) -> Array:
        areas = np.linalg.norm(doubled_areas(self._s.positions[self.original]), axis=1) / 6.0
        count = len(self._s.positions)
        return np.bincount(self.original.ravel(), np.repeat(areas, 3), count).astype(np.float64)

    def _quadrics(self) -> tuple[Array, Array]:
        """(points, 4, 4) sums of squared distances to planes, (points,) their weights [m2]."""
        corners = self._s.positions[self.original]
        doubled = doubled_areas(corners)
        area = np.linalg.norm(doubled, axis=1)
        normal = doubled / area[:, None]
        rows = [self.point[self.original].T.ravel()]
        planes = [np.tile(_plane(normal, corners[:, 0]), (3, 1))]
        weights = [np.tile(area, 3)]
        # Where normals or materials change, the line stays too: planes upright on both triangles.
        edges = _edges(self.original, self.point, self.count)
        line = (edges.other >= 0) & (edges.va != edges.va2)
        triangle = np.flatnonzero(line) // 3
        ends = self._s.positions[edges.va[line]], self._s.positions[edges.vb[line]]
        along = ends[1] - ends[0]
        length = np.linalg.norm(along, axis=1)
        upright = np.cross(normal[triangle], along) / np.maximum(length, 1e-30)[:, None]
        for end in (edges.a, edges.b):
            rows.append(end[line])
            planes.append(_plane(upright, ends[0]))
            weights.append(length**2)
        row, plane, weight = np.concatenate(rows), np.concatenate(planes), np.concatenate(weights)
        flat = np.einsum("i,ij,ik->ijk", weight, plane, plane).reshape(-1, 16)
        adding = sparse.coo_matrix(
            (np.ones(len(row)), (row, np.arange(len(row)))), shape=(self.count, len(row))
        ).tocsr()
        return (adding @ flat).reshape(-1, 4, 4), adding @ weight

    def reduce(self, error: float) -> None:
        """Collapse what keeps all that has gone within an error [m]."""
        still = self.frozen[self.shell_of(self.triangles)]
        rest, self.triangles = self.triangles[still], self.triangles[~still]
        banned = np.zeros(0, dtype=np.int64)
        tried = len(self.triangles)
        while tried > _LEAST_PROGRESS * len(self.triangles):
            taken, refused = self._round(error, banned)
            banned = np.sort(np.concatenate([banned, refused]))
            tried = taken + len(refused)
        self.triangles = self._sorted(np.concatenate([rest, self.triangles]))

    def _round(self, error: float, banned: IndexArray) -> tuple[int, IndexArray]:
        """One round: how many were collapsed, and the edges that may not be."""
        edges = _edges(self.triangles, self.point, self.count)
        chosen = self._candidates(edges, error, banned)
        if len(chosen) == 0:
            return 0, chosen
        fit = self._keeps_topology(edges, chosen) & self._keeps_facing(edges, chosen, error)
        refused = [edges.key[chosen[~fit]]]
        chosen = chosen[fit]
        if len(chosen) == 0:
            return 0, refused[0]
        chosen = self._apart(edges, chosen)
        near = self._keeps_near(edges, chosen, error)
        refused.append(edges.key[chosen[~near]])
        self._collapse(edges, chosen[near])
        return int(near.sum()), np.concatenate(refused)

    def _candidates(self, edges: _Edges, error: float, banned: IndexArray) -> IndexArray:
        """The best half edge of each point that may leave, cheapest first."""
        s = self._s
        used = np.bincount(self.triangles.ravel(), minlength=len(s.positions)) > 0
        wedges = np.bincount(self.point[used], minlength=self.count)
        locked = np.zeros(self.count, dtype=np.bool_)
        locked[edges.a[edges.other < 0]] = locked[edges.b[edges.other < 0]] = True
        locked |= self.frozen[self.shell] | self.held
        smooth = (edges.va == edges.va2) & (edges.vb == edges.vb2) & (wedges[edges.a] == 1)
        along = (edges.va != edges.va2) & (wedges[edges.a] == 2)
        allowed = (edges.other >= 0) & ~locked[edges.a] & (smooth | along)
        allowed &= s.labels[edges.va] == s.labels[edges.vb]
        allowed &= s.labels[edges.va2] == s.labels[edges.vb2]
        rows = np.flatnonzero(allowed)
        rows = rows[~_among(edges.key[rows], banned)]
        a, b = edges.a[rows], edges.b[rows]
        to = np.concatenate([self._place[b], np.ones((len(b), 1))], axis=1)
        squared = np.einsum("ij,ijk,ik->i", to, self._quadric[a], to) / self._quadric_weight[a]
        length = np.linalg.norm(self._place[b] - self._place[a], axis=1)
        turn = np.maximum(
            np.linalg.norm(s.normals[edges.va[rows]] - s.normals[edges.vb[rows]], axis=1),
            np.linalg.norm(s.normals[edges.va2[rows]] - s.normals[edges.vb2[rows]], axis=1),
        )
        # The second term is the height of an arc with such normals at its ends.
        cost = np.sqrt(np.maximum(squared, 0.0)) + 0.125 * length * turn
        cheap = cost <= _SLACK * error
        rows, cost = rows[cheap], cost[cheap]
        order = np.lexsort((edges.b[rows], cost))
        rows, cost = rows[order], cost[order]
        best = np.unique(edges.a[rows], return_index=True)[1]
        rows, cost = rows[best], cost[best]
        # Much the same costs go in a scattered order: in one of place, only the first could go.
        coarse = np.ceil(2.0 * np.log2(np.maximum(cost / error, 1e-3)))
        scattered = (edges.a[rows] * 2654435761) % (1 << 32)
        return rows[np.lexsort((scattered, coarse))]

    def _apart(self, edges: _Edges, chosen: IndexArray) -> IndexArray:
        """Those of which no other, cheaper one touches the same triangles."""
        rank = np.arange(len(chosen))
        touched = np.full(self.count, len(chosen))
        np.minimum.at(touched, edges.a[chosen], rank)
        np.minimum.at(touched, edges.b[chosen], rank)
        corners = self.point[self.triangles]
        least = np.full(self.count, len(chosen))
        np.minimum.at(least, corners.ravel(), np.repeat(touched[corners].min(axis=1), 3))
        free = (least[edges.a[chosen]] == rank) & (least[edges.b[chosen]] == rank)
        return chosen[free]

    def _keeps_topology(self, edges: _Edges, chosen: IndexArray) -> Mask:
        """Whether the two ends have no more than two neighbours in common."""
        owner, row = edges.leaving.of(edges.a[chosen])
        there = edges.has(edges.b[chosen][owner], edges.b[row])
        return np.bincount(owner, there, minlength=len(chosen)) == 2

    def _keeps_facing(self, edges: _Edges, chosen: IndexArray, error: float) -> Mask:
        """Whether no triangle that stays turns far, or is lifted off its plane."""
        owner, row = edges.leaving.of(edges.a[chosen])
        tri = row // 3
        old = self.point[self.triangles[tri]]
        a, b = edges.a[chosen][owner], edges.b[chosen][owner]
        stays = ~np.any(old == b[:, None], axis=1)
        owner, tri, old, a, b = (x[stays] for x in (owner, tri, old, a, b))
        new = np.where(old == a[:, None], b[:, None], old)
        before, after = (doubled_areas(self._place[p]) for p in (old, new))
        lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        facing = np.einsum("ij,ij->i", before, after) > _LEAST_COSINE * lengths
        rise = np.einsum("ij,ij->i", before, self._place[b] - self._place[a])
        facing &= np.abs(rise) <= _SLACK * error * np.linalg.norm(before, axis=1)
        return np.bincount(owner, ~facing, minlength=len(chosen)) == 0

    def _moves(
        self, edges: _Edges, chosen: IndexArray
    ) -> tuple[IndexArray, IndexArray, IndexArray]:
        """Vertices that go, those that stand for them, and which of ``chosen`` does it."""
        which = np.arange(len(chosen))
        rows = (edges.va[chosen], edges.vb[chosen]), (edges.va2[chosen], edges.vb2[chosen])
        old = np.concatenate([rows[0][0], rows[1][0]])
        new = np.concatenate([rows[0][1], rows[1][1]])
        return old, new, np.concatenate([which, which])

    def _keeps_near(self, edges: _Edges, chosen: IndexArray, error: float) -> Mask:
        """Whether all vertices that the collapses concern keep near to what is left."""
        s, old_new = self._s, self._moves(edges, chosen)
        remap = np.arange(len(s.positions))
        remap[old_new[0]] = old_new[1]
        triangles = _whole(remap[self.triangles], self.point)
        cause = np.full(len(s.positions), -1)
        cause[old_new[1]] = old_new[2]
        home = remap[self.home]
        gone = np.flatnonzero((cause[home] >= 0) & (self._weight > 0.0))
        at = Lists(triangles.ravel(), len(s.positions))
        gone = gone[at.counts(home[gone]) > 0]
        owner, corner = at.of(home[gone])
        candidates = triangles[corner // 3]
        place, distance = nearest_place(s.positions[gone[owner]], s.positions[candidates])
        best = first_least(distance, owner)
        place, corners = place[best][:, :, None], candidates[best]
        far = distance[best] > error
        n = (place * s.normals[corners]).sum(axis=1)
        n /= np.maximum(np.linalg.norm(n, axis=1), 1e-9)[:, None]
        length = np.maximum(np.linalg.norm(s.normals[gone], axis=1), 1e-9)[:, None]
        off = np.sum((n - s.normals[gone] / length) ** 2, axis=1) / NORMALS_TURN**2
        for values, unit in ((s.values, 1.0), (s.places, error)):
            change = ((place * values[corners]).sum(axis=1) - values[gone]) / unit
            off = np.maximum(off, np.max(change**2, axis=1, initial=0.0))
        to, weight = home[gone], self._weight[gone]
        total = np.bincount(to, weight, minlength=len(s.positions))
        mean = np.bincount(to, weight * off, minlength=len(s.positions)) / np.maximum(total, 1e-300)
        bad = far | (mean[to] > 1.0)
        change = (place * s.values[corners]).sum(axis=1) - s.values[gone]
        for column in change.T:
            shift = np.bincount(to, weight * column, minlength=len(s.positions))
            bad |= (np.abs(shift) > MEANS_SHIFT * total)[to]
        return np.bincount(cause[to], bad, minlength=len(chosen)) == 0

    def _collapse(self, edges: _Edges, chosen: IndexArray) -> None:
        old, new, _ = self._moves(edges, chosen)
        remap = np.arange(len(self._s.positions))
        remap[old] = new
        self.triangles = _whole(remap[self.triangles], self.point)
        self.home = remap[self.home]
        a, b = edges.a[chosen], edges.b[chosen]
        np.add.at(self._quadric, b, self._quadric[a])
        np.add.at(self._quadric_weight, b, self._quadric_weight[a])

    def state(self) -> tuple[IndexArray, IndexArray, Array, Array]:
        """What `restore` takes."""
        return self.triangles, self.home, self._quadric.copy(), self._quadric_weight.copy()

    def restore(
        self, state: tuple[IndexArray, IndexArray, Array, Array], shells: IndexArray
    ) -> None:
        """Put some shells back to where they were."""
        triangles, home, quadric, weight = state
        back = np.zeros(len(self.frozen), dtype=np.bool_)
        back[shells] = True
        now = back[self.shell_of(self.triangles)]
        kept = np.concatenate([self.triangles[~now], triangles[back[self.shell_of(triangles)]]])
        self.triangles = self._sorted(kept)
        self.home = np.where(back[self.shell[self.point]], home, self.home)
        points = back[self.shell]
        self._quadric[points], self._quadric_weight[points] = quadric[points], weight[points]

    def _sorted(self, triangles: IndexArray) -> IndexArray:
        """In the order of the shells, so that the order tells nothing of what was tried."""
        return triangles[np.argsort(self.shell_of(triangles), kind="stable")]

    def shell_of(self, triangles: IndexArray) -> IndexArray:
        """(m,) the connected piece of each triangle."""
        return self.shell[self.point[triangles[:, 0]]]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Edges:
    """The three half edges of each triangle, one after the other.

    a, b : points from and to; va, vb : vertices
    other : half edge the other way, -1 where there is not exactly one of each
    va2, vb2 : the vertices of a and b in the triangle on the other side
    key : one number for each pair of points
    leaving : half edges by the point that they leave
    """

    a: IndexArray
    b: IndexArray
    va: IndexArray
    vb: IndexArray
    other: IndexArray
    va2: IndexArray
    vb2: IndexArray
    key: IndexArray
    leaving: Lists
    count: int
    sorted_keys: IndexArray

    def has(self, a: IndexArray, b: IndexArray) -> Mask:
        """Whether there is an edge from one point to another."""
        return _among(a * self.count + b, self.sorted_keys)


def _edges(triangles: IndexArray, point: IndexArray, count: int) -> _Edges:
    va, vb = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    a, b = point[va], point[vb]
    key = a * count + b
    order = np.argsort(key, kind="stable")
    keys = key[order]
    single = np.ones(len(keys), dtype=np.bool_)
    single[1:] &= keys[1:] != keys[:-1]
    single[:-1] &= keys[:-1] != keys[1:]
    at = np.minimum(np.searchsorted(keys, b * count + a), len(keys) - 1)
    alone = np.zeros(len(keys), dtype=np.bool_)
    alone[order] = single
    found = (keys[at] == b * count + a) & single[at] & alone
    other = np.where(found, order[at], -1)
    return _Edges(
        a=a, b=b, va=va, vb=vb, other=other, va2=vb[other], vb2=va[other], key=key,
        leaving=Lists(a, count), count=count, sorted_keys=keys,
    )  # fmt: skip


def _among(keys: IndexArray, ordered: IndexArray) -> Mask:
    """Whether each key is one of some that are in order."""
    if len(ordered) == 0:
        return np.zeros(len(keys), dtype=np.bool_)
    at = np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)
    return ordered[at] == keys


def _plane(normal: Array, through: Array) -> Array:
    """(n, 4) coefficients of planes."""
    return np.column_stack([normal, -np.einsum("ij,ij->i", normal, through)])


def _whole(triangles: IndexArray, point: IndexArray) -> IndexArray:
    """Those with three different corners."""
    w = point[triangles]
    kept = (w[:, 0] != w[:, 1]) & (w[:, 1] != w[:, 2]) & (w[:, 2] != w[:, 0])
    return triangles[kept]


def _numbers(*columns: NDArray[np.generic]) -> IndexArray:
    """(n,) the same number for rows that are the same."""
    # Adding zero makes -0 and 0 the same bytes.
    rows = np.column_stack([np.asarray(c, dtype=np.float64) for c in columns]) + 0.0
    whole = np.ascontiguousarray(rows).view(np.dtype((np.void, rows.shape[1] * 8))).ravel()
    return np.asarray(np.unique(whole, return_inverse=True)[1], dtype=np.int64).ravel()
