"""Points of one spacecraft and clusters of another that see each other.

Of the light that leaves a cluster, how much comes to a point follows from its share of the
hemisphere there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray

# Of a cluster, area over pi times the square of its distance up to which the first order tells.
_LARGEST = np.float32(0.5)


@dataclass(frozen=True, kw_only=True, eq=False)
class Clusters:
    """What a body sends light as, in its own axes.

    middle, facing : (c, 3) and their mean normals; areas : (c,) [m2]
    """

    middle: Array32
    facing: Array32
    areas: Array32

    def seen_from(self, sender_from_receiver: Array) -> Clusters:
        """The same in the axes of the receiver."""
        turn, shift = sender_from_receiver[:3, :3], sender_from_receiver[:3, 3]
        return Clusters(
            middle=((self.middle - shift) @ turn).astype(np.float32),
            facing=(self.facing @ turn).astype(np.float32),
            areas=self.areas,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenPairs:
    """Points of a receiver and the clusters that are seen from them.

    points, normals : (n, 3)
    rows : (n,) of a matrix of what they get, in order
    parts : (n,) of its row that each point is
    point, cluster : (k,) of each pair
    end : (k,) where the ray of each pair ends
    behind : (k,) the patch of the receiver itself before which the cluster stands; -1 for the sky
    """

    points: Array32
    normals: Array32
    rows: IndexArray
    parts: Array32
    point: IndexArray
    cluster: IndexArray
    end: IndexArray
    behind: IndexArray

    def of_pairs(self, chosen: IndexArray) -> SeenPairs:
        """With some of the pairs alone."""
        return replace(
            self,
            point=self.point[chosen],
            cluster=self.cluster[chosen],
            end=self.end[chosen],
            behind=self.behind[chosen],
        )

    def shares(self, clusters: Clusters) -> Array32:
        """(k,) of the hemisphere above each point, weighted by the cosine, that a cluster fills,
        as a disc of its area, times the point's part.

        Of a disc seen along its normal this is exact, otherwise to the first order of its area over
        pi times the square of its distance: the mean of what its places give, by the Laplacian of
        that over its plane.

        clusters : in the receiver's axes
        """
        offset = np.take(clusters.middle, self.cluster, axis=0)
        offset -= np.take(self.points, self.point, axis=0)
        normal = np.take(self.normals, self.point, axis=0)
        facing = np.take(clusters.facing, self.cluster, axis=0)
        here = np.maximum(np.einsum("ij,ij->i", offset, normal), 0.0)
        towards = np.maximum(-np.einsum("ij,ij->i", offset, facing), 0.0)
        areas = np.take(clusters.areas, self.cluster)
        square = np.maximum(np.einsum("ij,ij->i", offset, offset), np.float32(1e-9))
        size = areas / (np.float32(np.pi) * square)
        more = here * (1.0 - 3.0 * towards * towards / square)
        more -= towards * np.einsum("ij,ij->i", normal, facing)
        less = here * here / np.maximum(here - size * np.minimum(more, 0.0), np.float32(1e-30))
        share = less + np.minimum(size, _LARGEST) * np.maximum(more, 0.0)
        share *= towards * size / square
        # Discs nearby would overlap.
        filled = np.bincount(self.point, share, minlength=len(self.points))
        scale = self.parts / np.maximum(filled, 1.0).astype(np.float32)
        return np.asarray(share * np.take(scale, self.point), dtype=np.float32)

    def entries(self, columns: IndexArray, shape: tuple[int, int]) -> PairEntries:
        """Pairs in their rows and in some columns (k,), which may occur twice; those in columns
        below 0 are left out."""
        rows, pairs = self.rows[self.point], None
        if columns.min(initial=0) < 0:
            pairs = np.flatnonzero(columns >= 0)
            columns, rows = columns[pairs], rows[pairs]
        first = np.searchsorted(rows, np.arange(shape[0] + 1))
        return PairEntries(
            pairs=pairs,
            columns=columns.astype(np.int32),
            first=first.astype(np.int32),
            shape=shape,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PairEntries:
    """Which entries of a matrix pairs of points and clusters are, row by row.

    pairs : (j,) which of them; None for all
    columns : (j,) of each; first : (rows + 1,) where those of each row start
    """

    pairs: IndexArray | None
    columns: NDArray[np.int32]
    first: NDArray[np.int32]
    shape: tuple[int, int]

    def matrix(self, shares: Array32) -> sparse.csr_matrix:
        """Of the shares (k,) of all pairs."""
        values = shares if self.pairs is None else np.take(shares, self.pairs)
        return sparse.csr_matrix((values, self.columns, self.first), shape=self.shape)
