"""Places of what moves while the shutter is open."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table
from simgl.simulator import Simulator
from tests.simulator.blurred_scenes import box, moving
from tests.simulator.moving_scenes import craft, drifting, electrons, row_errors, turning

_GOAL = 0.02
# Motions of the image over the read-out [px], and turns [deg].
_WAYS, _TURNS = (3.0, 25.0, 120.0, 200.0), (2.0, 10.0, 45.0)
# Motions within an exposure [px].
_BLURS = (0.7, 1.5, 3.0, 25.0, 120.0, 200.0)


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
            case = f"{name} over the read-out of 13 ms, exposure {1e3 * exposure:g} ms"
            rows.append(_row(case, rms))
    rows += [
        _row(f"global shutter, drift of {way:g} px within the exposure", _blur_error(gl, way))
        for way in _BLURS
    ]
    return Table(
        title="What moves while the shutter is open",
        reference="images of the scene as it stands at moments of the rows' exposures",
        quantity="misplacement of rows' middles, rms [px]",
        error="px; goal 0.02 px",
        rows=rows,
    )


def _row(case: str, rms: float) -> Row:
    return Row(case=case, truth=0.0, simgl=rms, error=rms, goal=_GOAL)


def _blur_error(gl: moderngl.Context, way: float) -> float:
    """Of the middles of rows' light, against the still image of the exposure's middle [px]."""
    one = box(width_px=384)
    during = moving(one, way, 0.3 * min(way, 25.0))
    with Simulator(one, gl) as simulator:
        state = during(one.epoch_tai_ns)
        blurred, still = (electrons(simulator, state, moves) for moves in (during, None))
    x = np.arange(384) + 0.5
    # Rows that the box fills all the time.
    middles = [image[44:84] @ x / image[44:84].sum(axis=1) for image in (blurred, still)]
    return float(np.sqrt(np.mean(np.square(middles[0] - middles[1]))))
