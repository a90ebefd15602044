"""Navigation filter: relative motion and the target's attitude, from fixes that arrive late.

State (9,): position [m] and velocity [m s-1] of the chaser from the target in LVLH, and the small
turn [rad] by which the target stands off its nominal attitude, in LVLH axes. A fix is the place of
the chaser from one point of the target, far off from its wing tips, near from its markers, which
give the turn as well.

A fix belongs to the middle of its exposure, but is known only after read-out, transport and
processing. ``Filter`` keeps the last minute of what it was told, goes back to the epoch of a fix,
takes it in there, and repeats what came after: pushes, and fixes that overtook it.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from examples.closed_loop.relative_motion import transition
from simgl.arrays import Array

# Chi-square of 3 and of 6 degrees of freedom exceeds these once in 10 000.
GATES = {3: 21.1, 6: 27.9}
# What the model leaves out: J2, the curved orbit, drag [m s-2 over a second, 1 sigma].
ACCELERATION_NOISE = 5e-5
# How fast the target's attitude wanders [rad over a second, 1 sigma]. Its control swings it through
# a dead band of 0.1 deg in minutes, 2e-5 rad/s: as much as this in half a minute, over which near
# fixes are averaged. A smaller one trails the swing by more than the covariance says.
TURN_NOISE = 1e-4
# The share of a commanded velocity change that may be missing or sideways, 1 sigma.
EXECUTION_ERROR = 0.02
# A fix that is older than this is of no use [s].
MEMORY = 60.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimate:
    """mean : (9,); covariance : (9, 9); see above."""

    mean: Array
    covariance: Array

    @property
    def position_sigma(self) -> Array:
        """(3,) standard deviation of the position in LVLH [m]."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def turn_sigma(self) -> Array:
        """(3,) standard deviation of the target's turn [rad]."""
        return np.sqrt(np.diag(self.covariance)[6:])

    @property
    def range(self) -> float:
        """Distance between the body origins [m]."""
        return float(np.linalg.norm(self.mean[:3]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Fix:
    """The chaser's place from a point of the target.

    point : (3,) of the target from its origin in LVLH, in its nominal attitude [m]
    position : (3,) of the chaser from that point in LVLH [m]
    turn : (3,) of the target off its nominal attitude [rad]; None where it was not seen
    covariance : (3, 3) or (6, 6) of position and turn
    """

    point: Array
    position: Array
    turn: Array | None
    covariance: Array


def far_fix(
    position: Array, point: Array, *, tip_error: float, span: float, drawing_error: float
) -> Fix:
    """A fix from both tips of a span, with the errors that its pixels imply.

    position : (3,) of the chaser from the middle of the span, ``point`` (3,), in LVLH [m]
    tip_error : of the direction of each tip [rad, 1 sigma]
    drawing_error : of the target's known shape along the line of sight [m, 1 sigma]

    The range is span / angle, so that its error grows with the square of the range; the error
    across the line of sight grows with the range.
    """
    distance = float(np.linalg.norm(position))
    range_error = np.hypot(np.sqrt(2.0) * tip_error * distance**2 / span, drawing_error)
    along = np.outer(position, position) / distance**2
    covariance = range_error**2 * along + (tip_error * distance) ** 2 * (np.eye(3) - along)
    return Fix(point=point, position=position, turn=None, covariance=covariance)


def predict(estimate: Estimate, mean_motion: float, duration: float) -> Estimate:
    """The estimate after a time [s] of coasting."""
    flow, t = np.eye(9), duration
    flow[:6, :6] = transition(mean_motion, duration)
    noise = np.zeros((9, 9))
    # A white acceleration, integrated once and twice.
    white = np.array([[t**3 / 3.0, t**2 / 2.0], [t**2 / 2.0, t]])
    noise[:6, :6] = ACCELERATION_NOISE**2 * np.kron(white, np.eye(3))
    noise[6:, 6:] = TURN_NOISE**2 * t * np.eye(3)
    return Estimate(
        mean=flow @ estimate.mean, covariance=flow @ estimate.covariance @ flow.T + noise
    )


def after_push(estimate: Estimate, delta_v: Array) -> Estimate:
    """The estimate after a commanded velocity change (3,) in LVLH [m s-1]."""
    mean, covariance = estimate.mean.copy(), estimate.covariance.copy()
    mean[3:6] += delta_v
    covariance[3:6, 3:6] += EXECUTION_ERROR**2 * float(delta_v @ delta_v) * np.eye(3)
    return Estimate(mean=mean, covariance=covariance)


def update(estimate: Estimate, fix: Fix) -> tuple[Estimate, bool]:
    """The estimate after a fix of its own epoch, and whether it passed the gate; else unchanged."""
    position, turn = estimate.mean[:3], estimate.mean[6:]
    x, y, z = fix.point
    H = np.zeros((len(fix.covariance), 9))
    H[:3, :3] = np.eye(3)
    # The point moves by turn x point, and the chaser from it by the opposite: [point] turn.
    H[:3, 6:] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    innovation = fix.position - (position - fix.point - np.cross(turn, fix.point))
    if fix.turn is not None:
        H[3:, 6:] = np.eye(3)
        innovation = np.concatenate([innovation, fix.turn - turn])
    spread = H @ estimate.covariance @ H.T + fix.covariance
    if innovation @ np.linalg.solve(spread, innovation) > GATES[len(innovation)]:
        return estimate, False
    gain = np.linalg.solve(spread, H @ estimate.covariance).T
    rest = np.eye(9) - gain @ H
    # Joseph's form stays symmetric and positive.
    covariance = rest @ estimate.covariance @ rest.T + gain @ fix.covariance @ gain.T
    return Estimate(mean=estimate.mean + gain @ innovation, covariance=covariance), True


Event = Array | Fix  # a velocity change (3,), or a fix


class Filter:
    """The estimate over time, told of pushes and fixes in any order. Times [s] from one epoch."""

    def __init__(self, start: Estimate, mean_motion: float, time: float = 0.0) -> None:
        self._mean_motion = mean_motion
        self._times: list[float] = []
        self._events: list[Event] = []
        # After each event; the first is where everything starts.
        self._after: list[tuple[float, Estimate]] = [(time, start)]

    def at(self, time: float) -> Estimate:
        """The estimate at a time, with all that is known by now of the time before."""
        then, estimate = self._after[bisect_right(self._times, time)]
        return estimate if time <= then else predict(estimate, self._mean_motion, time - then)

    def push(self, time: float, delta_v: Array) -> None:
        """A velocity change (3,) in LVLH [m s-1] was commanded."""
        self._take_in(time, delta_v)

    def fix(self, time: float, fix: Fix) -> bool:
        """A fix of a time that may have passed; whether it was believed."""
        if time < self._after[0][0]:
            return False
        _, accepted = update(self.at(time), fix)
        if accepted:
            self._take_in(time, fix)
        return accepted

    def _take_in(self, time: float, event: Event) -> None:
        place = bisect_right(self._times, time)
        self._times.insert(place, time)
        self._events.insert(place, event)
        del self._after[place + 1 :]
        for then, other in zip(self._times[place:], self._events[place:], strict=True):
            before, estimate = self._after[-1]
            estimate = predict(estimate, self._mean_motion, then - before)
            if isinstance(other, Fix):
                estimate, _ = update(estimate, other)
            else:
                estimate = after_push(estimate, other)
            self._after.append((then, estimate))
        # Older than any fix that may still come.
        while self._times and self._times[0] < self._times[-1] - MEMORY:
            del self._times[0], self._events[0], self._after[0]
