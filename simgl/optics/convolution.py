"""Convolution of whole pictures: Fourier transforms for cores, a coarse grid for tails.

Zero padded, so that no light comes back at the other edge. In single precision, whose noise is 1e-7
of the brightest pixels; what lies far above them (the Sun, glints) is convolved apart in double
precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from simgl.optics.kernel import Kernel, core_share

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# Pixels along the edge of a cell of the coarse grid.
CELL = 8
_WORKERS = 2


class Convolver:
    """Sums of planes, each convolved with a kernel of its own.

    kernels : ``kernels[result][zone][plane]``; None where a plane gives nothing to a result. All of
        one reach, their tails the same in all zones
    width, height : of the planes [pixels]
    """

    def __init__(
        self, kernels: Sequence[Sequence[Sequence[Kernel | None]]], width: int, height: int
    ) -> None:
        self._kernels = kernels
        self._width, self._height = width, height
        present = [k for zones in kernels for zone in zones for k in zone if k is not None]
        reach = present[0].reach
        self._padded = _fast_size((height, width), reach)
        made = {id(k): _transfer(k.core, self._padded, np.float32) for k in present}
        self._transfers = [
            [[None if k is None else made[id(k)] for k in zone] for zone in zones]
            for zones in kernels
        ]
        self._tails = np.array(
            [[0.0 if k is None else k.tail for k in zones[0]] for zones in kernels]
        )
        self._coarse_padded = _fast_size((2 * -(-height // CELL), 2 * -(-width // CELL)), 0)
        self._tail_transfer = _tail_transfer(self._coarse_padded, reach)

    def cores(
        self, planes: Sequence[Floats], zones: Sequence[Floats | None], limits: Array
    ) -> list[Floats]:
        """(height, width) results of the kernels' cores.

        planes : (height, width) each, 0 or more
        zones : (height, width) share of each zone in a plane's light; None for 1 everywhere
        limits : of each plane; what is brighter is convolved in double precision
        """
        totals: list[NDArray[np.complex64] | None] = [None] * len(self._kernels)
        apart: list[tuple[int, _Excess, Kernel]] = []
        for z, share in enumerate(zones):
            for p, (plane, limit) in enumerate(zip(planes, limits, strict=True)):
                part = plane if share is None else plane * share
                usual, excess = _split(part, limit)
                spectrum = scipy.fft.rfft2(usual, s=self._padded, workers=_WORKERS)
                for r, transfers in enumerate(self._transfers):
                    transfer, kernel, total = transfers[z][p], self._kernels[r][z][p], totals[r]
                    if transfer is None or kernel is None:
                        continue
                    passed = spectrum * transfer
                    totals[r] = passed if total is None else np.add(total, passed, out=total)
                    if excess is not None:
                        apart.append((r, excess, kernel))
        results = []
        for total in totals:
            image = scipy.fft.irfft2(total, s=self._padded, workers=_WORKERS, overwrite_x=True)
            inside = image[: self._height, : self._width]
            # Rounding alone makes a negative value here.
            results.append(np.maximum(inside, np.float32(0.0)))
        for r, excess, kernel in apart:
            _add_apart(results[r], excess, kernel)
        return results

    def tails(self, coarse: Array) -> Array:
        """(results, rows, columns) light that kernels' tails bring to the cells of the coarse grid.

        coarse : (planes, rows, columns) their means over the cells
        """
        rows, columns = coarse.shape[1:]
        if not self._tails.any():
            return np.zeros((len(self._tails), rows, columns))
        spectra = scipy.fft.rfft2(np.tensordot(self._tails, coarse, 1), s=self._coarse_padded)
        spread = scipy.fft.irfft2(spectra * self._tail_transfer, s=self._coarse_padded)
        return np.asarray(np.maximum(spread[:, :rows, :columns], 0.0))


def cell_means(plane: Floats) -> Array:
    """(rows, columns) means of a plane over the cells of the coarse grid."""
    height, width = plane.shape
    rows, columns = -(-height // CELL), -(-width // CELL)
    if (height, width) != (rows * CELL, columns * CELL):
        plane = np.pad(plane, ((0, rows * CELL - height), (0, columns * CELL - width)))
    lines = plane.reshape(rows, CELL, -1).sum(axis=1)
    return np.asarray(lines.reshape(rows, columns, CELL).sum(axis=2, dtype=np.float64) / CELL**2)


def add_coarse(image: Floats, coarse: Array) -> None:
    """Add values given on the coarse grid, linear between the middles of its cells."""
    height, width = image.shape
    across = _between(np.arange(width), coarse.shape[1])
    wide = (coarse @ across.T).astype(np.float32)
    down = _between(np.arange(CELL), 3, shift=CELL).astype(np.float32)
    whole = height // CELL
    # Each row of cells with the rows above and below it.
    edge = np.concatenate([wide[:1], wide, wide[-1:]])
    three = np.stack([edge[:whole], edge[1 : whole + 1], edge[2 : whole + 2]], axis=1)
    blocks = image[: whole * CELL].reshape(whole, CELL, width)
    blocks += down @ three
    if height > whole * CELL:
        image[whole * CELL :] += wide[-1:]


def _between(pixels: NDArray[np.int_], cells: int, shift: int = 0) -> Array:
    """(pixels, cells) weights of linear interpolation between the middles of cells."""
    at = np.clip((pixels + shift + 0.5) / CELL - 0.5, 0.0, cells - 1.0)
    return np.maximum(1.0 - np.abs(at[:, None] - np.arange(cells)), 0.0)


def _fast_size(shape: tuple[int, int], margin: int) -> tuple[int, int]:
    rows, columns = (scipy.fft.next_fast_len(n + margin, real=True) for n in shape)
    return rows, columns


def _transfer(
    core: Array, size: tuple[int, int], dtype: type[np.float32] | type[np.float64]
) -> NDArray[Any]:
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

    Light spread evenly over a cell, and linear interpolation between cells, smooth a tail as its
    Laplacian times CELL^2 / 8 would: 1/24 by the one, 1/12 by the other, along each axis.
    """
    rows, columns = (np.minimum(np.arange(n), n - np.arange(n)) * float(CELL) for n in size)
    r = np.maximum(np.hypot(rows[:, None], columns), 1.0)

    def tail(r: Array) -> Array:
        return np.asarray((1.0 - core_share(r, reach)) / np.maximum(r, 1.0) ** 3)

    step = 0.5
    outer, inner = tail(r + step), tail(np.maximum(r - step, 0.0))
    laplacian = (outer - 2.0 * tail(r) + inner) / step**2 + (outer - inner) / (2.0 * step * r)
    kernel = np.maximum(tail(r) - CELL**2 / 8.0 * laplacian, 0.0) * CELL**2
    return np.asarray(scipy.fft.rfft2(kernel).real)


@dataclass(frozen=True, eq=False)
class _Excess:
    """What bright pixels have beyond a limit; row and column of the first of them."""

    top: int
    left: int
    patch: Array


def _split(plane: Floats, limit: float) -> tuple[Floats, _Excess | None]:
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


def _add_apart(result: Floats, excess: _Excess, kernel: Kernel) -> None:
    """Add the convolution of few bright pixels with a core, in double precision."""
    patch, reach = excess.patch, kernel.reach
    top, left = excess.top, excess.left
    bottom, right = top + patch.shape[0], left + patch.shape[1]
    size = _fast_size((patch.shape[0], patch.shape[1]), 2 * reach)
    spectrum = scipy.fft.rfft2(patch, s=size, workers=_WORKERS)
    spectrum *= _transfer(kernel.core, size, np.float64)
    spread = scipy.fft.irfft2(spectrum, s=size, workers=_WORKERS)
    # The patch's first pixel lies at [0, 0]; what lies before it is at the end.
    spread = np.maximum(np.roll(spread, (reach, reach), (0, 1)), 0.0)
    height, width = result.shape
    rows = np.arange(max(top - reach, 0), min(bottom + reach, height))
    columns = np.arange(max(left - reach, 0), min(right + reach, width))
    part = spread[np.ix_(rows - top + reach, columns - left + reach)]
    result[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] += part.astype(np.float32)
