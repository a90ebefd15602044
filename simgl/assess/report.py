"""The assessment of a trajectory as one HTML page for a review."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

from simgl.assess.assessment_page import COLOURS, write_page
from simgl.assess.assessment_tables import write_tables, write_uncertainty_tables
from simgl.assess.epoch_images import epoch_images, shown_epochs, with_worst_of_requirements
from simgl.assess.model_limits import model_limits
from simgl.assess.orbit_plots import geometry_sketch, ground_track
from simgl.assess.provenance import input_files, provenance
from simgl.assess.requirement_check import (
    Check,
    Outcome,
    in_unit,
    passed,
    requirement_text,
)
from simgl.assess.target_background import TargetBackground
from simgl.assess.temperature_section import temperature_section
from simgl.assess.time_plots import NO_BANDS, geometry_plot, image_plot
from simgl.assess.timeline import Timeline
from simgl.assess.trajectory_assessment import Assignment
from simgl.assess.uncertainty_bands import UncertaintyBands, draw_text
from simgl.assess.verdict import Verdict
from simgl.figures.html_page import plot_source
from simgl.figures.style import BLUE, GREEN, NIGHT, ORANGE, PALE, RED, SKY
from simgl.sequence.journal import Row
from simgl.simulator import Simulator

_BACKGROUND_COLOURS = {
    TargetBackground.SPACE: NIGHT,
    TargetBackground.LIMB: SKY,
    TargetBackground.EARTH: GREEN,
    TargetBackground.MIXED: ORANGE,
    TargetBackground.NONE: PALE,
}
_OUTCOME_COLOURS = {
    Outcome.PASS: GREEN,
    Outcome.FAIL: RED,
    Outcome.NOT_JUDGED: BLUE,
}
_SHARES = {
    "usable": COLOURS[Verdict.GOOD],
    "dark": COLOURS[Verdict.TOO_DARK],
    "saturated": COLOURS[Verdict.TOO_BRIGHT],
}


def write_report(
    path: Path,
    work: Assignment,
    rows: Sequence[Row],
    summary: Timeline,
    simulator: Simulator,
    checks: Sequence[Check] = (),
    by: str | None = None,
    uncertainty: UncertaintyBands | None = None,
) -> None:
    """One HTML file that needs no other, and its tables as CSV beside it.

    checks : of the scenario's requirements
    by : who assessed; the login name if not given
    uncertainty : what the draws of the scenario's uncertainties say
    """
    bands = NO_BANDS if uncertainty is None else uncertainty.bands
    facts = provenance(work, simulator.renderer_name, by)
    files = input_files(work.scenario)
    limits = model_limits(work, rows)
    broken = [
        (check.requirement.key, check.worst_tai_ns)
        for check in checks
        if check.outcome is not Outcome.PASS
        and check.worst_tai_ns is not None
        and check.requirement.of.column is not None
    ]
    shown = with_worst_of_requirements(shown_epochs(rows), broken, rows)
    marked = [("worst", summary.worst.tai_ns)] if summary.worst is not None else []
    backgrounds = itertools.groupby(str(row["backdrop"]) for row in rows)
    track, sketch = ground_track(work, rows, marked), geometry_sketch(work, rows)
    write_tables(path.parent, facts | files, checks, summary, limits)
    if uncertainty is not None:
        write_uncertainty_tables(path.parent, uncertainty, rows)
    write_page(
        path,
        "trajectory_report.html.jinja",
        work,
        rows=rows,
        facts=facts,
        files=files,
        checks=checks,
        passed=passed(checks),
        uncertainty=uncertainty,
        draw_text=draw_text,
        outcome_colours=_OUTCOME_COLOURS,
        requirement_text=requirement_text,
        in_unit=in_unit,
        timeline=summary,
        backgrounds=[(kind, len(list(epochs))) for kind, epochs in backgrounds],
        background_colours={kind.value: colour for kind, colour in _BACKGROUND_COLOURS.items()},
        geometry_plot=plot_source(geometry_plot(rows, checks, bands)),
        image_plot=plot_source(image_plot(rows, checks, _SHARES, bands)),
        ground_track=plot_source(track) if track is not None else None,
        geometry_sketch=plot_source(sketch) if sketch is not None else None,
        temperatures=temperature_section(work, rows, simulator, path.parent),
        shown=[epoch_images(work, title, row, simulator, path.parent) for title, row in shown],
        limits=limits,
    )
