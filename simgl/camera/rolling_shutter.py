"""Exposure time of each row, and the instants at which the scene is drawn for it.

Row r of a rolling shutter starts r * row_time after the first; all rows of a global shutter start
together. The epoch of the image is the middle of the middle row's exposure. The time from the start
of the first row to the end of the last is divided into equal parts, and the scene is drawn at their
ends. Between two instants each pixel changes linearly, so that what moves is at its right place in
each row, not at that of the nearest instant.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera

# Parts per pixel of image motion, and their largest number.
PARTS_PER_PIXEL = 2.0
MAX_PARTS = 64
# Displacements of a row that one instant for all may leave [px]: 0.02 rms over the image.
LEAN = 0.07
# Paths within a row's exposure that one instant may leave [px]: they add 0.02 px^2 to the width of
# an edge, whose pixel has 0.083.
BLUR = 0.5


def duration(camera: Camera) -> float:
    """From the start of the first row's exposure to the end of the last row's [s]."""
    return _read_out(camera) + camera.exposure_time


def _read_out(camera: Camera) -> float:
    """From the first row's exposure to the last row's [s]."""
    return (camera.detector.height - 1) * camera.detector.row_time


def parts(camera: Camera, motion: float) -> int:
    """Number of parts for an image that moves by ``motion`` pixels; 0 where one instant is enough.

    motion : over the ``duration``
    """
    lean = motion * _read_out(camera) / duration(camera)
    if lean <= LEAN and motion - lean <= BLUR:
        return 0
    return int(np.clip(np.ceil(PARTS_PER_PIXEL * motion), 1, MAX_PARTS))


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
