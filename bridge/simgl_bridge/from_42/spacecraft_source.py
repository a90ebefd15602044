"""Which spacecraft of 42 is which of the scenario, and its pose in a message."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simgl.errors import ConfigError
from simgl.physics.frames import matrix_from_quaternion
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.from_42.state_message import StateMessage
from simgl_bridge.messages import Welcome

_SPACECRAFT = re.compile(r"([^=]+)=(\d+)(?::(\d+))?")
_CENTRE = re.compile(r"([^=]+)=([^,]+),([^,]+),([^,]+)")
_JOINT = re.compile(r"([^=.]+)\.([^=]+)=G\[?(\d+)\]?\.(Ang|Pos)\[?([012])\]?")


@dataclass(frozen=True)
class JointSource:
    """A component of a joint of 42.

    name : such as "G[0].Ang" [rad] or "G[0].Pos" [m]
    component : 0, 1 or 2
    """

    name: str
    component: int


@dataclass(frozen=True)
class SpacecraftSource:
    """Where the pose of a spacecraft comes from.

    index, orbit : N of SC[N], and of the reference orbit Orb[N] that it flies on
    centre_of_mass_m : (3,) in the axes and from the origin of the scenario's model
    joints : movable joint of the model to what moves it
    """

    index: int
    orbit: int = 0
    centre_of_mass_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    joints: Mapping[str, JointSource] = field(default_factory=dict)

    def pose(self, message: StateMessage) -> BodyPose:
        """The pose; raises BridgeError where the message lacks a part of it."""
        prefix, orbit = f"SC[{self.index}]", f"Orb[{self.orbit}]"
        q = np.array(message.numbers(f"{prefix}.qn", 4))
        q /= np.linalg.norm(q)
        rate_body = np.array(message.numbers(f"{prefix}.wn", 3))
        position = np.array(message.numbers(f"{orbit}.PosN", 3))
        position += message.numbers(f"{prefix}.PosR", 3)
        velocity = np.array(message.numbers(f"{orbit}.VelN", 3))
        velocity += message.numbers(f"{prefix}.VelR", 3)
        R_icrf_from_body = matrix_from_quaternion(q)
        centre = np.array(self.centre_of_mass_m)
        return BodyPose(
            position_m=position - R_icrf_from_body @ centre,
            velocity_m_s=velocity - R_icrf_from_body @ np.cross(rate_body, centre),
            q_icrf_from_body_xyzw=q,
            joints={
                joint: message.numbers(f"{prefix}.{source.name}", 3)[source.component]
                for joint, source in self.joints.items()
            },
            angular_velocity_rad_s=rate_body,
        )


def sources_of(
    welcome: Welcome,
    spacecraft: Sequence[str],
    centres_of_mass: Sequence[str],
    joints: Sequence[str],
) -> dict[str, SpacecraftSource]:
    """The source of each spacecraft that 42 places.

    spacecraft : "NAME=SC" or "NAME=SC:ORB"; none takes the server's spacecraft in their order as
        SC[0], SC[1] ... on Orb[0]
    centres_of_mass : "NAME=X,Y,Z" [m]
    joints : "NAME.JOINT=G0.Ang2": component 0 to 2 of the joint's angles [rad] or travel (Pos) [m]

    Raises ConfigError for an entry that is malformed, or names what the server does not have.
    """
    command = "simgl follow"
    sources: dict[str, SpacecraftSource] = {}
    for entry in spacecraft:
        match = _SPACECRAFT.fullmatch(entry)
        if match is None:
            raise ConfigError(
                command, "--spacecraft", f"must be NAME=SC or NAME=SC:ORB, got {entry}"
            )
        _check_known(welcome, match[1], "--spacecraft")
        sources[match[1]] = SpacecraftSource(int(match[2]), int(match[3] or 0))
    if not sources:
        sources = {name: SpacecraftSource(index) for index, name in enumerate(welcome.bodies)}
    for entry in centres_of_mass:
        match = _CENTRE.fullmatch(entry)
        try:
            if match is None:
                raise ValueError
            x, y, z = (float(number) for number in match.groups()[1:])
        except ValueError:
            problem = f"must be NAME=X,Y,Z in metres, got {entry}"
            raise ConfigError(command, "--centre-of-mass", problem) from None
        _check_placed(sources, match[1], "--centre-of-mass")
        sources[match[1]] = replace(sources[match[1]], centre_of_mass_m=(x, y, z))
    for entry in joints:
        match = _JOINT.fullmatch(entry)
        if match is None:
            problem = f"must be NAME.JOINT=G0.Ang2 (or .Pos), got {entry}"
            raise ConfigError(command, "--joint", problem)
        name, joint, number, kind, component = match.groups()
        _check_placed(sources, name, "--joint")
        movable = welcome.bodies[name]
        if joint not in movable:
            problem = f'"{name}" has no joint "{joint}"; it has {_listed(movable)}'
            raise ConfigError(command, "--joint", problem)
        moved = {**sources[name].joints, joint: JointSource(f"G[{number}].{kind}", int(component))}
        sources[name] = replace(sources[name], joints=moved)
    return sources


def _check_known(welcome: Welcome, name: str, option: str) -> None:
    if name not in welcome.bodies:
        problem = f'the server has no spacecraft "{name}"; it has {_listed(welcome.bodies)}'
        raise ConfigError("simgl follow", option, problem)


def _check_placed(sources: Mapping[str, SpacecraftSource], name: str, option: str) -> None:
    if name not in sources:
        problem = f'"{name}" is not placed by 42; placed are {_listed(sources)}'
        raise ConfigError("simgl follow", option, problem)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
