"""Light from one spacecraft to another near it."""

from __future__ import annotations

import moderngl

from benchmarks.truth.rows import Row, Table, relative
from simgl.scenario.scenario import Scenario
from tests.radiosity.near_spacecraft import box_over_bay, from_other_surfaces, two_boxes

_GOAL = 0.1
_SUNS = ((-0.9, 0.0, 0.43), (-0.6, 0.7, 0.4))
_GAPS = (2.0, 0.5)
_SUN_OF_BAY = (-0.3, 0.25, -0.92)
_TARGET, _CHASER = 1, 2


def table(gl: moderngl.Context) -> Table:
    """Two boxes, and a box before a bay."""

    def row(case: str, near: Scenario, rays: Scenario, body: int) -> Row:
        shown, instance = from_other_surfaces(gl, near)
        truth, _ = from_other_surfaces(gl, rays)
        seen = instance == body
        return relative(case, float(truth[seen].sum()), float(shown[seen].sum()), _GOAL)

    rows = [
        row(
            f"white box of 1 m, {gap:g} m from another, Sun {sun}",
            two_boxes(gap, sun),
            two_boxes(gap, sun, gather="pixel"),
            _TARGET,
        )
        for gap in _GAPS
        for sun in _SUNS
    ]
    near, rays = box_over_bay(_SUN_OF_BAY), box_over_bay(_SUN_OF_BAY, gather="pixel")
    rows.append(row("white box 2 m before Space Rider's sunlit bay", near, rays, _CHASER))
    return Table(
        title="Light from one spacecraft to another",
        reference='paths by Embree from every sample (`gather = "pixel"`)',
        quantity="sum of the radiance of that light over the spacecraft's pixels [W m-2 sr-1]",
        error="relative",
        rows=rows,
    )
