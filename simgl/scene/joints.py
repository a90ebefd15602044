"""Parts that turn on hinges: doors, flaps, solar wings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simgl.errors import did_you_mean
from simgl.scene.mesh import Mesh
from simgl.scene.samples import SampledAngles

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """A hinge of one part.

    part : index in the model's parts
    axis_body : (3,) unit, about which positive angles turn right-handed
    origin_body : (3,) a point on the hinge line [m]
    limits : least and greatest angle from the stored position [rad]
    keypoints : names of those that move with the part
    sunward_body : (3,) unit, the side of the part that a drive turns to the Sun, as stored; None
        for a joint that is no such drive
    """

    name: str
    part: int
    axis_body: Array
    origin_body: Array
    limits: tuple[float, float]
    keypoints: tuple[str, ...] = ()
    sunward_body: Array | None = None

    def sun_angle(self, sun_direction_body: Array) -> float:
        """The angle within the limits that brings the part's face nearest to the Sun [rad].

        sun_direction_body : (3,) towards the Sun, body axes
        """
        assert self.sunward_body is not None
        start = self.sunward_body - np.dot(self.sunward_body, self.axis_body) * self.axis_body
        aim = sun_direction_body - np.dot(sun_direction_body, self.axis_body) * self.axis_body
        angle = float(np.arctan2(np.dot(np.cross(start, aim), self.axis_body), np.dot(start, aim)))
        low, high = self.limits
        if low <= angle <= high:
            return angle
        # Out of reach: the end that is nearer, going round the shorter way.
        beyond = [abs(np.angle(np.exp(1j * (angle - end)))) for end in (low, high)]
        return low if beyond[0] <= beyond[1] else high


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLaws:
    """How the joints of one spacecraft move.

    fixed : name to angle [rad]
    sampled : None where no file moves any
    sunward : names of the drives that follow the Sun
    """

    fixed: Mapping[str, float] = field(default_factory=dict)
    sampled: SampledAngles | None = None
    sunward: tuple[str, ...] = ()

    def angles(
        self, joints: Sequence[Joint], tai_ns: int, sun_direction_body: Array
    ) -> dict[str, float]:
        """Name to angle [rad] of every joint that is moved.

        sun_direction_body : (3,) towards the Sun, body axes
        Raises ConfigError where a file has no angles for the epoch.
        """
        found = dict(self.fixed)
        if self.sampled is not None:
            found |= self.sampled.at(tai_ns)
        drives = [joint for joint in joints if joint.name in self.sunward]
        return found | {joint.name: joint.sun_angle(sun_direction_body) for joint in drives}


def unknown_joint(name: str, joints: Sequence[Joint]) -> str:
    """What to say of a name that is none of the joints'."""
    return f"is no joint of this model; {did_you_mean(name, [joint.name for joint in joints])}"


def turned_mesh(mesh: Mesh, joints: Sequence[Joint], angles: Mapping[str, float]) -> Mesh:
    """The mesh with the parts of some joints turned by angles [rad]; the others stay."""
    positions, normals = mesh.positions.copy(), mesh.normals.copy()
    moved = np.zeros(len(positions), dtype=np.uint32) if mesh.joint is None else mesh.joint.copy()
    for index, joint in enumerate(joints):
        angle = angles.get(joint.name, 0.0)
        chosen = mesh.part == joint.part
        if angle == 0.0 or not np.any(chosen):
            continue
        turn = Rotation.from_rotvec(angle * joint.axis_body).as_matrix()
        offsets = mesh.positions[chosen] - joint.origin_body
        positions[chosen] = offsets @ turn.T + joint.origin_body
        normals[chosen] = mesh.normals[chosen] @ turn.T
        moved[chosen] = index + 1
    return replace(mesh, positions=positions, normals=normals, joint=moved)


def stored_from_body(joints: Sequence[Joint], angles: Sequence[float]) -> Array:
    """(joints + 1, 3, 4) back from where joints have turned a place to where it is stored.

    The first is for places that no joint has turned.
    """
    back = [np.eye(3, 4)]
    for joint, angle in zip(joints, angles, strict=True):
        turn = Rotation.from_rotvec(-angle * joint.axis_body).as_matrix()
        shift = joint.origin_body - turn @ joint.origin_body
        back.append(np.column_stack([turn, shift]))
    return np.stack(back)


def turned_keypoints(
    keypoints: Mapping[str, Array], joints: Sequence[Joint], angles: Mapping[str, float]
) -> dict[str, Array]:
    """The keypoints with those on moved parts where they are now [m]."""
    moved = dict(keypoints)
    for joint in joints:
        turn = Rotation.from_rotvec(angles.get(joint.name, 0.0) * joint.axis_body)
        for name in joint.keypoints:
            offset = keypoints[name] - joint.origin_body
            moved[name] = turn.apply(offset) + joint.origin_body
    return moved
