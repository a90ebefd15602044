"""Truth model: two spacecraft under gravity, thruster errors, a target with attitude motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS
from simgl.physics.frames import (
    lvlh_angular_velocity,
    lvlh_from_icrf,
    rotation_between,
)

EARTH_J2 = 1.08262668e-3  # EGM96
EARTH_POLE_ICRF = np.array([0.0, 0.0, 1.0])  # the pole of date is 0.14 deg away: J2 bears that

# A cold-gas system of a CubeSat: size and direction of each push, 1 sigma.
THRUST_SIZE_ERROR = 0.015
THRUST_DIRECTION_ERROR = np.radians(0.5)
# Differential drag and what else pulls on a 20 kg craft at 400 km [m s-2, 1 sigma per step].
DISTURBANCE = 1e-6
# The target's attitude: it does not know its own to better than this [rad, 1 sigma], and swings.
TARGET_ATTITUDE_ERROR = np.radians(0.5)
DEAD_BAND = np.radians(0.1)
SWING_TIME = 600.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Orbit:
    """position [m] and velocity [m s-1] in ICRF axes, from the Earth's centre."""

    position: Array
    velocity: Array

    @property
    def R_lvlh_from_icrf(self) -> Array:
        """(3, 3) rotation into the LVLH axes of this craft."""
        return lvlh_from_icrf(self.position, self.velocity)

    @property
    def mean_motion(self) -> float:
        """Rate of the LVLH frame [rad s-1]."""
        return float(np.linalg.norm(lvlh_angular_velocity(self.position, self.velocity)))

    def advanced(self, duration: float, disturbance: Array | None = None) -> Orbit:
        """The state after a time [s]; ``disturbance`` is a constant acceleration [m s-2].

        One Runge-Kutta step. Over 3 s in low orbit its error is (n dt)^5 r / 120, some 1e-8 m.
        """
        push = np.zeros(3) if disturbance is None else disturbance
        y = np.concatenate([self.position, self.velocity])

        def rate(state: Array) -> Array:
            return np.concatenate([state[3:], gravity(state[:3]) + push])

        k1 = rate(y)
        k2 = rate(y + 0.5 * duration * k1)
        k3 = rate(y + 0.5 * duration * k2)
        k4 = rate(y + duration * k3)
        y = y + duration / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return Orbit(position=y[:3], velocity=y[3:])


def gravity(position: Array) -> Array:
    """(3,) acceleration [m s-2] by the Earth's mass and its oblateness J2."""
    r = float(np.linalg.norm(position))
    z = float(position @ EARTH_POLE_ICRF) / r
    bulge = 1.5 * EARTH_J2 * (WGS84_EQUATORIAL_RADIUS / r) ** 2
    pull = (1.0 + bulge * (1.0 - 5.0 * z * z)) * position / r + 2.0 * bulge * z * EARTH_POLE_ICRF
    return -EARTH_MU / (r * r) * pull


def relative_state(chaser: Orbit, target: Orbit) -> Array:
    """(6,) position [m] and velocity [m s-1] of the chaser in the target's turning LVLH frame."""
    R_lvlh_from_icrf = target.R_lvlh_from_icrf
    offset = chaser.position - target.position
    turning = lvlh_angular_velocity(target.position, target.velocity)
    drift = chaser.velocity - target.velocity - np.cross(turning, offset)
    return np.concatenate([R_lvlh_from_icrf @ offset, R_lvlh_from_icrf @ drift])


def pushed(chaser: Orbit, delta_v: Array, rng: np.random.Generator) -> Orbit:
    """The chaser after its thrusters tried a velocity change (3,) [m s-1] in ICRF axes."""
    turn = Rotation.from_rotvec(THRUST_DIRECTION_ERROR * rng.standard_normal(3))
    size = 1.0 + THRUST_SIZE_ERROR * rng.standard_normal()
    return replace(chaser, velocity=chaser.velocity + size * turn.apply(delta_v))


def pointing_attitude(orbit: Orbit, axis_body: Array, direction_icrf: Array) -> Array:
    """R_icrf_from_body with a body axis along a direction, by the smallest turn from LVLH."""
    level = orbit.R_lvlh_from_icrf.T
    return rotation_between(level @ axis_body, direction_icrf) @ level


def wandering(start: Array, time: float) -> Array:
    """(3,) turn [rad] of the target off its nominal attitude after a time [s].

    A constant part, ``start`` (3,), and a swing within its control's dead band.
    """
    swing = DEAD_BAND * np.sin(2.0 * np.pi * time / SWING_TIME + np.array([0.0, 2.0, 4.0]))
    return start + swing
