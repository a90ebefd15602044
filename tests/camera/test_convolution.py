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


def _kernel() -> PsfKernel:
    dice = np.random.default_rng(2)
    core = dice.random((17, 17))
    return PsfKernel((core + core[::-1, ::-1]) / (2.0 * core.sum()), 0.0)


@pytest.mark.parametrize("place", [(0, 0), (3, 250), (95, 128), (191, 255), (100, 3)])
def test_light_in_black_surroundings_spreads_as_in_bright_ones(place: tuple[int, int]) -> None:
    """Convolution is linear: a spot alone gives what it adds to an image that is lit everywhere."""
    kernel, (row, column) = _kernel(), place
    spot = np.zeros((192, 256), dtype=np.float32)
    spot[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] = 1.0
    lit = np.full_like(spot, 1.0)
    convolver = Convolver([[kernel]], np.eye(1), 256, 192)
    (alone,), (together,), (background,) = (
        convolver.cores([plane], [None], np.array([np.inf])) for plane in (spot, spot + lit, lit)
    )
    # Single precision: some steps of 1.2e-7 of the brightest pixel, 2, in each of two images.
    np.testing.assert_allclose(alone, together - background, rtol=0.0, atol=2e-6)


def test_a_black_image_stays_black() -> None:
    black = np.zeros((40, 60), dtype=np.float32)
    (result,) = Convolver([[_kernel()]], np.eye(1), 60, 40).cores([black], [None], np.ones(1))
    assert not result.any()


def test_zones_and_light_beyond_the_limit_are_weighted_where_they_lie() -> None:
    """Two zones of one kernel whose weights sum to 1 change nothing, nor does a limit."""
    kernel = _kernel()
    plane = np.zeros((192, 256), dtype=np.float32)
    plane[150:160, 30:45], plane[152, 33] = 1.0, 40.0
    share = np.linspace(0.0, 1.0, 256, dtype=np.float32)[None].repeat(192, axis=0)
    (plain,) = Convolver([[kernel]], np.eye(1), 256, 192).cores([plane], [None], np.array([99.0]))
    zoned = Convolver([[kernel], [kernel]], np.eye(1), 256, 192)
    (mixed,) = zoned.cores([plane], [share, 1.0 - share], np.array([2.0]))
    # Single precision of the brightest pixel, 40.
    np.testing.assert_allclose(mixed, plain, rtol=0.0, atol=3e-5)
