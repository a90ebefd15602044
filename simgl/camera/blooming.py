"""Blooming: charge beyond the full well that spills along the column."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32


def _filled(room: Array32, spill: Array32, rows: range) -> Array32:
    """What each pixel takes of the charge that flows through its column in the order of rows."""
    taken = np.zeros_like(room)
    flow = np.zeros_like(room[0])
    for row in rows:
        np.minimum(flow, room[row], out=taken[row])
        flow += spill[row]
        flow -= taken[row]
    return taken


def spilt(collected: Array32, full_well: float, share: float) -> Array32:
    """Electrons of each pixel after the excess has flowed up and down its column.

    collected : (height, width) whole electrons, not yet cut at the full well
    share : of the excess that spills, half of it each way; the rest is drained

    Each stream fills the pixels on its way to the full well, until it is used up or reaches the
    edge. Where two streams meet in one pixel, what is too much for it is drained.
    """
    well = np.float32(full_well)
    excess = np.maximum(collected - well, np.float32(0.0))
    if not excess.any():
        return collected
    spill = np.floor(np.float32(0.5 * share) * excess)
    room = np.maximum(well - collected, np.float32(0.0))
    height = len(collected)
    down = _filled(room, spill, range(height))
    up = _filled(room, spill, range(height - 1, -1, -1))
    return np.asarray(np.minimum(collected + down + up, well), dtype=np.float32)
