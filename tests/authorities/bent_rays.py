"""Rays bent by the air of the U.S. Standard Atmosphere, 1976, traced in Cartesian steps."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP
from tests.authorities.us_standard_1976 import density_by_integration

RADIUS = 6.371e6


@lru_cache(maxsize=1)
def log_density() -> CubicSpline:
    heights = np.arange(0.0, 85.1e3, 100.0)
    return CubicSpline(heights, np.log(density_by_integration(heights) / 1.225))


def refractivity(height: float, ground: float) -> tuple[float, float]:
    """Refractive index less 1, and its slope [m-1]; above 85 km it falls on as there."""
    spline = log_density()
    at = min(height, 85e3)
    slope = float(spline(at, 1))
    value = ground * np.exp(float(spline(at)) + slope * (height - at))
    return value, value * slope


def traced_bending(height: float, ground: float) -> float:
    """Of a ray from space to space with this lowest height, by steps along it.

    d(n t)/ds = grad n, with the direction t and the way s, in a plane with the Earth's centre.
    """

    def slopes(_: float, state: Array) -> Array:
        place, moved = state[:2], state[2:]
        r = float(np.hypot(*place))
        excess, slope = refractivity(r - RADIUS, ground)
        return np.concatenate([moved / (1.0 + excess), slope * place / r])

    start = np.array([0.0, RADIUS + height, 1.0 + refractivity(height, ground)[0], 0.0])
    reach = np.sqrt((RADIUS + AIR_TOP) ** 2 - (RADIUS + height) ** 2)
    end = solve_ivp(slopes, (0.0, reach), start, rtol=1e-9, atol=1e-12, max_step=2e4).y[:, -1]
    return 2.0 * float(np.arctan2(-end[3], end[2]))
