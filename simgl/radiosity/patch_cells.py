"""Cells of patches: of a patch that the Sun lights in part, which part gather points near it see.

A patch sends its light evenly. Beside a shadow's edge that lights what sees its dark part alone, a
bias that does not even out: what stands in a shadow mostly sees its neighbours in the same shadow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from simgl.arrays import Array32, IndexArray
from simgl.radiosity.gather_points import LIFT, face_normals
from simgl.radiosity.light_transport import PatchCells
from simgl.scene.mesh import Mesh

# Patches that cover less than this share of a gather point's hemisphere count for it as even.
_NEAR = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class CellIndex:
    """Numbers of the cells of patches: boxes in the two longest axes of each patch's own box.

    patch_of_side : (m * sides,) patch of each triangle's front, then of each one's back
    first : (p + 1,) where the cells of each patch start
    axes : (p, 2) of the body; low, size : (p, 2) of the boxes along them [m]
    across : (p, 2) cells along them
    """

    patch_of_side: IndexArray
    first: IndexArray
    axes: IndexArray
    low: Array32
    size: Array32
    across: IndexArray

    @property
    def count(self) -> int:
        """Of all cells."""
        return int(self.first[-1])

    @property
    def patch(self) -> IndexArray:
        """(n,) of each cell."""
        return np.repeat(np.arange(len(self.across)), np.diff(self.first))

    def of(self, side: IndexArray, places: Array32) -> IndexArray:
        """(k,) cells of places (k, 3) on sides of triangles."""
        patch = self.patch_of_side.take(side)
        row, column = (self._step(axis, patch, places) for axis in range(2))
        return self.first.take(patch) + row * self.across[:, 1].take(patch) + column

    def _step(self, axis: int, patch: IndexArray, places: Array32) -> IndexArray:
        """(k,) steps of cells to places on patches (k,) along the first or second of their axes."""
        of_place = 3 * np.arange(len(places)) + self.axes[:, axis].take(patch)
        along = places.ravel().take(of_place)
        along -= self.low[:, axis].take(patch)
        along /= self.size[:, axis].take(patch)
        across = self.across[:, axis].take(patch)
        return np.clip((along * across).astype(np.int64), 0, across - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenCells:
    """What rays of gather points met.

    shares : (s, n) csr, share of the cosine-weighted hemisphere that each cell covers
    places : (n, 3) where a ray met each cell [m]; side : (n,) of a triangle there, -1 if none did
    nearness : (s,) as of ``mean_nearness`` [m-1]; 0 where no rays were traced
    """

    shares: sparse.csr_matrix
    places: Array32
    side: IndexArray
    nearness: Array32

    def of_rows(self, rows: IndexArray) -> SeenCells:
        """Those of some gather points."""
        return replace(self, shares=self.shares[rows], nearness=self.nearness[rows])

    def of_patches(self, index: CellIndex) -> sparse.csr_matrix:
        """(s, p) the shares of patches."""
        one = np.ones(index.count, dtype=np.float32)
        entries = one, index.patch, np.arange(index.count + 1)
        to_patch = sparse.csr_matrix(entries, shape=(index.count, len(index.across)))
        return (self.shares @ to_patch).tocsr()


def cell_index(mesh: Mesh, patch_of_side: IndexArray, each: int) -> CellIndex:
    """About as many cells on each patch, as square as its box allows."""
    count, sides = int(patch_of_side.max()) + 1, len(patch_of_side) // len(mesh.triangles)
    low = np.full((count, 3), np.inf, dtype=np.float32)
    high = -low
    for corner in np.moveaxis(mesh.positions[mesh.triangles], 1, 0):
        np.minimum.at(low, patch_of_side, np.tile(corner, (sides, 1)))
        np.maximum.at(high, patch_of_side, np.tile(corner, (sides, 1)))
    axes = np.argsort(low - high, axis=1, kind="stable")[:, :2]
    low, high = (np.take_along_axis(box, axes, axis=1) for box in (low, high))
    size = np.maximum(high - low, np.float32(1e-6 * mesh.radius))
    ratio = size[:, 0] / size[:, 1]
    long = np.clip(np.round(np.sqrt(each * ratio)), 1, each).astype(np.int64)
    across = np.stack([long, np.maximum(each // long, 1)], axis=1)
    first = np.concatenate([[0], np.cumsum(across.prod(axis=1))])
    return CellIndex(
        patch_of_side=patch_of_side, first=first, axes=axes, low=low, size=size, across=across
    )


def patch_cells(
    mesh: Mesh, index: CellIndex, at_points: SeenCells, at_nodes: SeenCells | None
) -> PatchCells:
    """The cells that any gather point near them sees.

    at_nodes : what the gather points of grids see
    """
    both = [at_points] if at_nodes is None else [at_points, at_nodes]
    gather = sparse.vstack([_near(seen.shares, index.patch) for seen in both]).T.tocsr()
    chosen = np.flatnonzero(np.diff(gather.indptr))
    side, places = at_points.side[chosen], at_points.places[chosen]
    if at_nodes is not None:
        missing = side < 0
        side[missing] = at_nodes.side[chosen[missing]]
        places[missing] = at_nodes.places[chosen[missing]]
    count = len(mesh.triangles)
    normals = face_normals(mesh)[0][side % count] * np.where(side < count, 1.0, -1.0)[:, None]
    return PatchCells(
        patch=index.patch[chosen],
        points=(places + LIFT * mesh.radius * normals).astype(np.float32),
        normals=normals.astype(np.float32),
        gather=gather[chosen],
    )


def _near(shares: sparse.csr_matrix, patch: IndexArray) -> sparse.csr_matrix:
    """Only the entries of patches that cover much of a gather point's hemisphere."""
    shares.sort_indices()
    row = np.repeat(np.arange(shares.shape[0]), np.diff(shares.indptr))
    if len(row) == 0:
        return shares
    # Cells are numbered patch by patch: those of one patch stand together in a row.
    pair = row * (int(patch[-1]) + 1) + patch[shares.indices]
    start = np.flatnonzero(np.diff(pair, prepend=-1))
    of_pair = np.add.reduceat(shares.data, start)
    much = np.repeat(of_pair >= _NEAR, np.diff(start, append=len(pair)))
    entries = shares.data[much], (row[much], shares.indices[much])
    return sparse.csr_matrix(entries, shape=shares.shape)
