"""Places of what moves in the rows of a rolling shutter."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table
from tests.simulator.moving_scenes import craft, drifting, row_errors, turning

_GOAL = 0.02
# Motions of the image over the read-out [px], and turns [deg].
_WAYS, _TURNS = (3.0, 25.0, 120.0, 200.0), (2.0, 10.0, 45.0)


def table(gl: moderngl.Context) -> Table:
    """A box that drifts and turns, at a short and a long exposure."""
    rows = []
    for exposure in (1e-4, 1e-2):
        one = craft(exposure_time_s=exposure, width_px=384)
        motions = {f"drift of {way:g} px": drifting(one, way) for way in _WAYS}
        if exposure < 1e-3:
            motions |= {f"turn by {t:g} deg": turning(one, np.radians(t)) for t in _TURNS}
        for name, during in motions.items():
            rms = float(np.sqrt(np.mean(np.square(row_errors(gl, one, during)))))
            rows.append(
                Row(
                    case=f"{name} over the read-out of 13 ms, exposure {1e3 * exposure:g} ms",
                    truth=0.0,
                    simgl=rms,
                    error=rms,
                    goal=_GOAL,
                )
            )
    return Table(
        title="What moves in the rows of a rolling shutter",
        reference="images of the scene as it stands at moments of the rows' exposures",
        quantity="misplacement of rows' middles, rms [px]",
        error="px; goal 0.02 px",
        rows=rows,
    )
