"""Joints of a model: hinges and rails, possibly one on another.

``body_from_stored`` is the only place that turns joint values into transforms; mesh, lighting,
procedural patterns and keypoints use it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.errors import did_you_mean
from simgl.physics.frames import rotation_about


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """A hinge, or a rail.

    parts : indices of the model's parts that it carries directly
    axis_body : (3,) unit, as stored: hinges turn right-handed about it, rails slide along it
    origin_body : (3,) a point on the hinge line, as stored [m]
    limits : smallest and largest value from the stored position [rad], or [m] for a rail
    keypoints : names of the keypoints on its parts
    sunward_body : (3,) unit, the axis that a sun-tracking drive points at the Sun, as stored; None
        if the joint cannot track the Sun
    parent : index of the joint that carries it; None for the body
    slides : a rail instead of a hinge
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
        """Unit of the joint's value."""
        return "m" if self.slides else "rad"

    @property
    def carrier(self) -> int:
        """Index of its carrier in ``body_from_stored``."""
        return 0 if self.parent is None else self.parent + 1

    def transform(self, value: float) -> Array:
        """(4, 4) transform of what it carries, its carrier as stored; value [rad] or [m]."""
        motion = np.eye(4)
        if self.slides:
            motion[:3, 3] = value * self.axis_body
        else:
            turn = rotation_about(self.axis_body, value)
            motion[:3, :3] = turn
            motion[:3, 3] = self.origin_body - turn @ self.origin_body
        return motion


def chain(joints: Sequence[Joint], index: int) -> list[int]:
    """The indices of a joint and of its carriers, from the joint to the body."""
    indices = [index]
    while (parent := joints[indices[-1]].parent) is not None:
        indices.append(parent)
    return indices


def outward(joints: Sequence[Joint]) -> Iterator[int]:
    """The joints' indices, each after its carriers."""
    yield from sorted(range(len(joints)), key=lambda index: len(chain(joints, index)))


def carried_parts(joints: Sequence[Joint], index: int) -> list[int]:
    """Indices of all parts that move with a joint, directly or on other joints."""
    return [part for i, j in enumerate(joints) if index in chain(joints, i) for part in j.parts]


def body_from_stored(joints: Sequence[Joint], values: Sequence[float]) -> Array:
    """(joints + 1, 4, 4) transforms from stored to current positions, body axes.

    values : of the joints, in their order [rad] or [m]

    The first is for points on no joint. The transform of a joint is the product of the transforms
    along its chain about axes as stored, the joint on the body leftmost (product of exponentials,
    Brockett 1984).
    """
    moved = np.tile(np.eye(4), (len(joints) + 1, 1, 1))
    for index in outward(joints):
        joint = joints[index]
        transform = joint.transform(values[index]) if values[index] else np.eye(4)
        moved[index + 1] = moved[joint.carrier] @ transform
    return moved


def group_of_keypoint(joints: Sequence[Joint], keypoint: str) -> int:
    """Index in ``body_from_stored`` of what moves a keypoint; 0 if no joint does."""
    return next((i + 1 for i, joint in enumerate(joints) if keypoint in joint.keypoints), 0)


def group_of_part(joints: Sequence[Joint], part: int) -> int:
    """The same of a part, by its index."""
    return next((i + 1 for i, joint in enumerate(joints) if part in joint.parts), 0)


def relative_motion(first: Array, second: Array) -> Array:
    """(n, 4, 4) transforms from positions under the first transforms to those under the second.

    first, second : (n, 4, 4); exactly the identity where both are equal
    """
    motion = second @ np.linalg.inv(first)
    motion[(first == second).all(axis=(1, 2))] = np.eye(4)
    return motion


def moved_keypoints(
    keypoints: Mapping[str, Array], joints: Sequence[Joint], motion: Array
) -> dict[str, Array]:
    """The keypoints at their current positions, body axes [m].

    motion : (joints + 1, 4, 4) from ``body_from_stored``
    """
    moved = dict(keypoints)
    for joint, matrix in zip(joints, motion[1:], strict=True):
        for name in joint.keypoints:
            moved[name] = matrix[:3, :3] @ keypoints[name] + matrix[:3, 3]
    return moved


def unknown_joint(name: str, joints: Sequence[Joint]) -> str:
    """Error text for a name that is not a joint."""
    return f"is not a joint of this model; {did_you_mean(name, [joint.name for joint in joints])}"
