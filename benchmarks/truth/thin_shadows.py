"""Sunlight on thin things, and in their shadows."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table
from tests.passes.thin_casters import sun_directions, thin_scenes, wrong_pixels

_SUNS = 10


def table(gl: moderngl.Context) -> Table:
    """Each scene under Suns from all sides."""
    rows = []
    for case, thin in thin_scenes().items():
        wrong = 0
        for sun in sun_directions(_SUNS):
            off, _ = wrong_pixels(gl, thin, sun)
            wrong += int(np.count_nonzero(off))
        rows.append(Row(case=case, truth=0.0, simgl=float(wrong), error=float(wrong), goal=0.0))
    return Table(
        title="Sunlight on sheets, rods and booms",
        reference=(
            "64 rays to the Sun's disc from four places in each pixel, from 144 where these leave "
            f"doubt, {_SUNS} Suns"
        ),
        quantity=f"wrong pixels of {_SUNS} images of 300 x 300",
        error="pixels, a quarter of the sunlight off all places in them and their neighbours",
        rows=rows,
    )
