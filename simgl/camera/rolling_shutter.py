"""Exposure time of each row, and the instants at which what it sees is drawn.

Row r of a rolling shutter starts r * row_time after the first; all rows of a global shutter start
together. The epoch of the image is the middle of the middle row's exposure.

Spacecraft are drawn at their rows' own times, again for each of several moments of the rows'
exposures where they move within these. For what is behind them the time from the start of the
first row to the end of the last is divided into equal parts, and it is drawn at their ends. Between
two instants each pixel of it changes linearly.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera

# Drawings per pixel of image motion: where pixels change linearly between them, and where they are
# added up; their largest number.
PARTS_PER_PIXEL, MOMENTS_PER_PIXEL = 2.0, 1.0
MAX_PARTS = 64
# Displacements of a row that one instant for all may leave [px]: 0.02 rms over the image.
LEAN = 0.07
# Paths within a row's exposure that one instant may leave [px]: they add 0.02 px^2 to the width of
# an edge, whose pixel has 0.083.
BLUR = 0.5


def duration(camera: Camera) -> float:
    """From the start of the first row's exposure to the end of the last row's [s]."""
    return read_out(camera) + camera.exposure_time


def read_out(camera: Camera) -> float:
    """From the first row's exposure to the last row's [s]."""
    return (camera.detector.height - 1) * camera.detector.row_time


def lean_and_blur(camera: Camera, motion: float) -> tuple[float, float]:
    """The part of a motion over the ``duration`` that the rows see of each other, and each row."""
    lean = motion * read_out(camera) / duration(camera)
    return lean, motion - lean


def parts(camera: Camera, motion: float) -> int:
    """Number of parts for what moves by ``motion`` pixels; 0 where one instant is enough.

    motion : over the ``duration``
    """
    lean, blur = lean_and_blur(camera, motion)
    if lean <= LEAN and blur <= BLUR:
        return 0
    return int(np.clip(np.ceil(PARTS_PER_PIXEL * motion), 1, MAX_PARTS))


def moments(camera: Camera, blur: float) -> Array:
    """(n,) times within a row's exposure, from its middle on [s], each for an equal part of it.

    blur : how far anything moves within the exposure [px]

    Pixels are as wide as the steps, so that copies of an edge side by side make an even ramp. The
    times reach out so far that their variance is that of the exposure.
    """
    if blur <= BLUR:
        return np.zeros(1)
    count = int(np.clip(np.ceil(MOMENTS_PER_PIXEL * blur), 2, MAX_PARTS))
    middles = (np.arange(count) + 0.5) / count - 0.5
    return camera.exposure_time * middles / np.sqrt(1.0 - count**-2.0)


def instants(camera: Camera, count: int) -> Array:
    """(count + 1,) ends of the parts, relative to the epoch [s]."""
    return duration(camera) * (np.arange(count + 1) / count - 0.5)


def row_shares(camera: Camera, count: int) -> Array:
    """(count + 1, height) weight of each instant in each row; 1 over a row.

    The mean, over a row's exposure, of the weights of linear interpolation between the instants.
    """
    detector, t = camera.detector, camera.exposure_time
    rows = np.arange(detector.height)
    opens = (rows - 0.5 * (detector.height - 1)) * detector.row_time - 0.5 * t
    length = duration(camera) / count
    # Of the first and the last instant only the half inside the exposure matters.
    knots = duration(camera) * (np.arange(-1, count + 2) / count - 0.5)

    # The weight of an instant is the second difference of ramps; this is their integral.
    integrals = [0.5 * np.maximum(time - knots[:, None], 0.0) ** 2 for time in (opens, opens + t)]
    exposed = (integrals[1] - integrals[0]) / (length * t)
    shares = np.maximum(np.diff(exposed, n=2, axis=0), 0.0)
    return shares / shares.sum(axis=0)
