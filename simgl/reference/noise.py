"""Philox4x32-10 (Salmon et al., SC 2011) and the numbers made from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint32]

_MULTIPLIERS = np.array([0xD2511F53, 0xCD9E8D57], dtype=np.uint64)
_WEYL = np.array([0x9E3779B9, 0xBB67AE85], dtype=np.uint64)
_MASK = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)


def philox(counter: Words, key: Words) -> Words:
    """(k, 4) random words of (k, 4) counters under one (2,) key."""
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


def uniform_01(words: Words) -> NDArray[np.float64]:
    """Numbers in (0, 1) from the upper 23 bits."""
    return np.asarray(((words >> np.uint32(9)).astype(np.float64) + 0.5) / 2.0**23)


def gaussian(words: Words) -> NDArray[np.float64]:
    """(k,) standard normals of (k, 2) words by Box and Muller."""
    u = uniform_01(words)
    return np.asarray(np.sqrt(-2.0 * np.log(u[:, 0])) * np.cos(2.0 * np.pi * u[:, 1]))
