"""Which patches of a body the Sun shines on, as the Sun moves through its sky."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.lru_cache import LruCache
from simgl.next_step import FARTHEST_FRAMES
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.light_transport import LightTransport, PatchCells
from simgl.radiosity.solver import (
    Blocker,
    blocked_by,
    hidden_behind,
    lit_samples,
    mean_cosines,
    seeing,
)

# Steps of the grid of directions from one end of an axis to the other: half a degree each, the
# width of the Sun. What light a patch gets is linear between three of them, as in a penumbra.
_STEPS = 360
# A direction that goes on by more than a third of a step from frame to frame comes to others in
# each; it has a way to follow where it goes on twice by the same, to within that.
_FASTEST = np.radians(0.5) / 3.0
# Directions of the grid in memory; the Sun crosses some of them a minute.
CAPACITY = 64

# A direction of the grid: its column and row.
Node = tuple[int, int]
_Triangle = tuple[Node, Node, Node]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sunlit:
    """Sunlight of one direction on the patches.

    lit : (p, n) which sample points of each patch the Sun reaches
    cosines : (p,) mean over each patch of its cosine to the Sun where the Sun is seen
    partly : (p,) whether some of it is lit and some is not
    """

    lit: Mask
    cosines: Array32
    partly: Mask


@dataclass(frozen=True, kw_only=True, eq=False)
class HiddenPatches:
    """What other bodies take from the sunlight of one direction on the patches.

    samples : (p, n) which of their sample points that the Sun would reach
    cosines : (p,) of the mean cosine of each, as if hidden evenly in its lit part
    entire : (p,) whether they take all of it
    """

    samples: Mask
    cosines: Array32
    entire: Mask


class SunlitPatches:
    """The mean cosine of each patch to the Sun, traced for directions of a fixed grid.

    The grid is an octahedral map (simgl/environment_map.py). Results follow from transport and
    direction alone: those in memory only save tracing.
    """

    def __init__(self, transport: LightTransport) -> None:
        self._transport = transport
        self._nodes = LruCache[Node, Sunlit](CAPACITY)

    def cosines(self, direction: Array, blockers: Sequence[Blocker] = ()) -> Array32:
        """(p,) mean over each patch of its cosine to the Sun where the Sun is seen.

        direction : (3,) unit, towards the Sun, body axes
        blockers : other bodies; what they hide of a patch is hidden evenly in its lit part
        """
        cosines = np.zeros(len(self._transport.areas), dtype=np.float32)
        for node, weight in grid_corners(direction):
            cosines += np.float32(weight) * self.at(node).cosines
        if blockers:
            blocked = self._blocked(direction, cosines, blockers)
            cosines -= cosines * blocked.mean(axis=1, dtype=np.float32)
        return cosines

    def cosines_of_samples(self, direction: Array, samples: IndexArray) -> Array32:
        """(n,) the same of sample points, by their numbers among all, where no other body is before
        the Sun."""
        normals = np.take(self._transport.normals.reshape(-1, 3), samples, axis=0)
        cosines = np.zeros(len(samples), dtype=np.float32)
        for node, weight in grid_corners(direction):
            facing = np.maximum(normals @ (weight * direction_of(node)).astype(np.float32), 0.0)
            cosines += facing * self.at(node).lit.ravel().take(samples)
        return cosines

    def hidden(self, node: Node, blockers: Sequence[Blocker]) -> HiddenPatches:
        """What other bodies take from a direction of the grid."""
        sunlit = self.at(node)
        blocked = self._blocked(direction_of(node), sunlit.cosines, blockers)
        return HiddenPatches(
            samples=blocked & sunlit.lit,
            cosines=sunlit.cosines * blocked.mean(axis=1, dtype=np.float32),
            entire=np.asarray(blocked.all(axis=1)),
        )

    def _blocked(self, direction: Array, cosines: Array32, blockers: Sequence[Blocker]) -> Mask:
        """(p, n) which sample points others hide, of patches with cosines (p,) to a direction."""
        return blocked_by(self._transport, direction, blockers, cosines > 0.0)

    def at(self, node: Node) -> Sunlit:
        """The same for a direction of the grid, traced."""
        return self._nodes.get(node, lambda: self._traced(node))

    def facing(self, direction: Array) -> Array32:
        """(p,) cosines of the patches to a direction (3,), whatever stands before them."""
        return np.maximum(self._normals @ direction.astype(np.float32), 0.0)

    @cached_property
    def _normals(self) -> Array32:
        """(p, 3) mean unit normals of the patches."""
        means = self._transport.normals.mean(axis=1, dtype=np.float64)
        return unit_rows(means).astype(np.float32)

    def more_on_cells(self, cells: PatchCells, node: Node) -> tuple[IndexArray, Array32]:
        """Cells of the patches that are lit in part, and what the cosine (k,) there is more than
        that of their patch."""
        sunlit = self.at(node)
        asked = np.flatnonzero(sunlit.partly[cells.patch])
        direction, normals = direction_of(node), cells.normals[asked]
        every = np.ones(len(asked), dtype=np.bool_)
        lit = seeing(self._transport.tracer, cells.points[asked], normals, direction, every)
        cosines = (normals @ direction.astype(np.float32)) * lit
        return asked, cosines - sunlit.cosines[cells.patch[asked]]

    def on_cells(
        self, cells: PatchCells, chosen: IndexArray, node: Node, asked: IndexArray, more: Array32
    ) -> Array32:
        """(k,) cosines of chosen cells to a direction of the grid, 0 in shadow.

        asked, more : as of ``more_on_cells`` for that direction
        """
        of_patch = self.at(node).cosines
        lit = (of_patch > 0.0)[cells.patch]
        # What rounding leaves of a cosine is no light.
        lit[asked] = more + of_patch[cells.patch[asked]] > 1e-6
        facing = cells.normals[chosen] @ direction_of(node).astype(np.float32)
        return np.maximum(facing, 0.0) * lit[chosen]

    def hidden_on_cells(
        self,
        cells: PatchCells,
        chosen: IndexArray,
        node: Node,
        hidden: HiddenPatches,
        blockers: Sequence[Blocker],
    ) -> Array32:
        """(k,) what other bodies take from the cosines of chosen cells to a direction of the grid.

        hidden : what they take there from patches
        """
        direction, patch = direction_of(node), cells.patch[chosen]
        taken = hidden.entire[patch]
        asked = np.flatnonzero(~taken)
        for blocker in blockers:
            taken[asked] |= hidden_behind(cells.points[chosen[asked]], direction, blocker)
        normals = cells.normals[chosen]
        asked = np.flatnonzero(taken & self.at(node).partly[patch])
        every = np.ones(len(asked), dtype=np.bool_)
        points = cells.points[chosen[asked]]
        tracer = self._transport.tracer
        taken[asked] = seeing(tracer, points, normals[asked], direction, every)
        return np.maximum(normals @ direction.astype(np.float32), 0.0) * taken

    def _traced(self, node: Node) -> Sunlit:
        direction = direction_of(node)
        lit, valid = lit_samples(self._transport, direction)
        cosines = mean_cosines(self._transport, direction, lit, valid)
        number = lit.sum(axis=1)
        partly = (number > 0) & (number < valid.sum(axis=1))
        return Sunlit(lit=lit, cosines=cosines, partly=partly)


def grid_corners(direction: Array) -> tuple[tuple[Node, float], ...]:
    """Three directions of the grid whose sum with these weights is the one given.

    Cosines summed likewise are exact where all three see the Sun. Triangles do not cross the
    octahedron's edges, so their sides are arcs of great circles, which neighbours share.
    """
    nodes = _triangle_around(direction)
    # Rounding may leave less than nothing of the corner opposite.
    weights = np.maximum(_weights_of(nodes) @ direction, 0.0).tolist()
    return tuple(zip(nodes, weights, strict=True))


def _triangle_around(direction: Array) -> _Triangle:
    """The corners of the grid's triangle that a direction (3,) is in."""
    x, y, z = direction.tolist()
    size = abs(x) + abs(y) + abs(z)
    x, y = x / size, y / size
    if z < 0.0:
        x, y = (
            (1.0 - abs(y)) * (-1.0 if x < 0.0 else 1.0),
            (1.0 - abs(x)) * (-1.0 if y < 0.0 else 1.0),
        )
    at = [min(max((p + 1.0) * (_STEPS / 2.0), 0.0), _STEPS * (1.0 - 1e-12)) for p in (x, y)]
    i, j = int(at[0]), int(at[1])
    u, v = at[0] - i, at[1] - j
    if (i < _STEPS // 2) == (j < _STEPS // 2):
        # The octahedron's edge runs from upper left to lower right here.
        return (i + 1, j), (i, j + 1), (i, j) if u + v < 1.0 else (i + 1, j + 1)
    return (i, j), (i + 1, j + 1), (i + 1, j) if u > v else (i, j + 1)


@lru_cache(maxsize=256)
def _weights_of(nodes: _Triangle) -> Array:
    """(3, 3) whose product with a direction is the weights of the corners whose sum it is."""
    return np.linalg.inv(np.stack([direction_of(node) for node in nodes], axis=1))


def corners_ahead(last: Array, now: Array) -> Iterator[tuple[tuple[Node, ...], int]]:
    """Corners of the grid's triangles that a direction enters next if it goes on as it came, each
    with the frames that are left until then.

    Ends where they are far; none for a direction that stands or jumps.

    last, now : (3,) unit, in the last frame and in this one
    """
    step = now - last
    if not 0.0 < float(step @ step) < _FASTEST**2:
        return
    frame = 0
    while frame <= FARTHEST_FRAMES:
        place = now + frame * step
        of_corners = _weights_of(_triangle_around(place))
        weights, paces = (of_corners @ place).tolist(), (of_corners @ step).tolist()
        left = min(
            (max(w, 0.0) / -pace for w, pace in zip(weights, paces, strict=True) if pace < 0.0),
            default=np.inf,
        )
        if left > FARTHEST_FRAMES:
            return
        # The first frame beyond.
        frame += int(left) + 1
        if frame > 1:
            yield _triangle_around(now + frame * step), frame - 1


def corners_next(before: Array, last: Array, now: Array) -> tuple[Node, ...]:
    """Corners of the grid's triangle that a direction is in one frame later, if it goes on in equal
    long steps; none for short ones, which ``corners_ahead`` follows, and for unequal ones.

    before, last, now : (3,) unit, in the last frames and in this one
    """
    step = now - last
    change = step - (last - before)
    fastest2 = _FASTEST**2
    if float(step @ step) < fastest2 or float(change @ change) > fastest2:
        return ()
    return _triangle_around(now + step)


def direction_of(node: Node) -> Array:
    """(3,) unit direction of a place on the octahedral map."""
    place = np.array(node) * (2.0 / _STEPS) - 1.0
    z = 1.0 - float(np.abs(place).sum())
    folded = max(-z, 0.0)
    d = np.array([*(place - np.copysign(folded, place)), z])
    return d / np.linalg.norm(d)
