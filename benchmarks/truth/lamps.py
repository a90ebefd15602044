"""Soft shadows of lamps."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table
from tests.passes.lamp_scenes import BLINDS, soft_shadow

_GOAL = 0.02


def table(gl: moderngl.Context) -> Table:
    """The point of each penumbra that is farthest off."""
    rows = []
    for size, at, radius in BLINDS:
        lit, truth = soft_shadow(gl, size, at, radius)
        # Within a pixel the share changes along a sharp edge.
        error = np.maximum(np.abs(lit - truth) - 0.5 * np.abs(np.gradient(truth)), 0.0)
        point = int(np.argmax(error))
        edges = " x ".join(f"{edge:g}" for edge in size)
        rows.append(
            Row(
                case=f"{edges} m, {at[2]:g} m above the ground, aperture {radius:g} m",
                truth=float(truth[point]),
                simgl=float(lit[point]),
                error=float(error[point]),
                goal=_GOAL,
            )
        )
    return Table(
        title="Soft shadows of lamps",
        reference="rays to 2000 points of the aperture, 10 m above the ground",
        quantity="share of the full light, where it is farthest off",
        error="of the full light, less half of the change to the next pixel",
        rows=rows,
    )
