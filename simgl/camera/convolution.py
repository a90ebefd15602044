"""Convolution of images with point spread functions: FFT for the cores, a coarse grid for tails.

Images are zero padded, so that no light wraps around the edges. Transforms are in single precision
with an error of 1e-7 of the brightest pixels; the light of pixels far brighter than the rest (the
Sun, glints) is convolved separately in double precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from simgl.arrays import AnyArray, Array, Array32
from simgl.camera.psf_kernel import PsfKernel, core_share

Spectrum = NDArray[np.complex64]

# Pixels along the edge of a cell of the coarse grid.
CELL = 8
# Planes, or threads of one transform, at a time.
_WORKERS = 2


class Convolver:
    """Weighted sums of planes, each plane convolved with its kernel.

    kernels : ``kernels[zone][plane]``, all of one reach, with equal tails in all zones
    mixing : (results, planes) weight of each convolved plane in a result
    width, height : of the planes [px]
    executor : processes planes in parallel; None for one after the other
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
        reach = kernels[0][0].reach
        # A core may be larger than a small image.
        self._padded = _fast_size((max(height, reach + 1), max(width, reach + 1)), reach)
        distinct = {id(k): k for zone in kernels for k in zone}
        self._transfers = {
            key: _transfer(k.core, self._padded, np.float32) for key, k in distinct.items()
        }
        self._tails = mixing * np.array([kernel.tail for kernel in kernels[0]])
        self._coarse_padded = _fast_size((2 * -(-height // CELL), 2 * -(-width // CELL)), 0)
        self._tail_transfer = _tail_transfer(self._coarse_padded, reach)

    @property
    def nbytes(self) -> int:
        """Size of its kernels and their spectra."""
        kernels = {id(k): k.core.nbytes for zone in self._kernels for k in zone}
        spectra = [*self._transfers.values(), self._tail_transfer]
        return sum(kernels.values()) + sum(spectrum.nbytes for spectrum in spectra)

    def cores(
        self, planes: Sequence[Array32], zones: Sequence[Array32 | None], limits: Array
    ) -> list[Array32]:
        """(height, width) results of the convolution with the kernels' cores.

        planes : (height, width) each, non-negative
        zones : (height, width) weight of each zone; None for 1 everywhere
        limits : of each plane; light beyond is convolved in double precision
        """
        rows, columns = self._padded
        spectra = np.empty((len(planes), rows, columns // 2 + 1), dtype=np.complex64)
        # Threads of one transform: those that the planes leave idle.
        workers = max(_WORKERS // len(planes), 1)
        bright = list(
            self._map(
                lambda p, plane, limit: self._convolve(p, plane, zones, limit, spectra[p], workers),
                range(len(planes)),
                planes,
                limits.tolist(),
            )
        )
        workers = max(_WORKERS // len(self._mixing), 1)
        results = list(self._map(lambda mix: self._image(mix, spectra, workers), self._mixing))
        for p, patches in enumerate(bright):
            for patch in patches:
                for image, mix in zip(results, self._mixing, strict=True):
                    if mix[p] > 0.0:
                        patch.add_to(image, mix[p])
        return results

    def _convolve(
        self,
        p: int,
        plane: Array32,
        zones: Sequence[Array32 | None],
        limit: float,
        spectrum: Spectrum,
        workers: int,
    ) -> list[_Patch]:
        """Write the spectrum of a convolved plane.

        returns : the light beyond the limit, already convolved
        """
        patches = []
        for z, (kernels, share) in enumerate(zip(self._kernels, zones, strict=True)):
            usual, excess = _split(plane if share is None else plane * share, limit)
            sharp = scipy.fft.rfft2(usual, s=self._padded, workers=workers)
            transfer = self._transfers[id(kernels[p])]
            if z == 0:
                np.multiply(sharp, transfer, out=spectrum)
            else:
                spectrum += np.multiply(sharp, transfer, out=sharp)
            if excess is not None:
                patches.append(_convolved_patch(excess, kernels[p]))
        return patches

    def _image(self, mix: Array, spectra: Spectrum, workers: int) -> Array32:
        """(height, width) image of a weighted sum of spectra.

        Not a matrix product: the idle threads of BLAS would busy-wait on the cores that the
        transforms need.
        """
        total = np.zeros_like(spectra[0])
        for share, spectrum in zip(mix, spectra, strict=True):
            if share == 1.0:
                total += spectrum
            elif share > 0.0:
                total += spectrum * np.float32(share)
        image = scipy.fft.irfft2(total, s=self._padded, workers=workers, overwrite_x=True)
        # Negative values are rounding errors.
        return np.maximum(image[: self._height, : self._width], np.float32(0.0))

    def tails(self, coarse: Array) -> Array:
        """(results, rows, columns) results of the convolution with the tails, on the coarse grid.

        coarse : (planes, rows, columns) from ``coarse_light``
        """
        rows, columns = coarse.shape[1:]
        if not self._tails.any():
            return np.zeros((len(self._tails), rows, columns))
        spectra = scipy.fft.rfft2(np.tensordot(self._tails, coarse, 1), s=self._coarse_padded)
        spread = scipy.fft.irfft2(spectra * self._tail_transfer, s=self._coarse_padded)
        return np.maximum(spread[:, :rows, :columns], 0.0)


def coarse_light(plane: Array32) -> Array:
    """(rows, columns) light of a plane on the coarse grid [mean over a cell].

    Each pixel is distributed to the cells around it by the weights of linear interpolation, which
    keeps the centroid of light.
    """
    down, across = (_between(n) for n in plane.shape)
    lines = (down.T @ plane).astype(np.float64)
    return (across.T @ lines.T).T / CELL**2


def add_coarse(image: Array32, coarse: Array) -> None:
    """Add values of the coarse grid to an image, linear between the cell centres."""
    down, across = (_between(n) for n in image.shape)
    image += down @ (across @ coarse.T).T.astype(np.float32)


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
    spectrum = scipy.fft.rfft2(np.roll(padded, (-down, -across), (0, 1)), workers=_WORKERS)
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
    """A plane limited to a value, and the light beyond it."""
    rows = np.flatnonzero(plane.max(axis=1) > limit)
    if not rows.size:
        return plane, None
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(plane[top:bottom].max(axis=0) > limit)
    left, right = int(columns[0]), int(columns[-1]) + 1
    usual = np.minimum(plane, np.float32(limit))
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
