"""Joint angles over time: fixed, from a table, or by sun-tracking drives."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from simgl.arrays import Array
from simgl.motion.joints import Joint, body_from_stored, chain, outward
from simgl.motion.samples import SampledAngles
from simgl.physics.frames import rotation_about

TAU = 2.0 * np.pi

# Pointing errors that differ by less are equal: rounding of a few products in double precision.
_SAME = 1e-13  # [rad]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLaws:
    """Laws of the joints of one spacecraft.

    fixed : name to angle [rad] or travel [m]
    sampled : from a file; None for none
    sunward : names of the sun-tracking drives
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
        given : values that replace the laws; drives take them into account

        Raises ConfigError if a file does not cover the epoch.
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
    """Name to angle [rad] of the sun-tracking drives.

    drives : names; those in ``held`` do not move
    held : values of the other joints [rad] or [m]; joints without a value are as stored
    sun_direction_body : (3,) towards the Sun, body axes

    Two stacked drives point the outer drive's face at the Sun together. If a drive carries several
    others, it does so with the first; the rest come as close as they can.
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
    """(3,) the sunward axis of a drive as stored, or of the first drive that it carries.

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
    """The angle within limits at which a hinge points a face closest to the Sun [rad].

    axis, face, sun : (3,) unit, in the axes of the hinge's carrier; the face as stored
    """
    start = face - np.dot(face, axis) * axis
    aim = sun - np.dot(sun, axis) * axis
    angle = float(np.arctan2(np.dot(np.cross(start, aim), axis), np.dot(start, aim)))
    return _within(angle, limits)


def _within(angle: float, limits: tuple[float, float]) -> float:
    """The angle modulo 2 pi within limits, closest to 0; if there is none, the nearer limit."""
    low, high = limits
    first, last = np.ceil((low - angle) / TAU), np.floor((high - angle) / TAU)
    if first <= last:
        same = angle + TAU * np.arange(first, last + 1.0)
        return float(same[np.argmin(np.abs(same))])
    beyond = [abs(np.angle(np.exp(1j * (angle - end)))) for end in limits]
    return low if beyond[0] <= beyond[1] else high


def _pair(carrier: Joint, carried: Joint, between: Array, sun: Array) -> tuple[float, float]:
    """Angles of two stacked hinges that point the outer one's face closest to the Sun.

    between : (3, 3) rotation of the joints between the two hinges
    sun : (3,) unit, in the axes of the inner hinge's carrier

    In axes that turn with the inner hinge, the face lies on a cone about the outer axis. The inner
    angle turns the Sun onto that cone (subproblem 2 of Paden and Kahan, 1986), or as close to it as
    possible. If limits prevent that, the optimum is at a limit of one hinge. Among equally good
    solutions the one with the smallest outer angle is used.
    """
    assert carried.sunward_body is not None
    base, base_limits = carrier.axis_body, carrier.limits
    axis, face = between @ carried.axis_body, between @ carried.sunward_body
    # Component along the outer axis of the Sun turned back by the inner angle t:
    # A cos t + B sin t + C.
    constant = float(np.dot(base, sun) * np.dot(base, axis))
    cosine = float(np.dot(axis, sun)) - constant
    sine = -float(np.dot(axis, np.cross(base, sun)))
    reach = float(np.hypot(cosine, sine))
    wanted = float(np.clip(np.dot(axis, face) - constant, -reach, reach))
    middle = float(np.arctan2(sine, cosine))
    offset = float(np.arctan2(np.sqrt((reach - wanted) * (reach + wanted)), wanted))
    cone = _angle_between(axis, face)
    onto_cone = [_polished(middle + a, base, axis, cone, sun) for a in (-offset, offset)]
    angles = [0.0, *base_limits, *(_within(a, base_limits) for a in onto_cone)]
    pairs = [(a, sun_angle(axis, face, carried.limits, _turned(sun, base, -a))) for a in angles]
    for end in carried.limits:
        pairs.append((sun_angle(base, _turned(face, axis, end), base_limits, sun), end))
    misses = [
        _angle_between(_turned(face, axis, second), _turned(sun, base, -first))
        for first, second in pairs
    ]
    best = [p for p, miss in zip(pairs, misses, strict=True) if miss <= min(misses) + _SAME]
    return min(best, key=lambda pair: (round(abs(pair[1]), 9), abs(pair[0])))


def _polished(angle: float, base: Array, axis: Array, cone: float, sun: Array) -> float:
    """One step of Newton for the angle that turns the Sun onto the cone about an axis.

    The cosines of narrow cones keep few digits of their angles; cross products keep all.
    """
    turned = _turned(sun, base, -angle)
    across = float(np.linalg.norm(np.cross(axis, turned)))
    rate = float(np.dot(axis, np.cross(base, turned)))
    # Where the Sun only just comes to the cone, or to its axis, there is nothing to gain.
    if across == 0.0 or abs(rate) < 1e-6 * across:
        return angle
    return angle + (cone - _angle_between(axis, turned)) * across / rate


def _turned(vector: Array, axis: Array, angle: float) -> Array:
    return rotation_about(axis, angle) @ vector


def _angle_between(a: Array, b: Array) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))
