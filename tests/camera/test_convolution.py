"""The convolution of planes with cores is the sum over pairs of pixels, at any size of either."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import convolve2d

from simgl.camera.convolution import Convolver
from simgl.camera.psf_kernel import PsfKernel


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (16, 17), (32, 48), (64, 65), (200, 40)])
@pytest.mark.parametrize("even", [True, False])
def test_an_image_may_be_smaller_than_the_point_spread(size: tuple[int, int], even: bool) -> None:
    dice = np.random.default_rng(4)
    core = dice.random((129, 129))
    core = core + core[::-1, ::-1] if even else core
    core /= core.sum()
    plane = dice.random(size).astype(np.float32)
    height, width = size
    convolver = Convolver([[PsfKernel(core, 0.0)]], np.eye(1), width, height)
    (result,) = convolver.cores([plane], [None], np.array([np.inf]))
    full = convolve2d(plane.astype(np.float64), core)
    # Transforms in single precision: 1e-7 of the brightest pixel, some steps of it.
    expected = full[64 : 64 + height, 64 : 64 + width]
    np.testing.assert_allclose(result, expected, rtol=0.0, atol=1e-6 * max(1.0, plane.sum() / 1e3))
