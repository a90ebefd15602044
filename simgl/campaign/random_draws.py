"""Random values that depend on seed, name and frame alone, not on the worker or the order.

Uniform numbers come from Philox (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2,
3"): the key is the seed and the name of the value, the counter the frame. Another random value
therefore changes none of the others.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.random import Generator, Philox
from scipy.spatial.transform import Rotation
from scipy.special import ndtri

from simgl.arrays import Array


@dataclass(frozen=True)
class Draw:
    """The random numbers of one attempt at one frame."""

    seed: int
    frame: int
    attempt: int = 0

    def uniforms(self, name: str, count: int) -> Array:
        """(count,) numbers in 0..1, the same whenever a name is asked for."""
        key = np.array([self.seed, zlib.crc32(name.encode())], dtype=np.uint64)
        counter = np.array([0, 0, self.attempt, self.frame], dtype=np.uint64)
        return Generator(Philox(key=key, counter=counter)).random(count)

    def word(self, name: str) -> int:
        """An integer of 32 bits."""
        return int(self.uniforms(name, 1)[0] * 2.0**32)


@dataclass(frozen=True)
class Distribution:
    """Distribution of a value.

    quantile : the value that a share 0..1 of all draws stays below
    low, high : limits of the values, infinite where there are none
    """

    quantile: Callable[[float], float]
    low: float
    high: float

    def at(self, draw: Draw, name: str) -> float:
        """The value of a frame."""
        return float(self.quantile(float(draw.uniforms(name, 1)[0])))


# Quantiles at module level, since a campaign is pickled for its workers.
def _uniform(low: float, high: float, share: float) -> float:
    return low + share * (high - low)


def _log_uniform(low: float, high: float, share: float) -> float:
    return float(low * (high / low) ** share)


def _normal(mean: float, deviation: float, share: float) -> float:
    # The generator may give 0, never 1.
    return mean + deviation * float(ndtri(max(share, 2.0**-54)))


def _choice(values: tuple[float, ...], share: float) -> float:
    return values[int(share * len(values))]


def uniform(low: float, high: float) -> Distribution:
    """Every value between two limits is equally likely."""
    return Distribution(partial(_uniform, low, high), low, high)


def log_uniform(low: float, high: float) -> Distribution:
    """Every ratio is equally likely; both limits are positive."""
    return Distribution(partial(_log_uniform, low, high), low, high)


def normal(mean: float, deviation: float) -> Distribution:
    """The normal distribution."""
    if deviation == 0.0:
        return choice((mean,))
    return Distribution(partial(_normal, mean, deviation), -np.inf, np.inf)


def choice(values: tuple[float, ...]) -> Distribution:
    """Each of some values is equally likely."""
    return Distribution(partial(_choice, values), min(values), max(values))


def direction(draw: Draw, name: str) -> Array:
    """(3,) unit, uniform on the sphere."""
    share, turn = draw.uniforms(name, 2)
    z, angle = 2.0 * share - 1.0, 2.0 * np.pi * turn
    across = np.sqrt(1.0 - z * z)
    return np.array([across * np.cos(angle), across * np.sin(angle), z])


def rotation(draw: Draw, name: str) -> Array:
    """(3, 3), uniform over all rotations: Shoemake's quaternion of three uniform numbers (1992)."""
    share, first, second = draw.uniforms(name, 3)
    a, b = 2.0 * np.pi * first, 2.0 * np.pi * second
    low, high = np.sqrt(1.0 - share), np.sqrt(share)
    quaternion = [low * np.sin(a), low * np.cos(a), high * np.sin(b), high * np.cos(b)]
    return Rotation.from_quat(quaternion).as_matrix()
