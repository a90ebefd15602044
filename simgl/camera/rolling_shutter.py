"""Exposure time of each row, and its division into instants at which the scene is drawn.

Row r of a rolling shutter starts r * row_time after the first; all rows of a global shutter start
together. The epoch of the image is the middle of the middle row's exposure. The time from the start
of the first row to the end of the last is divided into equal parts; each shows one scene state.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera

# Parts per pixel of image motion, and their largest number.
PARTS_PER_PIXEL = 2.0
MAX_PARTS = 64


def duration(camera: Camera) -> float:
    """From the start of the first row's exposure to the end of the last row's [s]."""
    detector = camera.detector
    return (detector.height - 1) * detector.row_time + camera.exposure_time


def parts(motion: float) -> int:
    """Number of parts for an image motion of ``motion`` pixels."""
    return int(np.clip(np.ceil(PARTS_PER_PIXEL * motion), 1, MAX_PARTS))


def instants(camera: Camera, count: int) -> Array:
    """(count,) midpoints of the parts, relative to the epoch [s]."""
    return duration(camera) * ((np.arange(count) + 0.5) / count - 0.5)


def row_shares(camera: Camera, count: int) -> Array:
    """(count, height) fraction of each row's exposure in each part."""
    detector, t = camera.detector, camera.exposure_time
    rows = np.arange(detector.height)
    opens = (rows - 0.5 * (detector.height - 1)) * detector.row_time - 0.5 * t
    edges = duration(camera) * (np.arange(count + 1) / count - 0.5)
    # Fraction of a row's exposure that has passed at each edge.
    exposed = np.clip((edges[:, None] - opens) / t, 0.0, 1.0)
    exposed[0], exposed[-1] = 0.0, 1.0
    return np.diff(exposed, axis=0)
