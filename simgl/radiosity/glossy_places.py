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
# What lobes send has powers of their reflectance at normal incidence, f0: grey ones in one weight,
# coloured ones one and f0, and its square where they send on what met several microfacets.
GREY, COLOURED, CONSERVING = range(3)
# Pairs that are worked out together: what numpy makes of them stays in a processor's cache, and no
# memory that is new to the process has to be cleared for it.
_AT_ONCE = 1 << 13


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacePairs:
    """Places on glossy patches as receivers see them, n pairs of both: by kinds of the patches, by
    patch and by place.

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
        self._open = transport.point_open[self.glossy]
        self._strong = laws.part_of_lobe[self.law_of_patch] > _STRONG
        number = np.full(len(law), -1)
        number[self.glossy[self._strong]] = np.flatnonzero(self._strong)
        none = np.zeros(0, dtype=np.int64)
        of_cell = none if transport.cells is None else number[transport.cells.patch]
        self.cells = np.flatnonzero(of_cell >= 0)
        self._patch_of_cell = of_cell[self.cells]
        number_open = np.maximum(self._open.sum(axis=1), 1)[:, None]
        weight = (self._open / number_open).astype(np.float32)
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
        row, patch, share = seen.row, seen.col, seen.data
        at = np.ascontiguousarray(places.T)
        away = at.take(row, axis=1)
        away -= np.ascontiguousarray(self.middle.T).take(patch, axis=1)
        near = self._radius[patch] > _WIDE * np.maximum(_lengths(away), np.float32(1e-9))
        near &= self._strong[patch]
        far = np.flatnonzero(~near)
        parts = [(row[far], SAMPLES * self.count + patch[far], share[far])]
        if cells is not None:
            much = np.flatnonzero(near & (share >= _MUCH))
            in_cells, of_cells = self._in_cells(row[much], patch[much], cells)
            near[much[in_cells]] = False
            parts.append(of_cells)
        near_by = np.flatnonzero(near)
        parts.append(self._sampled(row[near_by], patch[near_by], share[near_by], at, normals))
        row, place, share = (np.concatenate(values) for values in zip(*parts, strict=True))
        order = self._by_patch(place)
        row, place, share = row[order].astype(np.int32), place[order], share[order]
        # Coordinates of the directions, their cosines, squared widths, shares and what is more.
        shapes = np.empty((7, len(place)), dtype=np.float32)
        for start in range(0, len(place), _AT_ONCE):
            some = slice(start, start + _AT_ONCE)
            self._shape(row[some], place[some], share[some], at, radii, shapes[:, some])
        x, y, z, lean, alpha2, share, more = shapes
        return PlacePairs(
            count=seen.shape[0],
            place=place,
            receiver=row,
            share=share,
            x=x,
            y=y,
            z=z,
            lean=lean,
            alpha2=alpha2,
            more=more,
        )

    def _shape(
        self,
        row: IndexArray,
        place: IndexArray,
        share: Array32,
        at: Array32,
        radii: Array32,
        shapes: Array32,
    ) -> None:
        """Work out numbers (7, n) of some pairs.

        at : (3, r) of the receivers [m]
        """
        away = at.take(row, axis=1)
        away -= self._at.take(place, axis=1)
        distance: Array32 = np.maximum(_lengths(away), self._min_distances[place])
        away /= distance
        # A receiver that is wide itself sees each place from many directions.
        size: Array32 = np.hypot(self._radii[place], radii[row])
        # What covers much of the hemisphere is touched, and seen from all heights.
        height = np.maximum(_OF_TOUCHED * np.sqrt(share), GRAZING).astype(np.float32)
        towards, lean = above(away.T, self._normals.take(place, axis=1).T, height)
        width = _min_widths(share, size / distance, lean)
        bent2 = self._bent2[place]
        alpha2 = np.maximum(bent2, width * width)
        shapes[:3] = towards.T
        shapes[3], shapes[4] = lean, alpha2
        shapes[5] = share * lost_by_widening(bent2, alpha2)
        shapes[6] = self._more(self.law[place], lean)

    def _more(self, law: IndexArray, lean: Array32) -> Array32:
        """(n,) of ``ReflectionLaws.more``, which is nothing for most laws."""
        more = np.zeros(len(law), dtype=np.float32)
        conserving = np.flatnonzero(self._laws.conserving[law])
        more[conserving] = self._laws.more(law[conserving], lean[conserving])
        return more

    def _in_cells(
        self, row: IndexArray, patch: IndexArray, cells: sparse.csr_matrix
    ) -> tuple[Mask, tuple[IndexArray, IndexArray, Array32]]:
        """(n,) which pairs of a receiver and a patch are seen in cells; and receiver, place and
        share of these."""
        seen, receivers = cells.tocoo(), cells.shape[1]
        # Sorted as those of cells are, row by row: the next one is near the last.
        wanted = _keys(patch, row, receivers)
        order = np.argsort(wanted)
        wanted = wanted[order]
        key = _keys(self._patch_of_cell[seen.row], seen.col, receivers)
        slot = np.searchsorted(wanted, key)
        slot[slot == len(wanted)] = 0
        held = np.flatnonzero(wanted[slot] == key) if len(wanted) else slot[:0]
        in_cells = np.zeros(len(wanted), dtype=np.bool_)
        in_cells[order[slot[held]]] = True
        place = (SAMPLES + 1) * self.count + seen.row[held]
        return in_cells, (seen.col[held], place, seen.data[held])

    def _sampled(
        self, row: IndexArray, patch: IndexArray, share: Array32, at: Array32, normals: Array32
    ) -> tuple[IndexArray, IndexArray, Array32]:
        """Receiver, place and share of pairs of patches nearby: their sample points, by what each
        covers of the hemisphere.

        at : (3, r) of the receivers [m]
        """
        few, facing = share < _FEW, np.ascontiguousarray(normals.T)
        number = np.cumsum(few) - 1
        parts = []
        for start in range(0, max(len(row), 1), _AT_ONCE // SAMPLES):
            some = slice(start, start + _AT_ONCE // SAMPLES)
            covered = self._covered(row[some], patch[some], at, facing)
            of_few = np.flatnonzero(few[some])
            covered[of_few] *= _one_of_each(covered[of_few], number[some][of_few])
            covered *= (share[some] / np.maximum(covered.sum(axis=1), 1e-30))[:, None]
            pair, sample = np.nonzero(covered > 0.0)
            place = SAMPLES * patch[some][pair] + sample
            parts.append((row[some][pair], place, covered[pair, sample]))
        rows, places, shares = (np.concatenate(values) for values in zip(*parts, strict=True))
        return rows, places, shares

    def _covered(self, row: IndexArray, patch: IndexArray, at: Array32, facing: Array32) -> Array32:
        """(n, 16) what sample points cover of the hemispheres of receivers, times a constant.

        at, facing : (3, r) of the receivers [m], and their normals
        """
        samples = slice(0, SAMPLES * self.count)
        points, normals = (
            values[:, samples].reshape(3, -1, SAMPLES).take(patch, axis=1)
            for values in (self._at, self._normals)
        )
        away = np.subtract(at.take(row, axis=1)[:, :, None], points, out=points)
        distance = np.maximum(_lengths(away), np.float32(1e-3) * self._radius[patch][:, None])
        away /= distance
        lean = np.einsum("ins,ins->ns", away, normals)
        falling = -np.einsum("ins,in->ns", away, facing.take(row, axis=1))
        covered = np.maximum(lean, GRAZING) * np.maximum(falling, GRAZING) / distance**2
        covered *= self._open[patch]
        covered[covered < _LITTLE * covered.sum(axis=1, keepdims=True)] = 0.0
        return np.asarray(covered)

    def _by_patch(self, place: IndexArray) -> IndexArray:
        """(n,) the order of pairs by the kinds of their patches, by patch and by place (n,)."""
        rank = np.empty(len(self.patch), dtype=np.int64)
        rank[np.lexsort((self.patch, self.kind[self.patch]))] = np.arange(len(self.patch))
        # One row for each place, which lists its pairs: faster than to sort them.
        number, held = np.arange(len(place)), np.ones(len(place), dtype=np.bool_)
        shape = len(self.patch), len(place)
        listed = sparse.csr_matrix((held, (rank[place], number)), shape=shape)
        return np.asarray(listed.indices)

    @cached_property
    def kind(self) -> IndexArray:
        """(g,) of the patches: how many powers of their f0 what lobes send has, less one."""
        f0, conserving = self._laws.f0[self.law_of_patch], self._laws.conserving[self.law_of_patch]
        kind = np.where(conserving, CONSERVING, COLOURED)
        kind[(f0 == f0[:, :1]).all(axis=1)] = GREY
        return kind

    @cached_property
    def _at(self) -> Array32:
        """(3, k) of the places [m]."""
        cells = self._transport.cells
        samples = self._transport.points[self.glossy].reshape(-1, 3)
        of_cells = samples[:0] if cells is None else cells.points[self.cells]
        return np.ascontiguousarray(np.concatenate([samples, self.middle, of_cells]).T)

    @cached_property
    def _normals(self) -> Array32:
        """(3, k) of the places."""
        return np.ascontiguousarray(self.normals.T)

    @cached_property
    def _radii(self) -> Array32:
        """(k,) of the places [m]."""
        of_cell = self._patch_of_cell
        cells = self._radius[of_cell] / np.sqrt(np.bincount(of_cell)[of_cell])
        samples = np.repeat(self._radius / np.float32(SAMPLES**0.5), SAMPLES)
        return np.concatenate([samples, self._radius, cells]).astype(np.float32)

    @cached_property
    def _min_distances(self) -> Array32:
        """(k,) smallest that counts from a receiver to each place [m]."""
        distance = np.float32(1e-3) * self._radius[self.patch]
        samples = SAMPLES * self.count
        distance[samples : samples + self.count] = np.float32(1e-9)
        return np.asarray(distance)

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
    def _bent2(self) -> Array32:
        """(k,) squared widths of lobes of the places, seen from afar."""
        bent2 = self._laws.alpha2[self.law]
        samples = SAMPLES * self.count
        bent2[samples : samples + self.count] += self._bend2
        return np.minimum(bent2, np.float32(1.0))

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
    raised /= np.maximum(_lengths(raised.T), np.float32(1e-9))[:, None]
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


def _keys(patch: IndexArray, row: IndexArray, count: int) -> IndexArray:
    """(n,) one number for each pair of a patch and one of ``count`` receivers."""
    return np.asarray(patch.astype(np.int64) * count + row)


def _lengths(vectors: Array32) -> Array32:
    """(...) of vectors (3, ...)."""
    return np.asarray(np.sqrt(np.einsum("i...,i...->...", vectors, vectors)))


def _one_of_each(weights: Array32, number: IndexArray) -> Mask:
    """(n, k) one of each row, drawn by its weights from what is even over the rows' numbers."""
    reach = np.cumsum(weights, axis=1)
    drawn = (0.5 + 0.6180339887498949 * number) % 1.0 * reach[:, -1]
    one = np.minimum((reach <= drawn[:, None]).sum(axis=1), weights.shape[1] - 1)
    return np.asarray(np.arange(weights.shape[1]) == one[:, None])
