"""Sunlight between surfaces, direction by direction: what comes next is made before it is needed.

What vertices get is interpolated between directions of a grid. A frame in which the Sun comes to a
new one would trace, solve and gather all of its light; while the Sun nears it, each frame makes a
part. Of frames so far apart that each comes to new ones, the frame before makes them, while the
client works on its image and beside the next one.
"""

from __future__ import annotations

from threading import Lock

from simgl.arrays import Array
from simgl.next_step import parts_due
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.sunlit_patches import corners_ahead, corners_next


class NextSunlight:
    """Follows the Sun in the axes of spacecraft, and makes its reflected light ahead of it.

    Results are those of a frame that makes all by itself. Any thread may use it.
    """

    def __init__(self) -> None:
        # In the last two frames, the newest one last.
        self._last: dict[int, tuple[Array, ...]] = {}
        # Spacecraft of one model have one response, whose parts are made one after another.
        self._lock = Lock()

    def make_ahead(self, instance: int, response: PrecomputedResponse, direction: Array) -> None:
        """Do what is due in this frame.

        instance : of the spacecraft in the scene, whose response to light is given
        direction : (3,) unit, towards the Sun in this frame, body axes
        """
        last = self._last.get(instance, ())
        self._last[instance] = *last[-1:], direction
        if not last:
            return
        with self._lock:
            for node in corners_next(last[0], last[-1], direction):
                for _ in range(response.parts_left(node)):
                    response.make_part(node)
            for nodes, frames in corners_ahead(last[-1], direction):
                left = [node for node in nodes for _ in range(response.parts_left(node))]
                for node in left[: parts_due(len(left), frames)]:
                    response.make_part(node)
                if left:
                    return
