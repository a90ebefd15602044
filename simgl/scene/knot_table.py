"""Linear interpolation between many knots, at values in no order."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, Array32

# Even steps for each knot, and values that are looked up together: they fit a core's cache.
_STEPS_EACH, _AT_ONCE = 4, 1 << 13


def interpolated(values: Array32, knots: Array32, at_knots: Array) -> Array32:
    """What ``np.interp`` returns, as float32, in a third of the time.

    A table of even steps says where to look, where ``np.interp`` searches for each value.

    values : of any shape; knots : (n,) ascending, some of them may be equal; at_knots : (n,)
    """
    x, y = knots.astype(np.float64), at_knots.astype(np.float64)
    width = np.diff(x)
    slope = np.zeros(len(x))
    np.divide(np.diff(y), width, out=slope[:-1], where=width > 0.0)
    next_ = np.append(x[1:], np.inf)
    steps = _STEPS_EACH * len(x)
    scale = steps / (x[-1] - x[0])
    # A knot at or before the start of each step, one earlier for what rounding leaves unsure.
    early = np.searchsorted(x, x[0] + np.arange(steps + 1) / scale, side="right") - 2
    early = np.maximum(early, 0).astype(np.int32)
    result = np.empty(values.shape, dtype=np.float32)
    flat, flat_result = values.ravel(), result.reshape(-1)
    for start in range(0, flat.size, _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        v = np.clip(flat[part].astype(np.float64), x[0], x[-1])
        knot = early.take(((v - x[0]) * scale).astype(np.int64))
        behind = np.arange(len(v))
        while len(behind):
            behind = behind[v[behind] >= next_.take(knot[behind])]
            knot[behind] += 1
        v -= x.take(knot)
        v *= slope.take(knot)
        v += y.take(knot)
        flat_result[part] = v
    return result
