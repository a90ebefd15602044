"""Convolution of whole pictures: Fourier transforms for cores, a coarse grid for tails.

Zero padded, so that no light comes back at the other edge. In single precision, whose noise is 1e-7
of the brightest pixels; what lies far above them (the Sun, glints) is convolved apart in double
precision.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.sparse import csr_array

from simgl.arrays import AnyArray, Array, Array32
from simgl.camera.psf_kernel import PsfKernel, core_share

Spectrum = NDArray[np.complex64]
Item = TypeVar("Item")
Result = TypeVar("Result")

# Pixels along the edge of a cell of the coarse grid.
CELL = 8
# Planes, or parts of one transform, at a time.
_WORKERS = 2
_THREADS = ThreadPoolExecutor(_WORKERS, thread_name_prefix="convolution")


def in_threads(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """The function's results, in order; numpy and scipy work side by side in them."""
    return list(_THREADS.map(function, items))


class Convolver:
    """Sums of planes, each convolved with a kernel of its own.

    kernels : ``kernels[zone][plane]``, all of one reach, their tails the same in all zones
    mixing : (results, planes) how much of each spread plane a result holds
    width, height : of the planes [pixels]
    """

    def __init__(
        self, kernels: Sequence[Sequence[PsfKernel]], mixing: Array, width: int, height: int
    ) -> None:
        self._kernels, self._mixing = kernels, mixing
        self._width, self._height = width, height
        reach = kernels[0][0].reach
        self._padded = _fast_size((height, width), reach)
        distinct = {id(k): k for zone in kernels for k in zone}
        self._transfers = {
            of: _transfer(k.core, self._padded, np.float32) for of, k in distinct.items()
        }
        self._tails = mixing * np.array([kernel.tail for kernel in kernels[0]])
        self._coarse_padded = _fast_size((2 * -(-height // CELL), 2 * -(-width // CELL)), 0)
        self._tail_transfer = _tail_transfer(self._coarse_padded, reach)

    def cores(
        self, planes: Sequence[Array32], zones: Sequence[Array32 | None], limits: Array
    ) -> list[Array32]:
        """(height, width) results of the kernels' cores.

        planes : (height, width) each, 0 or more
        zones : (height, width) share of each zone in a plane's light; None for 1 everywhere
        limits : of each plane; what is brighter is convolved in double precision
        """
        rows, columns = self._padded
        spectra = np.empty((len(planes), rows, columns // 2 + 1), dtype=np.complex64)
        # As many threads in a transform as the planes leave.
        workers = max(_WORKERS // len(planes), 1)
        bright = in_threads(
            lambda p: self._spread(p, planes[p], zones, float(limits[p]), spectra[p], workers),
            range(len(planes)),
        )
        apart = [(p, patch) for p, patches in enumerate(bright) for patch in patches]
        workers = max(_WORKERS // len(self._mixing), 1)
        results = in_threads(lambda mix: self._image(mix, spectra, workers), self._mixing)
        for p, patch in apart:
            for image, mix in zip(results, self._mixing, strict=True):
                if mix[p] > 0.0:
                    patch.add_to(image, mix[p])
        return results

    def _spread(
        self,
        p: int,
        plane: Array32,
        zones: Sequence[Array32 | None],
        limit: float,
        spectrum: Spectrum,
        workers: int,
    ) -> list[_Apart]:
        """Write the spectrum of a plane as it is spread.

        returns : what is too bright for that, spread apart
        """
        apart = []
        for z, (kernels, share) in enumerate(zip(self._kernels, zones, strict=True)):
            usual, excess = _split(plane if share is None else plane * share, limit)
            sharp = scipy.fft.rfft2(usual, s=self._padded, workers=workers)
            transfer = self._transfers[id(kernels[p])]
            if z == 0:
                np.multiply(sharp, transfer, out=spectrum)
            else:
                spectrum += np.multiply(sharp, transfer, out=sharp)
            if excess is not None:
                apart.append(_spread_apart(excess, kernels[p]))
        return apart

    def _image(self, mix: Array, spectra: Spectrum, workers: int) -> Array32:
        """The image of a sum of spectra; not by a matrix product, whose threads would go on
        waiting for more on the cores that the transforms want."""
        total = np.zeros_like(spectra[0])
        for share, spectrum in zip(mix, spectra, strict=True):
            if share == 1.0:
                total += spectrum
            elif share > 0.0:
                total += spectrum * np.float32(share)
        image = scipy.fft.irfft2(total, s=self._padded, workers=workers, overwrite_x=True)
        # Rounding alone makes a negative value here.
        return np.maximum(image[: self._height, : self._width], np.float32(0.0))

    def tails(self, coarse: Array) -> Array:
        """(results, rows, columns) light that kernels' tails bring to the cells of the coarse grid.

        coarse : (planes, rows, columns) as ``coarse_light`` gives it
        """
        rows, columns = coarse.shape[1:]
        if not self._tails.any():
            return np.zeros((len(self._tails), rows, columns))
        spectra = scipy.fft.rfft2(np.tensordot(self._tails, coarse, 1), s=self._coarse_padded)
        spread = scipy.fft.irfft2(spectra * self._tail_transfer, s=self._coarse_padded)
        return np.maximum(spread[:, :rows, :columns], 0.0)


def coarse_light(plane: Array32) -> Array:
    """(rows, columns) light of a plane on the coarse grid [mean over a cell].

    Each pixel gives to the cells around it as linear interpolation would take from them, so that
    light keeps its place.
    """
    down, across = (_between(n) for n in plane.shape)
    lines = (down.T @ plane).astype(np.float64)
    return (across.T @ lines.T).T / CELL**2


def add_coarse(image: Array32, coarse: Array) -> None:
    """Add values given on the coarse grid, linear between the middles of its cells."""
    down, across = (_between(n) for n in image.shape)
    wide = (across @ coarse.T).T
    image += down @ np.asarray(wide, dtype=np.float32)


@lru_cache(maxsize=8)
def _between(pixels: int) -> csr_array:
    """(pixels, cells) weights of linear interpolation between the middles of cells."""
    cells = -(-pixels // CELL)
    at = np.clip((np.arange(pixels) + 0.5) / CELL - 0.5, 0.0, cells - 1.0)
    left = np.minimum(at.astype(np.intp), max(cells - 2, 0))
    right = np.minimum(left + 1, cells - 1)
    places = np.tile(np.arange(pixels), 2), np.concatenate([left, right])
    weights = np.concatenate([1.0 - (at - left), at - left]).astype(np.float32)
    return csr_array((weights, places), shape=(pixels, cells))


def _fast_size(shape: tuple[int, int], margin: int) -> tuple[int, int]:
    rows, columns = (scipy.fft.next_fast_len(n + margin, real=True) for n in shape)
    return rows, columns


def _transfer(
    core: Array, size: tuple[int, int], dtype: type[np.float32] | type[np.float64]
) -> AnyArray:
    """Spectrum of a core whose middle is put at [0, 0]; real where the core is even."""
    reach = core.shape[0] // 2
    padded = np.zeros(size)
    padded[: core.shape[0], : core.shape[1]] = core
    spectrum = scipy.fft.rfft2(np.roll(padded, (-reach, -reach), (0, 1)), workers=_WORKERS)
    if np.array_equal(core, core[::-1, ::-1]):
        return np.asarray(spectrum.real, dtype=dtype)
    return np.asarray(spectrum, dtype=np.complex64 if dtype is np.float32 else np.complex128)


def _tail_transfer(size: tuple[int, int], reach: int) -> Array:
    """Spectrum of r^-3 outside the cores, on the coarse grid.

    Shared out to cells and interpolated between them, a tail is smoothed as its Laplacian times
    CELL^2 / 6 would smooth it: 1/12 by either, along each axis.
    """
    rows, columns = (np.minimum(np.arange(n), n - np.arange(n)) * float(CELL) for n in size)
    r = np.maximum(np.hypot(rows[:, None], columns), 1.0)

    def tail(r: Array) -> Array:
        return (1.0 - core_share(r, reach)) / np.maximum(r, 1.0) ** 3

    step = 0.5
    outer, inner = tail(r + step), tail(np.maximum(r - step, 0.0))
    laplacian = (outer - 2.0 * tail(r) + inner) / step**2 + (outer - inner) / (2.0 * step * r)
    kernel = np.maximum(tail(r) - CELL**2 / 6.0 * laplacian, 0.0) * CELL**2
    return np.asarray(scipy.fft.rfft2(kernel).real)


@dataclass(frozen=True, eq=False)
class _Excess:
    """What bright pixels have beyond a limit; row and column of the first of them."""

    top: int
    left: int
    patch: Array


def _split(plane: Array32, limit: float) -> tuple[Array32, _Excess | None]:
    """A plane without what is beyond a limit, and that."""
    rows = np.flatnonzero(plane.max(axis=1) > limit)
    if not rows.size:
        return plane, None
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(plane[top:bottom].max(axis=0) > limit)
    left, right = int(columns[0]), int(columns[-1]) + 1
    usual = np.minimum(plane, np.float32(limit))
    box = (slice(top, bottom), slice(left, right))
    return usual, _Excess(top, left, np.subtract(plane[box], usual[box], dtype=np.float64))


@dataclass(frozen=True, eq=False)
class _Apart:
    """Light to add to a picture, its first pixel in this row and column."""

    top: int
    left: int
    light: Array

    def add_to(self, image: Array32, factor: float) -> None:
        """Add so many times the light, as far as it falls into the picture."""
        bottom, right = self.top + self.light.shape[0], self.left + self.light.shape[1]
        top, left = max(self.top, 0), max(self.left, 0)
        part = image[top : max(bottom, 0), left : max(right, 0)]
        light = self.light[top - self.top :, left - self.left :]
        part += (factor * light[: part.shape[0], : part.shape[1]]).astype(np.float32)


def _spread_apart(excess: _Excess, kernel: PsfKernel) -> _Apart:
    """The convolution of few bright pixels with a core, in double precision."""
    patch, reach = excess.patch, kernel.reach
    rows, columns = (n + 2 * reach for n in patch.shape)
    size = _fast_size((rows, columns), 0)
    spectrum = scipy.fft.rfft2(patch, s=size)
    spectrum *= _transfer(kernel.core, size, np.float64)
    # The patch's first pixel lies at [0, 0]; what lies before it is at the end.
    spread = np.roll(scipy.fft.irfft2(spectrum, s=size), (reach, reach), (0, 1))
    light = np.maximum(spread[:rows, :columns], 0.0)
    return _Apart(excess.top - reach, excess.left - reach, light)
