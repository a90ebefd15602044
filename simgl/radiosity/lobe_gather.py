"""What glossy surfaces see of spacecraft in their lobes, by rays.

Each point sends a few rays, spread over its lobe by the visible microfacets. Neighbours in the
image send theirs in other directions, and what they find is spread over those whose lobes meet the
same places: a smooth picture of few rays, the same for the same scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.final_gather import LitBody, first_met, leaving
from simgl.radiosity.gather_points import LIFT
from simgl.radiosity.hemisphere import frames

# Of each point; the points of a square of 8 x 8 send different ones, which together fill the lobe.
RAYS = 4
# Further ones of points that have to do without their neighbours.
_MORE_RAYS = 12
# Rays that are traced together, some 300 bytes each.
_AT_ONCE = 400_000
# How far the rays of a point count for others: of its lobe's width where they end, and at most so
# many points to each side. A spread over 0.8 alpha to each side makes a lobe, of half width 1.3
# alpha, a tenth wider.
_OF_WIDTH, _MAX_POINTS = 0.8, 12
# Where fewer of the rays meet anything, a lobe's tail does, which changes slower over the surface.
_TAIL, _OF_TAIL = 0.02, 2.4
# So many points to each side tell how far away things are.
_LOOK_AROUND = 4
# Lobes as wide as this use two points to each side however close things are: this shows as a soft
# edge, where few rays would show as grain.
_ROUGH = 0.1
# Neighbours whose normals turn by more of the lobe's width, or whose step leaves the surface by
# more of its length, have rays of their own.
_TURN, _STEP = 0.2, 0.1


def _turns() -> IndexArray:
    """(8, 8) when each point of a square takes its rays: early ones lie apart (Bayer's dither)."""
    turns = np.zeros((1, 1), dtype=np.int64)
    for _ in range(3):
        turns = np.block([[4 * turns, 4 * turns + 2], [4 * turns + 3, 4 * turns + 1]])
    return turns


_TURNS = _turns()


@dataclass(frozen=True, kw_only=True, eq=False)
class Lobes:
    """Lobes of points of a body that an image shows, in its axes.

    places : (n, 3) [m]; normals, facets : (n, 3) unit, towards the viewer, of the shading and of
        the triangles; viewer : (n, 3) unit, towards the viewer
    alpha : (n,) widths; f0 : (n,) reflectance at normal incidence, mean of the bands
    label : (n,) the same for points of one surface law
    row, column : (n,) in the image, about a pixel each
    """

    places: Array32
    normals: Array32
    facets: Array32
    viewer: Array32
    alpha: Array32
    f0: Array32
    label: IndexArray
    row: IndexArray
    column: IndexArray

    def of(self, chosen: slice | IndexArray) -> Lobes:
        """Some of them."""
        return Lobes(**{name: values[chosen] for name, values in vars(self).items()})


def seen_in_lobes(lobes: Lobes, bodies: Sequence[LitBody]) -> tuple[Array32, Array32]:
    """What lobes see of bodies: (n, 4) mean radiance [W m-2 sr-1], and (n,) how much goes past.

    bodies : the points' own first, then those around

    Means are those of light by the lobe's reflectance: a uniform world gives its own radiance.
    """
    count = len(lobes.places)
    sums = _traced(lobes, bodies, 0, RAYS)
    if not sums[:, 7].any():
        return sums[:, :4], np.ones(count, dtype=np.float32)
    neighbours = _Neighbours(lobes, sums)
    isolated = np.flatnonzero(neighbours.isolated)
    if len(isolated):
        sums[isolated] += _traced(lobes.of(isolated), bodies, _TURNS.size * RAYS, _MORE_RAYS)
        # To their neighbours they count as others do.
        sums[isolated] *= RAYS / (RAYS + _MORE_RAYS)
    # Of running sums rounding may leave less than nothing.
    total = np.maximum(neighbours.spread(sums[:, :6]), 0.0)
    weight = np.maximum(total[:, 5], 1e-9)
    seen, past = total[:, :4] / weight[:, None], np.minimum(total[:, 4] / weight, 1.0)
    return seen.astype(np.float32), past.astype(np.float32)


def _traced(lobes: Lobes, bodies: Sequence[LitBody], first: int, rays: int) -> Array32:
    """(n, 8) sums over rays: light by weights; weights of what goes past, and of all; nearness of
    what was met, and its number.

    first : of a sequence of directions, from which each point of a square takes so many rays
    """
    count = len(lobes.places)
    sums = np.empty((count, 8), dtype=np.float32)
    step = max(1, _AT_ONCE // rays)
    for start in range(0, count, step):
        part = slice(start, start + step)
        sums[part] = _sums(lobes.of(part), bodies, first, rays)
    return sums


def _sums(lobes: Lobes, bodies: Sequence[LitBody], first: int, rays: int) -> Array32:
    directions, weights = _rays(lobes, first, rays)
    count = len(lobes.places)
    lift = np.float32(LIFT * bodies[0].mesh.radius)
    origins = np.repeat(lobes.places + lift * lobes.facets, rays, axis=0)
    body, triangle, distance = first_met(origins, directions, bodies)
    met = np.flatnonzero(body >= 0)
    sums = np.zeros((count * rays, 8), dtype=np.float32)
    ways = directions[met]
    places = origins[met] + distance[met, None] * ways
    radiance = leaving(places, ways, body[met], triangle[met], bodies)[0]
    sums[met, :4] = weights[met, None] * radiance
    sums[:, 4] = np.where(body < 0, weights, 0.0)
    sums[:, 5] = weights
    sums[met, 6] = 1.0 / np.maximum(distance[met], lift)
    sums[met, 7] = 1.0
    return sums.reshape(count, rays, 8).sum(axis=1)


def _rays(lobes: Lobes, first: int, rays: int) -> tuple[Array32, Array32]:
    """(n * rays, 3) directions and (n * rays,) what the lobe reflects of the light along each.

    Normals of microfacets follow those that the viewer sees (Heitz 2018, "Sampling the GGX
    distribution of visible normals"), as caps of a sphere (Dupuy & Benyoub 2023). What is left of
    the reflectance is Fresnel's term and the masking of the light, G2 / G1.
    """
    frame = frames(lobes.normals.astype(np.float64)).astype(np.float32)
    wo = np.einsum("nji,nj->ni", frame, lobes.viewer)
    # An interpolated normal can lean away from the viewer by a facet's angle.
    wo[:, 2] = np.maximum(wo[:, 2], np.float32(1e-2))
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    alpha = lobes.alpha[:, None]
    u, v = _even(lobes, first, rays)
    stretched = np.concatenate([alpha * wo[:, :2], wo[:, 2:]], axis=1)
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    turn = np.float32(2.0 * np.pi) * u
    z = (1.0 - v) * (1.0 + stretched[:, 2:]) - stretched[:, 2:]
    sine = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    h = np.stack(
        [
            alpha * (sine * np.cos(turn) + stretched[:, :1]),
            alpha * (sine * np.sin(turn) + stretched[:, 1:2]),
            np.maximum(z + stretched[:, 2:], np.float32(1e-6)),
        ],
        axis=2,
    )
    h /= np.linalg.norm(h, axis=2, keepdims=True)
    cosine = np.einsum("nki,ni->nk", h, wo)
    wi = 2.0 * cosine[..., None] * h - wo[:, None]
    f0 = lobes.f0[:, None]
    fresnel = f0 + (1.0 - f0) * (1.0 - np.clip(cosine, 0.0, 1.0)) ** 5
    out, in_ = _masked(wo[:, None, 2], alpha), _masked(np.maximum(wi[..., 2], 1e-6), alpha)
    weights = np.where(wi[..., 2] > 0.0, fresnel * (1.0 + out) / (1.0 + out + in_), 0.0)
    ways = np.einsum("nij,nkj->nki", frame, wi)
    # Below the triangle that stands for a smooth surface: upwards again.
    below = np.minimum(np.einsum("nki,ni->nk", ways, lobes.facets), 0.0)
    ways -= 2.0 * below[..., None] * lobes.facets[:, None]
    return (
        np.ascontiguousarray(ways.reshape(-1, 3), dtype=np.float32),
        weights.ravel().astype(np.float32),
    )


def _masked(cosine: Array32, alpha: Array32) -> Array32:
    """Smith's Lambda of a direction (Heitz 2014)."""
    tangent2 = 1.0 / (cosine * cosine) - 1.0
    return np.asarray(0.5 * (np.sqrt(1.0 + alpha * alpha * tangent2) - 1.0), dtype=np.float32)


def _even(lobes: Lobes, first: int, rays: int) -> tuple[Array32, Array32]:
    """(n, rays) pairs 0..1, even for each point and for all of a square (Roberts 2018).

    Squares are shifted against each other, so that they do not all miss the same.
    """
    turn = _TURNS[lobes.row % 8, lobes.column % 8]
    index = (first + turn * rays)[:, None] + np.arange(rays)
    across, down = lobes.column // 8, lobes.row // 8
    first_shift = 0.7548776662466927 * across + 0.5698402909980532 * down
    second_shift = 0.8566748838545029 * across + 0.7338918566271260 * down
    u = (0.7548776662466927 * index + first_shift[:, None]) % 1.0
    v = (0.5698402909980532 * index + second_shift[:, None]) % 1.0
    return u.astype(np.float32), v.astype(np.float32)


class _Neighbours:
    """Along the image's rows, then along its columns, the points whose rays each point uses.

    isolated : (n,) that use only their own, and do not see the same all over their lobes
    """

    def __init__(self, lobes: Lobes, sums: Array32) -> None:
        rows = _Runs(lobes, lobes.row, lobes.column)
        columns = _Runs(lobes, lobes.column, lobes.row)
        near = np.asarray(sums[:, 6:], dtype=np.float64)
        for runs in (rows, columns):
            near = runs.spread(near, np.full(len(sums), _LOOK_AROUND))
        # Less than one ray's share of a square is rounding.
        met = np.where(near[:, 1] > 1e-3, near[:, 1] / RAYS, 0.0)
        # The harmonic mean distance of what rays around met.
        distance = np.where(met > 0.0, near[:, 1] / np.maximum(near[:, 0], 1e-12), 0.0)
        width = lobes.alpha * distance * np.where(met < _TAIL, _OF_TAIL, _OF_WIDTH)
        reaches = []
        for runs in (rows, columns):
            points = 0.5 + 0.5 * width / np.maximum(runs.step, 1e-12)
            reach = 2 * np.minimum(points, _MAX_POINTS // 2).astype(np.int64)
            reach = np.maximum(reach, np.where(lobes.alpha >= _ROUGH, 2, 0))
            reaches.append(np.where(runs.step > 0.0, reach, 0))
        # At 1 a lobe is filled, but for rounding.
        unsure = (met > 0.0) & (met < 1.0 - 1e-3)
        self.isolated: Mask = unsure & (np.minimum(*reaches) == 0)
        self._along = list(zip((rows, columns), reaches, strict=True))

    def spread(self, values: Array32) -> Array:
        """(n, c) values, each spread over the points that use it."""
        result: Array = values.astype(np.float64)
        for runs, reach in self._along:
            result = runs.spread(result, reach)
        return result


class _Runs:
    """Points one after the other along lines of the image, in runs over one smooth surface.

    step : (n,) mean distance from point to point in each one's run [m]; 0 of a single point
    """

    def __init__(self, lobes: Lobes, line: IndexArray, along: IndexArray) -> None:
        self._order = np.argsort(line * (int(along.max()) + 2) + along, kind="stable")
        order = self._order
        a, b = order[:-1], order[1:]
        offset = lobes.places[b] - lobes.places[a]
        length = np.linalg.norm(offset, axis=1)
        turn = np.linalg.norm(lobes.normals[b] - lobes.normals[a], axis=1)
        rise = np.abs(np.einsum("ij,ij->i", offset, lobes.normals[a]))
        joined: Mask = (line[b] == line[a]) & (along[b] == along[a] + 1)
        joined &= (lobes.label[b] == lobes.label[a]) & (turn <= _TURN * lobes.alpha[a])
        joined &= rise <= _STEP * length
        run = np.concatenate([[0], np.cumsum(~joined)])
        first = np.concatenate([[0], np.flatnonzero(~joined) + 1, [len(order)]])
        self._start, self._end = first[run], first[run + 1] - 1
        total = np.bincount(run[1:][joined], length[joined], minlength=len(first) - 1)
        steps = total / np.maximum(np.diff(first) - 1, 1)
        self.step = np.empty(len(order))
        self.step[order] = steps[run]

    def spread(self, values: Array, reach: IndexArray) -> Array:
        """(n, c) values, each spread over so many points to each side (n,), even numbers, in runs.

        The outermost count half: all turns of a square then count the same.
        """
        here, reach = np.arange(len(self._order)), reach[self._order]
        low = np.maximum(here - reach, self._start)
        high = np.minimum(here + reach, self._end)
        # Two windows, with their ends and without.
        first, last = np.minimum(low + 1, here), np.maximum(high - 1, here)
        starts, ends = np.concatenate([low, first]), np.concatenate([high, last]) + 1
        part = values[self._order] / ((high - low) + (last - first) + 2)[:, None]
        result = np.empty_like(part)
        for channel, value in enumerate(np.tile(part, (2, 1)).T):
            change = np.bincount(starts, value, len(here) + 1)
            change -= np.bincount(ends, value, len(here) + 1)
            result[self._order, channel] = np.cumsum(change)[:-1]
        return result
