"""What other spacecraft take from the Sun's light between the surfaces of one.

Of what leaves evenly they take a share, found by solving for the light that they take as for all of
the Sun's. What the lobes of metal send before bounces comes from few places, and hides with these.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.lru_cache import LruCache
from simgl.radiosity.incident_light import Neighbour
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.precomputed_response import GatheredSunlight, PrecomputedResponse
from simgl.radiosity.solver import Reflectors
from simgl.radiosity.sunlit_patches import (
    HiddenPatches,
    Node,
    SunlitPatches,
    direction_of,
    grid_corners,
)

# Of some 100 kB each: directions of the Sun and poses of others to the body.
_MAX_NODES = 32


@dataclass(frozen=True, kw_only=True, eq=False)
class _Evenly:
    """What leaves the patches evenly (p,) of the light that others take from a Sun of 1 W/m2, and
    of all of its light; means of the bands."""

    taken: Array32
    sent: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class TakenSunlight:
    """What others take from a Sun of 1 W/m2, and all that there is; means of the bands.

    at_patches : (p, 2) of what leaves the patches evenly
    at_points : (s, 2) of what lobes bring to gather points of vertices
    """

    at_patches: Array32
    at_points: Array32


class HiddenSunlight:
    """Of one body, as others stand before the Sun."""

    def __init__(
        self,
        transport: LightTransport,
        surface: Reflectors,
        sunlit: SunlitPatches,
        response: PrecomputedResponse,
    ) -> None:
        self._transport, self._surface = transport, surface
        self._sunlit, self._response = sunlit, response
        self._nodes = LruCache[tuple[Hashable, ...], HiddenPatches](_MAX_NODES)
        self._lobes = LruCache[tuple[Hashable, ...], Array32](_MAX_NODES)

    def cosines(self, direction: Array, before: Sequence[Neighbour]) -> Array32:
        """(p,) of the Sun's light on the patches what others take.

        direction : (3,) unit, towards the Sun, body axes
        before : the others, in steps of their poses
        """
        hidden = np.zeros(len(self._transport.areas), dtype=np.float32)
        for node, weight in grid_corners(direction):
            hidden += np.float32(weight) * self._at(node, before).cosines
        return hidden

    def share_left(self, direction: Array, before: Sequence[Neighbour]) -> Array32 | None:
        """(p,) of the light that leaves the patches what others leave; None for all."""
        evenly = self._evenly(direction, before)
        return None if evenly is None else _share_left(evenly.taken, evenly.sent)

    def hide(
        self,
        sunlight: GatheredSunlight,
        direction: Array,
        before: Sequence[Neighbour],
    ) -> None:
        """Take what others take from what vertices and nodes get."""
        evenly = self._evenly(direction, before)
        if evenly is None:
            return
        left = self._left(direction, before, evenly)
        # In long rows: numpy takes as long for four numbers as for hundreds.
        sunlight.vertices.reshape(-1)[:] *= np.repeat(left, 4)
        if self._transport.grids is not None:
            of_nodes = sum(np.take(left, corners) for corners in self._corners_of_nodes)
            in_bands = np.repeat(of_nodes * np.float32(1.0 / 3.0), 4)
            sunlight.nodes.reshape(-1)[: len(in_bands)] *= in_bands

    def taken(self, direction: Array, before: Sequence[Neighbour]) -> TakenSunlight | None:
        """What ``hide`` takes, for whoever takes it; None where that is nothing."""
        evenly = self._evenly(direction, before)
        if evenly is None:
            return None
        at_patches, of_lobes = self._taken_and_sent(direction, before, evenly)
        points = np.zeros((self._transport.gather.shape[0], 2), dtype=np.float32)
        for taken, sent in of_lobes:
            points[:, 0] += taken
            points[:, 1] += sent
        return TakenSunlight(at_patches=at_patches, at_points=points)

    def _left(self, direction: Array, before: Sequence[Neighbour], evenly: _Evenly) -> Array32:
        """(r,) share of what vertices get that others leave."""
        at_patches, of_lobes = self._taken_and_sent(direction, before, evenly)
        both = self._transport.gather @ at_patches
        for taken, sent in of_lobes:
            both[:, 0] += taken
            both[:, 1] += sent
        return np.take(_share_left(*both.T), self._transport.vertex_rows)

    def _taken_and_sent(
        self, direction: Array, before: Sequence[Neighbour], evenly: _Evenly
    ) -> tuple[Array32, list[tuple[Array32, Array32]]]:
        """(p, 2) of what leaves patches evenly, and (s,) each of lobes at gather points."""
        corners = grid_corners(direction)
        of_all = self._response.lobes_at_vertices([node for node, _ in corners])
        if of_all is None:
            return np.stack([evenly.taken, evenly.sent], axis=1), []
        # What lobes send is none of what leaves evenly.
        lobes = self._surface.laws.lobe_albedo.mean(axis=1)[self._surface.law]
        free = np.zeros_like(lobes)
        for node, weight in corners:
            free += np.float32(weight) * self._sunlit.at(node).cosines
        taken = evenly.taken - lobes * self.cosines(direction, before)
        sent = evenly.sent - lobes * free
        of_lobes = [
            (np.float32(weight) * self._lobes_at(node, before), np.float32(weight) * light)
            for (node, weight), light in zip(corners, of_all, strict=True)
        ]
        return np.maximum(np.stack([taken, sent], axis=1), 0.0), of_lobes

    def _evenly(self, direction: Array, before: Sequence[Neighbour]) -> _Evenly | None:
        """None where others take nothing."""
        if not before:
            return None
        standing = tuple(other.key for other in before)
        corners, of_fields = grid_corners(direction), self._response.of_fields
        taken = of_fields(
            {(node, *standing): partial(self._cosines_at, node, before) for node, _ in corners}
        )
        if not any(field.any() for field in taken.values()):
            return None
        sent = of_fields({("all", node): partial(self._all_at, node) for node, _ in corners})

        def mean(fields: Iterable[Array32]) -> Array32:
            weights = (np.float32(weight) for _, weight in corners)
            bands = sum(w * field for w, field in zip(weights, fields, strict=True))
            return np.asarray(bands @ np.full(4, 0.25, dtype=np.float32))

        return _Evenly(
            taken=mean(taken[node, *standing] for node, _ in corners),
            sent=mean(sent["all", node] for node, _ in corners),
        )

    @cached_property
    def _corners_of_nodes(self) -> IndexArray:
        return corners_of_nodes(self._transport)

    def _at(self, node: Node, before: Sequence[Neighbour]) -> HiddenPatches:
        """Of a Sun in a direction of the grid; traced again only where others move."""
        key = node, *(other.key for other in before)
        return self._nodes.get(
            key, lambda: self._sunlit.hidden(node, [other.blocker() for other in before])
        )

    def _cosines_at(self, node: Node, before: Sequence[Neighbour]) -> Array32:
        return self._at(node, before).cosines

    def _all_at(self, node: Node) -> Array32:
        return self._sunlit.at(node).cosines

    def _lobes_at(self, node: Node, before: Sequence[Neighbour]) -> Array32:
        """(s,) of ``lobes_at_vertices`` what others take."""
        key = node, *(other.key for other in before)
        return self._lobes.get(key, lambda: self._hidden_lobes(node, before))

    def _hidden_lobes(self, node: Node, before: Sequence[Neighbour]) -> Array32:
        hidden, cells = self._at(node, before), self._transport.cells
        lobes, on_cells = self._response.lobes, None
        if cells is not None:
            some = np.flatnonzero((hidden.cosines > 0.0)[cells.patch[lobes.cells]])
            chosen = lobes.cells[some]
            on_cells = np.zeros(len(lobes.cells), dtype=np.float32)
            blockers = [other.blocker() for other in before]
            on_cells[some] = self._sunlit.hidden_on_cells(cells, chosen, node, hidden, blockers)
        return lobes.hidden_at_vertices(hidden, direction_of(node), on_cells)


def corners_of_nodes(transport: LightTransport) -> IndexArray:
    """(3, n) of each row of the table of nodes the rows of the corners of its triangle, or of one
    of those that share it."""
    grids = transport.grids
    assert grids is not None
    sides = grids.row_of_node.shape[2]
    corners = transport.mesh.triangles[grids.triangles].astype(np.int64)
    of_nodes = np.zeros((grids.rows, 3), dtype=np.int64)
    for side in range(sides):
        of_nodes[grids.row_of_node[:, :, side]] = (sides * corners + side)[:, None]
    return np.ascontiguousarray(of_nodes.T)


def _share_left(taken: Array32, sent: Array32) -> Array32:
    """What is left of light of which some is taken; all where there is none."""
    lost = np.divide(taken, sent, out=np.zeros_like(taken), where=sent > 0.0)
    return np.clip(1.0 - lost, 0.0, 1.0, out=lost)
