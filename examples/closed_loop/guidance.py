"""Two legs to docking range: up to a point before the board, then down its axis.

Both are a glideslope: hops between places by the Clohessy-Wiltshire law, no faster than a limit and
ever shorter near the end. The second leg waits until the markers are held, and stands still
whenever nothing has been seen for a while.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from examples.closed_loop.relative_motion import velocity_to_reach
from simgl.arrays import Array


class Phase(StrEnum):
    """What the chaser is about."""

    APPROACH = "approach"
    FINAL = "final approach"
    HOLD = "hold"


@dataclass(frozen=True, kw_only=True)
class Leg:
    """A glideslope.

    distance : of the camera from the board where it ends [m]
    top_speed : [m s-1]
    time_constant : of the exponential end [s]
    hop : time between pushes [s]
    """

    distance: float
    top_speed: float
    time_constant: float
    hop: float

    def next(self, from_aim: Array) -> Array:
        """(3,) where to be one hop from now, from the aim, like ``from_aim`` in LVLH [m].

        The way along the V-bar is the slope; offsets across it close in the same hop.
        """
        step = from_aim * (1.0 - np.exp(-self.hop / self.time_constant))
        size, limit = float(np.linalg.norm(step)), self.top_speed * self.hop
        return from_aim - step * min(1.0, limit / max(size, 1e-12))


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The approach.

    smallest_push : the thrusters' least impulse [m s-1]; a smaller one is not worth it
    patience : without a fix for so long [s] nothing is flown any closer
    held_fixes : from markers, in a row, before the final approach
    """

    far: Leg = Leg(distance=15.0, top_speed=0.45, time_constant=45.0, hop=16.0)
    near: Leg = Leg(distance=1.6, top_speed=0.09, time_constant=40.0, hop=12.0)
    smallest_push: float = 4e-4
    patience: float = 20.0
    held_fixes: int = 4
    arrived: float = 0.15

    def leg(self, phase: Phase) -> Leg:
        """The leg flown in a phase."""
        return self.far if phase is Phase.APPROACH else self.near

    def push(self, leg: Leg, state: Array, aim: Array, mean_motion: float) -> Array:
        """(3,) velocity change now in LVLH [m s-1].

        state : (6,) position and velocity by the filter
        aim : (3,) where the leg ends
        """
        place = aim + leg.next(state[:3] - aim)
        delta_v = velocity_to_reach(mean_motion, leg.hop, state[:3], place) - state[3:6]
        return delta_v if np.linalg.norm(delta_v) >= self.smallest_push else np.zeros(3)
