"""Sunlight that metal sends to another spacecraft in lobes: by where that stands, not evenly.

What parts of clusters send is worked out for blocks of the places that they light, both small
beside their distance from the other body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.glossy_places import above
from simgl.radiosity.near_body import NearBody
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.path_pairs import PairEntries, SeenPairs
from simgl.radiosity.reflection_laws import ReflectionLaws, lobe_towards


@dataclass(frozen=True, kw_only=True, eq=False)
class Blocks:
    """Blocks of the places of a receiver.

    middle : (b, 3) in the receiver's axes; radius : (b,) [m]
    of_places, of_points : of each place that gathers light, of each point of its patches
    """

    middle: Array32
    radius: Array32
    of_places: IndexArray
    of_points: IndexArray


@dataclass(frozen=True, kw_only=True, eq=False)
class SentLobes:
    """The glossy parts of clusters, finer than these, of one material each.

    cluster, law : (g,) of each part; cluster by its number among those with such parts
    middle, facing : (g, 3) in the sender's axes; bend2 : (g,) how much it bends; radius : (g,) [m]
    means : (g, n) csr, of samples of the sender's, over all of the cluster
    column : (c,) number of each cluster among those with such parts, -1 for others
    """

    cluster: IndexArray
    law: IndexArray
    middle: Array32
    facing: Array32
    bend2: Array32
    radius: Array32
    means: sparse.csr_matrix
    column: IndexArray
    blocks: Blocks

    @property
    def count(self) -> int:
        """Of clusters with such parts, and blocks, together."""
        return (int(self.column.max(initial=-1)) + 1) * len(self.blocks.middle)

    def entries(self, pairs: SeenPairs, rows: int, block: IndexArray) -> PairEntries:
        """(rows, clusters with such parts and blocks) which pairs get of their light.

        block : (n,) of the points of the pairs
        """
        column = self.column[pairs.cluster]
        of_block = column * len(self.blocks.middle) + block[pairs.point]
        return pairs.entries(np.where(column < 0, -1, of_block), (rows, self.count))

    def light(
        self,
        laws: ReflectionLaws,
        sender_from_receiver: Array,
        sun: tuple[Array, Array],
        cosines: Array32,
    ) -> Array32:
        """(count, 4) exitance that would send evenly what lobes send to each block [W m-2].

        sun : direction in the sender's axes and irradiance (4,) [W m-2]
        cosines : (n,) of the samples to it, 0 in shadow
        """
        parts, blocks = len(self.cluster), len(self.blocks.middle)
        arriving = self.means @ cosines
        turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
        way = (self.blocks.middle @ turn.T + shift).astype(np.float32)[None] - self.middle[:, None]
        distance = np.maximum(np.linalg.norm(way, axis=2), np.float32(1e-3))
        normals = np.repeat(self.facing, blocks, axis=0)
        viewer, lean = above((way / distance[..., None]).reshape(-1, 3), normals)
        towards = np.broadcast_to(sun[0].astype(np.float32), (parts, 3))
        raised, facing = above(towards, self.facing)
        turn_ = np.einsum("gbi,gi->gb", viewer.reshape(parts, blocks, 3), raised).ravel()
        # Slopes half as wide as directions: those of the block from the part, and of the part.
        width = 0.5 * (self.radius[:, None] + self.blocks.radius) / distance
        alpha2 = laws.alpha2[self.law] + self.bend2
        alpha2 = np.minimum(np.maximum(alpha2[:, None], width * width), 1.0).ravel()
        lobe, schlick = lobe_towards(alpha2, np.repeat(facing, blocks), lean, turn_)
        f0 = np.repeat(laws.f0[self.law], blocks, axis=0)
        more = laws.more(np.repeat(self.law, blocks), lean)
        sent = (f0 + (1.0 - f0) * schlick[:, None]) * (1.0 + f0 * more[:, None])
        arriving *= laws.taking_part(self.law, facing)
        sent *= (lobe * np.repeat(arriving, blocks))[:, None]
        at = (self.cluster[:, None] * blocks + np.arange(blocks)).ravel()
        of_all = np.zeros((self.count, 4), dtype=np.float32)
        np.add.at(of_all, at, sent)
        return of_all * sun[1].astype(np.float32)


def sent_lobes(
    sender: NearBody,
    chosen: IndexArray,
    number: IndexArray,
    parts: IndexArray,
    blocks: Callable[[int], Blocks],
) -> SentLobes | None:
    """Of some samples (n,) of the sender; None where none is glossy.

    number, parts : (n,) cluster of each, and which small part of space it is in
    blocks : makes those of the receiver, by how many parts there are
    """
    places, normals, areas, patch = (values[chosen] for values in sender.samples)
    law = np.argmax(sender.transport.materials, axis=1)[patch // SAMPLES]
    glossy = np.flatnonzero(sender.laws.glossy[law])
    if len(glossy) == 0:
        return None
    kinds, count = len(sender.laws.glossy), int(parts.max()) + 1
    keys = (number[glossy] * count + parts[glossy]) * kinds + law[glossy]
    key, part = np.unique(keys, return_inverse=True)
    with_lobes, cluster = np.unique(key // (kinds * count), return_inverse=True)
    column = np.full(int(number.max()) + 1, -1)
    column[with_lobes] = np.arange(len(with_lobes))
    weight = areas[glossy]
    of_part = np.bincount(part, weight)
    mean = sparse.csr_matrix((weight / of_part[part], (part, np.arange(len(part)))))
    middle, facing = mean @ places[glossy], mean @ normals[glossy]
    away2 = np.sum((places[glossy] - middle[part]) ** 2, axis=1)
    of_cluster = np.bincount(number, areas)[number[glossy]]
    entries = (weight / of_cluster).astype(np.float32), (part, glossy)
    return SentLobes(
        cluster=cluster,
        law=key % kinds,
        middle=middle.astype(np.float32),
        facing=unit_rows(facing).astype(np.float32),
        bend2=np.maximum(1.0 - np.sum(facing**2, axis=1), 0.0).astype(np.float32),
        radius=np.sqrt(mean @ away2).astype(np.float32),
        means=sparse.csr_matrix(entries, shape=(len(key), len(chosen))),
        column=column,
        blocks=blocks(len(key)),
    )


def blocks_of(places: Array32, points: Array32, number: IndexArray) -> Blocks:
    """Blocks of places that gather light and of points of patches, by numbers of both (n,)."""
    both = np.concatenate([places, points]).astype(np.float64)
    count = np.bincount(number)
    middle = np.stack([np.bincount(number, axis) / count for axis in both.T], axis=1)
    away2 = np.sum((both - middle[number]) ** 2, axis=1)
    return Blocks(
        middle=middle.astype(np.float32),
        radius=np.sqrt(np.bincount(number, away2) / count).astype(np.float32),
        of_places=number[: len(places)],
        of_points=number[len(places) :],
    )
