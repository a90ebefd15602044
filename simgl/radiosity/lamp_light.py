"""Light of lamps on the patches of a body.

Which sample points of the body see a lamp is traced from places of a grid, whose steps are small
beside the lamp's distance, and linear between four of them, as in a penumbra: a lamp that nears the
body comes to a new one every few frames. All else is that of the lamp's own place.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.lru_cache import LruCache
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.pose_steps import in_multiples
from simgl.radiosity.solver import Blocker

# Steps of the grid as a share of the distance from the body's box, at most: 0.9 deg as seen from
# there, 0.6 deg on average. The grid of the Sun's directions has half a degree.
_STEP = 1.0 / 64.0
# Places in memory, of some ten kilobytes each.
_PLACES = 64
# Lamps take steps of so much of that distance, and of so much of a radian: their light then
# changes by a thousandth on average, and is known again for some frames of a slow approach.
_SMALL_STEP = 1.0 / 512.0
# What is known of a sample point.
_UNKNOWN, _LIT, _SHADED = 0, 1, 2


@dataclass(frozen=True, kw_only=True, eq=False)
class SpotLight:
    """A lamp in body axes.

    place : (3,) [m]; axis : (3,) unit, along the beam
    half_angle, edge : of full intensity, and the fall to zero around it [rad]
    intensity : (4,) [W sr-1]
    """

    place: Array
    axis: Array
    half_angle: float
    edge: float
    intensity: Array

    def in_steps(self, gap: float) -> SpotLight:
        """The same lamp, its place and its axis rounded.

        gap : its distance from the box of the body that it lights [m]; at none its place stays
        """
        axis = in_multiples(self.axis, _SMALL_STEP)
        place = self.place if gap == 0.0 else in_multiples(self.place, _step(gap, _SMALL_STEP))
        return replace(self, place=place, axis=axis / np.linalg.norm(axis))

    @property
    def beam(self) -> tuple[Hashable, ...]:
        """Equal for lamps whose light differs by their intensity alone."""
        return self.place.tobytes(), self.axis.tobytes(), self.half_angle, self.edge


class LampLight:
    """The irradiance of the patches of a body by lamps.

    Results follow from transport and lamp alone: those in memory only save tracing.
    """

    def __init__(self, transport: LightTransport) -> None:
        self._transport = transport
        self._known = LruCache[bytes, NDArray[np.uint8]](_PLACES)

    def gap(self, lamp: SpotLight) -> float:
        """Its distance from the body's box [m]; 0 inside."""
        return beyond_box(lamp.place, self._transport.box)

    def irradiance(self, lamp: SpotLight, blockers: Sequence[Blocker] = ()) -> Array32:
        """(p,) mean of each patch, for an intensity of 1 W sr-1 [W m-2].

        blockers : other bodies, which may stand before the lamp
        """
        points = self._transport.sample_points
        place, axis = lamp.place.astype(np.float32), lamp.axis.astype(np.float32)
        # How far the lamp is above each point's plane. Most are turned away from it.
        height = np.einsum("in,i->n", points.normals, place) - points.plane
        facing = np.flatnonzero((height > 0.0) & points.open)
        offset = place[:, None] - np.take(points.places, facing, axis=1)
        distance = np.sqrt(np.einsum("in,in->n", offset, offset))
        cosine = np.einsum("in,i->n", offset, -axis) / distance
        power = _beam(lamp, cosine) * height[facing] / (distance * distance * distance)
        lit = np.flatnonzero(power > 0.0)
        seen = self.seen(lamp.place, facing[lit])
        lit, seen = lit[seen > 0.0], seen[seen > 0.0]
        ways = np.ascontiguousarray(np.take(offset, lit, axis=1).T)
        seen *= power[lit] * ~_blocked(lamp, ways, distance[lit], blockers)
        total = np.bincount(points.patch[facing[lit]], seen, minlength=len(self._transport.areas))
        return np.asarray(total / points.count, dtype=np.float32)

    def seen(self, place: Array, chosen: IndexArray) -> Array32:
        """(k,) how far sample points see a place, but for other bodies: 0 to 1."""
        share = np.zeros(len(chosen), dtype=np.float32)
        for corner, weight in self._corners(place):
            share += np.float32(weight) * self._sees(corner, chosen)
        return share

    def _sees(self, place: Array, chosen: IndexArray) -> Mask:
        """(k,) which sample points see a place, but for other bodies."""
        points = self._transport.sample_points
        known = self._known.get(place.tobytes(), lambda: np.zeros(len(points.patch), np.uint8))
        asked = chosen[known[chosen] == _UNKNOWN]
        starts = np.ascontiguousarray(np.take(points.places, asked, axis=1).T)
        ends = np.full(len(asked), 1.0 - 1e-3, dtype=np.float32)
        shaded = self._transport.tracer.occluded(starts, place.astype(np.float32) - starts, ends)
        known[asked] = np.where(shaded, _SHADED, _LIT)
        return np.asarray(known[chosen] == _LIT)

    def _corners(self, place: Array) -> list[tuple[Array, float]]:
        """Four places of the grid with weights whose mean is the one given.

        That one itself inside the body's box, where surfaces may be as near as they like.
        """
        gap = beyond_box(place, self._transport.box)
        if gap == 0.0:
            return [(place, 1.0)]
        step = _step(gap, _STEP)
        corner = np.floor(place / step)
        along = place / step - corner
        # The tetrahedron of its cube whose edges run along the axes in this order.
        order = np.argsort(-along, kind="stable")
        ends = [1.0, *along[order].tolist(), 0.0]
        corners = []
        for axis, weight in zip([*order.tolist(), 0], -np.diff(ends), strict=True):
            if weight > 0.0:
                # Without negative zeros: equal places have equal bits.
                corners.append((step * corner + 0.0, float(weight)))
            corner[axis] += 1.0
        return corners


def beyond_box(place: Array, box: tuple[Array, Array]) -> float:
    """Distance of a place from a box, given by its lowest and its highest corner; 0 inside."""
    low, high = box
    return float(np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0.0)))


def _step(distance: float, share: float) -> float:
    """A power of two, at most so much of a distance."""
    return float(2.0 ** np.floor(np.log2(share * distance)))


def _beam(lamp: SpotLight, cosine: Array32) -> Array32:
    """(n,) share of a lamp's full intensity at angles from its axis, given by their cosines."""
    share = (cosine >= np.cos(lamp.half_angle)).astype(np.float32)
    edge = np.flatnonzero(
        (share == 0.0) & (cosine > np.cos(min(lamp.half_angle + lamp.edge, np.pi)))
    )
    beyond = (np.arccos(cosine[edge]) - np.float32(lamp.half_angle)) / np.float32(lamp.edge)
    beyond = np.clip(beyond, 0.0, 1.0)
    share[edge] = 1.0 - beyond * beyond * (3.0 - 2.0 * beyond)
    return share


def _blocked(
    lamp: SpotLight, ways: Array32, distances: Array32, blockers: Sequence[Blocker]
) -> Mask:
    """(k,) whether other bodies lie between a lamp and points in its beam.

    ways : (k, 3) from the points to the lamp
    """
    blocked = np.zeros(len(ways), dtype=np.bool_)
    # The lamp sits on its own craft: its housing, within 1 cm, does not count.
    ends = (1.0 - 0.01 / distances).astype(np.float32)
    for blocker in blockers:
        turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
        rest = np.flatnonzero(~blocked)
        rays = np.take(ways, rest, axis=0) @ turn.T.astype(np.float32)
        origins = (turn @ lamp.place + shift).astype(np.float32) - rays
        blocked[rest] = blocker.tracer.occluded(origins, rays, ends[rest])
    return blocked


def reaches_into(blocker: Blocker, lamp: SpotLight) -> bool:
    """Whether any of a body lies before a lamp: none of what carries it does, as a rule."""
    if lamp.half_angle + lamp.edge >= 0.5 * np.pi:
        return True
    turn, shift = blocker.other_from_body[:3, :3], blocker.other_from_body[:3, 3]
    place, axis = turn @ lamp.place + shift, turn @ lamp.axis
    return bool(((blocker.hull - place) @ axis).max() > 0.0)
