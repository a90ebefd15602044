"""A glideslope along the V-bar: hops between waypoints, the last ones ever shorter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from examples.closed_loop.relative_motion import velocity_to_reach

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Glideslope:
    """The plan: close at ``top_speed``, then exponentially.

    hold : distance behind the target where the approach ends [m]
    top_speed : [m s-1]
    time_constant : of the exponential end [s]
    hop : time between pushes [s]
    smallest_push : the thrusters' least impulse [m s-1]; a smaller one is not worth it
    """

    hold: float = 20.0
    top_speed: float = 0.4
    time_constant: float = 75.0
    hop: float = 30.0
    smallest_push: float = 5e-4

    def waypoint(self, position: Array) -> Array:
        """(3,) where the chaser should be one hop from now, in LVLH [m]."""
        to_go = -position[0] - self.hold
        step = to_go * (1.0 - np.exp(-self.hop / self.time_constant))
        limit = self.top_speed * self.hop
        return np.array([position[0] + np.clip(step, -limit, limit), 0.0, 0.0])

    def push(self, state: Array, mean_motion: float) -> Array:
        """(3,) velocity change now in LVLH [m s-1], from the estimated state (6,)."""
        aim = self.waypoint(state[:3])
        delta_v = velocity_to_reach(mean_motion, self.hop, state[:3], aim) - state[3:]
        return delta_v if np.linalg.norm(delta_v) >= self.smallest_push else np.zeros(3)
