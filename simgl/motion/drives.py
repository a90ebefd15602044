"""How joints move over time: by numbers, by a table, or towards the Sun."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.motion.joints import Joint, body_from_stored, chain, outward
from simgl.motion.samples import SampledAngles

TAU = 2.0 * np.pi

# Ways to point are as good as each other to the rounding of a few products in double precision.
_SAME = 1e-13  # [rad]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLaws:
    """How the joints of one spacecraft move.

    fixed : name to angle [rad] or travel [m]
    sampled : None where no file moves any
    sunward : names of the drives that follow the Sun
    """

    fixed: Mapping[str, float] = field(default_factory=dict)
    sampled: SampledAngles | None = None
    sunward: tuple[str, ...] = ()

    def angles(
        self,
        joints: Sequence[Joint],
        tai_ns: int,
        sun_direction_body: Array,
        given: Mapping[str, float] | None = None,
    ) -> dict[str, float]:
        """Name to angle [rad] or travel [m] of every joint that is moved.

        sun_direction_body : (3,) towards the Sun, body axes
        given : what holds in place of the laws; drives on such joints reckon with it
        Raises ConfigError where a file has no angles for the epoch.
        """
        held = dict(self.fixed)
        if self.sampled is not None:
            held |= self.sampled.at(tai_ns)
        held |= given or {}
        return held | sun_angles(joints, self.sunward, held, sun_direction_body)


def sun_angles(
    joints: Sequence[Joint],
    drives: Collection[str],
    held: Mapping[str, float],
    sun_direction_body: Array,
) -> dict[str, float]:
    """Name to angle [rad] of the drives that follow the Sun.

    drives : names; those in ``held`` stay there
    held : values of the other joints [rad] or [m]; those not named are as stored

    A drive that carries another one works with it, so that the other one's face points at the Sun;
    where it carries several, with the first of them, and the rest do their best.
    """
    values = [held.get(joint.name, 0.0) for joint in joints]
    moving = [name for name in drives if name not in held]
    waiting = [index for index in outward(joints) if joints[index].name in moving]
    while waiting:
        index = waiting.pop(0)
        joint = joints[index]
        turned = body_from_stored(joints, values)[:, :3, :3]
        sun = turned[joint.carrier].T @ sun_direction_body
        carried = next((i for i in waiting if index in chain(joints, i)), None)
        if carried is None:
            face = turned[joint.carrier].T @ _face(joints, drives, index, turned)
            values[index] = sun_angle(joint.axis_body, face, joint.limits, sun)
        else:
            waiting.remove(carried)
            between = turned[joint.carrier].T @ turned[joints[carried].carrier]
            values[index], values[carried] = _pair(joint, joints[carried], between, sun)
    return {j.name: value for j, value in zip(joints, values, strict=True) if j.name in moving}


def _face(joints: Sequence[Joint], drives: Collection[str], index: int, turned: Array) -> Array:
    """(3,) the side that a drive as stored turns to the Sun: its own, or that of one it carries.

    turned : (joints + 1, 3, 3) by all joints
    """
    faces = [
        turned[i + 1] @ joints[i].sunward_body
        for i in outward(joints)
        if index in chain(joints, i) and joints[i].name in drives
        if joints[i].sunward_body is not None
    ]
    return faces[0]


def sun_angle(axis: Array, face: Array, limits: tuple[float, float], sun: Array) -> float:
    """The angle within limits at which a hinge brings a face nearest to the Sun [rad].

    axis, face, sun : (3,) unit, in the axes of what carries the hinge, the face as stored
    """
    start = face - np.dot(face, axis) * axis
    aim = sun - np.dot(sun, axis) * axis
    angle = float(np.arctan2(np.dot(np.cross(start, aim), axis), np.dot(start, aim)))
    return _within(angle, limits)


def _within(angle: float, limits: tuple[float, float]) -> float:
    """The same direction within limits, the nearest to 0; out of reach the end that is nearer,
    going round the shorter way."""
    low, high = limits
    first, last = np.ceil((low - angle) / TAU), np.floor((high - angle) / TAU)
    if first <= last:
        same = angle + TAU * np.arange(first, last + 1.0)
        return float(same[np.argmin(np.abs(same))])
    beyond = [abs(np.angle(np.exp(1j * (angle - end)))) for end in limits]
    return low if beyond[0] <= beyond[1] else high


def _pair(carrier: Joint, carried: Joint, between: Array, sun: Array) -> tuple[float, float]:
    """Angles of two hinges, one on the other, that bring the latter's face nearest to the Sun.

    between : (3, 3) turn of what lies between the two hinges
    sun : (3,) unit, in the axes of what holds the carrier

    Seen from what the carrier turns, the face can point anywhere on a cone about the second axis;
    the first angle brings the Sun onto that cone (subproblem 2 of Paden and Kahan, 1986), or as
    near to it as it gets. Where limits forbid that, the best lies at an end of one of the two. Of
    several ways as good as each other, the one that swings the carried one least is taken.
    """
    assert carried.sunward_body is not None
    base, base_limits = carrier.axis_body, carrier.limits
    axis, face = between @ carried.axis_body, between @ carried.sunward_body
    # Along the second axis, the Sun turned back by the first angle t is A cos t + B sin t + C.
    constant = float(np.dot(base, sun) * np.dot(base, axis))
    cosine = float(np.dot(axis, sun)) - constant
    sine = -float(np.dot(axis, np.cross(base, sun)))
    reach = float(np.hypot(cosine, sine))
    wanted = float(np.clip(np.dot(axis, face) - constant, -reach, reach))
    middle = float(np.arctan2(sine, cosine))
    aside = float(np.arctan2(np.sqrt((reach - wanted) * (reach + wanted)), wanted))
    ways = [0.0, *base_limits, *(_within(middle + a, base_limits) for a in (-aside, aside))]
    pairs = [(way, sun_angle(axis, face, carried.limits, _turned(sun, base, -way))) for way in ways]
    for end in carried.limits:
        pairs.append((sun_angle(base, _turned(face, axis, end), base_limits, sun), end))
    misses = [
        _angle_between(_turned(face, axis, second), _turned(sun, base, -first))
        for first, second in pairs
    ]
    best = [p for p, miss in zip(pairs, misses, strict=True) if miss <= min(misses) + _SAME]
    return min(best, key=lambda pair: (round(abs(pair[1]), 9), abs(pair[0])))


def _turned(vector: Array, axis: Array, angle: float) -> Array:
    return Rotation.from_rotvec(angle * axis).apply(vector)


def _angle_between(a: Array, b: Array) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))
