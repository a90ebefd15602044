"""How the chaser turns: a rigid body with three wheels, and the law that points it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array

MASS = 20.0  # [kg] of a 12U
INERTIA = np.array([0.26, 0.28, 0.31])  # [kg m2] with both panels out, about the body axes
MAX_TORQUE = 4e-3  # [N m] of a wheel of the class of 0.1 N m s
MAX_MOMENTUM = 0.1  # [N m s]
BANDWIDTH = 0.25  # [rad s-1] of the pointing law
DAMPING = 0.8
# Thrusters push past the centre of mass by this arm [m, 1 sigma].
THRUST_ARM = 5e-4
# What the star tracker and the gyro get wrong [rad], [rad s-1], 1 sigma about each axis.
ATTITUDE_KNOWLEDGE_ERROR = np.radians(0.005)
RATE_KNOWLEDGE_ERROR = 2e-5
STEP = 0.25  # [s] of the integration; the law settles in 10 s


@dataclass(frozen=True, kw_only=True, eq=False)
class Attitude:
    """R_icrf_from_body (3, 3); rate (3,) in body axes [rad s-1]; wheels (3,) momentum [N m s]."""

    R_icrf_from_body: Array
    rate: Array
    wheels: Array

    def known(self, rng: np.random.Generator) -> Attitude:
        """What the sensors say of it."""
        turn = Rotation.from_rotvec(ATTITUDE_KNOWLEDGE_ERROR * rng.standard_normal(3))
        return Attitude(
            R_icrf_from_body=self.R_icrf_from_body @ turn.as_matrix(),
            rate=self.rate + RATE_KNOWLEDGE_ERROR * rng.standard_normal(3),
            wheels=self.wheels,
        )

    def kicked(self, delta_v: float, rng: np.random.Generator) -> Attitude:
        """After a push [m s-1] whose thrust missed the centre of mass."""
        impulse = MASS * delta_v * THRUST_ARM * rng.standard_normal(3)
        return Attitude(
            R_icrf_from_body=self.R_icrf_from_body,
            rate=self.rate + impulse / INERTIA,
            wheels=self.wheels,
        )


def pointing_torque(known: Attitude, R_icrf_from_wanted: Array, rate_wanted: Array) -> Array:
    """(3,) torque of the wheels on the body [N m], by angle and rate (PD), within their power.

    rate_wanted : (3,) of the wanted attitude, in its own axes [rad s-1]
    """
    R_wanted_from_body = R_icrf_from_wanted.T @ known.R_icrf_from_body
    angle = Rotation.from_matrix(R_wanted_from_body).as_rotvec()
    excess = known.rate - R_wanted_from_body.T @ rate_wanted
    law = -(BANDWIDTH**2) * angle - 2.0 * DAMPING * BANDWIDTH * excess
    momentum = INERTIA * known.rate + known.wheels
    torque = INERTIA * law + np.cross(known.rate, momentum)
    torque = np.clip(torque, -MAX_TORQUE, MAX_TORQUE)
    # A wheel at its limit gives nothing that would drive it on.
    full = np.abs(known.wheels) > MAX_MOMENTUM
    return np.where(full & (np.sign(torque) == -np.sign(known.wheels)), 0.0, torque)


def turned(
    attitude: Attitude,
    R_icrf_from_wanted: Array,
    rate_wanted: Array,
    duration: float,
    rng: np.random.Generator,
) -> Attitude:
    """The attitude after a time [s] under the pointing law, Euler's equations with wheels.

    The wanted attitude goes on turning at its rate.
    """
    steps = max(1, round(duration / STEP))
    dt = duration / steps
    R, rate, wheels = attitude.R_icrf_from_body, attitude.rate, attitude.wheels
    for step in range(steps):
        now = Attitude(R_icrf_from_body=R, rate=rate, wheels=wheels)
        wanted = R_icrf_from_wanted @ Rotation.from_rotvec(step * dt * rate_wanted).as_matrix()
        torque = pointing_torque(now.known(rng), wanted, rate_wanted)
        gyroscopic = np.cross(rate, INERTIA * rate + wheels)
        rate = rate + dt * (torque - gyroscopic) / INERTIA
        wheels = wheels - dt * torque
        R = R @ Rotation.from_rotvec(dt * rate).as_matrix()
    return Attitude(R_icrf_from_body=R, rate=rate, wheels=wheels)
