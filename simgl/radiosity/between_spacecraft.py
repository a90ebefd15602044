"""Light from one spacecraft to another that is near.

A spacecraft sends light as few clusters of its patches, small beside their distance from the other
one. Each is seen from the places where the other one gathers light, unless a surface stands in
between: one ray for each place and cluster. Which of them see each other depends on how the two
stand to each other alone, and is known again while they do.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.gather_points import LIFT, unit_rows
from simgl.radiosity.hemisphere import CELLS_ACROSS, SKY_CELLS, sky_cell
from simgl.radiosity.light_transport import LightTransport, matrix_nbytes
from simgl.radiosity.occlusion import inside_others
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.transport_store import lit_mesh
from simgl.rays import RayTracer, ray_tracer
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel

# Clusters are so wide for each metre of their distance from the other spacecraft, and at most so
# many: as many as make so many pairs with its places, within these limits.
_WIDTH, _PAIRS, _LIMITS = 0.25, 800_000, (64, 1024)
# Clusters that would fill less of a hemisphere do not count. They are looked for from so many
# places together, few enough for the processor's cache.
_SMALLEST, _ROWS = 1e-6, 2048
# Poses of one to the other are known in steps of this share of their distance, and this turn [rad].
STEP = 1.0 / 64.0


@dataclass(frozen=True, kw_only=True, eq=False)
class NearBody:
    """A spacecraft with its transport, as others near it see it, in its own axes.

    standing : (s,) of ``standing_rows``
    """

    model: SpacecraftModel
    transport: LightTransport
    standing: IndexArray

    @property
    def key(self) -> tuple[str, str]:
        """Equal for equal bodies at equal poses."""
        return self.transport.digest, self.model.posed_mesh.digest

    @cached_property
    def places(self) -> tuple[Array32, Array32, IndexArray]:
        """(s, 3) places that gather light and their normals, and which one each row of vertex and
        side takes (r,)."""
        mesh = lit_mesh(self.model, self.transport)
        place, normal = (
            rows[self.standing] for rows in _lifted(mesh.baked(), self.transport.sides)
        )
        of_row = self.transport.vertex_rows
        return place, normal, np.unique(of_row, return_inverse=True)[1].ravel()

    @cached_property
    def samples(self) -> tuple[Array32, Array32, Array, IndexArray]:
        """(n, 3) sample points of its patches that are outside other parts and the normals there,
        their parts of the area [m2] and their numbers among all (n,)."""
        transport = self.transport
        number = np.flatnonzero(transport.point_open)
        area = (transport.areas / SAMPLES)[number // SAMPLES].astype(np.float64)
        points, normals = (a.reshape(-1, 3) for a in (transport.points, transport.normals))
        return points[number], normals[number], area, number


def standing_rows(transport: LightTransport) -> IndexArray:
    """(s,) for each gather point the row of a vertex and side that stands for it.

    Vertices of one gather point lie side by side; those inside other parts do not stand for it
    where another one does. Where joints move parts, they stay as they are.
    """
    place, normal = _lifted(transport.mesh, transport.sides)
    hidden = np.zeros(len(place), dtype=np.bool_)
    if transport.sides == 1 and transport.form_factors.nnz:
        mesh, tracer = transport.mesh, RayTracer(transport.mesh)
        hidden = inside_others(mesh, tracer, place.astype(np.float64), normal.astype(np.float64))
    # Rows of a vertex lie beside each other; places, side after side.
    of_place = transport.gather_point_of_vertex.ravel()
    order = np.lexsort((hidden, of_place))
    return order[np.unique(of_place[order], return_index=True)[1]]


def _lifted(mesh: Mesh, sides: int) -> tuple[Array32, Array32]:
    """(sides * v, 3) the vertices of a mesh, just above each of its sides, and normals there."""
    lift = np.float32(LIFT * mesh.radius)
    outwards = unit_rows(mesh.normals.astype(np.float64)).astype(np.float32)
    normal = np.concatenate([np.float32(side) * outwards for side in (1.0, -1.0)[:sides]])
    return np.concatenate([mesh.positions] * sides) + lift * normal, normal


@dataclass(frozen=True, kw_only=True, eq=False)
class LightPath:
    """How the light of one body, the sender, comes to another one.

    samples : (n,) of the sender's that are seen from the receiver, by their numbers among all
    means : (c, n) csr, the mean of those in each cluster
    senders : (c, p) csr, the same of the sender's patches
    to_places : (s, c) csr, share of the hemisphere above a place that a cluster fills, weighted by
        the cosine
    to_patches : (q, c) csr, of the receiver's patches
    hides : (s, 96) csr, of which the sender stands before each cell of the receiver's sky
    """

    samples: IndexArray
    means: sparse.csr_matrix
    senders: sparse.csr_matrix
    to_places: sparse.csr_matrix
    to_patches: sparse.csr_matrix
    hides: sparse.csr_matrix

    def at_patches(self, exitance: Array32) -> Array32:
        """(q, 4) irradiance of the receiver's patches by the clusters' (c, 4) [W m-2]."""
        return self.to_patches @ exitance

    def at_places(self, exitance: Array32) -> Array32:
        """(s, 4) irradiance of the receiver's places [W m-2]."""
        return self.to_places @ exitance

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        return sum(matrix_nbytes(m) for m in (self.to_places, self.to_patches, self.hides))


def in_steps(other_from_body: Array, reach: float) -> Array:
    """(4, 4) a pose of one body in the axes of another, in steps small beside their distance.

    reach : [m] between them
    """
    result = np.eye(4)
    step = 2.0 ** np.floor(np.log2(max(STEP * reach, 1e-6)))
    result[:3, 3] = step * np.round(other_from_body[:3, 3] / step)
    turn = STEP * np.round(Rotation.from_matrix(other_from_body[:3, :3]).as_rotvec() / STEP) + 0.0
    # Half a turn is one either way: rounding errors do not choose.
    if np.linalg.norm(turn) > np.pi - STEP and turn[np.flatnonzero(turn)[0]] < 0.0:
        turn = -turn
    result[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    # Without negative zeros: equal poses have equal bits.
    return result + 0.0


def light_path(receiver: NearBody, sender: NearBody, sender_from_receiver: Array) -> LightPath:
    """How light comes from the sender to the receiver.

    sender_from_receiver : (4, 4) between their axes
    """
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    open_ = _towards(sender, receiver, turn, shift)
    if len(open_) == 0:
        return _no_path(receiver, sender)
    clusters, share = _clustered(receiver, sender, open_, sender_from_receiver)
    samples = sender.samples[3][open_]
    patch = samples // SAMPLES
    of_patch = sparse.csr_matrix(
        (np.ones(len(patch), dtype=np.float32), (np.arange(len(patch)), patch)),
        shape=(len(patch), len(sender.transport.areas)),
    )

    def seen(points: Array32, outwards: Array32) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        return _form_factors(receiver, sender, sender_from_receiver, (points, outwards), clusters)

    to_places, hides = seen(*receiver.places[:2])
    inverse: Array = np.linalg.inv(sender_from_receiver).astype(np.float64)
    at, chosen = _samples_for(receiver, sender, inverse[:3, :3], inverse[:3, 3])
    number = np.bincount(at, minlength=len(receiver.transport.areas)).astype(np.float32)
    mean = sparse.csr_matrix(
        (1.0 / number[at], (at, np.arange(len(at)))), shape=(len(number), len(at))
    )
    to_samples, _ = seen(receiver.samples[0][chosen], receiver.samples[1][chosen])
    return LightPath(
        samples=samples,
        means=share,
        senders=(share @ of_patch).tocsr(),
        to_places=to_places,
        to_patches=(mean @ to_samples).tocsr(),
        hides=hides,
    )


def _clustered(
    receiver: NearBody, sender: NearBody, open_: IndexArray, sender_from_receiver: Array
) -> tuple[_Clusters, sparse.csr_matrix]:
    """Some samples of the sender merged, and (c, n) csr the mean of those in each cluster."""
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    points, normals = sender.samples[0][open_], sender.samples[1][open_]
    part = sender.samples[2][open_]
    seen_from = (points - shift) @ turn
    distance = np.maximum(_distance(receiver, seen_from), _nearest(receiver, sender))
    limit = int(np.clip(_PAIRS // len(receiver.places[0]), *_LIMITS))
    cluster = clusters_of(points, normals, distance, limit)
    count = int(cluster.max()) + 1
    areas = np.bincount(cluster, part, minlength=count)
    share = sparse.csr_matrix(
        ((part / areas[cluster]).astype(np.float32), (cluster, np.arange(len(cluster)))),
        shape=(count, len(cluster)),
    )
    order = np.argsort(cluster, kind="stable")
    clusters = _Clusters(
        middle=(share @ seen_from).astype(np.float32),
        facing=unit_rows(share @ (normals @ turn)).astype(np.float32),
        areas=areas.astype(np.float32),
        points=seen_from[order].astype(np.float32),
        in_sender=points[order],
        first=np.searchsorted(cluster[order], np.arange(count + 1)),
    )
    return clusters, share


def _distance(body: NearBody, points: Array) -> Array:
    """(n,) of points in its axes from the box around a body [m]."""
    corners = body.model.posed_mesh.hull
    low, high = corners.min(axis=0), corners.max(axis=0)
    return np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)


def _samples_for(
    receiver: NearBody, sender: NearBody, turn: Array, shift: Array
) -> tuple[IndexArray, IndexArray]:
    """Patch and sample point of the receiver for each place where its patches get light: one of a
    small patch, all of a large one.

    turn, shift : to the receiver's axes from the sender's
    """
    patch = receiver.samples[3] // SAMPLES
    centres, radii = receiver.transport.patch_spheres
    distance = _distance(sender, (centres - shift) @ turn)
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
    looks = np.concatenate([mesh.centre[None], [0.5 * (mesh.centre + c) for c in _eight(corners)]])
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


def _no_path(receiver: NearBody, sender: NearBody) -> LightPath:
    """Of a sender that the receiver does not see."""
    places, patches = len(receiver.places[0]), len(receiver.transport.areas)
    return LightPath(
        samples=np.zeros(0, dtype=np.int64),
        means=sparse.csr_matrix((0, 0), dtype=np.float32),
        senders=sparse.csr_matrix((0, len(sender.transport.areas)), dtype=np.float32),
        to_places=sparse.csr_matrix((places, 0), dtype=np.float32),
        to_patches=sparse.csr_matrix((patches, 0), dtype=np.float32),
        hides=sparse.csr_matrix((places, SKY_CELLS), dtype=np.float32),
    )


def clusters_of(points: Array32, normals: Array32, distance: Array, limit: int) -> IndexArray:
    """(n,) number of the cluster of each sample: those of one cell of space that face alike.

    distance : (n,) from the other spacecraft [m]
    limit : of the number of clusters
    """
    axis = np.argmax(np.abs(normals), axis=1)
    side = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0.0)
    low = points.min(axis=0)
    # One cell of this edge holds all of them.
    largest = int(np.ceil(np.log2(max(float((points.max(axis=0) - low).max()), 1e-6)))) + 1
    width = _WIDTH
    while True:
        level = np.minimum(np.ceil(np.log2(width * distance)).astype(np.int64), largest)
        cell = ((points - low) / np.exp2(level)[:, None]).astype(np.int64)
        across = int(cell.max()) + 1
        key = (level - level.min()) * 6 + side
        for place in cell.T:
            key = key * across + place
        _, number = np.unique(key, return_inverse=True)
        if int(number.max()) < limit:
            return np.asarray(number, dtype=np.int64)
        width *= 1.3


@dataclass(frozen=True, kw_only=True, eq=False)
class _Clusters:
    """What sends light, in the receiver's axes.

    middle, facing : (c, 3) and their mean normals; areas : (c,) [m2]
    points, in_sender : (n, 3) of their surfaces, also in the sender's axes, those of one cluster
        from ``first`` (c + 1,) on
    """

    middle: Array32
    facing: Array32
    areas: Array32
    points: Array32
    in_sender: Array32
    first: IndexArray


def _form_factors(
    receiver: NearBody,
    sender: NearBody,
    sender_from_receiver: Array,
    points: tuple[Array32, Array32],
    clusters: _Clusters,
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """(n, c) csr, share of each point's hemisphere that each cluster fills, as a disc of its area,
    and (n, 96) the same of the cells of the sky behind them.

    points : (n, 3) places and normals
    """
    places, normals = points
    place, cluster = _facing(places, normals, clusters)
    # Neighbouring places look at different points of a cluster: what hides a part of it hides it
    # from as many.
    number = np.diff(clusters.first)[cluster]
    point = clusters.first[cluster] + (place * 7 + cluster * 3) % number
    turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
    in_sender = (places @ turn.T + shift).astype(np.float32)
    for body, starts, ends in (
        (receiver, places, clusters.points),
        (sender, in_sender, clusters.in_sender),
    ):
        origins = np.take(starts, place, axis=0)
        ways = np.take(ends, point, axis=0) - origins
        reach = np.full(len(place), 1.0 - 1e-3, dtype=np.float32)
        seen = np.flatnonzero(~ray_tracer(body.model.posed_mesh).occluded(origins, ways, reach))
        place, cluster, point = place[seen], cluster[seen], point[seen]
    offset = np.take(clusters.middle, cluster, axis=0) - np.take(places, place, axis=0)
    here = np.einsum("ij,ij->i", offset, np.take(normals, place, axis=0))
    there = -np.einsum("ij,ij->i", offset, np.take(clusters.facing, cluster, axis=0))
    square, areas = np.einsum("ij,ij->i", offset, offset), clusters.areas[cluster]
    square = np.maximum(square, np.float32(1e-9))
    share = np.maximum(here, 0.0) * np.maximum(there, 0.0) * areas
    share /= square * (np.float32(np.pi) * square + areas)
    # Discs nearby would overlap.
    whole = np.bincount(place, share, minlength=len(places))
    share /= np.maximum(whole, 1.0).astype(np.float32)[place]

    def of_places(columns: IndexArray, count: int) -> sparse.csr_matrix:
        return sparse.csr_matrix((share, (place, columns)), shape=(len(places), count))

    return (
        of_places(cluster, len(clusters.areas)),
        of_places(sky_cell(offset.astype(np.float64), CELLS_ACROSS), SKY_CELLS),
    )


def _facing(
    places: Array32, normals: Array32, clusters: _Clusters
) -> tuple[IndexArray, IndexArray]:
    """Pairs of a place and a cluster that face each other, where the cluster would fill more than
    ``_SMALLEST`` of the hemisphere; place by place."""
    # About a point near both, where float32 tells small distances.
    origin = clusters.middle.mean(axis=0)
    middle, facing, areas = clusters.middle - origin, clusters.facing, clusters.areas
    beyond = np.linalg.norm(middle, axis=1).max()
    # Most places look away from all clusters.
    open_ = np.flatnonzero(np.einsum("ij,ij->i", normals, places - origin) < beyond)
    pairs = [(open_[:0], open_[:0])]
    for at in range(0, len(open_), _ROWS):
        rows = open_[at : at + _ROWS]
        here, outwards = places[rows] - origin, normals[rows]
        square = np.sum(middle**2, axis=1) + np.sum(here**2, axis=1)[:, None]
        square = np.maximum(square - 2.0 * here @ middle.T, np.float32(1e-9))
        facing_it = np.maximum(outwards @ middle.T - np.sum(here * outwards, axis=1)[:, None], 0.0)
        faced = np.maximum(here @ facing.T - np.sum(middle * facing, axis=1), 0.0)
        least = _SMALLEST * square * (np.float32(np.pi) * square + areas)
        place, cluster = np.nonzero(facing_it * faced * areas > least)
        pairs.append((rows[place], cluster))
    place, cluster = (np.concatenate(numbers) for numbers in zip(*pairs, strict=True))
    return place, cluster
