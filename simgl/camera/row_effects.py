"""What belongs to whole rows: their noise, and the part of the exposure that each one sees."""

from __future__ import annotations

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.noise_streams import (
    PIXELS,
    Stream,
    epoch_words,
    frame_key,
    list_words,
    normal,
    uniform_01,
)


def row_offsets(camera: Camera, tai_ns: int, seed: int) -> Array:
    """(height,) offset of each row in one frame [e-]."""
    detector = camera.detector
    key = frame_key(seed, camera.name, Stream.ROW_NOISE)
    words = list_words(-(-detector.height // PIXELS), key, epoch_words(tai_ns))
    return detector.row_noise * normal(uniform_01(words).ravel()[: detector.height])
