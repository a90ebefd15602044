"""The pose of a spacecraft in a client program, and its message."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array
from simgl.physics.frames import Pose, quaternion_from_matrix
from simgl_bridge.message_parts import SentPose


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyPose:
    """Position, velocity, attitude and joints of a spacecraft.

    position_m : (3,) origin of the body frame, Earth-centred, ICRF axes [m]
    velocity_m_s : (3,) in the same axes [m s-1]. It determines LVLH axes and the aberration of
        stars. It moves the spacecraft during the exposure only if ``moving`` is set
    q_icrf_from_body_xyzw : (4,) unit, Hamilton, scalar last; transforms body to ICRF components
    joints : movable joint to its angle [rad] or travel [m]
    angular_velocity_rad_s : (3,) relative to ICRF, in body axes; used if ``moving`` is set
    """

    position_m: ArrayLike
    velocity_m_s: ArrayLike
    q_icrf_from_body_xyzw: ArrayLike
    joints: Mapping[str, float] = field(default_factory=dict)
    angular_velocity_rad_s: ArrayLike = (0.0, 0.0, 0.0)

    @classmethod
    def from_pose(cls, pose: Pose) -> BodyPose:
        """The same pose, from simgl's own type.

        pose : in GCRF
        """
        return cls(
            position_m=pose.position,
            velocity_m_s=pose.velocity,
            q_icrf_from_body_xyzw=quaternion_from_matrix(pose.R_icrf_from_body),
        )

    def as_sent(self) -> SentPose:
        """The pose as a message; raises ValueError for a wrong shape."""
        x, y, z = floats("position_m", self.position_m, 3)
        vx, vy, vz = floats("velocity_m_s", self.velocity_m_s, 3)
        qx, qy, qz, qw = floats("q_icrf_from_body_xyzw", self.q_icrf_from_body_xyzw, 4)
        wx, wy, wz = floats("angular_velocity_rad_s", self.angular_velocity_rad_s, 3)
        return SentPose(
            position_m=(x, y, z),
            velocity_m_s=(vx, vy, vz),
            q_icrf_from_body_xyzw=(qx, qy, qz, qw),
            joints={name: float(value) for name, value in self.joints.items()},
            angular_velocity_rad_s=(wx, wy, wz),
        )


def floats(field: str, values: ArrayLike, count: int) -> list[float]:
    """Numbers of a message; raises ValueError for a wrong shape."""
    array: Array = np.asarray(values, dtype=np.float64)
    if array.shape != (count,):
        raise ValueError(f"{field} must be {count} numbers, got shape {array.shape}")
    numbers: list[float] = array.tolist()
    return numbers
