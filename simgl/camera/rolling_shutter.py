"""When each row is exposed, and which states of the scene it sees.

Row r of a rolling shutter opens r * row_time after the first; all rows of a global one open at
once. The epoch of the picture is the middle of the middle row's exposure. Time between the opening
of the first row and the closing of the last is cut into equal parts, each of which shows one state.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera

# Parts for each pixel by which something moves meanwhile, and the most that are drawn.
PARTS_PER_PIXEL = 2.0
MOST_PARTS = 64


def duration(camera: Camera) -> float:
    """From the opening of the first row to the closing of the last [s]."""
    detector = camera.detector
    return (detector.height - 1) * detector.row_time + camera.exposure_time


def parts(motion: float) -> int:
    """How many states a picture needs in which something moves by ``motion`` pixels."""
    return int(np.clip(np.ceil(PARTS_PER_PIXEL * motion), 1, MOST_PARTS))


def instants(camera: Camera, count: int) -> Array:
    """(count,) middles of the parts, relative to the epoch [s]."""
    return duration(camera) * ((np.arange(count) + 0.5) / count - 0.5)


def row_shares(camera: Camera, count: int) -> Array:
    """(count, height) part of each row's exposure time that falls into each part of the time."""
    detector, t = camera.detector, camera.exposure_time
    rows = np.arange(detector.height)
    opens = (rows - 0.5 * (detector.height - 1)) * detector.row_time - 0.5 * t
    edges = duration(camera) * (np.arange(count + 1) / count - 0.5)
    # Exposed so far, at each edge: rising from 0 to 1 while the row is open.
    exposed = np.clip((edges[:, None] - opens) / t, 0.0, 1.0)
    exposed[0], exposed[-1] = 0.0, 1.0
    return np.diff(exposed, axis=0)
