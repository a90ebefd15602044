"""Places of small targets before calibrated cameras."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table
from tests.passes.calibrated_targets import CAMERAS, place_errors

_RMS_GOAL, _WORST_GOAL = 0.01, 0.03


def table(gl: moderngl.Context) -> Table:
    """Each camera over its whole field."""
    rows = []
    for name in CAMERAS:
        off = np.linalg.norm(place_errors(gl, name), axis=1)
        for which, value, goal in (
            ("rms", float(np.sqrt(np.mean(off**2))), _RMS_GOAL),
            ("worst", float(off.max()), _WORST_GOAL),
        ):
            case = f"{name}, {which} of {len(off)} targets"
            rows.append(Row(case=case, truth=0.0, simgl=value, error=value, goal=goal))
    return Table(
        title="Places of targets of 7 pixels before calibrated cameras",
        reference="OpenCV (a double sphere: its formula), by quadrature over each target",
        quantity="distance of the centre of light [px]",
        error="pixels",
        rows=rows,
    )
