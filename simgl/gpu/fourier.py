"""Fourier transforms of images on the GPU, in single precision."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.compute_program import ComputeProgram
from simgl.gpu.release import all_or_nothing, release_all

# Values that one invocation transforms.
_LARGEST_RADIX = 16


def radices(length: int) -> list[int]:
    """Factors of a length, each at most 16: the steps of its transform.

    Raises ValueError for a length with a prime factor beyond that.
    """
    factors = []
    while length > 1:
        fitting = [r for r in range(_LARGEST_RADIX, 1, -1) if length % r == 0]
        if not fitting:
            raise ValueError(f"a transform of {length} values has no step of at most 16")
        factors.append(fitting[0])
        length //= fitting[0]
    return factors


class ComplexLayers:
    """Storage for (layers, rows, columns) complex values, and as much again to work in.

    values : the buffer that holds them
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, layers: int, size: tuple[int, int]) -> None:
        self.layers, self.size = layers, size
        nbytes = 8 * layers * size[0] * size[1]
        self.values = ctx.buffer(reserve=nbytes)
        self._others = ctx.buffer(reserve=nbytes)

    @property
    def nbytes(self) -> int:
        """Of both buffers."""
        return int(self.values.size + self._others.size)

    @property
    def columns_and_rows(self) -> tuple[int, int]:
        """Of a layer, as shaders have it."""
        return self.size[1], self.size[0]

    @property
    def others(self) -> moderngl.Buffer:
        """Where the result of the next step goes, before ``swap``."""
        return self._others

    def swap(self) -> None:
        """What was written to the other buffer are the values now."""
        self.values, self._others = self._others, self.values

    def release(self) -> None:
        """Free both."""
        self.values.release()
        self._others.release()


class FourierTransforms:
    """Transforms of layers along both axes; the inverse is not scaled.

    Each length is a product of factors of at most 16.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._steps: dict[tuple[int, bool], ComputeProgram] = {}
        self._roots: dict[int, moderngl.Buffer] = {}

    def transform(self, layers: ComplexLayers) -> None:
        """In place, as ``numpy.fft.fft2`` does it for each layer."""
        self._along(layers, 1, 1.0)
        self._along(layers, 0, 1.0)

    def inverse(self, layers: ComplexLayers) -> None:
        """The same as ``numpy.fft.ifft2`` with ``norm="forward"``."""
        self._along(layers, 0, -1.0)
        self._along(layers, 1, -1.0)

    def _along(self, layers: ComplexLayers, axis: int, sense: float) -> None:
        length, columns, rows = layers.size[axis], *layers.columns_and_rows
        done = 1
        for radix in radices(length):
            parts = length // radix
            grid = (parts, rows) if axis else (columns, parts)
            self._step(radix, bool(axis)).run(
                (*grid, layers.layers),
                (layers.values, layers.others, self._roots_of(length)),
                size=(columns, rows),
                done=done,
                sense=sense,
            )
            layers.swap()
            done *= radix

    def _step(self, radix: int, along_rows: bool) -> ComputeProgram:
        if (radix, along_rows) not in self._steps:
            self._steps[radix, along_rows] = ComputeProgram(
                self._ctx,
                "common/fourier_step",
                parameters=("size", "done", "sense"),
                defines={"RADIX": radix} | ({"ALONG_ROWS": 1} if along_rows else {}),
            )
        return self._steps[radix, along_rows]

    def _roots_of(self, length: int) -> moderngl.Buffer:
        """exp(-2 pi i k / length), rounded once from double precision."""
        if length not in self._roots:
            roots = np.exp(-2j * np.pi * np.arange(length) / length).astype(np.complex64)
            self._roots[length] = self._ctx.buffer(roots.tobytes())
        return self._roots[length]

    def release(self) -> None:
        """Free everything."""
        release_all(self._ctx, *self._steps.values(), *self._roots.values())
        self._steps.clear()
        self._roots.clear()
