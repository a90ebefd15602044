"""Trajectory and attitude laws of spacecraft: from an epoch to poses.

A law may refer to another spacecraft; ``poses`` resolves them in order of dependence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.motion.orbits import KeplerianOrbit, TwoLineElements, clohessy_wiltshire
from simgl.motion.samples import Path, SampledRotations
from simgl.physics.constants import EARTH_MU
from simgl.physics.frames import (
    Pose,
    cross,
    lvlh_angular_velocity,
    lvlh_from_icrf,
    rotation_between,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class UniformMotion:
    """A straight line in GCRF at constant velocity, without gravity.

    position : (3,) at ``epoch_tai_ns`` [m]
    velocity : (3,), zeros for a fixed position [m s-1]
    """

    position: Array
    velocity: Array
    epoch_tai_ns: int

    def state(self, tai_ns: int) -> tuple[Array, Array]:
        """Position [m] and velocity [m s-1], (3,) in GCRF."""
        elapsed = (tai_ns - self.epoch_tai_ns) * 1e-9
        return self.position + elapsed * self.velocity, self.velocity


@dataclass(frozen=True, kw_only=True, eq=False)
class RelativeUniformMotion:
    """A straight line in the LVLH frame of another spacecraft, at constant velocity.

    position_lvlh : (3,) at ``epoch_tai_ns`` [m]
    velocity_lvlh : (3,), zeros for a fixed place [m s-1]
    """

    reference: str
    position_lvlh: Array
    velocity_lvlh: Array
    epoch_tai_ns: int


@dataclass(frozen=True, kw_only=True, eq=False)
class RelativeOrbit:
    """Free drift relative to another spacecraft, by Clohessy and Wiltshire's equations.

    position_lvlh, velocity_lvlh : (3,) at ``epoch_tai_ns``, in LVLH axes of the reference, whose
        orbit should be nearly circular [m], [m s-1]
    """

    reference: str
    position_lvlh: Array
    velocity_lvlh: Array
    epoch_tai_ns: int


@dataclass(frozen=True, kw_only=True, eq=False)
class RelativePath:
    """A sampled trajectory in the LVLH frame of another spacecraft."""

    reference: str
    path: Path


@dataclass(frozen=True, kw_only=True, eq=False)
class FixedAttitude:
    """Inertially fixed."""

    R_icrf_from_body: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class LvlhAttitude:
    """Fixed relative to the spacecraft's LVLH axes."""

    R_lvlh_from_body: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledAttitude:
    """A sampled attitude, relative to ICRF or to the spacecraft's LVLH axes."""

    rotations: SampledRotations
    in_lvlh: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class PointingAttitude:
    """A body axis points at another spacecraft, by the smallest rotation from LVLH."""

    target: str
    axis_body: Array


Relative = RelativeUniformMotion | RelativeOrbit | RelativePath
Trajectory = UniformMotion | KeplerianOrbit | TwoLineElements | Path | Relative
Attitude = FixedAttitude | LvlhAttitude | SampledAttitude | PointingAttitude


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Trajectory and attitude laws of one spacecraft."""

    trajectory: Trajectory
    attitude: Attitude


def _relative(law: Relative, tai_ns: int, reference: tuple[Array, Array]) -> tuple[Array, Array]:
    """Position [m] and velocity [m s-1] in GCRF."""
    r, v = reference
    if isinstance(law, RelativePath):
        place, moving = law.path.state(tai_ns)
    else:
        place, moving = law.position_lvlh, law.velocity_lvlh
        elapsed = (tai_ns - law.epoch_tai_ns) * 1e-9
        if isinstance(law, RelativeOrbit):
            # Of the reference's osculating ellipse.
            axis = 1.0 / (2.0 / np.linalg.norm(r) - np.dot(v, v) / EARTH_MU)
            mean_motion = float(np.sqrt(EARTH_MU / axis**3))
            place, moving = clohessy_wiltshire(place, moving, mean_motion, elapsed)
        else:
            place = place + elapsed * moving
    R_icrf_from_lvlh = lvlh_from_icrf(r, v).T
    offset = R_icrf_from_lvlh @ place
    rate = lvlh_angular_velocity(r, v)
    return r + offset, v + R_icrf_from_lvlh @ moving + cross(rate, offset)


def lvlh_axes(where: str, key: str, name: str, position: Array, velocity: Array) -> Array:
    """R_lvlh_from_icrf; ConfigError if spacecraft ``name`` has no orbital motion."""
    if np.linalg.norm(cross(position, velocity)) == 0.0:
        problem = f'needs LVLH axes, which "{name}" lacks: it does not move about the Earth'
        raise ConfigError(where, key, problem)
    return lvlh_from_icrf(position, velocity)


def _attitude(
    name: str, law: Attitude, tai_ns: int, states: Mapping[str, tuple[Array, Array]]
) -> Array:
    position, velocity = states[name]
    if isinstance(law, FixedAttitude):
        return law.R_icrf_from_body
    if isinstance(law, LvlhAttitude):
        R_lvlh_from_icrf = lvlh_axes(f"[spacecraft.{name}]", "attitude", name, position, velocity)
        return R_lvlh_from_icrf.T @ law.R_lvlh_from_body
    if isinstance(law, SampledAttitude):
        turn = law.rotations.matrix(tai_ns)
        if not law.in_lvlh:
            return turn
        R_lvlh_from_icrf = lvlh_axes(
            f"[spacecraft.{name}]", "attitude_file", name, position, velocity
        )
        return R_lvlh_from_icrf.T @ turn
    line = states[law.target][0] - position
    if not np.any(line):
        problem = f'cannot point at "{law.target}", which is at the same place'
        raise ConfigError(f"[spacecraft.{name}]", "point_at", problem)
    moving = np.linalg.norm(cross(position, velocity)) > 0.0
    start = lvlh_from_icrf(position, velocity).T if moving else np.eye(3)
    return rotation_between(start @ law.axis_body, line) @ start


def poses(
    motions: Mapping[str, Motion], tai_ns: int, given: Mapping[str, Pose] | None = None
) -> dict[str, Pose]:
    """Pose of every spacecraft at an epoch.

    given : poses that hold in place of the laws of motion; laws relative to them follow them

    Raises ConfigError for circular references, and if a law does not cover the epoch.
    """
    given = given or {}
    states = {name: (pose.position, pose.velocity) for name, pose in given.items()}
    for name in motions:
        _resolve(name, motions, tai_ns, states)
    by_law = {
        name: Pose(
            position=states[name][0],
            velocity=states[name][1],
            R_icrf_from_body=_attitude(name, motion.attitude, tai_ns, states),
        )
        for name, motion in motions.items()
        if name not in given
    }
    return {**by_law, **given}


def _resolve(
    name: str,
    motions: Mapping[str, Motion],
    tai_ns: int,
    states: dict[str, tuple[Array, Array]],
) -> None:
    """Store position and velocity of a spacecraft in ``states``, and those that it refers to."""
    chain: dict[str, Motion] = {}
    while name not in states:
        if name in chain:
            names = list(chain)
            circle = " -> ".join([*names, name])
            raise ConfigError(f"[spacecraft.{name}]", "relative_to", f"runs in a circle: {circle}")
        chain[name] = motions[name]
        law = motions[name].trajectory
        if not isinstance(law, Relative):
            break
        name = law.reference
    for name, motion in reversed(chain.items()):
        law = motion.trajectory
        if isinstance(law, Relative):
            reference = states[law.reference]
            lvlh_axes(f"[spacecraft.{name}]", "relative_to", law.reference, *reference)
            states[name] = _relative(law, tai_ns, reference)
        else:
            states[name] = law.state(tai_ns)
