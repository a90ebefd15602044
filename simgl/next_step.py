"""Which step of a lattice a value that changes from frame to frame enters next, and when.

Some results are held for steps: a table of the air for one height, light between parts for one
pose of their joints, reflected sunlight for one direction of the Sun. A frame in which a value
enters a new step would make all of it. Whoever knows that step beforehand makes it in parts, one in
each frame; what is made depends on the step alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

# A step that takes longer to reach is still unknown: its way may turn.
FARTHEST_FRAMES = 128.0
# In frames that are farther apart, in steps, there is no way to go on.
_FASTEST = 0.5


@dataclass(frozen=True, kw_only=True)
class NextStep:
    """What a value enters next.

    index : of the step
    frames : that are left to make it, one at least
    enters : how many frames later it is needed
    """

    index: int
    frames: int
    enters: int

    def due(self, parts: int) -> int:
        """How many of so many parts to make now."""
        return parts_due(parts, self.frames)


def parts_due(parts: int, frames: int) -> int:
    """How many of so many parts to make now where so many frames are left: evenly to the end, and
    none as long as there are more frames than parts, for what is made early may not be what is
    needed then."""
    return parts // frames


class StepWatch:
    """Follows a value. It belongs to the step whose index is the nearest whole number."""

    def __init__(self) -> None:
        self._place: float | None = None

    def next_step(self, place: float) -> NextStep | None:
        """What comes next; None where the value stands, jumps, or is far from another step.

        place : of the value in this frame, in steps
        """
        last, self._place = self._place, place
        pace = 0.0 if last is None else place - last
        if not 0.0 < abs(pace) < _FASTEST:
            return None
        ahead = 1 if pace > 0.0 else -1
        index = round(place) + ahead
        left = (index - 0.5 * ahead - place) / pace
        if left > FARTHEST_FRAMES:
            return None
        between = max(floor(left), 0)
        return NextStep(index=index, frames=max(between, 1), enters=between + 1)
