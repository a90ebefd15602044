"""Which patches of a body the Sun shines on, as the Sun moves through its sky."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simgl.transport.solve import Blocker, blocked_by, lit_normals
from simgl.transport.transport import Floats, Transport

Array = NDArray[np.float64]

# Steps of the lattice of directions from one end of an axis to the other: half a degree each, the
# width of the Sun. What light a patch gets is linear between three of them, as in a penumbra.
_STEPS = 360
# The Sun crosses some of them a minute; one takes 100 kB.
_KEPT = 64


class SunlitPatches:
    """The mean of the lit normals of each patch, traced for directions of a fixed lattice.

    The lattice is an octahedral map (simgl/sky.py). What is asked for follows from transport and
    direction alone: what is kept from earlier calls only saves the tracing.
    """

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._nodes: OrderedDict[tuple[int, int], Floats] = OrderedDict()

    def cosines(self, direction: Array, blockers: Sequence[Blocker] = ()) -> Floats:
        """(p,) mean over each patch of its cosine to the Sun where the Sun is seen.

        direction : (3,) unit, towards the Sun, body axes
        blockers : other bodies; what they hide of a patch is hidden evenly in its lit part
        """
        mean = np.zeros((len(self._transport.areas), 3), dtype=np.float32)
        for node, weight in _around(direction):
            mean += np.float32(weight) * self._node(node)
        cosines = np.maximum(mean @ direction.astype(np.float32), 0.0)
        if blockers:
            cosines *= 1.0 - blocked_by(self._transport, direction, blockers)
        return np.asarray(cosines)

    def _node(self, node: tuple[int, int]) -> Floats:
        if node in self._nodes:
            self._nodes.move_to_end(node)
            return self._nodes[node]
        if len(self._nodes) >= _KEPT:
            self._nodes.popitem(last=False)
        # Neighbours take turns between two halves of a patch's sample points.
        direction = _direction(np.array(node) * (2.0 / _STEPS) - 1.0)
        self._nodes[node] = lit_normals(self._transport, direction, sum(node) % 2)
        return self._nodes[node]


def _around(direction: Array) -> list[tuple[tuple[int, int], float]]:
    """The three points of the lattice about a direction, and their weights."""
    place = direction[:2] / np.abs(direction).sum()
    if direction[2] < 0.0:
        place = (1.0 - np.abs(place[::-1])) * np.where(place < 0.0, -1.0, 1.0)
    at = np.clip((place + 1.0) * (_STEPS / 2.0), 0.0, _STEPS * (1.0 - 1e-12))
    i, j = (int(v) for v in at)
    u, v = at[0] - i, at[1] - j
    third = (i + 1, j) if u > v else (i, j + 1)
    weights = 1.0 - max(u, v), min(u, v), abs(u - v)
    return list(zip(((i, j), (i + 1, j + 1), third), weights, strict=True))


def _direction(place: Array) -> Array:
    """(3,) unit direction of a place on the octahedral map, -1..1."""
    z = 1.0 - float(np.abs(place).sum())
    folded = max(-z, 0.0)
    d = np.array([*(place - np.copysign(folded, place)), z])
    return np.asarray(d / np.linalg.norm(d))
