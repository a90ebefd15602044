"""Pixels of 12 bits, packed as GenICam's Mono12p."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Image16


def pack_mono12p(dn: Image16) -> bytes:
    """GenICam's Mono12p (PFNC): two pixels in three bytes, low bits first, rows without padding.

    An odd number of pixels ends with four zero bits. Raises ValueError beyond 12 bits, and for
    pixels that are no integers.
    """
    flat = dn.ravel()
    if flat.dtype.kind not in "ui":
        raise ValueError(f"Mono12p holds integers, got {flat.dtype}")
    for extreme in (int(flat.min()), int(flat.max())) if flat.size else ():
        if not 0 <= extreme <= 0xFFF:
            raise ValueError(f"Mono12p holds 0..4095, got {extreme}")
    pairs = np.zeros((-(-flat.size // 2), 2), dtype=np.uint16)
    pairs.ravel()[: flat.size] = flat
    first, second = pairs.T
    packed = np.empty((len(pairs), 3), dtype=np.uint8)
    packed[:, 0] = first & 0xFF
    packed[:, 1] = (first >> 8) | ((second & 0xF) << 4)
    packed[:, 2] = second >> 4
    data = packed.tobytes()
    return data[: -(-flat.size * 3 // 2)]


def unpack_mono12p(data: bytes, height: int, width: int) -> Image16:
    """(height, width) pixels of Mono12p data; ValueError for data of another length."""
    count = height * width
    wanted = -(-count * 3 // 2)
    if len(data) != wanted:
        raise ValueError(f"{width} x {height} pixels take {wanted} bytes, got {len(data)}")
    padded = np.zeros(-(-count // 2) * 3, dtype=np.uint16)
    padded[: len(data)] = np.frombuffer(data, dtype=np.uint8)
    low, middle, high = padded.reshape(-1, 3).T
    pairs = np.stack([low | ((middle & 0xF) << 8), (middle >> 4) | (high << 4)], axis=1)
    return pairs.ravel()[:count].reshape(height, width)
