"""Thermal radiation in a band: Planck's law integrated between two wavelengths."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array
from simgl.physics.constants import BOLTZMANN, LIGHT_SPEED, PLANCK, STEFAN_BOLTZMANN

_SECOND_RADIATION = PLANCK * LIGHT_SPEED / BOLTZMANN  # [m K]

# Below this argument the series in powers of x converges by 0.1 with each term, above it the one in
# powers of exp(-x) by 0.14: terms enough for 1e-16.
_MIDDLE = 2.0
_POWER_TERMS, _EXPONENTIAL_TERMS = 17, 20


@lru_cache(maxsize=1)
def _bernoulli_numbers() -> tuple[float, ...]:
    """B_2, B_4, ... by their recursion in exact fractions."""
    from fractions import Fraction

    numbers = [Fraction(1)]
    for m in range(1, 2 * _POWER_TERMS + 1):
        total = sum(math.comb(m + 1, k) * numbers[k] for k in range(m))
        numbers.append(Fraction(-total, m + 1))
    return tuple(float(numbers[2 * k]) for k in range(1, _POWER_TERMS + 1))


def _below(x: Array, power: int) -> Array:
    """Integral of x^power / (e^x - 1) from 0 to x, for x up to 2; power 2 or 3."""
    result = x**power / power - 0.5 * x ** (power + 1) / (power + 1)
    for index, number in enumerate(_bernoulli_numbers()):
        k = 2 * (index + 1)
        result += number / math.factorial(k) * x ** (power + k) / (power + k)
    return result


def _above(x: Array, power: int) -> Array:
    """The same integral from x to infinity, for x from 2."""
    result = np.zeros_like(x)
    for n in range(1, _EXPONENTIAL_TERMS + 1):
        y = n * x
        inner = y * (y + 2.0) + 2.0
        polynomial = inner if power == 2 else y**3 + 3.0 * inner
        result += np.exp(-y) * polynomial / n ** (power + 1)
    return result


def _integral(low: Array, high: Array, power: int) -> Array:
    """Integral of x^power / (e^x - 1) between low and high, without loss in the tails."""
    complete = 2.4041138063191886 if power == 2 else np.pi**4 / 15.0  # 2 zeta(3), pi^4 / 15
    small = [np.minimum(x, _MIDDLE) for x in (low, high)]
    large = [np.maximum(x, _MIDDLE) for x in (low, high)]
    both = complete - _below(small[0], power) - _above(large[1], power)
    return np.where(
        high <= _MIDDLE,
        _below(small[1], power) - _below(small[0], power),
        np.where(low >= _MIDDLE, _above(large[0], power) - _above(large[1], power), both),
    )


def _arguments(band: tuple[float, float], temperature: Array) -> tuple[Array, Array]:
    low, high = band
    if not 0.0 <= low < high:
        raise ValueError(f"a band goes from 0 or more to a longer wavelength, got {band}")
    with np.errstate(divide="ignore"):
        shortest = _SECOND_RADIATION / (high * temperature)
        longest = _SECOND_RADIATION / (np.float64(low) * temperature)
    # e^-700 is 0 for all that follows; infinity would give 0 times infinity.
    return np.minimum(shortest, 700.0), np.minimum(longest, 700.0)


def band_fraction(band: tuple[float, float], temperature: ArrayLike) -> Array:
    """(...) share of a black body's radiation between two wavelengths.

    band : lower and upper wavelength [m]; 0 and infinity are allowed
    temperature : (...) above 0 [K]

    The integral of x^3 / (e^x - 1), x = h c / (lambda k T), by its series in powers of x (Bernoulli
    numbers) below x = 2 and of e^-x above (Chang & Rhee 1984). Relative error below 1e-12, for a
    band of a thousandth of its wavelength 1e-11.
    """
    t = np.asarray(temperature, dtype=np.float64)
    return np.asarray(_integral(*_arguments(band, t), 3) * (15.0 / np.pi**4))


def band_radiance(band: tuple[float, float], temperature: ArrayLike) -> Array:
    """(...) radiance of a black body between two wavelengths [W m-2 sr-1].

    band, temperature : as of ``band_fraction``
    """
    t = np.asarray(temperature, dtype=np.float64)
    return band_fraction(band, t) * (STEFAN_BOLTZMANN / np.pi) * t**4


def band_photon_radiance(band: tuple[float, float], temperature: ArrayLike) -> Array:
    """(...) photons of a black body between two wavelengths [s-1 m-2 sr-1].

    band, temperature : as of ``band_fraction``
    """
    t = np.asarray(temperature, dtype=np.float64)
    scale = 2.0 * (BOLTZMANN / PLANCK) ** 3 / LIGHT_SPEED**2
    return np.asarray(_integral(*_arguments(band, t), 2) * scale * t**3)


def band_temperature(band: tuple[float, float], radiance: ArrayLike) -> Array:
    """(...) temperature of a black body of a band radiance [W m-2 sr-1], 2 to 5000 K [K].

    The inverse of ``band_radiance``, to 1e-9, by Newton's method on the logarithms.
    """
    wanted = np.log(np.maximum(np.asarray(radiance, dtype=np.float64), 1e-280))
    grid = np.geomspace(2.0, 5000.0, 400)
    known = np.log(np.maximum(band_radiance(band, grid), 1e-290))
    t = np.log(np.interp(wanted, known, grid))
    for _ in range(4):
        low, high = (np.log(np.maximum(band_radiance(band, np.exp(t + s)), 1e-290))
                     for s in (-1e-5, 1e-5))  # fmt: skip
        slope = np.maximum((high - low) / 2e-5, 1.0)
        t = np.clip(t + (wanted - 0.5 * (low + high)) / slope, np.log(2.0), np.log(5000.0))
    return np.exp(t)
