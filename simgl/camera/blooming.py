"""Blooming: charge beyond the full well that flows along the column."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32


def _received(capacity: Array32, spill: Array32, rows: range) -> Array32:
    """Charge that each pixel receives from the flow through its column in the order of ``rows``."""
    received = np.zeros_like(capacity)
    flow = np.zeros_like(capacity[0])
    for row in rows:
        np.minimum(flow, capacity[row], out=received[row])
        flow += spill[row]
        flow -= received[row]
    return received


def with_blooming(collected: Array32, full_well: float, share: float) -> Array32:
    """(height, width) electrons after the excess has flowed up and down the columns.

    collected : (height, width) integer electrons, not limited to the full well
    full_well : [e-]
    share : fraction of the excess that flows, half of it each way; the rest is drained

    Each flow fills the pixels on its way to their full well until it is used up or reaches the
    edge. Where two flows meet in one pixel, the surplus is drained.
    """
    well = np.float32(full_well)
    excess = np.maximum(collected - well, np.float32(0.0))
    if not excess.any():
        return collected
    spill = np.floor(np.float32(0.5 * share) * excess)
    capacity = np.maximum(well - collected, np.float32(0.0))
    height = len(collected)
    down = _received(capacity, spill, range(height))
    up = _received(capacity, spill, range(height - 1, -1, -1))
    return np.minimum(collected + down + up, well)
