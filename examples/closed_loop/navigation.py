"""Kalman filter of the relative state in LVLH, from range and line of sight.

A sighting enters as a position whose covariance is long along the line of sight and narrow across
it. That keeps the filter linear: with a first range wrong by tens of metres, a filter linearised in
angles would turn the range error into a false certainty across the line of sight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from examples.closed_loop.relative_motion import transition

Array = NDArray[np.float64]

# Chi-square of 3 degrees of freedom exceeds this once in 10 000.
GATE = 21.1
# What the model leaves out: J2, the curved orbit, drag [m s-2 over a second, 1 sigma].
ACCELERATION_NOISE = 1e-4
# The share of a commanded velocity change that may be missing or sideways, 1 sigma.
EXECUTION_ERROR = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimate:
    """mean : (6,) chaser from target in LVLH, m and m s-1; covariance : (6, 6)."""

    mean: Array
    covariance: Array

    @property
    def position_sigma(self) -> Array:
        """(3,) standard deviation of the position in LVLH [m]."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def range(self) -> float:
        """Distance between the body origins [m]."""
        return float(np.linalg.norm(self.mean[:3]))

    @property
    def range_sigma(self) -> float:
        """[m]"""
        along = self.mean[:3] / self.range
        return float(np.sqrt(along @ self.covariance[:3, :3] @ along))


@dataclass(frozen=True, kw_only=True, eq=False)
class Sighting:
    """position : (3,) chaser from target in LVLH [m]; covariance : (3, 3)."""

    position: Array
    covariance: Array

    @property
    def range(self) -> float:
        """Distance between the body origins [m]."""
        return float(np.linalg.norm(self.position))


def sighting(position: Array, *, tip_error: float, span: float, drawing_error: float) -> Sighting:
    """A position from the image with the errors that its pixels imply.

    position : (3,) chaser from target in LVLH [m]
    tip_error : of the direction of each wing tip [rad, 1 sigma]
    span : between the tips [m]
    drawing_error : of the target's known shape along the line of sight [m, 1 sigma]

    The range is span / angle, so that its error grows with the square of the range; the error
    across the line of sight grows with the range.
    """
    distance = float(np.linalg.norm(position))
    range_error = np.hypot(np.sqrt(2.0) * tip_error * distance**2 / span, drawing_error)
    along = np.outer(position, position) / distance**2
    across = np.eye(3) - along
    covariance = range_error**2 * along + (tip_error * distance) ** 2 * across
    return Sighting(position=position, covariance=covariance)


def predict(estimate: Estimate, mean_motion: float, duration: float) -> Estimate:
    """The estimate after a time [s] of coasting."""
    flow = transition(mean_motion, duration)
    t = duration
    # A white acceleration, integrated once and twice.
    noise = np.kron([[t**3 / 3.0, t**2 / 2.0], [t**2 / 2.0, t]], np.eye(3))
    return Estimate(
        mean=flow @ estimate.mean,
        covariance=flow @ estimate.covariance @ flow.T + ACCELERATION_NOISE**2 * noise,
    )


def after_push(estimate: Estimate, delta_v: Array) -> Estimate:
    """The estimate after a commanded velocity change (3,) in LVLH [m s-1]."""
    covariance = estimate.covariance.copy()
    covariance[3:, 3:] += EXECUTION_ERROR**2 * float(delta_v @ delta_v) * np.eye(3)
    return Estimate(
        mean=estimate.mean + np.concatenate([np.zeros(3), delta_v]), covariance=covariance
    )


def update(estimate: Estimate, seen: Sighting) -> tuple[Estimate, bool]:
    """The estimate after a sighting, and whether it passed the gate; else nothing changes."""
    H = np.eye(3, 6)
    innovation = seen.position - H @ estimate.mean
    spread = H @ estimate.covariance @ H.T + seen.covariance
    if innovation @ np.linalg.solve(spread, innovation) > GATE:
        return estimate, False
    gain = np.linalg.solve(spread, H @ estimate.covariance).T
    rest = np.eye(6) - gain @ H
    # Joseph's form stays symmetric and positive.
    covariance = rest @ estimate.covariance @ rest.T + gain @ seen.covariance @ gain.T
    return Estimate(mean=estimate.mean + gain @ innovation, covariance=covariance), True
