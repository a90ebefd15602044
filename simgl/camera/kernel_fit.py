"""The middle of a kernel between pixels, fitted to the transfer function of a lens.

What a pixel gets from the scene is a square of one pixel, softened by a ``ramp``: a square of one
pixel convolved with one as wide as the ramp, whose contrast is sinc(u) sinc(v) sinc(w u) sinc(w v).
Convolved with a kernel between pixels of the transfer H(u, v), the image shows a frequency with the
product of both. It should be what lens and pixel leave: sinc(u) sinc(v) times the lens's.

H repeats itself beyond the Nyquist frequency. Where the lens's contrast still falls there, H would
need a fold, and its kernel would swing about 0 for many pixels. Divided by the ramp's contrast it
is nearly level, and a smooth, non-negative kernel of a few pixels follows it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from simgl.arrays import Array

# Half width of what is fitted [px].
FIT_REACH = 6
# Frequencies along each axis, from 0 to the Nyquist frequency.
_NODES = 33
# Against noise where the fit leaves a choice: some 1e-5 of the light in a pixel.
_STILLNESS = 3e-3
# Weight of frequencies beyond the Nyquist frequency, along the diagonals.
_BEYOND = 0.5
# Of the light, which the fit keeps.
_CONSERVED = 1e3
# Up to where the contrast tells how good a fit is [cycles per pixel]: just beyond the Nyquist
# frequency, where that of the image turns back from the lens's unless the ramp fits.
_JUDGED = 0.55


def fitted(core: Array, transfer: Callable[[Array], Array], ramp: float) -> Array:
    """A core behind which images have the contrast of a lens.

    core : (2 reach + 1, 2 reach + 1) even and symmetric between rows and columns, non-negative
    transfer : of the lens, at frequencies [cycles per pixel]
    ramp : by which pixels are softened [px]

    The core returned is non-negative too, and has changed within ``FIT_REACH`` of its middle.
    """
    reach = core.shape[0] // 2
    n = min(FIT_REACH, reach)
    row, column = np.triu_indices(n + 1)
    nodes = np.linspace(0.0, 0.5, _NODES)
    down, across = (index[1:] for index in np.triu_indices(_NODES))
    v, u = nodes[down], nodes[across]
    cosines = np.cos(2.0 * np.pi * np.multiply.outer(nodes, np.arange(-reach, reach + 1)))
    pixel = np.sinc(u) * np.sinc(v)
    softened = pixel * np.sinc(ramp * u) * np.sinc(ramp * v)
    middle = slice(reach - n, reach + n + 1)
    far = core.copy()
    far[middle, middle] = 0.0
    weight = np.where(np.hypot(u, v) <= 0.5, 1.0, _BEYOND)
    wanted = pixel * transfer(np.hypot(u, v)) - softened * (cosines @ far @ cosines.T)[down, across]
    # Of a pixel and all that are like it: eight, or four on the axes and diagonals.
    like = np.where(row == 0, np.where(column == 0, 1, 4), np.where(row == column, 4, 8))
    near = cosines[:, reach : reach + n + 1]
    each = near[down][:, row] * near[across][:, column]
    each += near[down][:, column] * near[across][:, row]
    contrast = softened[:, None] * 0.5 * like * each
    had = core[reach + row, reach + column]
    still = _STILLNESS * np.sqrt(like)
    values, _ = scipy.optimize.nnls(
        np.concatenate([weight[:, None] * contrast, _CONSERVED * like[None], np.diag(still)]),
        np.concatenate([weight * wanted, [_CONSERVED * like @ had], still * had]),
    )
    values *= (like @ had) / (like @ values)
    quarter = np.zeros((n + 1, n + 1))
    quarter[row, column] = quarter[column, row] = values
    half = np.concatenate([quarter[:0:-1], quarter])
    far[middle, middle] = np.concatenate([half[:, :0:-1], half], axis=1)
    return far


def contrast_error(core: Array, transfer: Callable[[Array], Array], ramp: float) -> float:
    """How far the contrast of images is from that of a lens, rms up to ``_JUDGED`` [1].

    core, transfer, ramp : as ``fitted`` takes them; the light that the core lacks has no contrast
    """
    reach = core.shape[0] // 2
    nodes = np.linspace(0.0, _JUDGED, _NODES)
    cosines = np.cos(2.0 * np.pi * np.multiply.outer(nodes, np.arange(-reach, reach + 1)))
    pixel, softened = np.sinc(nodes), np.sinc(nodes) * np.sinc(ramp * nodes)
    frequency = np.hypot(nodes[:, None], nodes)
    image = np.multiply.outer(softened, softened) * (cosines @ core @ cosines.T)
    off = image - np.multiply.outer(pixel, pixel) * transfer(frequency)
    return float(np.sqrt(np.mean(off[(frequency > 0.0) & (frequency <= _JUDGED)] ** 2)))
