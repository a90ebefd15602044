"""Glossy patches as receivers see them: from their middles, or place by place.

Where a patch is near, directions to a receiver differ over it: its sample points then send their
light each, with their part of what the receiver sees of the patch. Of a patch that covers much of
the hemisphere, the cells do that which rays of the receiver met.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from simgl.arrays import Array32, IndexArray, Mask
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.reflection_laws import ReflectionLaws, lost_by_widening

# Patches whose radius is more than this share of their distance are seen sample point by sample
# point.
_WIDE = 0.2
# Directions to neighbouring places lie about 1.8 radii of these apart. A lobe is this multiple of
# the radius wide at least, so that what is seen of it does not depend on where they lie; but no
# wider than that, however near they are.
_SMOOTH, _WIDEST = 1.0, 0.4
# Lobes that are less than this of what leaves a patch are sent from its middle, however near it is.
_STRONG = 0.25
# What one of the fewest rays of a receiver covers is a disc of about so many radians.
_OF_RAY = 0.05
# Cosine below which lobes cover so much less of the hemisphere that it counts.
_LOW = 0.25
# Sample points that cover less than this share of what a receiver sees of their patch are left out.
_LITTLE = 0.02
# Of patches that cover less than this share of the hemisphere one sample point stands for all; of
# those that cover more than that one, cells.
_FEW, _MUCH = 0.01, 0.05
# What covers more than this by itself sends lobes at least this multiple of the root of its share
# wide.
_BROAD, _OF_COVERED = 0.02, 1.5
# Of the angular radius of what a receiver sees of a place, its least height above that.
_OF_TOUCHED = 0.5
# Directions closer to a place's plane than this, or beyond it, count as if they were so far above:
# of a patch that bends other parts are seen than its middle, and of one that is touched any.
GRAZING = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacePairs:
    """Places on glossy patches as receivers see them, n pairs of both.

    count : of the receivers
    place, receiver : (n,) which
    share : (n,) of the receiver's cosine-weighted hemisphere
    x, y, z : (n,) unit, to the receiver; lean : (n,) their cosine to the place's normal
    alpha2 : (n,) squared width of the lobe
    more : (n,) what the lobe gets besides, for light that meets several microfacets, over f0
    """

    count: int
    place: IndexArray
    receiver: IndexArray
    share: Array32
    x: Array32
    y: Array32
    z: Array32
    lean: Array32
    alpha2: Array32
    more: Array32


class GlossyPlaces:
    """Places on the patches of a body whose lobes are followed.

    They are the sample points of all of these patches, patch by patch, then their middles, then
    their cells.

    glossy : (g,) which patches; law_of_patch : (g,) of each
    cells : (c,) which cells of the transport
    middle, normal : (g, 3) of each [m], float32
    """

    def __init__(self, transport: LightTransport, laws: ReflectionLaws) -> None:
        self._transport, self._laws = transport, laws
        law = np.argmax(transport.materials, axis=1)
        self.glossy = np.flatnonzero(laws.glossy[law])
        self.law_of_patch = law[self.glossy]
        self._strong = laws.part_of_lobe[self.law_of_patch] > _STRONG
        number = np.full(len(law), -1)
        number[self.glossy[self._strong]] = np.flatnonzero(self._strong)
        none = np.zeros(0, dtype=np.int64)
        of_cell = none if transport.cells is None else number[transport.cells.patch]
        self.cells = np.flatnonzero(of_cell >= 0)
        self._patch_of_cell = of_cell[self.cells]
        open_ = transport.point_open[self.glossy]
        weight = (open_ / np.maximum(open_.sum(axis=1), 1)[:, None]).astype(np.float32)
        self.middle = np.einsum("ps,psi->pi", weight, transport.points[self.glossy])
        self.normal = np.einsum("ps,psi->pi", weight, transport.normals[self.glossy])
        away = transport.points[self.glossy] - self.middle[:, None]
        self._radius = np.sqrt(np.einsum("ps,psi,psi->p", weight, away, away))
        # Slopes of a bent patch's normals widen the lobe of its middle.
        bend = 1.0 - np.einsum("pi,pi->p", self.normal, self.normal)
        self._bend2 = np.maximum(bend, 0.0).astype(np.float32)
        self.normal = unit_rows(self.normal.astype(np.float64)).astype(np.float32)

    @property
    def count(self) -> int:
        """Of the patches."""
        return len(self.glossy)

    def pairs(
        self,
        seen: sparse.coo_matrix,
        places: Array32,
        normals: Array32,
        radii: Array32,
        cells: sparse.csr_matrix | None = None,
    ) -> PlacePairs:
        """The patches that receivers see.

        seen : (r, g) share of the hemisphere of each receiver
        places, normals : (r, 3) of the receivers, in the mean [m]
        radii : (r,) of the places that they stand for [m]
        cells : (c, r) the same of ``cells``; None where they are not known
        """
        row, patch, share = seen.row.astype(np.int64), seen.col.astype(np.int64), seen.data
        offset = places[row] - self.middle[patch]
        distance = np.maximum(_lengths(offset), np.float32(1e-9))
        near = (self._radius[patch] > _WIDE * distance) & self._strong[patch]
        far = ~near
        parts = [
            (
                row[far],
                SAMPLES * len(self.glossy) + patch[far],
                share[far],
                offset[far] / distance[far, None],
                self._radius[patch[far]],
                distance[far],
            )
        ]
        if cells is not None:
            much = near & (share >= _MUCH)
            in_cells = self._in_cells(row[much], patch[much], cells, places)
            near &= ~np.isin(_keys(row, patch, self.count), in_cells[0])
            parts.append(in_cells[1:])
        parts.append(self._sampled(row[near], patch[near], share[near], places, normals))
        row, place, share, towards, radius, distance = (
            np.concatenate(values) for values in zip(*parts, strict=True)
        )
        # A receiver that is wide itself sees each place from many directions.
        reach = np.hypot(radius, radii[row]) / distance
        # What covers much of the hemisphere is touched, and seen from all heights.
        height = np.maximum(_OF_TOUCHED * np.sqrt(share), GRAZING).astype(np.float32)
        towards, lean = above(towards, self.normals[place], height)
        law = self.law[place]
        width = _min_widths(share, reach, lean)
        bent = np.minimum(self._laws.alpha2[law] + self._bends[place], np.float32(1.0))
        alpha2 = np.maximum(bent, width * width)
        return PlacePairs(
            count=seen.shape[0],
            place=place,
            receiver=row.astype(np.int32),
            share=(share * lost_by_widening(bent, alpha2)).astype(np.float32),
            x=towards[:, 0],
            y=towards[:, 1],
            z=towards[:, 2],
            lean=lean,
            alpha2=alpha2,
            more=self._more(law, lean),
        )

    def _more(self, law: IndexArray, lean: Array32) -> Array32:
        """(n,) of ``ReflectionLaws.more``, which is nothing for most laws."""
        more = np.zeros(len(law), dtype=np.float32)
        conserving = np.flatnonzero(self._laws.conserving[law])
        more[conserving] = self._laws.more(law[conserving], lean[conserving])
        return more

    def _in_cells(
        self, row: IndexArray, patch: IndexArray, cells: sparse.csr_matrix, places: Array32
    ) -> tuple[IndexArray, IndexArray, IndexArray, Array32, Array32, Array32, Array32]:
        """Which pairs of a receiver and a patch are seen in cells, by ``_keys``, and the cells."""
        of_transport = self._transport.cells
        assert of_transport is not None
        seen = cells.tocoo()
        key = _keys(seen.col, self._patch_of_cell[seen.row], self.count)
        held = np.isin(key, _keys(row, patch, self.count))
        cell, receiver = seen.row[held], seen.col[held].astype(np.int64)
        offset = places[receiver] - of_transport.points[self.cells[cell]]
        on = self._patch_of_cell[cell]
        radius = self._radius[on] / np.sqrt(np.bincount(self._patch_of_cell)[on])
        distance = np.maximum(_lengths(offset), np.float32(1e-3) * self._radius[on])
        place = (SAMPLES + 1) * len(self.glossy) + cell.astype(np.int64)
        towards, radius = offset / distance[:, None], radius.astype(np.float32)
        return np.unique(key[held]), receiver, place, seen.data[held], towards, radius, distance

    def _sampled(
        self,
        row: IndexArray,
        patch: IndexArray,
        share: Array32,
        places: Array32,
        normals: Array32,
    ) -> tuple[IndexArray, IndexArray, Array32, Array32, Array32, Array32]:
        """Pairs of patches nearby: their sample points, by what each covers of the hemisphere."""
        points = self._transport.points[self.glossy]
        offset = places[row][:, None] - points[patch]
        distance = np.maximum(_lengths(offset), np.float32(1e-3) * self._radius[patch][:, None])
        towards = offset / distance[:, :, None]
        lean = np.einsum("nsi,nsi->ns", towards, self._transport.normals[self.glossy][patch])
        facing = -np.einsum("nsi,ni->ns", towards, normals[row])
        covered = np.maximum(lean, GRAZING) * np.maximum(facing, GRAZING) / distance**2
        covered *= self._transport.point_open[self.glossy][patch]
        covered[covered < _LITTLE * covered.sum(axis=1, keepdims=True)] = 0.0
        few = np.flatnonzero(share < _FEW)
        covered[few] *= _one_of_each(covered[few])
        covered *= (share / np.maximum(covered.sum(axis=1), 1e-30))[:, None]
        each = SAMPLES * patch[:, None] + np.arange(SAMPLES)
        held = covered > 0.0
        rows = np.broadcast_to(row[:, None], held.shape)
        radii = np.broadcast_to(self._radius[patch][:, None] / np.float32(SAMPLES**0.5), held.shape)
        return rows[held], each[held], covered[held], towards[held], radii[held], distance[held]

    @cached_property
    def normals(self) -> Array32:
        """(k, 3) of the places."""
        samples = self._transport.normals[self.glossy].reshape(-1, 3)
        cells = self._transport.cells
        of_cells = samples[:0] if cells is None else cells.normals[self.cells]
        return np.concatenate([samples, self.normal, of_cells])

    @cached_property
    def law(self) -> IndexArray:
        """(k,) of the places."""
        return self.law_of_patch[self.patch]

    @cached_property
    def _bends(self) -> Array32:
        bends = np.zeros(len(self.patch), dtype=np.float32)
        samples = SAMPLES * len(self.glossy)
        bends[samples : samples + len(self.glossy)] = self._bend2
        return bends

    @cached_property
    def patch(self) -> IndexArray:
        """(k,) of the places, in the order of ``glossy``."""
        number = np.arange(len(self.glossy))
        return np.concatenate([np.repeat(number, SAMPLES), number, self._patch_of_cell])


def above(
    directions: Array32, normals: Array32, height: Array32 | np.float32 = np.float32(GRAZING)
) -> tuple[Array32, Array32]:
    """(n, 3) unit directions, raised to a height above the planes of normals (n, 3), and (n,) their
    cosines to these."""
    cosine = np.einsum("ni,ni->n", directions, normals)
    raised = directions + np.maximum(height - cosine, 0.0)[:, None] * normals
    raised /= np.maximum(_lengths(raised), np.float32(1e-9))[:, None]
    cosine = np.einsum("ni,ni->n", raised, normals)
    return raised, np.maximum(cosine, np.float32(0.5 * GRAZING))


def _min_widths(share: Array32, reach: Array32, lean: Array32) -> Array32:
    """(n,) of the lobes of places that cover shares of a receiver's hemisphere.

    reach : their radii over their distances; lean : cosine of the receiver's direction there
    """
    # A ray stands for a part of the hemisphere, and no lobe may be narrower than that. Close to the
    # surface lobes cover less of it, as their cosine does.
    low = np.minimum(lean / np.float32(_LOW), 1.0)
    reach = np.maximum(reach, np.minimum(np.sqrt(share), _OF_RAY) / np.sqrt(low))
    width = np.minimum(_SMOOTH * reach, _WIDEST)
    # What covers much is seen under as many directions, wherever its middle is.
    broad = np.flatnonzero(share > _BROAD)
    wide = np.minimum(_OF_COVERED * np.sqrt(share[broad]), 1.0)
    width[broad] = np.maximum(width[broad], wide)
    return np.asarray(width, dtype=np.float32)


def _keys(row: IndexArray, patch: IndexArray, count: int) -> IndexArray:
    """(n,) one number for each pair of a row and one of ``count`` patches."""
    return np.asarray(row.astype(np.int64) * count + patch)


def _lengths(vectors: Array32) -> Array32:
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))


def _one_of_each(weights: Array32) -> Mask:
    """(n, k) one of each row, drawn by its weights from numbers that are even over the rows."""
    reach = np.cumsum(weights, axis=1)
    drawn = (0.5 + 0.6180339887498949 * np.arange(len(weights))) % 1.0 * reach[:, -1]
    one = np.minimum((reach <= drawn[:, None]).sum(axis=1), weights.shape[1] - 1)
    return np.asarray(np.arange(weights.shape[1]) == one[:, None])
