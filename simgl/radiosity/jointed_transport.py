"""Light between the surfaces of a body whose joints move.

What each rigid group does to its own light is traced once, finely, with all other groups away. For
a pose, the rays of the patches of each group are tested against every other group
(simgl/radiosity/rigid_pairs.py): seen from a group they always go the same way, and what another
group does is to end some of them earlier.

Vertices keep what their own group gives them. What other groups add to it, and take away from it,
is known at the patches, and interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import permutations

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.lru_cache import LruCache
from simgl.motion.joints import Joint
from simgl.radiosity.bake import patch_directions
from simgl.radiosity.gather_points import BURIED, face_normals
from simgl.radiosity.hemisphere import SKY_CELLS, sky_cell
from simgl.radiosity.light_transport import Between, LightTransport, by_columns
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.posed_transport import PosedTransport
from simgl.radiosity.rigid_pairs import (
    NOWHERE,
    Ends,
    PatchRays,
    Target,
    ends,
    joints_between,
    other_from_this,
)
from simgl.rays import group_tracers
from simgl.scene.posed_mesh import PosedMesh

# Pairs of groups whose rays stay in memory, and their bytes: 50 groups make 2450 at each pose.
_MAX_PAIRS = 20_000
_PAIR_BYTES = 128 << 20

_Pair = tuple[int, int, tuple[float, ...]]
_Sides = tuple[list[int], list[int]]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointedTransport:
    """A body whose rigid groups were traced one by one.

    separate : how light goes with each group by itself, as stored. Its cells of the sky are those
        in the axes of the first group, then those of the second ...
    joints : of the body
    group_of_patch : (p,) index among the rigid groups of the mesh
    reach : (p, n, k) how far the rays of the patches go [m]; 0 where they do not count
    target : (p, n, k) the patch that they meet, -1 - cell for the sky, or ``NOWHERE``
    spread : (r, p) csc, mean of the patches about each vertex, on each of its sides
    """

    separate: LightTransport
    joints: tuple[Joint, ...]
    group_of_patch: IndexArray
    reach: Array32
    target: IndexArray
    spread: sparse.csc_matrix
    _ends: LruCache[_Pair, Ends] = field(
        default_factory=lambda: LruCache[_Pair, Ends](_MAX_PAIRS, max_bytes=_PAIR_BYTES), init=False
    )

    @property
    def nbytes(self) -> int:
        """Size of its arrays, of what is derived from them at the first use, and of the pairs."""
        directions = 3 * self.reach.nbytes
        return self.separate.nbytes + 3 * self.reach.nbytes + directions + _PAIR_BYTES

    @cached_property
    def _rays(self) -> tuple[PatchRays, ...]:
        """The rays of each group."""
        separate, each = self.separate, self.reach.shape[2]
        spread = patch_directions(separate.normals.astype(np.float64), SAMPLES * each)
        directions = spread.reshape(-1, each, 3).astype(np.float32)
        of_point = np.repeat(self.group_of_patch, SAMPLES)
        points = [np.flatnonzero(of_point == g) for g in range(len(self._targets))]
        return tuple(
            PatchRays(
                point=point,
                origins=separate.points.reshape(-1, 3)[point],
                normals=separate.normals.reshape(-1, 3)[point],
                directions=directions[point],
                reach=self.reach.reshape(-1, each)[point],
            )
            for point in points
        )

    @cached_property
    def _between(self) -> dict[tuple[int, int], _Sides]:
        """The joints between each two groups."""
        index = [target.group.index for target in self._targets]
        pairs = permutations(range(len(index)), 2)
        return {(i, j): joints_between(self.joints, index[i], index[j]) for i, j in pairs}

    @cached_property
    def _targets(self) -> tuple[Target, ...]:
        """The groups as rays meet them."""
        mesh = self.separate.mesh
        faces = face_normals(mesh)[0].astype(np.float32)
        of_side = self.separate.patch_of_side.reshape(self.separate.sides, -1)
        return tuple(
            Target(group=group, tracer=tracer, faces=faces, patch_of_side=of_side)
            for group, tracer in group_tracers(mesh, self.joints)
        )

    @cached_property
    def _sky_rays(self) -> sparse.csc_matrix:
        """(p, c) csc, share of the rays of each patch that go to each cell of the sky, were they
        free."""
        count, rays_each = len(self.separate.areas), self.reach[0].size
        columns = np.empty((count * SAMPLES, self.reach.shape[2]), dtype=np.int64)
        for group, rays in enumerate(self._rays):
            cells = sky_cell(rays.directions.astype(np.float64))
            columns[rays.point] = group * SKY_CELLS + cells
        columns = columns.reshape(count, rays_each)
        weight = np.full(count, 1.0 / rays_each, dtype=np.float32)
        everywhere = np.ones(columns.shape, dtype=np.bool_)
        return by_columns(_summed(columns, everywhere, weight, self.separate.sky.shape[1]))

    def at(self, posed: PosedMesh, values: Sequence[float]) -> PosedTransport:
        """The transport at a pose; it depends on nothing else.

        posed : the unrefined mesh there; values : of the joints [rad] or [m]
        """
        assert posed.motion is not None
        separate = self.separate
        target, point_open = self._met(values)
        by_rows = shares(target, len(separate.areas), separate.sky.shape[1])
        factors, sky, used = by_columns(by_rows[0]), by_columns(by_rows[1]), by_rows[2]
        light = factors - separate.form_factors
        light.eliminate_zeros()
        sky_lost = separate.sky - sky
        sky_lost.eliminate_zeros()
        groups = [t.group.index for t in self._targets]
        turns, shifts = posed.motion[groups, :3, :3], posed.motion[groups, :3, 3]
        points, normals = separate.points.copy(), separate.normals.copy()
        for group, rays in enumerate(self._rays):
            turn = turns[group].T.astype(np.float32)
            points.reshape(-1, 3)[rays.point] = rays.origins @ turn + shifts[group].astype(
                np.float32
            )
            normals.reshape(-1, 3)[rays.point] = rays.normals @ turn
        changed = {
            "points": points,
            "normals": normals,
            "point_open": point_open,
            "form_factors": factors,
            "sky": sky,
        }
        return PosedTransport(
            **{f.name: getattr(separate, f.name) for f in fields(separate)} | changed,
            key=f"{separate.digest} {posed.digest}",
            body=posed,
            group_turns=turns,
            between=Between(
                spread=_among(self.spread, used > 0),
                light=light,
                sky_lost=sky_lost,
                sky_rays=self._sky_rays,
            ),
            separate=separate.of_vertices,
        )

    def untraced(self, values: Sequence[float]) -> int:
        """How many pairs of groups a pose would trace.

        values : of the joints [rad] or [m]
        """
        return sum(pair not in self._ends for pair in self._pairs(values))

    def trace(self, values: Sequence[float], count: int | None = None) -> None:
        """Trace the pairs of groups at a pose, or so many of them; poses near to it then ask for
        few others.

        values : of the joints [rad] or [m]
        """
        untraced = [pair for pair in self._pairs(values) if pair not in self._ends]
        transforms = self._transforms(values)
        # By what the rays meet: those of the largest group, most of all rays, are spread then.
        for pair in sorted(untraced, key=lambda pair: pair[1])[:count]:
            self._ends_of(pair, transforms)

    def _met(self, values: Sequence[float]) -> tuple[IndexArray, Mask]:
        """(p, n, k) what the rays meet at a pose, and (p, n) the sample points that are outside."""
        reach, target = self.reach.ravel().copy(), self.target.ravel().copy()
        transforms = self._transforms(values)
        for pair in self._pairs(values):
            shorter = self._ends_of(pair, transforms)
            nearer = shorter.reach < reach[shorter.ray]
            ray = shorter.ray[nearer]
            reach[ray], target[ray] = shorter.reach[nearer], shorter.target[nearer]
        met = target.reshape(self.target.shape)
        inside = (met == NOWHERE).mean(axis=2) > BURIED
        point_open = self.separate.point_open & ~inside
        met[~point_open] = NOWHERE
        return met, point_open

    def _transforms(self, values: Sequence[float]) -> list[Array]:
        return [j.transform(v) for j, v in zip(self.joints, values, strict=True)]

    def _pairs(self, values: Sequence[float]) -> list[_Pair]:
        """Two groups each, and the values of the joints between them."""
        return [
            (this, other, tuple(values[index] for side in between for index in side))
            for (this, other), between in self._between.items()
        ]

    def _ends_of(self, pair: _Pair, transforms: Sequence[Array]) -> Ends:
        this, other, _ = pair

        def traced() -> Ends:
            motion = other_from_this(transforms, *self._between[this, other])
            return ends(self._rays[this], self._targets[other], motion)

        return self._ends.get(pair, traced, lambda e: e.nbytes)


def shares(
    target: IndexArray, patches: int, cells: int
) -> tuple[sparse.csr_matrix, sparse.csr_matrix, IndexArray]:
    """Share of the rays of each patch that meet each patch (p, p), that go to each cell of the sky
    (p, c), and how many count (p,).

    target : (p, n, k) see ``JointedTransport``
    """
    flat = target.reshape(patches, -1)
    valid = flat != NOWHERE
    used = valid.sum(axis=1)
    weight = (1.0 / np.maximum(used, 1)).astype(np.float32)
    return (
        _summed(flat, valid & (flat >= 0), weight, patches),
        _summed(-1 - flat, valid & (flat < 0), weight, cells),
        used,
    )


def _summed(columns: IndexArray, chosen: Mask, weight: Array32, width: int) -> sparse.csr_matrix:
    """(p, width) csr: for each row its weight times how often each chosen column occurs in it."""
    number = chosen.sum(axis=1)
    matrix = sparse.csr_matrix(
        (
            np.repeat(weight, number),
            columns[chosen].astype(np.int32),
            np.concatenate([[0], np.cumsum(number)]).astype(np.int32),
        ),
        shape=(len(columns), width),
    )
    matrix.sum_duplicates()
    return matrix


def _among(spread: sparse.csc_matrix, seen: Mask) -> sparse.csc_matrix:
    """Means over some patches only: those that no other part hides wholly."""
    if seen.all():
        return spread
    among = (spread @ sparse.diags_array(seen.astype(np.float32))).tocsc()
    total = np.asarray(among.sum(axis=1)).ravel()
    scale = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
    return by_columns((sparse.diags_array(scale) @ among).astype(np.float32))
