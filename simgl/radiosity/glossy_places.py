"""Glossy patches as receivers see them: from their middles, or sample point by sample point.

Where a patch is near, directions to a receiver differ over it: its sample points then send their
light each, with their part of what the receiver sees of the patch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.reflection_laws import ReflectionLaws

# Patches whose radius is more than this share of their distance are seen sample point by sample
# point.
_WIDE = 0.3
# Directions to neighbouring places lie about 1.8 radii of these apart. A lobe is this multiple of
# the radius wide at least, so that what is seen of it does not depend on where they lie; but no
# wider than that, however near they are.
_SMOOTH, _WIDEST = 1.0, 0.4
# What one of the fewest rays of a receiver covers is a disc of about so many radians.
_OF_RAY = 0.05
# Sample points that cover less than this share of what a receiver sees of their patch are left out.
_LITTLE = 0.02
# Of patches that cover less than this share of the hemisphere one sample point stands for all.
_FEW = 0.01
# Of the angular radius of what a receiver sees of a place, its least height above that.
_OF_TOUCHED = 0.5
# Directions closer to a place's plane than this, or beyond it, count as if they were so far above:
# of a patch that bends other parts are seen than its middle, and of one that is touched any.
GRAZING = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacePairs:
    """Places on glossy patches as receivers see them.

    count : of the receivers
    receiver, place : (n,) of each pair; receivers ascending
    share : (n,) of the receiver's cosine-weighted hemisphere
    towards : (3, n) unit, to the receiver; lean : (n,) their cosines to the place's normal
    alpha2 : (n,) squared width of the lobe
    more : (n,) what the lobe gets besides, for light that meets several microfacets, times f0
    """

    count: int
    receiver: IndexArray
    place: IndexArray
    share: Array32
    towards: Array32
    lean: Array32
    alpha2: Array32
    more: Array32

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        arrays = (self.receiver, self.place, self.share, self.towards, self.lean)
        return sum(array.nbytes for array in (*arrays, self.alpha2, self.more))


class GlossyPlaces:
    """Middles and sample points of the patches of a body whose lobes are followed.

    Places are the sample points of all of these patches, patch by patch, then their middles.

    glossy : (g,) which patches; law_of_patch : (g,) of each
    middle, normal : (g, 3) of each [m], float32
    """

    def __init__(self, transport: LightTransport, laws: ReflectionLaws) -> None:
        self._transport, self._laws = transport, laws
        law = np.argmax(transport.materials, axis=1)
        self.glossy = np.flatnonzero(laws.glossy[law])
        self.law_of_patch = law[self.glossy]
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

    def pairs(self, seen: sparse.coo_matrix, places: Array, normals: Array) -> PlacePairs:
        """The patches that receivers see.

        seen : (r, g) share of the hemisphere of each receiver
        places, normals : (r, 3) of the receivers [m]
        """
        at, facing = places.astype(np.float32), normals.astype(np.float32)
        order = np.argsort(seen.row, kind="stable")
        row, patch = seen.row[order].astype(np.int64), seen.col[order].astype(np.int64)
        share = seen.data[order]
        offset = at[row] - self.middle[patch]
        distance = np.maximum(_lengths(offset), np.float32(1e-9))
        radius = self._radius
        reach = radius[patch] / distance
        near = reach > _WIDE
        far = ~near
        parts = [
            (
                row[far],
                SAMPLES * len(self.glossy) + patch[far],
                share[far],
                offset[far] / distance[far, None],
                reach[far],
            ),
            self._sampled(row[near], patch[near], share[near], at, facing, radius),
        ]
        row, place, share, towards, reach = (
            np.concatenate(values) for values in zip(*parts, strict=True)
        )
        order = np.argsort(row, kind="stable")
        row, place, share, towards, reach = (
            values[order] for values in (row, place, share, towards, reach)
        )
        # What covers much of the hemisphere is touched, and seen from all heights.
        height = np.maximum(_OF_TOUCHED * np.sqrt(share), GRAZING).astype(np.float32)
        towards, lean = above(towards, self.normals[place], height)
        law = self.law[place]
        # A ray stands for a part of the hemisphere, and no lobe may be narrower than that.
        reach = np.maximum(reach, np.minimum(np.sqrt(share), _OF_RAY))
        width = np.minimum(_SMOOTH * reach, _WIDEST).astype(np.float32)
        alpha2 = self._laws.alpha2[law] + self._bends[place]
        return PlacePairs(
            count=seen.shape[0],
            receiver=row.astype(np.int32),
            place=place,
            share=share.astype(np.float32),
            towards=np.ascontiguousarray(towards.T, dtype=np.float32),
            lean=lean,
            alpha2=np.minimum(np.maximum(alpha2, width * width), np.float32(1.0)),
            more=self._laws.more(law, lean),
        )

    def _sampled(
        self,
        row: IndexArray,
        patch: IndexArray,
        share: Array32,
        places: Array32,
        normals: Array32,
        radius: Array32,
    ) -> tuple[IndexArray, IndexArray, Array32, Array32, Array32]:
        """Pairs of patches nearby: their sample points, by what each covers of the hemisphere."""
        points = self._transport.points[self.glossy]
        offset = places[row][:, None] - points[patch]
        distance = np.maximum(_lengths(offset), np.float32(1e-3) * radius[patch][:, None])
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
        reach = radius[patch][:, None] / (np.float32(SAMPLES**0.5) * distance)
        held = covered > 0.0
        rows = np.broadcast_to(row[:, None], held.shape)
        return rows[held], each[held], covered[held], towards[held], reach[held]

    @cached_property
    def normals(self) -> Array32:
        """(k, 3) of the places."""
        samples = self._transport.normals[self.glossy].reshape(-1, 3)
        return np.concatenate([samples, self.normal])

    @cached_property
    def law(self) -> IndexArray:
        """(k,) of the places."""
        return np.concatenate([np.repeat(self.law_of_patch, SAMPLES), self.law_of_patch])

    @cached_property
    def _bends(self) -> Array32:
        flat = np.zeros(SAMPLES * len(self.glossy), dtype=np.float32)
        return np.concatenate([flat, self._bend2])

    @cached_property
    def patch(self) -> IndexArray:
        """(k,) of the places, in the order of ``glossy``."""
        number = np.arange(len(self.glossy))
        return np.concatenate([np.repeat(number, SAMPLES), number])


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


def _lengths(vectors: Array32) -> Array32:
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))


def _one_of_each(weights: Array32) -> Mask:
    """(n, k) one of each row, drawn by its weights from numbers that are even over the rows."""
    reach = np.cumsum(weights, axis=1)
    drawn = (0.5 + 0.6180339887498949 * np.arange(len(weights))) % 1.0 * reach[:, -1]
    one = np.minimum((reach <= drawn[:, None]).sum(axis=1), weights.shape[1] - 1)
    return np.asarray(np.arange(weights.shape[1]) == one[:, None])
