"""Poses of one body to another, rounded: what is worked out for one is known again near it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array

# What float64 leaves unsure of places some 7000 km from the Earth's centre, and of turns, is below
# these: a micrometre and a nanoradian.
_PLACES, _TURNS = 2.0**-20, 2.0**-30


def in_steps(other_from_body: Array, reach: float, step: float) -> Array:
    """(4, 4) a pose of one body in the axes of another, in steps small beside their distance.

    reach : [m] between them
    step : as a share of that, and of turns [rad]
    """
    return _in_steps(other_from_body.tobytes(), reach, step)


# Poses of bodies that keep their places: SciPy takes a tenth of a millisecond for each.
@lru_cache(maxsize=64)
def _in_steps(pose: bytes, reach: float, step: float) -> Array:
    other_from_body = np.frombuffer(pose).reshape(4, 4)
    result = np.eye(4)
    size = 2.0 ** np.floor(np.log2(max(step * reach, 1e-6)))
    result[:3, 3] = size * np.round(other_from_body[:3, 3] / size)
    turn = step * np.round(Rotation.from_matrix(other_from_body[:3, :3]).as_rotvec() / step) + 0.0
    # Half a turn is one either way: rounding errors do not choose.
    if np.linalg.norm(turn) > np.pi - step and turn[np.flatnonzero(turn)[0]] < 0.0:
        turn = -turn
    result[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    # Without negative zeros: equal poses have equal bits.
    result += 0.0
    result.setflags(write=False)
    return result


def without_noise(other_from_body: Array) -> Array:
    """(4, 4) a pose of one body in the axes of another; the same while the two stand to each other
    as they do but for rounding errors."""
    result = np.eye(4)
    result[:3, :3] = in_multiples(other_from_body[:3, :3], _TURNS)
    result[:3, 3] = in_multiples(other_from_body[:3, 3], _PLACES)
    return result


def place_without_noise(place: Array) -> Array:
    """(3,) likewise a place [m]."""
    return in_multiples(place, _PLACES)


def direction_without_noise(direction: Array) -> Array:
    """(3,) likewise a unit vector."""
    return in_multiples(direction, _TURNS)


def in_multiples(values: Array, step: float) -> Array:
    """Rounded to multiples of a step, without negative zeros: equal values have equal bits."""
    return step * np.round(values / step) + 0.0
