"""Sunlight that glossy patches send on in lobes: by where it goes, not evenly over the hemisphere.

Only the first reflection of the Sun's light is followed so; later bounces leave evenly. What a
patch sends to a receiver is worked out for its middle, or for its sample points where it is so near
that directions differ over it, each with its part of what the receiver sees of the patch.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.near_means import gather_places
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.reflection_laws import ReflectionLaws, lobe_towards
from simgl.radiosity.sunlit_patches import Sunlit

# Of the work for one direction of the Sun.
PARTS = 4
# Patches whose radius is more than this share of their distance are seen sample point by sample
# point.
_WIDE = 0.3
# Directions to neighbouring places lie about 1.8 radii of these apart. A lobe is this multiple of
# the radius wide at least, so that what is seen of it does not depend on where they lie; but no
# wider than that, however near they are.
_SMOOTH, _WIDEST = 1.0, 0.4
# Sample points that cover less than this share of what a receiver sees of their patch are left out.
_LITTLE = 0.02
# Of patches that cover less than this share of the hemisphere one sample point stands for all.
_FEW = 0.01
# Cosines below this count as this, of places that a receiver sees only in part.
_GRAZING = 0.02
# Of how directions spread about their mean, what widens lobes: slopes are half as wide.
_OF_SPREAD = 0.25
# Patches that get less of others than this, by a Sun of 1 W/m2, send that on evenly.
_DIM = 0.02
# Pairs that are worked out together: what numpy makes of them stays in a processor's cache.
_AT_ONCE = 16_384


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pairs:
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


@dataclass(frozen=True, kw_only=True, eq=False)
class _LightOfPlaces:
    """Light that falls on places, from one direction each.

    counts : (k,) whether it is to be followed
    direction : (3, k) unit, where it comes from; facing : (k,) its cosine to the normal
    spread2 : (k,) what it widens the squared widths of lobes by; None for nothing
    sent : irradiance (k, 4) [W m-2], that times f0 and that times f0^2
    """

    counts: Mask
    direction: Array32
    facing: Array32
    spread2: Array32 | None
    sent: tuple[Array32, Array32, Array32]


class LobeSunlight:
    """What the lobes of a body's patches make of the Sun's light.

    Works on numbers of the glossy patches alone.
    """

    def __init__(self, transport: LightTransport, laws: ReflectionLaws) -> None:
        self._transport, self._laws = transport, laws
        law = np.argmax(transport.materials, axis=1)
        self._glossy = np.flatnonzero(laws.glossy[law])
        self._law = law[self._glossy]
        open_ = transport.point_open[self._glossy]
        weight = open_ / np.maximum(open_.sum(axis=1), 1)[:, None]
        self._middle = np.einsum("ps,psi->pi", weight, transport.points[self._glossy])
        self._normal = np.einsum("ps,psi->pi", weight, transport.normals[self._glossy])
        away = transport.points[self._glossy] - self._middle[:, None]
        self._radius = np.sqrt(np.einsum("ps,psi,psi->p", weight, away, away))
        # Slopes of a bent patch's normals widen the lobe of its middle.
        bend = 1.0 - np.einsum("pi,pi->p", self._normal, self._normal)
        self._bend2 = np.maximum(bend, 0.0).astype(np.float32)
        self._normal = unit_rows(self._normal)

    def __bool__(self) -> bool:
        """Whether there is any."""
        return len(self._glossy) > 0

    @property
    def nbytes(self) -> int:
        """Size of its arrays, which it makes at the latest now."""
        return self._to_points.nbytes + self._to_patches.nbytes

    def at_points(self, sunlit: Sunlit, direction: Array) -> Iterator[Array32]:
        """(s + g, 4) ``PARTS`` of what gather points, of vertices and then of grids, get of the
        lobes of a Sun of 1 W/m2.

        direction : (3,) unit, towards the Sun
        """
        pairs, light = self._to_points, self._sunlight(sunlit, direction)
        for start, end in pairwise(
            np.linspace(0, len(pairs.place), PARTS + 1).astype(int).tolist()
        ):
            yield self._sent(pairs, light, start, end)

    def at_patches(self, sunlit: Sunlit, direction: Array, evenly: Array32) -> Array32:
        """(p, 4) the same of patches."""
        even = self._transport.form_factors @ evenly
        pairs, light = self._to_patches, self._sunlight(sunlit, direction)
        return self._sent(pairs, light, 0, len(pairs.place)) - even

    def again_at_vertices(self, exitance: Array32) -> Array32:
        """(s, 4) what gather points of vertices get more than if lobes sent evenly what they get of
        other patches.

        exitance : (p, 4) of the patches [W m-2]
        """
        vertices = self._transport.gather.shape[0]
        end = int(np.searchsorted(self._to_points.receiver, vertices))
        light, evenly = self._light_of_others(exitance)
        sent = self._sent(self._to_points, light, 0, end)[:vertices]
        return np.asarray(sent - self._transport.sun_gather @ evenly)

    def again_at_patches(self, exitance: Array32) -> Array32:
        """(p, 4) the same of patches."""
        pairs, (light, evenly) = self._to_patches, self._light_of_others(exitance)
        sent = self._sent(pairs, light, 0, len(pairs.place))
        return np.asarray(sent - self._transport.form_factors @ evenly)

    @cached_property
    def _to_points(self) -> _Pairs:
        transport = self._transport
        matrices = [transport.sun_gather.tocsr()[:, self._glossy]]
        if transport.grids is not None:
            matrices.append(transport.grids.gather.tocsr()[:, self._glossy])
        return self._pairs(sparse.vstack(matrices, format="coo"), *gather_places(transport))

    @cached_property
    def _to_patches(self) -> _Pairs:
        transport = self._transport
        seen = transport.form_factors.tocsr()[:, self._glossy].tocoo()
        normals = unit_rows(transport.normals.mean(axis=1))
        return self._pairs(seen, transport.points.mean(axis=1), normals)

    def _pairs(self, seen: sparse.coo_matrix, places: Array, normals: Array) -> _Pairs:
        order = np.argsort(seen.row, kind="stable")
        row, patch = seen.row[order].astype(np.int64), seen.col[order].astype(np.int64)
        share = seen.data[order]
        offset = places[row] - self._middle[patch]
        distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
        radius = self._radius
        reach = radius[patch] / distance
        near = reach > _WIDE
        far = ~near
        parts = [
            (
                row[far],
                SAMPLES * len(self._glossy) + patch[far],
                share[far],
                offset[far] / distance[far, None],
                reach[far],
            ),
            self._sampled(row[near], patch[near], share[near], places, normals, radius),
        ]
        row, place, share, towards, reach = (
            np.concatenate(values) for values in zip(*parts, strict=True)
        )
        order = np.argsort(row, kind="stable")
        row, place, share, towards, reach = (
            values[order] for values in (row, place, share, towards, reach)
        )
        lean = np.einsum("ni,ni->n", towards, self._place_normals[place])
        lean = np.maximum(lean, _GRAZING)
        law = self._law_of_place[place]
        width = np.minimum(_SMOOTH * reach, _WIDEST).astype(np.float32)
        alpha2 = self._laws.alpha2[law] + self._bend_of_place[place]
        return _Pairs(
            count=seen.shape[0],
            receiver=row.astype(np.int32),
            place=place,
            share=share.astype(np.float32),
            towards=np.ascontiguousarray(towards.T, dtype=np.float32),
            lean=lean.astype(np.float32),
            alpha2=np.minimum(np.maximum(alpha2, width * width), np.float32(1.0)),
            more=self._laws.more(law, lean),
        )

    def _sampled(
        self,
        row: IndexArray,
        patch: IndexArray,
        share: Array32,
        places: Array,
        normals: Array,
        radius: Array,
    ) -> tuple[IndexArray, IndexArray, Array, Array, Array]:
        """Pairs of patches nearby: their sample points, by what each covers of the hemisphere."""
        points = self._transport.points[self._glossy]
        offset = places[row][:, None] - points[patch]
        distance = np.maximum(np.linalg.norm(offset, axis=2), 1e-3 * radius[patch][:, None])
        towards = offset / distance[:, :, None]
        lean = np.einsum("nsi,nsi->ns", towards, self._transport.normals[self._glossy][patch])
        facing = -np.einsum("nsi,ni->ns", towards, normals[row])
        covered = np.maximum(lean, _GRAZING) * np.maximum(facing, _GRAZING) / distance**2
        covered *= self._transport.point_open[self._glossy][patch]
        covered[covered < _LITTLE * covered.sum(axis=1, keepdims=True)] = 0.0
        few = np.flatnonzero(share < _FEW)
        covered[few] *= _one_of_each(covered[few])
        covered *= (share / np.maximum(covered.sum(axis=1), 1e-30))[:, None]
        each = SAMPLES * patch[:, None] + np.arange(SAMPLES)
        reach = radius[patch][:, None] / (np.sqrt(SAMPLES) * distance)
        held = covered > 0.0
        rows = np.broadcast_to(row[:, None], held.shape)
        return rows[held], each[held], covered[held], towards[held], reach[held]

    @cached_property
    def _place_normals(self) -> Array:
        samples = self._transport.normals[self._glossy].reshape(-1, 3)
        return np.concatenate([samples, self._normal])

    @cached_property
    def _law_of_place(self) -> IndexArray:
        return np.concatenate([np.repeat(self._law, SAMPLES), self._law])

    @cached_property
    def _bend_of_place(self) -> Array32:
        flat = np.zeros(SAMPLES * len(self._glossy), dtype=np.float32)
        return np.concatenate([flat, self._bend2])

    @cached_property
    def _seen(self) -> tuple[sparse.csr_matrix, list[sparse.csr_matrix]]:
        """(g, p) what glossy patches see of all, and that times each coordinate of the directions
        to what they see."""
        seen = self._transport.form_factors.tocsr()[self._glossy].tocoo()
        away = self._transport.points.mean(axis=1)[seen.col] - self._middle[seen.row]
        away /= np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
        shape = seen.row, seen.col
        towards = [
            sparse.csr_matrix(((seen.data * axis).astype(np.float32), shape), shape=seen.shape)
            for axis in away.T
        ]
        return seen.tocsr(), towards

    def _sunlight(self, sunlit: Sunlit, direction: Array) -> _LightOfPlaces:
        """The light of a Sun of 1 W/m2."""
        facing = np.maximum(self._place_normals @ direction, 0.0).astype(np.float32)
        lit = (sunlit.lit & self._transport.point_open)[self._glossy].ravel()
        arriving = np.concatenate([facing[: len(lit)] * lit, sunlit.cosines[self._glossy]])
        return self._light_of_places(
            np.broadcast_to(arriving[:, None], (len(arriving), 4)),
            arriving > 0.0,
            np.broadcast_to(direction.astype(np.float32)[:, None], (3, len(arriving))),
            facing,
            None,
        )

    def _light_of_others(self, exitance: Array32) -> tuple[_LightOfPlaces, Array32]:
        """The light of other patches (p, 4), and what lobes send of it if evenly (p, 4).

        It counts as if it came from its mean direction, and lobes are widened by how much
        directions spread about that.
        """
        seen, towards = self._seen
        irradiance, grey = seen @ exitance, exitance.mean(axis=1)
        vector = np.stack([axis @ grey for axis in towards])
        length = np.linalg.norm(vector, axis=0)
        ratio = np.minimum(length / np.maximum(irradiance.mean(axis=1), np.float32(1e-9)), 1.0)
        from_ = vector / np.maximum(length, np.float32(1e-9))
        spread2 = _OF_SPREAD * (1.0 - ratio * ratio)
        evenly = np.zeros_like(exitance)
        evenly[self._glossy] = self._laws.lobe_albedo[self._law] * irradiance
        patch = self._patch_of_place
        light = self._light_of_places(
            irradiance[patch],
            (irradiance.max(axis=1) > _DIM)[patch],
            from_[:, patch],
            np.einsum("ip,pi->p", from_, self._normal)[patch],
            spread2[patch],
        )
        return light, evenly

    def _light_of_places(
        self,
        irradiance: Array32,
        counts: Mask,
        direction: Array32,
        facing: Array | Array32,
        spread2: Array32 | None,
    ) -> _LightOfPlaces:
        f0 = self._laws.f0[self._law_of_place]
        sent = irradiance, f0 * irradiance, f0 * f0 * irradiance
        return _LightOfPlaces(
            counts=counts,
            direction=direction,
            facing=np.maximum(facing, _GRAZING).astype(np.float32),
            spread2=spread2,
            sent=sent,
        )

    def _sent(self, pairs: _Pairs, light: _LightOfPlaces, start: int, end: int) -> Array32:
        """(r, 4) what receivers get of lobes by some of the pairs [W m-2]."""
        chosen = start + np.flatnonzero(light.counts.take(pairs.place[start:end]))
        straight, grazing = np.empty((2, len(chosen)), dtype=np.float32)
        for first in range(0, len(chosen), _AT_ONCE):
            block = chosen[first : first + _AT_ONCE]
            place = pairs.place.take(block)
            x, y, z = (
                light.direction[i].take(place) * pairs.towards[i].take(block) for i in range(3)
            )
            alpha2 = pairs.alpha2.take(block)
            if light.spread2 is not None:
                alpha2 = np.minimum(alpha2 + light.spread2.take(place), np.float32(1.0))
            lean, facing = pairs.lean.take(block), light.facing.take(place)
            lobe, schlick = lobe_towards(alpha2, facing, lean, x + y + z)
            lobe *= pairs.share.take(block)
            schlick *= lobe
            grazing[first : first + len(block)] = schlick
            np.subtract(lobe, schlick, out=straight[first : first + len(block)])
        place, receiver = pairs.place.take(chosen), pairs.receiver.take(chosen)
        heads = np.flatnonzero(np.diff(receiver, prepend=-1))
        ends, shape = np.append(heads, len(chosen)), (len(heads), len(light.counts))

        def sums(weights: Array32, sent: Array32) -> Array32:
            return np.asarray(sparse.csr_matrix((weights, place, ends), shape=shape) @ sent)

        arriving = sums(grazing, light.sent[0])
        if self._laws.conserving.any():
            more = pairs.more.take(chosen)
            arriving += sums(straight * more, light.sent[2])
            straight += grazing * more
        arriving += sums(straight, light.sent[1])
        all_light = np.zeros((pairs.count, 4), dtype=np.float32)
        all_light[receiver[heads]] = arriving
        return all_light

    @cached_property
    def _patch_of_place(self) -> IndexArray:
        number = np.arange(len(self._glossy))
        return np.concatenate([np.repeat(number, SAMPLES), number])


def _one_of_each(weights: Array) -> Mask:
    """(n, k) one of each row, drawn by its weights from numbers that are even over the rows."""
    reach = np.cumsum(weights, axis=1)
    drawn = (0.5 + 0.6180339887498949 * np.arange(len(weights))) % 1.0 * reach[:, -1]
    one = np.minimum((reach <= drawn[:, None]).sum(axis=1), weights.shape[1] - 1)
    return np.asarray(np.arange(weights.shape[1]) == one[:, None])
