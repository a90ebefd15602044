"""Clohessy-Wiltshire: motion near a craft on a circular orbit, in its LVLH frame.

The state is (6,): position [m] and velocity [m s-1] of the chaser from the target.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from simgl.arrays import Array


def transition(mean_motion: float, duration: float) -> Array:
    """(6, 6) state transition over a time [s] on an orbit with a mean motion [rad s-1].

    x'' = 2 n z',  y'' = -n^2 y,  z'' = 3 n^2 z - 2 n x'  (Clohessy & Wiltshire 1960, with z down).
    """
    n = mean_motion
    rate = np.zeros((6, 6))
    rate[:3, 3:] = np.eye(3)
    rate[3, 5] = 2.0 * n
    rate[4, 1] = -n * n
    rate[5, 2] = 3.0 * n * n
    rate[5, 3] = -2.0 * n
    return expm(rate * duration)


def velocity_to_reach(mean_motion: float, duration: float, position: Array, aim: Array) -> Array:
    """(3,) velocity [m s-1] that carries from one position [m] to another in a time [s]."""
    flow = transition(mean_motion, duration)
    velocity = np.linalg.solve(flow[:3, 3:], aim - flow[:3, :3] @ position)
    return np.asarray(velocity, dtype=np.float64)
