"""Pairs of a place on a glossy patch and a receiver, laid out for numpy: what lobes send.

The pairs of a patch stand together in rows of some dozens, coordinate by coordinate. Rows without
light are left out; the others are read as they stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array32, IndexArray, Mask
from simgl.radiosity.glossy_places import CONSERVING, GREY, GlossyPlaces, PlacePairs
from simgl.radiosity.reflection_laws import LOBE_ROOM, ReflectionLaws, lobe_in

# Pairs in a row: long ones are copied faster, short ones have less that is filled up.
_ROW = 32
# Rows that are worked out together: what numpy makes of their pairs stays in a processor's cache.
_AT_ONCE = 512
# Of f0, at most.
_POWERS = 3
# Of the table of pairs; and arrays that some rows are worked out in.
_COLUMNS = 6
_ROOM = _COLUMNS + 2 + LOBE_ROOM


@dataclass(frozen=True, kw_only=True, eq=False)
class SunOnPlaces:
    """Sunlight on places of glossy patches.

    direction : (3,) unit, towards the Sun
    arriving : (k,) irradiance that takes part in the lobes of each place [W m-2]
    facing : (k,) cosine of the direction to the normal
    raised : (k,) how much of the normal is added to the direction, and (k,) what the length of
        their sum is divided by; None where nothing is
    """

    direction: Array32
    arriving: Array32
    facing: Array32
    raised: tuple[Array32, Array32] | None


@dataclass(frozen=True, kw_only=True, eq=False)
class LightOnPatches:
    """Light on glossy patches, on each from one direction.

    bright : (g,) those whose lobes send it
    direction : (3, g) unit, where it comes from
    facing : (g,) cosine of that to the normal
    spread2 : (g,) what it widens the squared widths of lobes by
    arriving : (g, 4) irradiance that takes part in lobes [W m-2]
    """

    bright: Mask
    direction: Array32
    facing: Array32
    spread2: Array32
    arriving: Array32


Light = SunOnPlaces | LightOnPatches


class LobePairs:
    """All pairs of some receivers.

    count : of the receivers
    """

    def __init__(self, pairs: PlacePairs, places: GlossyPlaces, laws: ReflectionLaws) -> None:
        self.count = pairs.count
        f0, kind, place = laws.f0[places.law_of_patch], places.kind, pairs.place
        patch = places.patch[place]
        start = np.flatnonzero(np.diff(patch, prepend=-1))
        number = np.diff(start, append=len(patch))
        rows = -(-number // _ROW)
        count = int(rows.sum())
        slot = np.arange(len(patch), dtype=np.int32)
        slot += np.repeat((_ROW * (np.cumsum(rows) - rows) - start).astype(np.int32), number)
        self._patch = np.repeat(patch[start], rows)
        self._f0 = f0
        grey = np.where(kind == GREY, f0[:, 0], np.float32(0.0))
        self._grey = grey[self._patch]
        self._first = np.searchsorted(kind[self._patch], range(_POWERS + 1))
        # Of grey lobes what they send besides is a factor.
        share = pairs.share * (1.0 + grey[patch] * pairs.more)
        # What fills up sends nothing, in a direction for which that can be worked out.
        columns = pairs.x, pairs.y, pairs.z, pairs.lean, pairs.alpha2, share
        self._table = np.zeros((_COLUMNS, count, _ROW), dtype=np.float32)
        self._table[3:5] = 1.0
        for laid, values in zip(self._table.reshape(_COLUMNS, -1), columns, strict=True):
            laid[slot] = values
        first = np.searchsorted(kind[patch], CONSERVING)
        before = int(self._first[CONSERVING])
        self._more = np.zeros((count - before, _ROW), dtype=np.float32)
        self._more.reshape(-1)[slot[first:] - _ROW * before] = pairs.more[first:]
        self._receiver = np.zeros((count, _ROW), dtype=np.int32)
        self._receiver.reshape(-1)[slot] = pairs.receiver
        self._place = np.repeat(place[start], rows).astype(np.int32)[:, None].repeat(_ROW, axis=1)
        self._place.reshape(-1)[slot] = place
        # Places follow each other, in a row as over all: where either changes the next one begins.
        row = slot // _ROW
        begins = np.ones(len(patch), dtype=np.bool_)
        np.not_equal(place[1:], place[:-1], out=begins[1:])
        begins[1:] |= row[1:] != row[:-1]
        each = np.flatnonzero(begins)
        entries = np.ones(len(each), dtype=np.float32), (row[each], place[each])
        shape = len(self._patch), len(places.patch)
        self._of_places = sparse.csr_matrix(entries, shape=shape)

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        arrays = self._table, self._more, self._receiver, self._place, self._patch, self._grey
        of_places = self._of_places
        held = *arrays, of_places.data, of_places.indices, of_places.indptr
        return sum(array.nbytes for array in held)

    def reached(self, light: Light) -> IndexArray:
        """(n,) the rows that a light reaches."""
        if isinstance(light, SunOnPlaces):
            return np.flatnonzero(self._of_places @ light.arriving)
        return np.flatnonzero(light.bright[self._patch])

    def sent(self, lights: Sequence[tuple[Light, IndexArray]]) -> Array32:
        """(count, 4) what receivers get of lights of one type by rows that each reaches [W m-2]."""
        ends = [np.searchsorted(rows, self._first).tolist() for _, rows in lights]
        rows = np.concatenate(
            [
                reached[end[kind] : end[kind + 1]]
                for kind in range(_POWERS)
                for (_, reached), end in zip(lights, ends, strict=True)
            ]
        )
        # From which row on there are weights of each power of f0, and where these stand.
        first = [sum(end[kind] for end in ends) for kind in range(_POWERS)]
        place = np.cumsum([0, *(len(rows) - start for start in first)])
        weights = np.empty((int(place[-1]), _ROW), dtype=np.float32)
        room, done = np.empty((_ROOM, _AT_ONCE, _ROW), dtype=np.float32), 0
        for kind in range(_POWERS):
            for (light, _), end in zip(lights, ends, strict=True):
                for start in range(end[kind], end[kind + 1], _AT_ONCE):
                    number = min(_AT_ONCE, end[kind + 1] - start)
                    of_powers = [
                        weights[at + done - before :][:number]
                        for at, before in zip(place[: kind + 1], first, strict=False)
                    ]
                    some = rows[done : done + number]
                    self._weigh(light, some, of_powers, room[:, :number])
                    done += number
        return self._gathered([rows[start:] for start in first], weights, lights[0][0])

    def _gathered(self, rows: list[IndexArray], weights: Array32, light: Light) -> Array32:
        """(count, 4) by weights (n, _ROW) of the rows of each power of f0, one after the other."""
        of_all = np.concatenate(rows)
        of_powers = [self._f0[self._patch[some]] ** power for power, some in enumerate(rows)]
        factor = np.concatenate(of_powers)
        if isinstance(light, LightOnPatches):
            # Of the Sun weights hold it: it is alike in all bands.
            factor *= light.arriving[self._patch[of_all]]
        # In one product: a result of all receivers takes as long as some thousand pairs.
        each = np.arange(0, weights.size + 1, _ROW, dtype=np.int32)
        entries = weights.ravel(), self._receiver.take(of_all, axis=0).ravel(), each
        matrix = sparse.csc_matrix(entries, shape=(self.count, len(of_all)))
        return np.asarray(matrix @ factor)

    def _weigh(self, light: Light, rows: IndexArray, weights: list[Array32], room: Array32) -> None:
        """What receivers get of rows of one kind (n,): weights (n, _ROW) of each power of f0."""
        table, facing, factor = room[:_COLUMNS], room[_COLUMNS], room[_COLUMNS + 1]
        np.take(self._table, rows, axis=1, out=table, mode="clip")
        x, y, z, lean, alpha2, share = table
        if isinstance(light, SunOnPlaces):
            place = self._place.take(rows, axis=0)
            share *= np.take(light.arriving, place, out=factor, mode="clip")
            np.take(light.facing, place, out=facing, mode="clip")
            direction = light.direction
        else:
            patch = self._patch[rows]
            facing[:] = light.facing[patch, None]
            direction = light.direction[:, patch, None]
            alpha2 += light.spread2[patch, None]
            np.minimum(alpha2, np.float32(1.0), out=alpha2)
        x *= direction[0]
        y *= direction[1]
        z *= direction[2]
        x += y
        x += z
        if isinstance(light, SunOnPlaces) and light.raised is not None:
            by, scale = light.raised
            x += np.multiply(by.take(place), lean, out=factor)
            x *= scale.take(place)
        lobe, schlick = lobe_in(room[-LOBE_ROOM:], alpha2, facing, lean, x)
        lobe *= share
        grazing = np.multiply(schlick, lobe, out=weights[0])
        lobe -= grazing
        if len(weights) == 1:
            lobe *= self._grey[rows, None]
            grazing += lobe
        else:
            weights[1][:] = lobe
        if len(weights) == _POWERS:
            of_more = rows - self._first[CONSERVING]
            more = np.take(self._more, of_more, axis=0, out=factor, mode="clip")
            np.multiply(lobe, more, out=weights[2])
            more *= grazing
            weights[1] += more
