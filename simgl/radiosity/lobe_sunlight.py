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

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.near_means import gather_places
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.reflection_laws import ReflectionLaws, lobe_towards
from simgl.radiosity.sunlit_patches import Sunlit

# Of the work for one direction of the Sun.
PARTS = 5
# Patches whose radius is more than this share of their distance are seen sample point by sample
# point.
_WIDE = 0.3
# Directions to neighbouring places lie about 1.8 radii of these apart. A lobe is this multiple of
# the radius wide at least, so that what is seen of it does not depend on where they lie; but no
# wider than that, however near they are.
_SMOOTH, _WIDEST = 1.0, 0.4
# Sample points that cover less than this share of what a receiver sees of their patch are left out.
_LITTLE = 0.02
# Cosines below this count as this, of places that a receiver sees only in part.
_GRAZING = 0.02
# Pairs that are worked out together: what numpy makes of them stays in a processor's cache.
_AT_ONCE = 16_384


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pairs:
    """Places on glossy patches as receivers see them.

    count : of the receivers
    receiver, place : (n,) of each pair; ascending by the law of the place, then by receiver
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

    def at_points(self, sunlit: Sunlit, direction: Array, evenly: Array32) -> Iterator[Array32]:
        """(s + g, 4) ``PARTS`` of what gather points, of vertices and then of grids, get of a Sun
        of 1 W/m2 more than if the light of lobes left evenly.

        direction : (3,) unit, towards the Sun
        evenly : (p, 4) exitance of the patches by their lobes
        """
        transport, pairs = self._transport, self._to_points
        seen = [transport.sun_gather @ evenly]
        if transport.grids is not None:
            seen.append(transport.grids.gather @ evenly)
        yield -np.concatenate(seen)
        ends = np.linspace(0, len(pairs.place), PARTS, dtype=np.int64)
        for start, end in pairwise(ends.tolist()):
            yield self._received(pairs, sunlit, direction, slice(start, end))

    def at_patches(self, sunlit: Sunlit, direction: Array, evenly: Array32) -> Array32:
        """(p, 4) the same of patches."""
        even = self._transport.form_factors @ evenly
        return self._received(self._to_patches, sunlit, direction) - even

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
        order = np.lexsort((row, self._law_of_place[place]))
        row, place, share, towards, reach = (
            values[order] for values in (row, place, share, towards, reach)
        )
        lean = np.einsum("ni,ni->n", towards, self._place_normals[place])
        lean = np.maximum(lean, _GRAZING)
        law = self._law_of_place[place]
        least = np.minimum(_SMOOTH * reach, _WIDEST).astype(np.float32)
        alpha2 = self._laws.alpha2[law] + self._bend_of_place[place]
        return _Pairs(
            count=seen.shape[0],
            receiver=row.astype(np.int32),
            place=place.astype(np.int32),
            share=share.astype(np.float32),
            towards=np.ascontiguousarray(towards.T, dtype=np.float32),
            lean=lean.astype(np.float32),
            alpha2=np.minimum(np.maximum(alpha2, least * least), np.float32(1.0)),
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

    def _received(
        self, pairs: _Pairs, sunlit: Sunlit, direction: Array, part: slice = slice(None)
    ) -> Array32:
        """(r, 4) what receivers get by the lobes of a Sun of 1 W/m2, by a part of the pairs."""
        facing = np.maximum(self._place_normals @ direction, 0.0).astype(np.float32)
        lit = (sunlit.lit & self._transport.point_open)[self._glossy].ravel()
        arriving = np.concatenate([facing[: len(lit)] * lit, sunlit.cosines[self._glossy]])
        facing = np.maximum(facing, np.float32(_GRAZING))
        light = np.zeros((pairs.count, 4), dtype=np.float32)
        chosen = np.arange(len(pairs.place))[part]
        chosen = chosen[arriving[pairs.place[part]] > 0.0]
        for law, alike in _runs(self._law_of_place[pairs.place[chosen]], chosen):
            for block in _blocks(alike):
                place, receiver = pairs.place[block], pairs.receiver[block]
                x, y, z = (np.float32(direction[i]) * pairs.towards[i][block] for i in range(3))
                lobe, schlick = lobe_towards(
                    pairs.alpha2[block], facing[place], pairs.lean[block], x + y + z
                )
                lobe *= arriving[place] * pairs.share[block]
                more = pairs.more[block] if self._laws.conserving[law] else None
                first = np.flatnonzero(np.diff(receiver, prepend=-1))
                light[receiver[first]] += _sent(self._laws.f0[law], lobe, schlick, more, first)
        return light


def _sent(
    f0: Array32, lobe: Array32, schlick: Array32, more: Array32 | None, first: IndexArray
) -> Array32:
    """(k, 4) sums of lobes with Fresnel's term, each from one of the ``first`` on.

    f0 : (4,); lobe, schlick : (n,); more : (n,) of ``_Pairs``, None for nothing
    """
    grazing = lobe * schlick
    straight = lobe - grazing
    sums = [np.add.reduceat(part, first)[:, None] for part in (straight, grazing)]
    sent = f0 * sums[0] + sums[1]
    if more is not None:
        sums = [np.add.reduceat(part * more, first)[:, None] for part in (straight, grazing)]
        sent += f0 * (f0 * sums[0] + sums[1])
    return np.asarray(sent)


def _runs(law: IndexArray, pairs: IndexArray) -> Iterator[tuple[int, IndexArray]]:
    """Pairs of one law after the other, with its number; laws ascend."""
    starts = np.flatnonzero(np.diff(law, prepend=-1))
    for start, alike in zip(starts, np.split(pairs, starts[1:]), strict=True):
        yield int(law[start]), alike


def _blocks(numbers: IndexArray) -> Iterator[IndexArray]:
    for start in range(0, len(numbers), _AT_ONCE):
        yield numbers[start : start + _AT_ONCE]
