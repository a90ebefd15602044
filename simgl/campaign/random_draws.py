"""Random values that depend on seed, name and frame alone, whoever draws them and in what order.

Uniform numbers come from Philox (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2,
3"): the key is the seed and what is drawn, the counter the frame. A further value that is drawn
therefore changes none of the others.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

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
        """(count,) numbers in 0..1, always the same ones for a name."""
        key = np.array([self.seed, zlib.crc32(name.encode())], dtype=np.uint64)
        counter = np.array([0, 0, self.attempt, self.frame], dtype=np.uint64)
        return Generator(Philox(key=key, counter=counter)).random(count)

    def word(self, name: str) -> int:
        """A number of 32 bits."""
        return int(self.uniforms(name, 1)[0] * 2.0**32)


@dataclass(frozen=True)
class Distribution:
    """Where a value lies.

    quantile : the value that a share 0..1 of all draws stays below
    low, high : limits of the values, infinite where there are none
    """

    quantile: Callable[[float], float]
    low: float
    high: float

    def at(self, draw: Draw, name: str) -> float:
        """The value of a frame."""
        return float(self.quantile(float(draw.uniforms(name, 1)[0])))


@dataclass(frozen=True)
class _Between:
    low: float
    high: float

    def __call__(self, share: float) -> float:
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True)
class _LogBetween:
    low: float
    high: float

    def __call__(self, share: float) -> float:
        return float(self.low * (self.high / self.low) ** share)


@dataclass(frozen=True)
class _Normal:
    mean: float
    deviation: float

    def __call__(self, share: float) -> float:
        # The generator may give 0, never 1.
        return self.mean + self.deviation * float(ndtri(max(share, 2.0**-54)))


@dataclass(frozen=True)
class _Choice:
    values: tuple[float, ...]

    def __call__(self, share: float) -> float:
        return self.values[int(share * len(self.values))]


def uniform(low: float, high: float) -> Distribution:
    """Every value between two as likely."""
    return Distribution(_Between(low, high), low, high)


def log_uniform(low: float, high: float) -> Distribution:
    """Every ratio as likely; both limits positive."""
    return Distribution(_LogBetween(low, high), low, high)


def normal(mean: float, deviation: float) -> Distribution:
    """Gauss's."""
    if deviation == 0.0:
        return choice((mean,))
    return Distribution(_Normal(mean, deviation), -np.inf, np.inf)


def choice(values: tuple[float, ...]) -> Distribution:
    """One of some values."""
    return Distribution(_Choice(values), min(values), max(values))


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
