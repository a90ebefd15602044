"""When the rows of an image are exposed.

Row r of a rolling shutter starts r * row_time after the first; all rows of a global shutter start
together. The epoch of the image is the middle of the middle row's exposure.
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
