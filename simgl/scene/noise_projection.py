"""Noise on charts of the sphere, finer than the maps' texels: hills, eddies of the sea, clouds.

One pair of periodic images for all six faces of a cube about the Earth; shaders/planet/chart.glsl
lays it out. Made in Fourier space, so that it repeats without a seam.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy

from simgl.arrays import AnyArray, Array32, Image8
from simgl.disk_cache import computed_once, is_computed
from simgl.scene import knot_table
from simgl.scene.knot_table import interpolated

SIZE = 1024
# Of a texel [km], where the chart is not drawn out: by up to 1.4 about the faces' corners.
TEXEL_KM = 0.25
# Stored as 0.5 + value / (2 * RANGE).
RANGE = 4.0
# Mipmap levels whose texels may still show something of it.
LEVELS = 8

# Cycles along an edge of the longest waves: 64 km of cloud and 18 km of hills, beyond which the
# maps have waves of their own.
_CLOUDS, _HILLS = 4.0, 14.0
# Of an octave's waves over those of the last, in height of ground and in cloud: the latter's
# variance falls by 2^-0.64 an octave, as that of liquid water does in stratus (Davis et al. 1999).
_HILL_WEIGHT, _PUFF_WEIGHT = 0.5, 0.8
# Power of their number to which the amplitude of waves of cumulus goes. Where such noise, of 2^-h
# an octave, crosses a level, outlines have the dimension 2 - h: that of clouds is 1.35 (Lovejoy
# 1982, Science 216, 185). More of the finest would break them up into grains.
_CUMULUS_SLOPE = -1.65
# Cells on the image: closed ones of stratocumulus, 20 km wide, and open ones, 32 km wide
# (Wood and Hartmann 2006: 10 to 50 km).
_CLOSED, _OPEN = 160, 64
# Longest waves [cycles] of what lies on cells, and of cumulus: 16 and 11 km. Streets of cumulus are
# 8 km apart, two to three times the height of their layer (Weston 1980).
_ON_CELLS, _CUMULUS, _STREETS = 16.0, 24.0, 32.0
# Of the sea's eddies: longest and shortest waves [cycles] of the stream function, and the power of
# their number to which amplitudes go, as in turbulence on a plane; of what they carry. A slick is
# as far drawn out as so many steps of so many of the stream's texels take it.
_EDDIES, _STREAM_SLOPE, _CARRIED, _CARRIED_SLOPE = (3.0, 60.0), -2.6, 4.0, -1.7
_STEPS, _STEP = 10, 2.0
# Knots of the table by which a field is bent to a normal one.
_BENT_LEVELS = 4096
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
    return "earth", (__name__, knot_table.__name__, "numpy", "scipy"), ("chart", seed)


def _packed(codes: tuple[Image8, ...], left: Array32) -> dict[str, AnyArray]:
    return {"left": left} | {f"codes_{level}": code for level, code in enumerate(codes)}


def _is_complete(arrays: dict[str, AnyArray]) -> bool:
    shapes = {f"codes_{level}": (SIZE >> level, SIZE >> level, 8) for level in range(LEVELS)}
    return {name: array.shape for name, array in arrays.items()} == shapes | {"left": (LEVELS, 6)}


def make_chart(seed: int) -> tuple[tuple[Image8, ...], Array32]:
    """Noise by texel at each halving, and how much of its variance is left there.

    seed : of the clouds
    returns : LEVELS arrays, the first (SIZE, SIZE, 8), of codes of a field of hills' slopes along
        columns and rows, their rms 1, of what eddies of the sea draw out, and of fibres of ice
        cloud; then of the kinds of cloud: closed cells, open cells, cumulus in streets, lumps.
        All but slopes are spread like a standard normal variable. And (LEVELS, 6) the variance
        of slopes, fibres and the kinds at each
    """
    ground, clouds = np.random.default_rng(_GROUND_SEED), np.random.default_rng([seed, 1])
    lumps = _normal(_octaves(clouds, _CLOUDS, _PUFF_WEIGHT, folded=True), clouds)
    fields = [_fibres(clouds), _closed_cells(clouds), _open_cells(clouds), _cumulus(clouds)]
    fibres, *cells = (_normal(field, clouds) for field in fields)
    swirled = np.random.default_rng([seed, 2])
    eddies = _normal(_eddies(swirled), swirled)
    values = np.dstack([_slopes(ground), eddies, fibres, *cells, lumps])
    codes, left = [], []
    for _ in range(LEVELS):
        codes.append(
            np.round(255.0 * np.clip(0.5 + 0.5 / RANGE * values, 0.0, 1.0)).astype(np.uint8)
        )
        slope_x, slope_y, _, *others = (_read_variance(values[..., k]) for k in range(8))
        left.append((0.5 * (slope_x + slope_y), *others))
        half = values.shape[0] // 2
        values = values.reshape(half, 2, half, 2, 8).mean(axis=(1, 3))
    variances = np.array(left, dtype=np.float32)
    return tuple(codes), variances / variances[0]


def _frequencies() -> tuple[Array32, Array32, Array32]:
    """Cycles along x and y, and their length, for a real transform's half plane."""
    y = np.fft.fftfreq(SIZE, 1.0 / SIZE).astype(np.float32)[:, None]
    x = np.fft.rfftfreq(SIZE, 1.0 / SIZE).astype(np.float32)
    return x, y, np.hypot(x, y)


@lru_cache(maxsize=1)
def _octave_of_frequencies() -> Array32:
    """Binary logarithm of the length of ``_frequencies``."""
    return np.log2(np.maximum(_frequencies()[2], np.float32(0.1)))


def _octaves(
    rng: np.random.Generator, longest: float, weight: float, *, folded: bool = False
) -> Array32:
    """(n, n) a sum of octaves, each ``weight`` times the last; all but the first are folded,
    which makes round heads between sharp creases."""
    octave_of = _octave_of_frequencies()
    total = np.zeros((SIZE, SIZE), dtype=np.float32)
    cycles, amplitude = longest, 1.0
    while cycles <= SIZE / 4.0:
        band = np.exp(-(((octave_of - np.float32(np.log2(cycles))) / 0.5) ** 2))
        white = scipy.fft.rfft2(rng.standard_normal((SIZE, SIZE), dtype=np.float32))
        octave = _standard(scipy.fft.irfft2(white * band).astype(np.float32))
        total += amplitude * (np.abs(octave) if folded and cycles > longest else octave)
        cycles, amplitude = 2.0 * cycles, weight * amplitude
    return total


def _slopes(rng: np.random.Generator) -> Array32:
    """(n, n, 2) gradient of heights."""
    x, y, _ = _frequencies()
    # Plains lie between hills.
    rugged = np.exp(0.15 * _standard(_octaves(rng, _CLOUDS, 0.7)))
    hills = _standard(_octaves(rng, _HILLS, _HILL_WEIGHT, folded=True))
    heights = scipy.fft.rfft2(rugged * hills)
    parts = [scipy.fft.irfft2(1j * axis * heights) for axis in (x, y)]
    return _standard(np.stack(parts, axis=-1).astype(np.float32))


def _fibres(rng: np.random.Generator) -> Array32:
    """(n, n) streaks along rows, drawn out the more the finer they are, in patches."""
    x, y, _ = _frequencies()
    # As long along rows as the square root of their width.
    k = np.hypot(x * (1.0 + np.abs(x) / 4.0), y)
    power = np.where(k < 2.0, 0.0, np.maximum(k, 2.0) ** -1.05)
    streaks = _coloured(rng, power)
    # Fibres fall out of their heads to one side, bent as the wind below is slower.
    bend = 12.0 * _standard(_octaves(rng, 2.0, 0.3))
    rows, columns = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    return _standard(
        scipy.ndimage.map_coordinates(streaks, (rows + bend, columns), order=1, mode="grid-wrap")
    )


def _closed_cells(rng: np.random.Generator) -> Array32:
    """(n, n) domes that meet along creases, as wide as high."""
    near = _to_walls(rng, _CLOSED)
    domes = _standard(np.log(16.0 + near[1] - near[0]))
    return domes + 0.6 * _standard(_octaves(rng, _ON_CELLS, _PUFF_WEIGHT, folded=True))


def _open_cells(rng: np.random.Generator) -> Array32:
    """(n, n) walls about empty cells, thickest where three meet, made of cumulus."""
    near = _to_walls(rng, _OPEN)
    walls = -np.log(14.0 + near[1] - near[0]) - 0.6 * np.log(20.0 + near[2] - near[0])
    return _standard(walls) + 0.5 * _standard(_octaves(rng, _ON_CELLS, _PUFF_WEIGHT, folded=True))


def _cumulus(rng: np.random.Generator) -> Array32:
    """(n, n) small clouds in streets along rows that bend, and in swarms."""
    x, y, k = _frequencies()
    k = np.maximum(k, 0.1)
    across = np.log2(np.maximum(np.abs(y), 0.1) / _STREETS) / 0.8
    streets = _coloured(rng, np.exp(-(across**2) - (x / 6.0) ** 2))
    bend = 12.0 * _standard(_octaves(rng, 2.0, 0.4))
    rows, columns = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    streets = scipy.ndimage.map_coordinates(
        streets, (rows + bend, columns), order=1, mode="grid-wrap"
    )
    swarms = _coloured(rng, np.where(k > 40.0, 0.0, k**-0.9))
    # Heads of many sizes, a part of them round between creases: folded alone they would be grains
    # of one size.
    fine = np.where((k < _CUMULUS) | (k > SIZE / 5.0), 0.0, k**_CUMULUS_SLOPE)
    plain, folded = _coloured(rng, fine), np.abs(_coloured(rng, fine))
    heads = (plain + 0.8 * folded).astype(np.float32)
    return _standard(heads) + 0.3 * streets + 0.8 * swarms


def _eddies(rng: np.random.Generator) -> Array32:
    """(n, n) what a steady flow of eddies has drawn out into filaments and wound up."""
    x, y, k = _frequencies()
    k = np.maximum(k, 0.1)
    wide, short = _EDDIES
    stream = _coloured(rng, np.where((k < wide) | (k > short), 0.0, k**_STREAM_SLOPE))
    carried = _coloured(rng, np.where(k < _CARRIED, 0.0, k**_CARRIED_SLOPE))[::2, ::2]
    # Every second texel is enough.
    waves = scipy.fft.rfft2(stream)
    speeds = [scipy.fft.irfft2(1j * axis * waves)[::2, ::2] for axis in (x, -y)]
    flow = [(speed / np.std(speeds)).astype(np.float32) for speed in speeds]
    # Where the water came from.
    places = np.mgrid[: SIZE // 2, : SIZE // 2].astype(np.float32)
    for _ in range(_STEPS):
        places += _STEP * np.stack([_at(part, places) for part in flow])
    return scipy.ndimage.zoom(_at(carried, places), 2, order=1, mode="grid-wrap", grid_mode=True)


def _at(field: Array32, places: Array32) -> Array32:
    """Values of a periodic field between its texels; places : (2, ...) rows and columns."""
    return scipy.ndimage.map_coordinates(field, places, order=1, mode="grid-wrap")


def _coloured(rng: np.random.Generator, amplitude: Array32) -> Array32:
    """(n, n) a field of random waves of these amplitudes, its variance 1."""
    white = scipy.fft.rfft2(rng.standard_normal((SIZE, SIZE), dtype=np.float32))
    return _standard(scipy.fft.irfft2(white * amplitude).astype(np.float32))


def _to_walls(rng: np.random.Generator, cells: int) -> Array32:
    """(3, n, n) ways to the three nearest of the cells' middles [texels]."""
    places = rng.uniform(0.0, SIZE, (cells, 2))
    # Every second texel is enough for them, and their walls are bent.
    y, x = np.mgrid[:SIZE:2, :SIZE:2] + 0.5
    bend = [10.0 * _standard(_octaves(rng, _CLOUDS, 0.6)[::2, ::2]) for _ in range(2)]
    at = np.mod(np.stack([x + bend[0], y + bend[1]], axis=-1), SIZE).reshape(-1, 2)
    near, _ = scipy.spatial.KDTree(places, boxsize=SIZE).query(at, k=3)
    ways = near.T.reshape(3, SIZE // 2, SIZE // 2).astype(np.float32)
    return scipy.ndimage.zoom(ways, (1, 2, 2), order=1, mode="grid-wrap", grid_mode=True)


def _standard(field: Array32) -> Array32:
    """The field with mean 0 and standard deviation 1."""
    return (field - field.mean()) / field.std()


def _read(field: Array32, rng: np.random.Generator) -> Array32:
    """Values at random places, between texels."""
    places = rng.uniform(0.0, field.shape[0], (2, 200_000))
    return scipy.ndimage.map_coordinates(field, places, order=1, mode="grid-wrap")


def _read_variance(field: Array32) -> float:
    """Variance of what is read at any place between texels.

    A reading is a mean of two texels along each axis, weighted by w and 1 - w: the mean of
    w^2 + (1 - w)^2 is 2/3, and that of w (1 - w) 1/6.
    """
    field = field - field.mean()
    along = np.roll(field, -1, axis=1)
    down = np.roll(field, -1, axis=0)
    across = np.roll(down, -1, axis=1)
    adjacent = np.vdot(field, along) + np.vdot(field, down)
    diagonal = np.vdot(field, across) + np.vdot(along, down)
    total = 4.0 / 9.0 * np.vdot(field, field) + 2.0 / 9.0 * adjacent + 1.0 / 18.0 * diagonal
    return float(total) / field.size


def _normal(field: Array32, rng: np.random.Generator) -> Array32:
    """The field bent so that what is read of it is normally distributed."""
    levels = np.sort(_read(field, rng))
    # Of all levels, those that stand evenly on the normal distribution: a table that a cache holds.
    even = scipy.special.ndtr(np.linspace(-5.0, 5.0, _BENT_LEVELS))
    chosen = np.unique(np.round(even * (levels.size - 1)).astype(np.int64))
    wanted = scipy.special.ndtri((chosen + 0.5) / levels.size)
    return interpolated(field, levels[chosen], wanted)
