"""Counter-based random numbers: Philox4x32-10 (Salmon et al., SC 2011), streams, distributions.

A random word is a function of a key and a counter. The key identifies the source of noise: stream
and camera with the scenario's seed, or with the camera's serial number for fixed patterns. The
counter identifies the pixels, the epoch and the draw: the number of an image among those of one
epoch. There is no state, so the order of calls is free.
"""

from __future__ import annotations

import zlib
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgl.arrays import Array, UIntArray
from simgl.camera.camera import Camera

_MULTIPLIERS = np.array([0xD2511F53, 0xCD9E8D57], dtype=np.uint64)
_WEYL = np.array([0x9E3779B9, 0xBB67AE85], dtype=np.uint64)
_MASK = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)

# Pixels in a row that share one call of Philox, one word each.
PIXELS = 4


class Stream(IntEnum):
    """One stream per source of noise, so that they are independent; values below 16."""

    SHOT = 1
    READ = 2
    ROW_NOISE = 3
    HITS = 4
    TRACKS = 5
    EVENTS = 6
    LEAK = 7
    PRNU = 8
    DEAD = 9
    HOT = 10
    DSNU = 11
    ROWS = 12
    COLUMNS = 13
    THRESHOLD_ON = 14
    THRESHOLD_OFF = 15


def philox(counter: UIntArray, key: UIntArray) -> UIntArray:
    """(k, 4) random words of (k, 4) counters with one (2,) key."""
    c = counter.astype(np.uint64)
    k = key.astype(np.uint64)
    for _ in range(10):
        product = _MULTIPLIERS * c[:, [0, 2]]
        high, low = product >> _SHIFT, product & _MASK
        c = np.stack(
            [high[:, 1] ^ c[:, 1] ^ k[0], low[:, 1], high[:, 0] ^ c[:, 3] ^ k[1], low[:, 0]], axis=1
        )
        k = (k + _WEYL) & _MASK
    return c.astype(np.uint32)


def camera_salt(name: str) -> int:
    """Part of a key that depends on the camera; the low four bits are left to the stream."""
    return zlib.crc32(name.encode()) & 0xFFFFFFF0


def frame_key(seed: int, camera: str, stream: Stream) -> UIntArray:
    """(2,) key of a source of noise that changes from frame to frame."""
    return np.array([seed, stream ^ camera_salt(camera)], dtype=np.uint32)


def pattern_key(serial: int, stream: Stream) -> UIntArray:
    """(2,) key of a source of fixed-pattern noise."""
    return np.array([serial, stream], dtype=np.uint32)


def epoch_words(tai_ns: int) -> tuple[int, int]:
    """Low and high word of an epoch [TAI ns]."""
    return tai_ns & 0xFFFFFFFF, (tai_ns >> 32) & 0xFFFFFFFF


def list_words(
    count: int, key: UIntArray, epoch: tuple[int, int] = (0, 0), draw: int = 0
) -> UIntArray:
    """(count, 4) random words for the counters 0, 1, ..."""
    counter = np.zeros((count, 4), dtype=np.uint32)
    counter[:, 0] = np.arange(count)
    counter[:, 1] = draw
    counter[:, 2:] = epoch
    return philox(counter, key)


def uniform_01(words: UIntArray) -> Array:
    """Uniform numbers in (0, 1) from the upper 23 bits: exact in float32, never 0 or 1."""
    return ((words >> np.uint32(9)).astype(np.float64) + 0.5) / 2.0**23


def normal(u: NDArray[np.floating[Any]]) -> Array:
    """Standard normal quantiles at u in (0, 1).

    Wichura, "Algorithm AS 241: the percentage points of the normal distribution" (1988), in the
    seven-digit form PPND7; within +-5.3 for the numbers of ``uniform_01``.
    """
    q = u - 0.5
    r = 0.180625 - q * q
    middle = q * (((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179)
    middle /= ((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0
    s = np.sqrt(-np.log(np.minimum(u, 1.0 - u))) - 1.6
    tail = ((0.17023821103 * s + 1.3067284816) * s + 2.7568153900) * s + 1.4234372777
    tail /= (0.12021132975 * s + 0.73700164250) * s + 1.0
    return np.where(np.abs(q) <= 0.425, middle, np.copysign(tail, q))


def row_offsets(camera: Camera, tai_ns: int, seed: int, draw: int = 0) -> Array:
    """(height,) row noise of one frame [e-]."""
    detector = camera.detector
    key = frame_key(seed, camera.name, Stream.ROW_NOISE)
    words = list_words(-(-detector.height // PIXELS), key, epoch_words(tai_ns), draw)
    return detector.row_noise * normal(uniform_01(words).ravel()[: detector.height])
