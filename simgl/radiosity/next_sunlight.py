"""Sunlight between surfaces, direction by direction: what comes next is made before it is needed.

What vertices get is interpolated between directions of a grid. A frame in which the Sun comes to a
new one would trace, solve and gather all of its light; while the Sun nears it, each frame makes a
part.
"""

from __future__ import annotations

from threading import Lock

from simgl.arrays import Array
from simgl.next_step import parts_due
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.sunlit_patches import corners_ahead


class NextSunlight:
    """Follows the Sun in the axes of spacecraft, and makes its reflected light ahead of it.

    Results are those of a frame that makes all by itself. Any thread may use it.
    """

    def __init__(self) -> None:
        self._last: dict[int, Array] = {}
        # Spacecraft of one model have one response, whose parts are made one after another.
        self._lock = Lock()

    def make_ahead(self, instance: int, response: PrecomputedResponse, direction: Array) -> None:
        """Do what is due in this frame.

        instance : of the spacecraft in the scene, whose response to light is given
        direction : (3,) unit, towards the Sun in this frame, body axes
        """
        last, self._last[instance] = self._last.get(instance), direction
        if last is None:
            return
        with self._lock:
            for nodes, frames in corners_ahead(last, direction):
                left = [node for node in nodes for _ in range(response.parts_left(node))]
                for node in left[: parts_due(len(left), frames)]:
                    response.make_part(node)
                if left:
                    return
