"""Light from one spacecraft to another that is near.

A spacecraft sends light as few clusters of its patches, small beside their distance from the other
one. Each is seen from the places where the other one gathers light, unless a surface stands in
between: one ray for each place and cluster. Which of them see each other depends on how the two
stand to each other alone, and is known again while they do.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.hemisphere import CELLS_ACROSS, SKY_CELLS, sky_cell
from simgl.radiosity.light_transport import matrix_nbytes
from simgl.radiosity.lobes_to_others import Blocks, SentLobes, blocks_of, sent_lobes
from simgl.radiosity.near_body import NearBody
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.path_pairs import Clusters, PairEntries, SeenPairs
from simgl.rays import ray_tracer

# Clusters are so wide for each metre of their distance from the other spacecraft, and at most so
# many: as many as make so many pairs with its places, within these limits.
_WIDTH, _PAIRS, _LIMITS = 0.25, 800_000, (64, 1024)
# Parts of clusters and blocks of places between which a lobe is even are so much of their distance
# wide; at most so many parts, blocks, and pairs of the two.
_OF_LOBES, _MAX_PARTS, _BLOCKS, _LOBES = 0.1, 1024, (16, 256), 20_000
# Clusters that would fill less of a hemisphere do not count. They are looked for from so many
# places together, few enough for the processor's cache.
_SMALLEST, _ROWS = 1e-6, 2048
# Shares of their distance and turns [rad]: which places see which clusters is known in such steps
# of the pose of one to the other, and how much of a hemisphere those fill in these small ones.
STEP, FINE_STEP = 1.0 / 32.0, 1.0 / 4096.0


@dataclass(frozen=True, kw_only=True, eq=False)
class LightPath:
    """How the light of one body, the sender, comes to another one near a pose.

    samples : (n,) of the sender's that are seen from the receiver, by their numbers among all
    means : (c, n) csr, the mean of those in each cluster
    senders : (c, p) csr, the same of the sender's patches
    ends : (e, 3) where rays to the sender end, in its axes
    at_places, at_patches : where the receiver gathers light, and its patches
    cells : (k,) of the receiver's sky, before which the clusters stand that places see; -1 where
        they stand before the receiver itself
    patches : number of the receiver's
    lobes : of the glossy parts of clusters; None where there are none
    """

    samples: IndexArray
    means: sparse.csr_matrix
    senders: sparse.csr_matrix
    clusters: Clusters
    ends: Array32
    at_places: SeenPairs
    at_patches: SeenPairs
    cells: IndexArray
    patches: int
    lobes: SentLobes | None

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        pairs = len(self.at_places.point) + len(self.at_patches.point)
        of_lobes = 0 if self.lobes is None else 8 * pairs + matrix_nbytes(self.lobes.means)
        return 48 * pairs + self.cells.nbytes + matrix_nbytes(self.means) + of_lobes

    def means_of_patches(self, weights: Array32) -> sparse.csr_matrix:
        """(c, p) csr, of what is alike on each of the sender's patches, the mean in each cluster by
        weights (n,) of the samples."""
        entries = self.means.data * np.take(weights, self.means.indices)
        patch = np.take(self.samples // SAMPLES, self.means.indices)
        return sparse.csr_matrix((entries, patch, self.means.indptr), shape=self.senders.shape)

    @cached_property
    def clusters_at_places(self) -> PairEntries:
        """(s, c) the clusters that places see."""
        shape = len(self.at_places.points), len(self.clusters.areas)
        return self.at_places.entries(self.at_places.cluster, shape)

    @cached_property
    def clusters_at_patches(self) -> PairEntries:
        """(q, c) those that patches see."""
        return self.at_patches.entries(
            self.at_patches.cluster, (self.patches, len(self.clusters.areas))
        )

    @cached_property
    def lobes_at_places(self) -> PairEntries:
        """(s, l) the lobes of clusters that places see, where there are any."""
        assert self.lobes is not None
        rows, blocks = len(self.at_places.points), self.lobes.blocks.of_places
        return self.lobes.entries(self.at_places, rows, blocks)

    @cached_property
    def lobes_at_patches(self) -> PairEntries:
        """(q, l) those that patches see."""
        assert self.lobes is not None
        return self.lobes.entries(self.at_patches, self.patches, self.lobes.blocks.of_points)

    @cached_property
    def sky_at_places(self) -> PairEntries:
        """(s, 96) the cells of the sky behind them."""
        return self.at_places.entries(self.cells, (len(self.at_places.points), SKY_CELLS))

    @cached_property
    def patches_at_places(self) -> PairEntries:
        """(s, q) the receiver's own patches behind them."""
        shape = len(self.at_places.points), self.patches
        return self.at_places.entries(self.at_places.behind, shape)

    @cached_property
    def patches_at_patches(self) -> PairEntries:
        """(q, q) the same, as patches see them."""
        return self.at_patches.entries(self.at_patches.behind, (self.patches, self.patches))


@dataclass(frozen=True, kw_only=True, eq=False)
class PosedPath:
    """A light path at a pose of its bodies to each other.

    sender_from_receiver : (4, 4) between their axes
    """

    path: LightPath
    sender_from_receiver: Array

    @cached_property
    def to_patches(self) -> sparse.csr_matrix:
        """(q, c) csr, share of the hemisphere above a patch that a cluster fills, weighted by the
        cosine."""
        return self.path.clusters_at_patches.matrix(self._to_patches)

    @cached_property
    def to_places(self) -> sparse.csr_matrix:
        """(s, c) csr, the same of the places."""
        return self.path.clusters_at_places.matrix(self._to_places)

    @cached_property
    def lobes_to_patches(self) -> sparse.csr_matrix:
        """(q, l) csr, the same of the lobes of clusters at patches."""
        return self.path.lobes_at_patches.matrix(self._to_patches)

    @cached_property
    def lobes_to_places(self) -> sparse.csr_matrix:
        """(s, l) csr, the same of the places."""
        return self.path.lobes_at_places.matrix(self._to_places)

    @cached_property
    def hides(self) -> sparse.csr_matrix:
        """(s, 96) csr, of which the sender stands before each cell of the receiver's sky."""
        return self.path.sky_at_places.matrix(self._to_places)

    @cached_property
    def hides_from_patches(self) -> sparse.csr_matrix:
        """(q, q) csr, of which the sender stands before each patch of the receiver."""
        return self.path.patches_at_patches.matrix(self._to_patches)

    @cached_property
    def hides_from_places(self) -> sparse.csr_matrix:
        """(s, q) csr, the same of the places."""
        return self.path.patches_at_places.matrix(self._to_places)

    @cached_property
    def _to_patches(self) -> Array32:
        return self.path.at_patches.shares(self._clusters)

    @cached_property
    def _to_places(self) -> Array32:
        return self.path.at_places.shares(self._clusters)

    @cached_property
    def _clusters(self) -> Clusters:
        return self.path.clusters.seen_from(self.sender_from_receiver)

    @property
    def nbytes(self) -> int:
        """Size of its matrices."""
        return 12 * (len(self.path.at_places.point) + len(self.path.at_patches.point))


def light_path(receiver: NearBody, sender: NearBody, sender_from_receiver: Array) -> LightPath:
    """How light comes from the sender to the receiver near a pose.

    sender_from_receiver : (4, 4) between their axes
    """
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    open_ = _towards(sender, receiver, turn, shift)
    samples, part = sender.samples[3][open_], sender.samples[2][open_]
    number, finer = _clustered(receiver, sender, open_, sender_from_receiver)
    count = int(number.max(initial=-1)) + 1
    areas = np.bincount(number, part, minlength=count)
    means = sparse.csr_matrix(
        ((part / areas[number]).astype(np.float32), (number, np.arange(len(number)))),
        shape=(count, len(number)),
    )
    of_patch = sparse.csr_matrix(
        (np.ones(len(samples), dtype=np.float32), (np.arange(len(samples)), samples // SAMPLES)),
        shape=(len(samples), len(sender.transport.areas)),
    )
    clusters = Clusters(
        middle=(means @ sender.samples[0][open_]).astype(np.float32),
        facing=unit_rows(means @ sender.samples[1][open_]).astype(np.float32),
        areas=areas.astype(np.float32),
    )
    ends = _Ends.of(sender.samples[0][open_], number, count)
    places, outwards, _ = receiver.places
    every = np.arange(len(places))
    pose = receiver, sender, sender_from_receiver
    at_places = _seen(pose, (places, outwards), (every, np.ones_like(places[:, 0])), clusters, ends)
    at, chosen = _samples_for(*pose)
    parts = (1.0 / np.bincount(at)[at]).astype(np.float32)
    points, normals = receiver.samples[0][chosen], receiver.samples[1][chosen]
    at_patches = _seen(pose, (points, normals), (at, parts), clusters, ends)
    ways = clusters.seen_from(sender_from_receiver).middle[at_places.cluster]
    ways -= places[at_places.point]
    cells = sky_cell(ways.astype(np.float64), CELLS_ACROSS)
    return LightPath(
        samples=samples,
        means=means,
        senders=(means @ of_patch).tocsr(),
        clusters=clusters,
        ends=ends.points,
        at_places=at_places,
        at_patches=at_patches,
        cells=np.where(at_places.behind < 0, cells, -1),
        patches=len(receiver.transport.areas),
        lobes=sent_lobes(sender, open_, number, finer, partial(_blocks, pose, points)),
    )


def _blocks(pose: tuple[NearBody, NearBody, Array], points: Array32, parts: int) -> Blocks:
    """Of the places of a receiver and of points (n, 3) of its patches, for so many parts of a
    sender."""
    receiver, sender, sender_from_receiver = pose
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    places = receiver.places[0]
    both = np.concatenate([places, points])
    distance = np.maximum(_distance(sender, both @ turn.T + shift), _nearest(receiver, sender))
    limit = int(np.clip(_LOBES // parts, *_BLOCKS))
    number = clusters_of(both, np.zeros_like(both), _OF_LOBES * distance, limit)
    return blocks_of(places, points, number)


def _clustered(
    receiver: NearBody, sender: NearBody, open_: IndexArray, sender_from_receiver: Array
) -> tuple[IndexArray, IndexArray]:
    """(n,) number of the cluster of each of some samples of the sender, and of the smaller part."""
    if len(open_) == 0:
        return open_, open_
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    points, normals = sender.samples[0][open_], sender.samples[1][open_]
    distance = np.maximum(_distance(receiver, (points - shift) @ turn), _nearest(receiver, sender))
    limit = int(np.clip(_PAIRS // len(receiver.places[0]), *_LIMITS))
    return (
        clusters_of(points, normals, _WIDTH * distance, limit),
        clusters_of(points, normals, _OF_LOBES * distance, _MAX_PARTS),
    )


def _distance(body: NearBody, points: Array) -> Array:
    """(n,) of points in its axes from the box around a body [m]."""
    corners = body.model.posed_mesh.hull
    low, high = corners.min(axis=0), corners.max(axis=0)
    return np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)


def _samples_for(
    receiver: NearBody, sender: NearBody, sender_from_receiver: Array
) -> tuple[IndexArray, IndexArray]:
    """Patch and sample point of the receiver for each place where its patches get light: one of a
    small patch, all of a large one."""
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    patch = receiver.samples[3] // SAMPLES
    centres, radii = receiver.transport.patch_spheres
    distance = _distance(sender, centres @ turn.T + shift)
    large = radii > _WIDTH * np.maximum(distance, _nearest(receiver, sender))
    first = np.concatenate([[True], patch[1:] != patch[:-1]])
    chosen = np.flatnonzero(first | large[patch])
    return patch[chosen], chosen


def _nearest(one: NearBody, other: NearBody) -> float:
    """Distance below which nothing is resolved [m]."""
    return 0.05 * min(one.model.posed_mesh.radius, other.model.posed_mesh.radius)


def _towards(sender: NearBody, receiver: NearBody, turn: Array, shift: Array) -> IndexArray:
    """The samples of the sender that see any of a few points of the receiver.

    Others, deep inside of it, would stand for clusters that are seen, or hide those they are in.
    """
    points, normals, _, _ = sender.samples
    mesh = receiver.model.posed_mesh
    corners = np.stack([mesh.hull.min(axis=0), mesh.hull.max(axis=0)])
    around = _eight(corners)
    looks = np.concatenate([mesh.centre[None], 0.5 * (mesh.centre + around), around])
    tracer = ray_tracer(sender.model.posed_mesh)
    seen = np.zeros(len(points), dtype=np.bool_)
    for look in looks @ turn.T + shift:
        way = look - points
        rest = np.flatnonzero(~seen & (np.einsum("ij,ij->i", way, normals) > 0.0))
        reach = np.ones(len(rest), dtype=np.float32)
        seen[rest] = ~tracer.occluded(points[rest], way[rest], reach)
    return np.flatnonzero(seen)


def _eight(corners: Array) -> Array:
    """(8, 3) corners of the box between two of them (2, 3)."""
    return np.stack([c.ravel() for c in np.meshgrid(*corners.T)], axis=1)


def clusters_of(points: Array32, normals: Array32, widths: Array, limit: int) -> IndexArray:
    """(n,) number of the cluster of each sample: those of one cell of space that face alike.

    widths : (n,) of cells, at least [m]
    limit : of the number of clusters
    """
    axis = np.argmax(np.abs(normals), axis=1)
    side = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0.0)
    low = points.min(axis=0)
    # One cell of this edge holds all of them.
    largest = int(np.ceil(np.log2(max(float((points.max(axis=0) - low).max()), 1e-6)))) + 1
    wider = 1.0
    while True:
        level = np.minimum(np.ceil(np.log2(wider * widths)).astype(np.int64), largest)
        cell = ((points - low) / np.exp2(level)[:, None]).astype(np.int64)
        across = int(cell.max()) + 1
        key = (level - level.min()) * 6 + side
        for place in cell.T:
            key = key * across + place
        _, number = np.unique(key, return_inverse=True)
        if int(number.max()) < limit:
            return np.asarray(number, dtype=np.int64)
        wider *= 1.3


@dataclass(frozen=True, kw_only=True, eq=False)
class _Ends:
    """Where rays to clusters end: (n, 3) points of their surfaces, sender's axes, those of one
    cluster from ``first`` (c + 1,) on."""

    points: Array32
    first: IndexArray

    @classmethod
    def of(cls, points: Array32, number: IndexArray, count: int) -> _Ends:
        """Of points by the numbers (n,) of their clusters."""
        order = np.argsort(number, kind="stable")
        return cls(points=points[order], first=np.searchsorted(number[order], np.arange(count + 1)))


def _seen(
    pose: tuple[NearBody, NearBody, Array],
    points: tuple[Array32, Array32],
    rows: tuple[IndexArray, Array32],
    clusters: Clusters,
    ends: _Ends,
) -> SeenPairs:
    """The clusters that points of a receiver see.

    pose : receiver, sender, and (4, 4) to the sender's axes from the receiver's
    points : (n, 3) and their normals
    rows : of each point, and its part of its row
    """
    receiver, sender, sender_from_receiver = pose
    starts, normals = points
    point, cluster = _facing(starts, normals, clusters.seen_from(sender_from_receiver))
    # Neighbouring points look at different places of a cluster: what hides a part of it hides it
    # from as many.
    number = np.diff(ends.first)[cluster]
    end = ends.first[cluster] + (point * 7 + cluster * 3) % number
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    far = ((ends.points - shift) @ turn).astype(np.float32)
    for body, origins, goals in (
        (receiver, starts, far),
        (sender, (starts @ turn.T + shift).astype(np.float32), ends.points),
    ):
        begin = np.take(origins, point, axis=0)
        ways = np.take(goals, end, axis=0) - begin
        reach = np.full(len(point), 1.0 - 1e-3, dtype=np.float32)
        seen = np.flatnonzero(~ray_tracer(body.model.posed_mesh).occluded(begin, ways, reach))
        point, cluster, end = point[seen], cluster[seen], end[seen]
    behind = receiver.patches_met(far[end], far[end] - starts[point])
    return SeenPairs(
        points=starts,
        normals=normals,
        rows=rows[0],
        parts=rows[1],
        point=point.astype(np.int32),
        cluster=cluster.astype(np.int32),
        end=end.astype(np.int32),
        behind=behind.astype(np.int32),
    )


def _facing(places: Array32, normals: Array32, clusters: Clusters) -> tuple[IndexArray, IndexArray]:
    """Pairs of a place and a cluster that face each other, where the cluster would fill more than
    ``_SMALLEST`` of the hemisphere; place by place."""
    nothing = np.zeros(0, dtype=np.int64)
    if len(clusters.areas) == 0:
        return nothing, nothing
    # About a point near both, where float32 tells small distances.
    origin = clusters.middle.mean(axis=0)
    middle, facing, areas = clusters.middle - origin, clusters.facing, clusters.areas
    beyond = np.linalg.norm(middle, axis=1).max()
    # Most places look away from all clusters.
    open_ = np.flatnonzero(np.einsum("ij,ij->i", normals, places - origin) < beyond)
    pairs = [(nothing, nothing)]
    for at in range(0, len(open_), _ROWS):
        rows = open_[at : at + _ROWS]
        here, outwards = places[rows] - origin, normals[rows]
        square = np.sum(middle**2, axis=1) + np.sum(here**2, axis=1)[:, None]
        square = np.maximum(square - 2.0 * here @ middle.T, np.float32(1e-9))
        facing_it = np.maximum(outwards @ middle.T - np.sum(here * outwards, axis=1)[:, None], 0.0)
        faced = np.maximum(here @ facing.T - np.sum(middle * facing, axis=1), 0.0)
        smallest = _SMALLEST * square * (np.float32(np.pi) * square + areas)
        place, cluster = np.nonzero(facing_it * faced * areas > smallest)
        pairs.append((rows[place], cluster))
    place, cluster = (np.concatenate(numbers) for numbers in zip(*pairs, strict=True))
    return place, cluster
