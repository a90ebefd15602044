"""Convolution of images with point spread functions: FFT for the cores, a coarse grid for tails.

Images are zero padded, so that no light wraps around the edges. Transforms are in single precision
with an error of 1e-7 of the brightest pixels; the light of pixels far brighter than the rest (the
Sun, glints) is convolved separately in double precision.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np
import scipy
from numpy.typing import NDArray

from simgl.arrays import AnyArray, Array, Array32
from simgl.camera.psf_kernel import PsfKernel, core_share
from simgl.lru_cache import LruCache

Spectrum = NDArray[np.complex64]

# Pixels along the edge of a cell of the coarse grid.
CELL = 8
# Planes, or threads of one transform, at a time. More than eight have too little to do each.
WORKERS = min(max(len(os.sched_getaffinity(0)), 2), 8)
# Parts of an edge that windows have, and of how many sizes of them the spectra of kernels stay.
_PARTS = tuple(part * 0.5**halved for halved in range(10) for part in (1.0, 0.75))
_WINDOWS = 4
# Pixels that are worth a thread of their own beyond the second.
_OF_THREAD = 1 << 17
# Lines that are looked through at a time for the first that are lit.
_LINES = 64


@dataclass(frozen=True, kw_only=True)
class Window:
    """Pixels of an image: some of its rows and columns, perhaps every second of them.

    size : of the image, height and width [px]
    """

    rows: slice
    columns: slice
    size: tuple[int, int]

    @staticmethod
    def full(size: tuple[int, ...]) -> Window:
        """All of an image."""
        height, width = size
        return Window(rows=slice(0, height), columns=slice(0, width), size=(height, width))

    @property
    def pixels(self) -> tuple[slice, slice]:
        """Index of an array of the image."""
        return self.rows, self.columns

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a window of every pixel."""
        return self.rows.stop - self.rows.start, self.columns.stop - self.columns.start

    def shifted(self, down: int, right: int, size: tuple[int, int]) -> Window:
        """The same pixels, every one of them, of an image that begins so much earlier."""
        return Window(
            rows=slice(self.rows.start + down, self.rows.stop + down),
            columns=slice(self.columns.start + right, self.columns.stop + right),
            size=size,
        )

    def between_cells(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """(rows, cells) and (columns, cells) weights of linear interpolation between cells."""
        height, width = self.size
        return _between(height)[self.rows], _between(width)[self.columns]


class Convolver:
    """Weighted sums of planes, each plane convolved with its kernel.

    kernels : ``kernels[zone][plane]``, all of one reach, with equal tails in all zones
    mixing : (results, planes) weight of each convolved plane in a result
    width, height : of the planes [px]
    executor : processes planes in parallel; None for one after the other

    Black surroundings cost nothing: what is transformed is a ``window`` around all light, of the
    image's size or some ``_PARTS`` of it.
    """

    def __init__(
        self,
        kernels: Sequence[Sequence[PsfKernel]],
        mixing: Array,
        width: int,
        height: int,
        executor: Executor | None = None,
    ) -> None:
        self._kernels, self._mixing = kernels, mixing
        self._width, self._height = width, height
        self._map = map if executor is None else executor.map
        self._reach = kernels[0][0].reach
        self._transfers = LruCache[tuple[int, int], dict[int, AnyArray]](_WINDOWS)
        self._transfers_of((height, width))
        self._tails = mixing * np.array([kernel.tail for kernel in kernels[0]])
        self._coarse_padded = coarse_size((height, width))
        self._tail_transfer = _tail_transfer(self._coarse_padded, self._reach)

    @property
    def nbytes(self) -> int:
        """Size of its kernels and their spectra, once it has worked on windows of all sizes."""
        kernels = {id(k): k.core.nbytes for zone in self._kernels for k in zone}
        spectra = self._transfers_of((self._height, self._width)).values()
        largest = sum(spectrum.nbytes for spectrum in spectra)
        return sum(kernels.values()) + _WINDOWS * largest + self._tail_transfer.nbytes

    def window(self, lit: Window) -> Window:
        """Of an image whose light is all in a window: what the cores bring light to."""
        return Window(
            rows=self._within(lit.rows, self._height),
            columns=self._within(lit.columns, self._width),
            size=(self._height, self._width),
        )

    def _within(self, lit: slice, size: int) -> slice:
        """A range of an edge of ``size``, or some part of it, around light."""
        needed = lit.stop - lit.start + 2 * self._reach
        lengths = (ceil(part * size) for part in _PARTS)
        length = min((one for one in lengths if one >= needed), default=size)
        first = min(max(lit.start - self._reach, 0), size - length)
        return slice(first, first + length)

    def cores(
        self, planes: Sequence[Array32], zones: Sequence[Array32 | None], limits: Array
    ) -> list[Array32]:
        """(rows, columns) results of the convolution with the kernels' cores.

        planes : (rows, columns) each, a ``window`` of them or all, non-negative
        zones : (rows, columns) weight of each zone there; None for 1 everywhere
        limits : of each plane; pixels beyond are convolved in double precision
        """
        # Threads of one transform: those that the planes leave idle.
        threads = threads_for(planes[0].size * len(planes))
        workers = max(threads // len(planes), 1)
        convolved = list(
            self._map(
                lambda p, plane, limit: self._convolve(p, plane, zones, limit, workers),
                range(len(planes)),
                planes,
                limits.tolist(),
            )
        )
        shape = planes[0].shape
        spectra = [spectrum for spectrum, _ in convolved]
        workers = max(threads // len(self._mixing), 1)
        results = list(
            self._map(lambda mix: self._image(mix, spectra, shape, workers), self._mixing)
        )
        for p, (_, patches) in enumerate(convolved):
            for patch in patches:
                for result, mix in zip(results, self._mixing, strict=True):
                    if mix[p] > 0.0:
                        patch.add_to(result, mix[p])
        return results

    def core_spectra(self) -> tuple[tuple[int, int], list[AnyArray]]:
        """Size of the transforms of a whole image, and the spectrum of each plane's core, zone by
        zone: (rows, columns / 2 + 1), divided by the number of pixels."""
        size = self._height, self._width
        transfers = self._transfers_of(size)
        spectra = [transfers[id(kernel)] for zone in self._kernels for kernel in zone]
        return self._padded(size), spectra

    def tail_spectra(self) -> list[Array]:
        """Of each plane on the coarse grid, of ``coarse_size``, divided by its number of cells."""
        down, across = self._coarse_padded
        return [kernel.tail / (down * across) * self._tail_transfer for kernel in self._kernels[0]]

    def add_excess(self, results: Sequence[Array32], place: tuple[int, int], excess: Array) -> None:
        """Add to the results of ``cores`` for a whole image what pixels beyond the limits bring.

        place : row and column of the first of a rectangle of pixels
        excess : (zones, planes, rows, columns) their light; 0 for the others
        """
        for kernels, of_zone in zip(self._kernels, excess, strict=True):
            for kernel, light, mix in zip(kernels, of_zone, self._mixing.T, strict=True):
                if not light.any():
                    continue
                patch = _convolved_patch(_Patch(*place, light), kernel)
                for result, share in zip(results, mix.tolist(), strict=True):
                    if share > 0.0:
                        patch.add_to(result, share)

    def _padded(self, shape: tuple[int, ...]) -> tuple[int, int]:
        """Size of the transforms of a window."""
        # A core may be larger than a small image.
        rows, columns = (max(n, self._reach + 1) for n in shape)
        return _fast_size((rows, columns), self._reach)

    def _transfers_of(self, shape: tuple[int, ...]) -> dict[int, AnyArray]:
        """Spectra of all cores for a window, by the identities of the kernels."""
        padded = self._padded(shape)
        # There and back, transforms multiply by the number of pixels.
        scale = 1.0 / (padded[0] * padded[1])

        def made() -> dict[int, AnyArray]:
            distinct = {id(k): k for zone in self._kernels for k in zone}
            return {
                key: _transfer(scale * kernel.core, padded, np.float32)
                for key, kernel in distinct.items()
            }

        return self._transfers.get(padded, made)

    def _convolve(
        self,
        p: int,
        plane: Array32,
        zones: Sequence[Array32 | None],
        limit: float,
        workers: int,
    ) -> tuple[Spectrum, list[_Patch]]:
        """Spectrum of a convolved window of a plane, and the pixels beyond the limit, convolved."""
        patches = []
        rows, columns = self._padded(plane.shape)
        transfers = self._transfers_of(plane.shape)
        total: Spectrum | None = None
        for kernels, share in zip(self._kernels, zones, strict=True):
            usual, excess = _split(plane if share is None else plane * share, limit)
            # One edge after the other: rows of padding need no transform.
            spectrum = np.zeros((rows, columns // 2 + 1), dtype=np.complex64)
            lines = scipy.fft.rfft(usual, n=columns, axis=1, workers=workers)
            spectrum[: len(lines)] = lines
            spectrum = scipy.fft.fft(spectrum, axis=0, workers=workers, overwrite_x=True)
            spectrum *= transfers[id(kernels[p])]
            total = spectrum if total is None else np.add(total, spectrum, out=total)
            if excess is not None:
                patches.append(_convolved_patch(excess, kernels[p]))
        assert total is not None
        return total, patches

    def _image(
        self, mix: Array, spectra: Sequence[Spectrum], shape: tuple[int, ...], workers: int
    ) -> Array32:
        """Window of a weighted sum of spectra.

        Not a matrix product: the idle threads of BLAS would busy-wait on the cores that the
        transforms need.
        """
        total: Spectrum | None = None
        for share, spectrum in zip(mix.tolist(), spectra, strict=True):
            if share > 0.0:
                part = spectrum if share == 1.0 else spectrum * np.float32(share)
                total = part if total is None else total + part
        height, width = shape
        if total is None:
            return np.zeros((height, width), dtype=np.float32)
        total = scipy.fft.ifft(total, axis=0, norm="forward", workers=workers)
        _, columns = self._padded(shape)
        image = scipy.fft.irfft(total[:height], n=columns, axis=1, norm="forward", workers=workers)
        # Negative values are rounding errors.
        return np.maximum(image[:, :width], np.float32(0.0))

    def tails(self, coarse: Array) -> Array:
        """(results, rows, columns) results of the convolution with the tails, on the coarse grid.

        coarse : (planes, rows, columns) from ``coarse_light``
        """
        rows, columns = coarse.shape[1:]
        if not self._tails.any():
            return np.zeros((len(self._tails), rows, columns))
        total = np.einsum("rp,pij->rij", self._tails, coarse)
        down, across = self._coarse_padded
        # One edge after the other: rows of padding need no transform.
        spectra = np.zeros((len(total), down, across // 2 + 1), dtype=np.complex128)
        spectra[:, :rows] = scipy.fft.rfft(total, n=across, axis=2)
        spectra = scipy.fft.fft(spectra, axis=1, overwrite_x=True)
        spectra *= self._tail_transfer
        spread = scipy.fft.ifft(spectra, axis=1, overwrite_x=True)[:, :rows]
        spread = scipy.fft.irfft(spread, n=across, axis=2)
        return np.maximum(spread[:, :, :columns], 0.0)


def threads_for(pixels: int) -> int:
    """So many threads work on so many pixels: to wake one takes as long as its work on few."""
    return min(WORKERS, max(2, pixels // _OF_THREAD))


def lit_window(light: Array32) -> Window:
    """The rows and columns of (height, width) or (height, width, n) values that are not all 0."""
    rows = _span(light)
    columns = _span(light[rows].swapaxes(0, 1))
    return Window(rows=rows, columns=columns, size=light.shape[:2])


def _span(lines: Array32) -> slice:
    """From the first to past the last of lines (n, ...) that are not all 0; empty where all are.

    From both ends on: an image that is lit to its edges is not looked through.
    """
    count = len(lines)
    first = next(_lit(lines), count)
    if first == count:
        return slice(0, 0)
    return slice(first, count - next(_lit(lines[::-1])))


def _lit(lines: Array32) -> Iterator[int]:
    """The first lines that are not all 0 of every so many, where there are any."""
    for start in range(0, len(lines), _LINES):
        part = lines[start : start + _LINES]
        lit = part.max(axis=tuple(range(1, part.ndim)), initial=0.0) > 0.0
        if lit.any():
            yield start + int(lit.argmax())


def coarse_light(plane: Array32, window: Window | None = None) -> Array:
    """(rows, columns) light of a plane on the coarse grid of an image [mean over a cell].

    Each pixel is distributed to the cells around it by the weights of linear interpolation, which
    keeps the centroid of light.

    plane : in a window of the image; without one, all of it
    """
    window = Window.full(plane.shape) if window is None else window
    down, across = window.between_cells()
    lines = (down.T @ plane).astype(np.float64)
    return (across.T @ lines.T).T / CELL**2


def between_cells(coarse: Array, window: Window) -> Array32:
    """Values of the coarse grid of an image in a window, linear between the cell centres."""
    down, across = window.between_cells()
    return np.asarray(down @ (across @ coarse.T).T.astype(np.float32))


def add_coarse(image: Array32, coarse: Array) -> None:
    """Add values of the coarse grid to an image, linear between the cell centres."""
    image += between_cells(coarse, Window.full(image.shape))


@lru_cache(maxsize=8)
def _between(pixels: int) -> scipy.sparse.csr_array:
    """(pixels, cells) weights of linear interpolation between the cell centres."""
    cells = -(-pixels // CELL)
    at = np.clip((np.arange(pixels) + 0.5) / CELL - 0.5, 0.0, cells - 1.0)
    left = np.minimum(at.astype(np.intp), max(cells - 2, 0))
    right = np.minimum(left + 1, cells - 1)
    places = np.tile(np.arange(pixels), 2), np.concatenate([left, right])
    weights = np.concatenate([1.0 - (at - left), at - left]).astype(np.float32)
    return scipy.sparse.csr_array((weights, places), shape=(pixels, cells))


def coarse_size(image: tuple[int, int]) -> tuple[int, int]:
    """Size of the transforms on the coarse grid of an image, which has twice its cells."""
    rows, columns = (2 * -(-pixels // CELL) for pixels in image)
    return _fast_size((rows, columns), 0)


def _fast_size(shape: tuple[int, int], margin: int) -> tuple[int, int]:
    rows, columns = (scipy.fft.next_fast_len(n + margin, real=True) for n in shape)
    return rows, columns


def _transfer(
    core: Array, size: tuple[int, int], dtype: type[np.float32] | type[np.float64]
) -> AnyArray:
    """Spectrum of a core with its centre moved to [0, 0]; real if the core is even."""
    reach = core.shape[0] // 2
    # Of an image smaller than the core no two pixels are as far from each other as its edges.
    down, across = (min(reach, (n - 1) // 2) for n in size)
    core = core[reach - down : reach + down + 1, reach - across : reach + across + 1]
    padded = np.zeros(size)
    padded[: core.shape[0], : core.shape[1]] = core
    spectrum = scipy.fft.rfft2(np.roll(padded, (-down, -across), (0, 1)), workers=WORKERS)
    if np.array_equal(core, core[::-1, ::-1]):
        return spectrum.real.astype(dtype)
    return spectrum.astype(np.complex64 if dtype is np.float32 else np.complex128)


def _tail_transfer(size: tuple[int, int], reach: int) -> Array:
    """Spectrum of r^-3 outside the cores, on the coarse grid.

    Distribution to cells and interpolation between them each add CELL^2 / 12 times the Laplacian
    to the tail; the kernel is corrected for both.
    """
    rows, columns = (np.minimum(np.arange(n), n - np.arange(n)) * float(CELL) for n in size)
    r = np.maximum(np.hypot(rows[:, None], columns), 1.0)

    def tail(r: Array) -> Array:
        return (1.0 - core_share(r, reach)) / np.maximum(r, 1.0) ** 3

    step = 0.5
    outer, inner = tail(r + step), tail(np.maximum(r - step, 0.0))
    laplacian = (outer - 2.0 * tail(r) + inner) / step**2 + (outer - inner) / (2.0 * step * r)
    kernel = np.maximum(tail(r) - CELL**2 / 6.0 * laplacian, 0.0) * CELL**2
    return scipy.fft.rfft2(kernel).real


@dataclass(frozen=True, eq=False)
class _Patch:
    """Light in a rectangle that may extend beyond the image; row and column of its first pixel."""

    top: int
    left: int
    light: Array

    def add_to(self, image: Array32, factor: float) -> None:
        """Add the part inside the image, times a factor."""
        bottom, right = self.top + self.light.shape[0], self.left + self.light.shape[1]
        top, left = max(self.top, 0), max(self.left, 0)
        part = image[top : max(bottom, 0), left : max(right, 0)]
        light = self.light[top - self.top :, left - self.left :]
        part += (factor * light[: part.shape[0], : part.shape[1]]).astype(np.float32)


def _split(plane: Array32, limit: float) -> tuple[Array32, _Patch | None]:
    """A plane without the pixels beyond a value, and these."""
    rows = np.flatnonzero(plane.max(axis=1) > limit)
    if not rows.size:
        return plane, None
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(plane[top:bottom].max(axis=0) > limit)
    left, right = int(columns[0]), int(columns[-1]) + 1
    usual = np.where(plane > limit, np.float32(0.0), plane)
    box = (slice(top, bottom), slice(left, right))
    return usual, _Patch(top, left, np.subtract(plane[box], usual[box], dtype=np.float64))


def _convolved_patch(bright: _Patch, kernel: PsfKernel) -> _Patch:
    """A small patch convolved with a core in double precision."""
    reach = kernel.reach
    rows, columns = (n + 2 * reach for n in bright.light.shape)
    size = _fast_size((rows, columns), 0)
    spectrum = scipy.fft.rfft2(bright.light, s=size)
    spectrum *= _transfer(kernel.core, size, np.float64)
    # The patch starts at [0, 0]; light above and left of it has wrapped around to the end.
    spread = np.roll(scipy.fft.irfft2(spectrum, s=size), (reach, reach), (0, 1))
    light = np.maximum(spread[:rows, :columns], 0.0)
    return _Patch(bright.top - reach, bright.left - reach, light)
