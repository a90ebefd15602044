"""Ranges of distance that a depth buffer each resolves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from simgl.arrays import Array

# Nothing closer to the pinhole than this is drawn [m].
NEAREST = 0.01
# One 24-bit depth buffer covers distances up to this ratio: steps of 4e-6 of the distance.
SLICE_RATIO = 64.0


def depth_slices(depths: Array) -> tuple[tuple[float, float], ...]:
    """Near and far of the depth slices that hold the given depths [m], farthest first."""
    near = max(float(depths.min()) * 0.999, NEAREST)
    far = max(float(depths.max()) * 1.001, 2.0 * near)
    count = int(np.ceil(np.log(far / near) / np.log(SLICE_RATIO)))
    # Of one slice its ends, for which numpy takes as long as for many.
    edges = [near, far] if count == 1 else np.geomspace(near, far, count + 1).tolist()
    # Neighbours overlap by 1e-4, so that rounding leaves no crack between them.
    return tuple((a, b * 1.0001) for a, b in pairwise(edges))[::-1]
