"""What glossy surfaces show of their own spacecraft, in the frame loop."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.glossy_paths import GlossyPaths
from benchmarks.truth.rows import Row, Table, difference, relative
from simgl.scenario.scenario import Scenario
from tests.radiosity.glossy_scenes import (
    ACROSS,
    ALONG,
    PANEL,
    RED,
    dielectric,
    from_other_surfaces,
    inside,
    metal,
    panel_and_box,
)

_GOAL, _PIXELS = 0.1, 0.5
_PATHS = 256
_ALPHAS = (0.05, 0.1, 0.2, 0.4)
_VIEWS = {"over the box's mirror image": ACROSS, "past it": ALONG}
_KINDS = {"metal": metal, "black dielectric": dielectric}
_RED_BAND, _NEAR_INFRARED = 0, 3


def table(gl: moderngl.Context) -> Table:
    """A panel beside a sunlit box, from two sides; with a shadow on the box; and a coloured box."""
    rng = np.random.default_rng(20261124)
    rows: list[Row] = []
    for view, camera in _VIEWS.items():
        for kind, of_width in _KINDS.items():
            for alpha in _ALPHAS:
                case = f"{kind}, alpha {alpha:g}, seen {view}"
                rows += _rows(gl, case, panel_and_box(of_width(alpha), camera=camera), rng)
    for alpha in (0.1, 0.4):
        shaded = panel_and_box(metal(alpha), shade=True)
        rows += _rows(gl, f"metal, alpha {alpha:g}, a wall's shadow on the box", shaded, rng)
    red = panel_and_box(metal(0.2), RED)
    rows += _rows(gl, "metal, alpha 0.2, red box, red", red, rng, _RED_BAND)
    rows += _rows(gl, "metal, alpha 0.2, red box, near infrared", red, rng, _NEAR_INFRARED)
    mirror = panel_and_box(metal(0.02))
    rows += _rows(
        gl, "metal, alpha 0.02, seen over the box's mirror image", mirror, rng, place=True
    )
    return Table(
        title="What glossy surfaces show of their spacecraft",
        reference=f"paths of light, {_PATHS} of each pixel, whose half vectors follow GGX",
        quantity="sum of the lobe's light over the panel [W m-2 sr-1]; its middle [px]",
        error="of sums relative, of places in pixels",
        rows=rows,
    )


def _rows(
    gl: moderngl.Context,
    case: str,
    scenario: Scenario,
    rng: np.random.Generator,
    band: int | None = None,
    *,
    place: bool = False,
) -> list[Row]:
    shown, part = from_other_surfaces(gl, scenario)
    pixels = np.argwhere(inside(part == PANEL))
    state = scenario.at(scenario.epoch_tai_ns)
    paths = GlossyPaths(state)
    light = paths.light(state.cameras["cam"], pixels[:, ::-1], _PATHS, rng)
    seen = shown[pixels[:, 0], pixels[:, 1]]
    chosen = slice(None) if band is None else slice(band, band + 1)
    truth, simgl = (values[:, chosen].sum(axis=1) for values in (light, seen))
    rows = [relative(case, float(truth.sum()), float(simgl.sum()), _GOAL)]
    if place:
        for axis, name in ((1, "column"), (0, "row")):
            true, seen_at = (float(v @ pixels[:, axis] / v.sum()) for v in (truth, simgl))
            rows.append(difference(f"{case}: {name} of its middle", true, seen_at, _PIXELS))
    return rows
