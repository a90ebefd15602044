"""Parts that turn on hinges or slide on rails: doors, wings, arms, one joint on another.

`body_from_stored` alone says where joints put a place; the mesh, its light, its patterns and its
keypoints all follow it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.errors import did_you_mean


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """A hinge, or a rail.

    parts : indices of the model's parts that sit on it and on no joint that it carries
    axis_body : (3,) unit, as stored: about it positive angles turn right-handed, along it it slides
    origin_body : (3,) a point on the hinge line, as stored [m]
    limits : least and greatest value from the stored position [rad], or [m] where it slides
    keypoints : names of those that move with its parts
    sunward_body : (3,) unit, the side of its parts that a drive turns to the Sun, as stored; None
        for a joint that is no such drive
    parent : index among the model's joints of the one that carries it; None for the body
    slides : along its axis, instead of turning about it
    """

    name: str
    parts: tuple[int, ...]
    axis_body: Array
    origin_body: Array
    limits: tuple[float, float]
    keypoints: tuple[str, ...] = ()
    sunward_body: Array | None = None
    parent: int | None = None
    slides: bool = False

    @property
    def unit(self) -> str:
        """Of its values."""
        return "m" if self.slides else "rad"

    @property
    def carrier(self) -> int:
        """Where `body_from_stored` has what carries it."""
        return 0 if self.parent is None else self.parent + 1

    def own_motion(self, value: float) -> Array:
        """(4, 4) of what sits on it, what carries it as stored; value [rad] or [m]."""
        motion = np.eye(4)
        if self.slides:
            motion[:3, 3] = value * self.axis_body
        else:
            turn = Rotation.from_rotvec(value * self.axis_body).as_matrix()
            motion[:3, :3] = turn
            motion[:3, 3] = self.origin_body - turn @ self.origin_body
        return motion


def chain(joints: Sequence[Joint], index: int) -> list[int]:
    """The indices of a joint and of those that carry it, the one on the body last."""
    found = [index]
    while (parent := joints[found[-1]].parent) is not None:
        found.append(parent)
    return found


def outward(joints: Sequence[Joint]) -> Iterator[int]:
    """The joints' indices, each after those that carry it."""
    yield from sorted(range(len(joints)), key=lambda index: len(chain(joints, index)))


def carried_parts(joints: Sequence[Joint], index: int) -> list[int]:
    """Indices of all parts that move with a joint, on it or on what it carries."""
    return [part for i, j in enumerate(joints) if index in chain(joints, i) for part in j.parts]


def body_from_stored(joints: Sequence[Joint], values: Sequence[float]) -> Array:
    """(joints + 1, 4, 4) from where a place is stored to where the joints put it, body axes.

    values : of the joints, in their order [rad] or [m]
    The first is for places on no joint. What sits on a joint moves by the product of the motions
    along its chain about axes as stored, the joint on the body leftmost (product of exponentials,
    Brockett 1984).
    """
    moved = np.tile(np.eye(4), (len(joints) + 1, 1, 1))
    for index in outward(joints):
        joint = joints[index]
        own = joint.own_motion(values[index]) if values[index] else np.eye(4)
        moved[index + 1] = moved[joint.carrier] @ own
    return moved


def motion_between(
    joints: Sequence[Joint], before: Sequence[float], after: Sequence[float]
) -> Array:
    """(joints + 1, 4, 4) from where the joints put a place to where they put it later.

    Exactly the identity for what has not moved.
    """
    return relative_motion(body_from_stored(joints, before), body_from_stored(joints, after))


def relative_motion(first: Array, second: Array) -> Array:
    """(n, 4, 4) from where one set of motions (n, 4, 4) puts a place to where the second does.

    Exactly the identity where both are equal.
    """
    motion = second @ np.linalg.inv(first)
    motion[(first == second).all(axis=(1, 2))] = np.eye(4)
    return motion


def moved_keypoints(
    keypoints: Mapping[str, Array], joints: Sequence[Joint], motion: Array
) -> dict[str, Array]:
    """The keypoints with those on joints where they are now [m].

    motion : (joints + 1, 4, 4) of each joint's parts, after `body_from_stored`
    """
    moved = dict(keypoints)
    for joint, matrix in zip(joints, motion[1:], strict=True):
        for name in joint.keypoints:
            moved[name] = matrix[:3, :3] @ keypoints[name] + matrix[:3, 3]
    return moved


def unknown_joint(name: str, joints: Sequence[Joint]) -> str:
    """What to say of a name that is none of the joints'."""
    return f"is no joint of this model; {did_you_mean(name, [joint.name for joint in joints])}"
