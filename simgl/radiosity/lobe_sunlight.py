"""Sunlight that glossy patches send on in lobes: by where it goes, not evenly over the hemisphere.

Followed so are the first reflection of the Sun's light and, as if it came from one direction, what
glossy patches get of all others. What they send to each other otherwise leaves evenly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, Mask
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.glossy_places import GlossyPlaces, PlacePairs, above
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.near_means import gather_places
from simgl.radiosity.reflection_laws import ReflectionLaws, lobe_towards, lost_by_widening
from simgl.radiosity.sunlit_patches import Sunlit

# Of the work for one direction of the Sun.
PARTS = 4
# Of how directions spread about their mean, what widens lobes: slopes are half as wide.
_OF_SPREAD = 0.25
# Patches that get less of others than this, by a Sun of 1 W/m2, send that on evenly.
_DIM = 0.02
# Pairs that are worked out together: what numpy makes of them stays in a processor's cache.
_AT_ONCE = 16_384


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

    laws : of the body's materials
    """

    def __init__(self, transport: LightTransport, laws: ReflectionLaws) -> None:
        self._transport, self._laws = transport, laws
        self._places = GlossyPlaces(transport, laws)

    def __bool__(self) -> bool:
        """Whether there is any."""
        return self._places.count > 0

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
    def _to_points(self) -> PlacePairs:
        transport = self._transport
        matrices = [transport.sun_gather.tocsr()[:, self._places.glossy]]
        if transport.grids is not None:
            matrices.append(transport.grids.gather.tocsr()[:, self._places.glossy])
        return self._places.pairs(sparse.vstack(matrices, format="coo"), *gather_places(transport))

    @cached_property
    def _to_patches(self) -> PlacePairs:
        transport = self._transport
        seen = transport.form_factors.tocsr()[:, self._places.glossy].tocoo()
        normals = unit_rows(transport.normals.mean(axis=1))
        return self._places.pairs(seen, transport.points.mean(axis=1), normals)

    @cached_property
    def _seen(self) -> tuple[sparse.csr_matrix, list[sparse.csr_matrix]]:
        """(g, p) what glossy patches see of all, and that times each coordinate of the directions
        to what they see."""
        seen = self._transport.form_factors.tocsr()[self._places.glossy].tocoo()
        away = self._transport.points.mean(axis=1)[seen.col] - self._places.middle[seen.row]
        away /= np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
        shape = seen.row, seen.col
        towards = [
            sparse.csr_matrix(((seen.data * axis).astype(np.float32), shape), shape=seen.shape)
            for axis in away.T
        ]
        return seen.tocsr(), towards

    def _sunlight(self, sunlit: Sunlit, direction: Array) -> _LightOfPlaces:
        """The light of a Sun of 1 W/m2."""
        facing = np.maximum(self._places.normals @ direction, 0.0).astype(np.float32)
        lit = (sunlit.lit & self._transport.point_open)[self._places.glossy].ravel()
        arriving = np.concatenate([facing[: len(lit)] * lit, sunlit.cosines[self._places.glossy]])
        towards = np.broadcast_to(direction.astype(np.float32), (len(arriving), 3))
        irradiance = np.broadcast_to(arriving[:, None], (len(arriving), 4))
        return self._light_of_places(irradiance, arriving > 0.0, towards, None)

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
        evenly[self._places.glossy] = self._laws.lobe_albedo[self._places.law_of_patch] * irradiance
        alpha2 = self._laws.alpha2[self._places.law_of_patch]
        remaining = lost_by_widening(alpha2, np.minimum(alpha2 + spread2, np.float32(1.0)))
        patch = self._places.patch
        light = self._light_of_places(
            (remaining[:, None] * irradiance)[patch],
            (irradiance.max(axis=1) > _DIM)[patch],
            from_.T[patch],
            spread2[patch],
        )
        return light, evenly

    def _light_of_places(
        self,
        irradiance: Array32,
        counts: Mask,
        towards: Array32,
        spread2: Array32 | None,
    ) -> _LightOfPlaces:
        f0 = self._laws.f0[self._places.law]
        sent = irradiance, f0 * irradiance, f0 * f0 * irradiance
        raised, facing = above(towards, self._places.normals)
        return _LightOfPlaces(
            counts=counts,
            direction=np.ascontiguousarray(raised.T),
            facing=facing,
            spread2=spread2,
            sent=sent,
        )

    def _sent(self, pairs: PlacePairs, light: _LightOfPlaces, start: int, end: int) -> Array32:
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
