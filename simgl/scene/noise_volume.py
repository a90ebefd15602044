"""A periodic volume of noise: hills of the ground and puffs of cloud, finer than the maps' texels.

Made in Fourier space, so that it repeats without a seam. A sphere that cuts it askew shows a
pattern that does not repeat in practice.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from simgl.arrays import Array32, Image8
from simgl.disk_cache import computed_once
from simgl.scene import knot_table
from simgl.scene.knot_table import interpolated

SIZE = 128
# Middles of the first and last octave, in cycles along an edge; the last is four texels long.
_CYCLES = (4.0, 32.0)
# The ground's hills stay where they are, whatever the clouds do.
_GROUND_SEED = 20260320
# Slopes are stored as 0.5 + slope / (2 * SLOPE_RANGE).
SLOPE_RANGE = 4.0


@lru_cache(maxsize=1)
def noise_volume(seed: int) -> Image8:
    """What ``make_volume`` returns, made once on a machine."""
    made_by = (__name__, knot_table.__name__, "numpy", "scipy")
    return computed_once(
        "earth",
        made_by,
        ("volume", seed),
        lambda: {"codes": make_volume(seed)},
        lambda arrays: arrays["codes"].shape == (SIZE, SIZE, SIZE, 4),
    )["codes"]


def make_volume(seed: int) -> Image8:
    """(SIZE, SIZE, SIZE, 4) bytes, indexed z, y, x.

    seed : of the clouds
    returns : slopes along x, y, z of one field of hills, their rms 1; and a level that is evenly
        spread over 0..1, so that the part of space above 1 - c is c
    """
    ground, clouds = np.random.default_rng(_GROUND_SEED), np.random.default_rng([seed, 1])
    slopes = 0.5 + 0.5 / SLOPE_RANGE * _slopes(ground)
    volume = np.concatenate(
        [slopes, _evenly_spread(_folded_octaves(clouds, 0.7), clouds)[..., None]], axis=-1
    )
    return np.asarray(np.round(255.0 * np.clip(volume, 0.0, 1.0)), dtype=np.uint8)


def _frequencies() -> tuple[Array32, Array32, Array32, Array32]:
    """Cycles along x, y, z and their length, for a real transform's half space."""
    full = np.fft.fftfreq(SIZE, 1.0 / SIZE).astype(np.float32)
    half = np.fft.rfftfreq(SIZE, 1.0 / SIZE).astype(np.float32)
    z, y, x = full[:, None, None], full[:, None], half
    return x, y, z, np.sqrt(x * x + y * y + z * z)


def _white(rng: np.random.Generator) -> NDArray[np.complex64]:
    noise = rng.standard_normal((SIZE, SIZE, SIZE), dtype=np.float32)
    return scipy.fft.rfftn(noise).astype(np.complex64)


def _slopes(rng: np.random.Generator) -> Array32:
    """(n, n, n, 3) gradient of heights; a third an octave, so that hills show above their grain."""
    x, y, z, _ = _frequencies()
    heights = scipy.fft.rfftn(_folded_octaves(rng, 0.33))
    parts = [scipy.fft.irfftn(1j * axis * heights) for axis in (x, y, z)]
    slopes = np.stack(parts, axis=-1).astype(np.float32)
    return slopes / np.float32(slopes.std())


def _folded_octaves(rng: np.random.Generator, weight: float) -> Array32:
    """(n, n, n) a sum of octaves, each ``weight`` times the last; all but the first are folded,
    which makes round heads between sharp creases."""
    k = _frequencies()[3]
    total = np.zeros((SIZE, SIZE, SIZE), dtype=np.float32)
    cycles, amplitude = _CYCLES[0], 1.0
    while cycles <= _CYCLES[1]:
        band = np.exp(-((np.log2(np.maximum(k, 0.1) / (1.3 * cycles)) / 0.45) ** 2))
        octave = scipy.fft.irfftn(_white(rng) * band).astype(np.float32)
        octave /= octave.std()
        total += amplitude * (octave if cycles == _CYCLES[0] else np.abs(octave))
        cycles, amplitude = 2.0 * cycles, weight * amplitude
    return total


def _evenly_spread(field: Array32, rng: np.random.Generator) -> Array32:
    """The share of space where the field, read between its texels, is lower."""
    places = rng.uniform(0.0, SIZE, (3, 200_000))
    levels = np.sort(scipy.ndimage.map_coordinates(field, places, order=1, mode="grid-wrap"))
    share = np.linspace(0.0, 1.0, levels.size)
    return interpolated(field, levels, share)
