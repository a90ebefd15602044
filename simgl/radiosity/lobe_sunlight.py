"""Sunlight that glossy patches send on in lobes: by where it goes, not evenly over the hemisphere.

Followed so are the first reflection of the Sun's light and, as if it came from one direction, what
glossy patches get of all others. What they send to each other otherwise leaves evenly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.glossy_places import GlossyPlaces, PlacePairs, SomePairs, above
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.near_means import gather_places
from simgl.radiosity.reflection_laws import ReflectionLaws, lobe_towards, lost_by_widening
from simgl.radiosity.sunlit_patches import HiddenPatches, Sunlit

# Of the work for one direction of the Sun, for vertices and for grids each.
PARTS = 2
# Of how directions spread about their mean, what widens lobes: slopes are half as wide.
_OF_SPREAD = 0.25
# Patches that get less of others than this, by a Sun of 1 W/m2, send that evenly; as do those that
# get more, as much as their lobes are less than all that they send.
_DIM = 0.02
# Patches nearby, and those that cover so much more of the hemisphere than their area could from
# their middle, as do the lines between solar cells, are around: their light has no direction and
# goes on evenly. Few rays tell little of those that cover less than this.
_NEAR, _AROUND, _SMALL = 1.3, 1.5, 0.02
# What a cell of the sky, as wide as these lie apart, widens the squared width of lobes by.
_OF_CELL = 0.02
# Pairs that are worked out together: what numpy makes of them stays in a processor's cache.
_AT_ONCE = 16_384


@dataclass(frozen=True, kw_only=True, eq=False)
class _LightOfPlaces:
    """Light that falls on some places, from one direction each; places may share it.

    places : (k,) which, ascending
    row : (k,) the row of each in what follows
    direction : (3, m) unit, where it comes from; facing : (m,) its cosine to the normal
    spread2 : (m,) what it widens the squared widths of lobes by; None for nothing
    sent : irradiance (m, 4) [W m-2], that times f0 and that times f0^2
    """

    places: IndexArray
    row: IndexArray
    direction: Array32
    facing: Array32
    spread2: Array32 | None
    sent: tuple[Array32, Array32, Array32]

    def part(self, start: int, end: int) -> _LightOfPlaces:
        """That of some of the places."""
        return replace(self, places=self.places[start:end], row=self.row[start:end])


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
    def glossy(self) -> IndexArray:
        """(g,) which patches have lobes that are followed."""
        return self._places.glossy

    @property
    def cells(self) -> IndexArray:
        """(c,) which of the transport's cells send light by themselves."""
        return self._places.cells

    @property
    def nbytes(self) -> int:
        """Size of its arrays, which it makes at the latest now."""
        of_points = sum(pairs.nbytes for pairs in self._to_points)
        return of_points + self._to_patches.nbytes

    @property
    def parts(self) -> int:
        """Of ``at_points``."""
        return PARTS * len(self._to_points)

    def at_points(
        self, sunlit: Sunlit, direction: Array, on_cells: Array32 | None
    ) -> Iterator[tuple[int, Array32]]:
        """What gather points, of vertices and then of grids, get of the lobes of a Sun of 1 W/m2,
        in parts: the first point, and (n, 4) more from that on.

        direction : (3,) unit, towards the Sun
        on_cells : of ``cells`` their cosines to it, 0 in shadow; None without cells
        """
        light, start = self._sunlight(sunlit.lit, sunlit.cosines, direction, on_cells), 0
        for pairs in self._to_points:
            number = np.cumsum(np.diff(pairs.first)[light.places])
            ends = np.searchsorted(number, np.linspace(0, number[-1:].sum(), PARTS + 1)[1:-1])
            for first, end in pairwise((0, *ends.tolist(), len(number))):
                yield start, self._sent(pairs, light.part(first, end))
            start += pairs.count

    def at_patches(self, sunlit: Sunlit, direction: Array, evenly: Array32) -> Array32:
        """(p, 4) the same of patches."""
        even = self._transport.form_factors @ evenly
        light = self._sunlight(sunlit.lit, sunlit.cosines, direction, None)
        return self._sent(self._to_patches, light) - even

    def hidden_at_vertices(
        self, hidden: HiddenPatches, direction: Array, on_cells: Array32 | None
    ) -> Array32:
        """(s,) what gather points of vertices would get of the lobes of light that others take
        from a Sun of 1 W/m2, mean of the bands.

        on_cells : as of ``at_points``, where that light is taken
        """
        light = self._sunlight(hidden.samples, hidden.cosines, direction, on_cells)
        return self._sent(self._to_points[0], light).mean(axis=1)

    def again_at_vertices(self, exitance: Array32) -> Array32:
        """(s, 4) what gather points of vertices get more than if lobes sent evenly what they get of
        other patches.

        exitance : (p, 4) of the patches [W m-2]
        """
        light, evenly = self._light_of_others(exitance)
        sent = self._sent(self._to_points[0], light)
        return np.asarray(sent - self._transport.sun_gather @ evenly)

    def again_at_patches(self, exitance: Array32) -> Array32:
        """(p, 4) the same of patches."""
        light, evenly = self._light_of_others(exitance)
        sent = self._sent(self._to_patches, light)
        return np.asarray(sent - self._transport.form_factors @ evenly)

    def of_sky(self, towards: Array32, irradiance: Array32) -> tuple[Array32, Array32]:
        """(s, 4) and (p, 4) what gather points of vertices and patches get of lobes of light from a
        cell of the sky, alike in all bands.

        towards, irradiance : (g, 3) unit and (g,) of the patches ``glossy``
        """
        lit = np.flatnonzero(irradiance > 0.0)
        number = np.full(len(irradiance), -1)
        number[lit] = np.arange(len(lit))
        law, row = self._places.law_of_patch[lit], number[self._places.patch]
        alpha2 = self._laws.alpha2[law]
        wider = np.minimum(alpha2 + np.float32(_OF_CELL), np.float32(1.0))
        arriving = lost_by_widening(alpha2, wider) * irradiance[lit]
        places = np.flatnonzero(row >= 0)
        light = self._light(
            places,
            row[places],
            law,
            (towards[lit], self._places.normal[lit]),
            np.broadcast_to(arriving[:, None], (len(lit), 4)),
            np.full(len(lit), _OF_CELL, dtype=np.float32),
        )
        return self._sent(self._to_points[0], light), self._sent(self._to_patches, light)

    @cached_property
    def _to_points(self) -> list[PlacePairs]:
        """To those of vertices and, where there are any, of grids."""
        transport, start, of_points = self._transport, 0, []
        at, normals = gather_places(transport)
        matrices = [transport.sun_gather]
        if transport.grids is not None:
            matrices.append(transport.grids.gather)
        for gather in matrices:
            part = slice(start, start + gather.shape[0])
            cells = None
            if transport.cells is not None:
                cells = transport.cells.gather[self._places.cells, part]
            seen = gather.tocsr()[:, self._places.glossy].tocoo()
            of_points.append(self._places.pairs(seen, at[part], normals[part], cells))
            start = part.stop
        return of_points

    @cached_property
    def _to_patches(self) -> PlacePairs:
        transport = self._transport
        seen = transport.form_factors.tocsr()[:, self._places.glossy].tocoo()
        normals = unit_rows(transport.normals.mean(axis=1))
        return self._places.pairs(seen, transport.points.mean(axis=1), normals)

    @cached_property
    def _seen(self) -> tuple[sparse.csr_matrix, list[sparse.csr_matrix]]:
        """(g, p) what glossy patches see of all that have a direction, and that times each
        coordinate of the directions to these, less as these spread over the patch."""
        transport, places = self._transport, self._places
        seen = transport.form_factors.tocsr()[places.glossy].tocoo()
        away = transport.points.mean(axis=1)[seen.col] - places.middle[seen.row]
        distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        away /= distance[:, None]
        facing = np.maximum(np.einsum("ni,ni->n", away, places.normal[seen.row]), 0.0)
        # Of the patch as a disc that faces the place, the solid angle over pi.
        size = transport.areas[seen.col] / (np.pi * distance**2)
        away /= np.sqrt(1.0 + size)[:, None]
        has = (size < _NEAR) & (seen.data < _AROUND * size * facing)
        has = np.flatnonzero(has | (seen.data < _SMALL))
        entries = seen.data[has], (seen.row[has], seen.col[has])
        seen, away = sparse.coo_matrix(entries, shape=seen.shape), away[has]
        shape = seen.row, seen.col
        towards = [
            sparse.csr_matrix(((seen.data * axis).astype(np.float32), shape), shape=seen.shape)
            for axis in away.T
        ]
        return seen.tocsr(), towards

    def _sunlight(
        self, samples: Mask, cosines: Array32, direction: Array, on_cells: Array32 | None
    ) -> _LightOfPlaces:
        """The light of a Sun of 1 W/m2 on sample points (p, n), on patches by their mean cosines
        (p,), and on cells; not on these where they are not asked for."""
        glossy = self._places.glossy
        lit = (samples & self._transport.point_open)[glossy].ravel()
        towards = direction.astype(np.float32)
        facing = np.maximum(self._places.normals[: len(lit)] @ towards, 0.0)
        arriving = [facing * lit, cosines[glossy]]
        if on_cells is not None:
            arriving.append(on_cells)
        of_places = np.concatenate(arriving)
        places = np.flatnonzero(of_places > 0.0)
        return self._light(
            places,
            np.arange(len(places)),
            self._places.law[places],
            (np.broadcast_to(towards, (len(places), 3)), self._places.normals[places]),
            np.broadcast_to(of_places[places, None], (len(places), 4)),
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
        law = self._places.law_of_patch
        sent = self._laws.lobe_albedo[law] * irradiance
        bright = irradiance.max(axis=1) * self._laws.part_of_lobe[law] > _DIM
        evenly = np.zeros_like(exitance)
        evenly[self._places.glossy[bright]] = sent[bright]
        alpha2 = self._laws.alpha2[law]
        remaining = lost_by_widening(alpha2, np.minimum(alpha2 + spread2, np.float32(1.0)))
        places = np.flatnonzero(bright[self._places.patch])
        light = self._light(
            places,
            (np.cumsum(bright) - 1)[self._places.patch[places]],
            law[bright],
            (from_.T[bright], self._places.normal[bright]),
            (remaining[:, None] * irradiance)[bright],
            spread2[bright],
        )
        return light, evenly

    def _light(
        self,
        places: IndexArray,
        row: IndexArray,
        law: IndexArray,
        towards: tuple[Array32, Array32],
        irradiance: Array32,
        spread2: Array32 | None = None,
    ) -> _LightOfPlaces:
        """Of irradiance (m, 4) from directions and on normals (m, 3)."""
        raised, facing = above(*towards)
        arriving = irradiance * self._laws.taking_part(law, facing)[:, None]
        f0 = self._laws.f0[law]
        return _LightOfPlaces(
            places=places,
            row=row,
            direction=np.ascontiguousarray(raised.T),
            facing=facing,
            spread2=spread2,
            sent=(arriving, f0 * arriving, f0 * f0 * arriving),
        )

    def _sent(self, pairs: PlacePairs, light: _LightOfPlaces) -> Array32:
        """(r, 4) what receivers get of lobes [W m-2]."""
        first = pairs.first[light.places]
        number = pairs.first[light.places + 1] - first
        ends = np.zeros(len(number) + 1, dtype=np.int64)
        np.cumsum(number, out=ends[1:])
        # Weights of what is sent, and who gets it: pairs of these places one after the other.
        weights = np.empty((3, int(ends[-1])), dtype=np.float32)
        receiver = np.empty(int(ends[-1]), dtype=np.int32)
        starts = np.searchsorted(ends, np.arange(0, int(ends[-1]), _AT_ONCE))
        for start, end in pairwise(np.unique([*starts.tolist(), len(number)]).tolist()):
            each, part = number[start:end], slice(int(ends[start]), int(ends[end]))
            chosen = np.repeat(first[start:end] - ends[start:end], each)
            chosen += np.arange(part.start, part.stop)
            row = np.repeat(light.row[start:end], each)
            receiver[part] = _weights(pairs.of(chosen), light, row, weights[:, part])
        # One matrix whose entries change: the numbers of rows are checked once.
        shape, light_sent = (pairs.count, len(number)), np.zeros((pairs.count, 4), np.float32)
        matrix = sparse.csc_matrix((weights[0], receiver, ends), shape=shape)
        for weight, sent in zip(weights, light.sent, strict=True):
            matrix.data = weight
            light_sent += matrix @ sent.take(light.row, axis=0)
        return light_sent


def _weights(pairs: SomePairs, light: _LightOfPlaces, row: IndexArray, weights: Array32) -> Array32:
    """(n,) the receivers of some pairs.

    row : (n,) the light of each
    weights : (3, n) gets their shares of what is ``sent``
    """
    turn = light.direction[0].take(row) * pairs.x
    turn += light.direction[1].take(row) * pairs.y
    turn += light.direction[2].take(row) * pairs.z
    alpha2 = pairs.alpha2
    if light.spread2 is not None:
        alpha2 = np.minimum(alpha2 + light.spread2.take(row), np.float32(1.0))
    lobe, schlick = lobe_towards(alpha2, light.facing.take(row), pairs.lean, turn)
    lobe *= pairs.share
    grazing = np.multiply(schlick, lobe, out=weights[0])
    lobe -= grazing
    np.multiply(lobe, pairs.more, out=weights[2])
    lobe += grazing * pairs.more
    weights[1] = lobe
    return pairs.receiver
