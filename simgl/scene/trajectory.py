"""Where spacecraft are and how they point: laws that turn an epoch into poses.

A law may name another spacecraft; ``poses`` resolves them in order of dependence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simgl.errors import ConfigError
from simgl.physics.constants import EARTH_MU
from simgl.physics.frames import (
    Pose,
    camera_from_directions,
    lvlh_angular_velocity,
    lvlh_from_icrf,
    rotation_between,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class FixedPosition:
    """At rest in ICRF axes: position [m], velocity [m s-1] (used for LVLH axes only)."""

    position: Array
    velocity: Array


@dataclass(frozen=True, kw_only=True)
class KeplerianOrbit:
    """A two-body orbit about the Earth; lengths [m], angles [rad].

    true_anomaly : at ``epoch_tai_ns``
    """

    semi_major_axis: float
    eccentricity: float
    inclination: float
    raan: float
    argument_of_perigee: float
    true_anomaly: float
    epoch_tai_ns: int

    def state(self, tai_ns: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m s-1] in ICRF axes."""
        a, e = self.semi_major_axis, self.eccentricity
        root = np.sqrt((1.0 + e) / (1.0 - e))
        eccentric = 2.0 * np.arctan(np.tan(0.5 * self.true_anomaly) / root)
        motion = np.sqrt(EARTH_MU / a**3)
        elapsed = (tai_ns - self.epoch_tai_ns) * 1e-9
        mean = np.mod(eccentric - e * np.sin(eccentric) + motion * elapsed, 2.0 * np.pi)
        big_e = mean if e < 0.8 else np.pi
        # Newton on Kepler's equation doubles its digits each step; 12 reach the last bit for e < 1.
        for _ in range(12):
            big_e -= (big_e - e * np.sin(big_e) - mean) / (1.0 - e * np.cos(big_e))
        cosine, sine = np.cos(big_e), np.sin(big_e)
        minor = np.sqrt(1.0 - e * e)
        rate = motion * a / (1.0 - e * cosine)
        in_plane_r = a * np.array([cosine - e, minor * sine, 0.0])
        in_plane_v = rate * np.array([-sine, minor * cosine, 0.0])
        angles = [self.raan, self.inclination, self.argument_of_perigee]
        R_icrf_from_plane = Rotation.from_euler("ZXZ", angles).as_matrix()
        return R_icrf_from_plane @ in_plane_r, R_icrf_from_plane @ in_plane_v


@dataclass(frozen=True, kw_only=True, eq=False)
class RelativePosition:
    """At a place in the LVLH frame of another spacecraft: position [m], velocity [m s-1]."""

    reference: str
    position_lvlh: Array
    velocity_lvlh: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class FixedAttitude:
    """Inertially fixed."""

    R_icrf_from_body: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class LvlhAttitude:
    """Turned with the orbit: body axes along LVLH after ``R_lvlh_from_body``."""

    R_lvlh_from_body: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class PointingAttitude:
    """A body axis towards another spacecraft; the rest is the smallest turn from LVLH."""

    target: str
    axis_body: Array


Trajectory = FixedPosition | KeplerianOrbit | RelativePosition
Attitude = FixedAttitude | LvlhAttitude | PointingAttitude


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The laws of one spacecraft."""

    trajectory: Trajectory
    attitude: Attitude


def _position(
    law: Trajectory, tai_ns: int, reference: tuple[Array, Array] | None
) -> tuple[Array, Array]:
    if isinstance(law, FixedPosition):
        return law.position, law.velocity
    if isinstance(law, KeplerianOrbit):
        return law.state(tai_ns)
    assert reference is not None
    r, v = reference
    R_icrf_from_lvlh = lvlh_from_icrf(r, v).T
    offset = R_icrf_from_lvlh @ law.position_lvlh
    rate = lvlh_angular_velocity(r, v)
    return r + offset, v + R_icrf_from_lvlh @ law.velocity_lvlh + np.cross(rate, offset)


def _lvlh(where: str, key: str, name: str, position: Array, velocity: Array) -> Array:
    """R_lvlh_from_icrf, or the reason why spacecraft ``name`` has none."""
    if np.linalg.norm(np.cross(position, velocity)) == 0.0:
        problem = f'needs LVLH axes, which "{name}" lacks: it does not move about the Earth'
        raise ConfigError(where, key, problem)
    return lvlh_from_icrf(position, velocity)


def _attitude(name: str, law: Attitude, states: Mapping[str, tuple[Array, Array]]) -> Array:
    position, velocity = states[name]
    if isinstance(law, FixedAttitude):
        return law.R_icrf_from_body
    if isinstance(law, LvlhAttitude):
        R_lvlh_from_icrf = _lvlh(f"[spacecraft.{name}]", "attitude", name, position, velocity)
        return np.asarray(R_lvlh_from_icrf.T @ law.R_lvlh_from_body)
    line = states[law.target][0] - position
    if not np.any(line):
        problem = f'cannot point at "{law.target}", which is at the same place'
        raise ConfigError(f"[spacecraft.{name}]", "point_at", problem)
    moving = np.linalg.norm(np.cross(position, velocity)) > 0.0
    start = lvlh_from_icrf(position, velocity).T if moving else np.eye(3)
    return np.asarray(rotation_between(start @ law.axis_body, line) @ start)


def poses(motions: Mapping[str, Motion], tai_ns: int) -> dict[str, Pose]:
    """Pose of every spacecraft at an epoch.

    Raises ConfigError where relative positions refer to each other in a circle.
    """
    states: dict[str, tuple[Array, Array]] = {}

    def resolve(name: str, chain: tuple[str, ...]) -> tuple[Array, Array]:
        if name in chain:
            circle = " -> ".join((*chain, name))
            raise ConfigError(f"[spacecraft.{name}]", "relative_to", f"runs in a circle: {circle}")
        if name not in states:
            law = motions[name].trajectory
            reference = None
            if isinstance(law, RelativePosition):
                reference = resolve(law.reference, (*chain, name))
                _lvlh(f"[spacecraft.{name}]", "relative_to", law.reference, *reference)
            states[name] = _position(law, tai_ns, reference)
        return states[name]

    for name in motions:
        resolve(name, ())
    return {
        name: Pose(
            position=states[name][0],
            velocity=states[name][1],
            R_icrf_from_body=_attitude(name, motion.attitude, states),
        )
        for name, motion in motions.items()
    }


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyMount:
    """A camera fixed to a spacecraft, or turning on it to look at another.

    position_body : (3,) of the pinhole [m]
    boresight_body, up_body : (3,) directions in body axes
    look_at : name of the spacecraft that the camera keeps in the centre; None keeps the boresight
    """

    spacecraft: str
    position_body: Array
    boresight_body: Array
    up_body: Array
    look_at: str | None


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMount:
    """A camera at a place in ICRF axes.

    position : (3,) [m]
    boresight_icrf, up_icrf : (3,) directions; the boresight is not used where ``look_at`` is given
    """

    position: Array
    boresight_icrf: Array
    up_icrf: Array
    look_at: str | None


@dataclass(frozen=True, kw_only=True)
class OrbitingMount:
    """A camera that looks at a spacecraft from azimuth, elevation and range about it.

    In the target's LVLH axes, azimuth 0 stands behind the target (-x), azimuth 90 deg above it
    (zenith, -z); elevation leans out of the orbit plane towards the orbit normal (-y). Angles
    [rad], range [m] from the target's body origin. The top of the image points along increasing
    azimuth, that is to zenith at azimuth 0.
    """

    target: str
    azimuth: float
    elevation: float
    range: float


Mount = BodyMount | FreeMount | OrbitingMount


def camera_velocity(mount: Mount, bodies: Mapping[str, Pose]) -> Array:
    """(3,) of a camera in ICRF axes about the Earth [m s-1]: that of the spacecraft it goes with.

    A camera at a place in ICRF axes is at rest there.
    """
    if isinstance(mount, FreeMount):
        return np.zeros(3)
    return bodies[mount.target if isinstance(mount, OrbitingMount) else mount.spacecraft].velocity


def camera_pose(name: str, mount: Mount, bodies: Mapping[str, Pose]) -> tuple[Array, Array]:
    """Position (3,) [m] and R_camera_from_icrf of the camera ``name`` on its mount.

    Raises ConfigError where the mount gives it no direction to look.
    """
    where = f"[camera.{name}]"
    if isinstance(mount, OrbitingMount):
        target = bodies[mount.target]
        R_icrf_from_lvlh = _lvlh(where, "about", mount.target, target.position, target.velocity).T
        ca, sa = np.cos(mount.azimuth), np.sin(mount.azimuth)
        ce, se = np.cos(mount.elevation), np.sin(mount.elevation)
        out = R_icrf_from_lvlh @ np.array([-ca * ce, -se, -sa * ce])
        up = R_icrf_from_lvlh @ np.array([sa, 0.0, -ca])
        return target.position + mount.range * out, camera_from_directions(-out, up)
    if isinstance(mount, BodyMount):
        body = bodies[mount.spacecraft]
        position = body.position + body.R_icrf_from_body @ mount.position_body
        boresight = body.R_icrf_from_body @ mount.boresight_body
        up = body.R_icrf_from_body @ mount.up_body
    else:
        position, boresight, up = mount.position, mount.boresight_icrf, mount.up_icrf
    if mount.look_at is not None:
        boresight = bodies[mount.look_at].position - position
        if not np.any(boresight):
            problem = f'cannot look at "{mount.look_at}", whose origin is at the pinhole'
            raise ConfigError(where, "look_at", problem)
    return position, camera_from_directions(boresight, up)
