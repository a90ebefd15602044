"""Noise on charts of the sphere: hills and puffs of cloud, finer than the maps' texels.

One periodic image for all six faces of a cube about the Earth; shaders/planet/chart.glsl lays it
out. Made in Fourier space, so that it repeats without a seam.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy

from simgl.arrays import AnyArray, Array32, Image8
from simgl.disk_cache import computed_once, is_computed

SIZE = 1024
# Of a texel [km], where the chart is not drawn out: by up to 1.4 about the faces' corners.
TEXEL_KM = 0.25
# Stored as 0.5 + value / (2 * RANGE).
RANGE = 4.0
# Mipmap levels whose texels may still show something of it.
LEVELS = 8

# Cycles along an edge of the longest waves: 64 km of cloud and 10 km of hills, beyond which the
# maps have waves of their own.
_CLOUDS, _HILLS = 4.0, 25.0
# Of an octave's waves over those of the last, in height of ground and in cloud: the latter's
# variance falls by 2^-0.64 an octave, as that of liquid water does in stratus (Davis et al. 1999).
_HILL_WEIGHT, _PUFF_WEIGHT = 0.4, 0.8
# Cells of stratocumulus on the image: 20 km wide each.
_CELLS = 160
# The ground's hills stay where they are, whatever the clouds do.
_GROUND_SEED = 20260320


@lru_cache(maxsize=2)
def chart(seed: int) -> tuple[tuple[Image8, ...], Array32]:
    """What ``make_chart`` returns, made once on a machine."""
    arrays = computed_once(*_source(seed), lambda: _packed(*make_chart(seed)), _is_complete)
    return tuple(arrays[f"codes_{level}"] for level in range(LEVELS)), arrays["left"]


def has_chart(seed: int) -> bool:
    """Whether ``chart`` need not make it."""
    return is_computed(*_source(seed))


def _source(seed: int) -> tuple[str, tuple[str, ...], object]:
    return "earth", (__name__, "numpy", "scipy"), ("chart", seed)


def _packed(codes: tuple[Image8, ...], left: Array32) -> dict[str, AnyArray]:
    return {"left": left} | {f"codes_{level}": code for level, code in enumerate(codes)}


def _is_complete(arrays: dict[str, AnyArray]) -> bool:
    shapes = {f"codes_{level}": (SIZE >> level, SIZE >> level, 4) for level in range(LEVELS)}
    return {name: array.shape for name, array in arrays.items()} == shapes | {"left": (LEVELS, 2)}


def make_chart(seed: int) -> tuple[tuple[Image8, ...], Array32]:
    """Noise by texel at each halving, and how much of its variance is left there.

    seed : of the clouds
    returns : LEVELS arrays, the first (SIZE, SIZE, 4), of codes of a field of hills' slopes along
        columns and rows, their rms 1, and of two fields of cloud, puffs and cells, both spread like
        a standard normal variable; and (LEVELS, 2) the variance of clouds and slopes at each
    """
    ground, clouds = np.random.default_rng(_GROUND_SEED), np.random.default_rng([seed, 1])
    puffs = _normal(_octaves(clouds, _CLOUDS, _PUFF_WEIGHT, folded=True), clouds)
    cells = _normal(
        _walled_cells(clouds) + 0.6 * _standard(_octaves(clouds, _CLOUDS, 0.9, folded=True)), clouds
    )
    values = np.dstack([_slopes(ground), puffs, cells])
    codes, left = [], []
    for _ in range(LEVELS):
        codes.append(
            np.round(255.0 * np.clip(0.5 + 0.5 / RANGE * values, 0.0, 1.0)).astype(np.uint8)
        )
        slope_x, slope_y, puff, cell = (_read(values[..., k], clouds).var() for k in range(4))
        left.append((puff + cell, slope_x + slope_y))
        half = values.shape[0] // 2
        values = values.reshape(half, 2, half, 2, 4).mean(axis=(1, 3))
    variances = np.array(left, dtype=np.float32)
    return tuple(codes), variances / variances[0]


def _frequencies() -> tuple[Array32, Array32, Array32]:
    """Cycles along x and y, and their length, for a real transform's half plane."""
    y = np.fft.fftfreq(SIZE, 1.0 / SIZE).astype(np.float32)[:, None]
    x = np.fft.rfftfreq(SIZE, 1.0 / SIZE).astype(np.float32)
    return x, y, np.hypot(x, y)


def _octaves(
    rng: np.random.Generator, longest: float, weight: float, *, folded: bool = False
) -> Array32:
    """(n, n) a sum of octaves, each ``weight`` times the last; all but the first are folded,
    which makes round heads between sharp creases."""
    k = _frequencies()[2]
    total = np.zeros((SIZE, SIZE), dtype=np.float32)
    cycles, amplitude = longest, 1.0
    while cycles <= SIZE / 4.0:
        band = np.exp(-((np.log2(np.maximum(k, 0.1) / cycles) / 0.5) ** 2))
        white = np.fft.rfft2(rng.standard_normal((SIZE, SIZE), dtype=np.float32))
        octave = _standard(np.fft.irfft2(white * band).astype(np.float32))
        total += amplitude * (np.abs(octave) if folded and cycles > longest else octave)
        cycles, amplitude = 2.0 * cycles, weight * amplitude
    return total


def _slopes(rng: np.random.Generator) -> Array32:
    """(n, n, 2) gradient of heights."""
    x, y, _ = _frequencies()
    heights = np.fft.rfft2(_octaves(rng, _HILLS, _HILL_WEIGHT, folded=True))
    parts = [np.fft.irfft2(1j * axis * heights) for axis in (x, y)]
    return _standard(np.stack(parts, axis=-1).astype(np.float32))


def _walled_cells(rng: np.random.Generator) -> Array32:
    """(n, n) domes that meet along creases, as wide as high."""
    places = rng.uniform(0.0, SIZE, (_CELLS, 2))
    y, x = np.mgrid[:SIZE, :SIZE] + 0.5
    # Their walls are bent.
    bend = 8.0 * np.stack([_standard(_octaves(rng, _CLOUDS, 0.5)) for _ in range(2)], axis=-1)
    at = np.mod(np.stack([x, y], axis=-1) + bend, SIZE).reshape(-1, 2)
    near, _ = scipy.spatial.KDTree(places, boxsize=SIZE).query(at, k=2)
    return _standard(np.log(4.0 + near[:, 1] - near[:, 0]).reshape(SIZE, SIZE).astype(np.float32))


def _standard(field: Array32) -> Array32:
    """The field with mean 0 and standard deviation 1."""
    return (field - field.mean()) / field.std()


def _read(field: Array32, rng: np.random.Generator) -> Array32:
    """Values at random places, between texels."""
    places = rng.uniform(0.0, field.shape[0], (2, 200_000))
    return scipy.ndimage.map_coordinates(field, places, order=1, mode="grid-wrap")


def _normal(field: Array32, rng: np.random.Generator) -> Array32:
    """The field bent so that what is read of it is normally distributed."""
    levels = np.sort(_read(field, rng))
    wanted = scipy.special.ndtri((np.arange(levels.size) + 0.5) / levels.size)
    return np.interp(field, levels, wanted).astype(np.float32)
