"""The assessment of a trajectory as one HTML page: numbers, timeline, images, maps."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from simgl.arrays import Array
from simgl.assess.assessment_page import COLOURS, write_page
from simgl.assess.target_background import TargetBackground
from simgl.assess.timeline import Timeline
from simgl.assess.trajectory_assessment import PRODUCTS, Assignment
from simgl.assess.verdict import Verdict
from simgl.html_page import base64_png
from simgl.images import display_from_radiance, display_gain, png_bytes
from simgl.maps import electron_map
from simgl.sequence.journal import Row
from simgl.simulator import Simulator

# More gain does not help the eye; stars would become visible before the target.
_MAX_GAIN = 1024.0
_BACKGROUND_COLOURS = {
    TargetBackground.SPACE: "#3b4252",
    TargetBackground.LIMB: "#4f8fd0",
    TargetBackground.EARTH: "#8fb996",
    TargetBackground.MIXED: "#c9a66b",
    TargetBackground.NONE: "#c8ccd4",
}


def write_report(
    path: Path, work: Assignment, rows: Sequence[Row], timeline: Timeline, simulator: Simulator
) -> None:
    """One HTML file that needs no other."""
    backgrounds = itertools.groupby(str(row["backdrop"]) for row in rows)
    write_page(
        path,
        "trajectory_report.html.jinja",
        work,
        rows=rows,
        timeline=timeline,
        backgrounds=[(kind, len(list(epochs))) for kind, epochs in backgrounds],
        background_colours={kind.value: colour for kind, colour in _BACKGROUND_COLOURS.items()},
        plot=_plot(rows),
        shown=[_images(work, title, row, simulator) for title, row in shown_epochs(rows)],
    )


def _column(rows: Sequence[Row], name: str) -> Array:
    return np.array([np.nan if row[name] is None else float(row[name] or 0.0) for row in rows])


def _plot(rows: Sequence[Row]) -> str:
    """Quantities over time, as a PNG in base64."""
    from matplotlib.figure import Figure

    minutes = (_column(rows, "tai_ns") - float(rows[0]["tai_ns"] or 0)) / 60e9
    figure = Figure(figsize=(10.4, 8.2), layout="constrained")
    phase, sunlight, pixels, signal, contrast = figure.subplots(5, 1, sharex=True)
    phase.plot(minutes, _column(rows, "phase_angle_deg"), color="#1f5fa8")
    phase.set_ylabel("phase angle [deg]")
    sunlight.plot(minutes, 100.0 * _column(rows, "sunlight"), color="#d08700")
    sunlight.set(ylabel="sunlight [%]", ylim=(-5.0, 105.0))
    shares = {"usable": Verdict.GOOD, "dark": Verdict.TOO_DARK, "saturated": Verdict.TOO_BRIGHT}
    pixels.stackplot(
        minutes,
        [100.0 * _column(rows, name) for name in shares],
        labels=list(shares),
        colors=[COLOURS[verdict] for verdict in shares.values()],
    )
    pixels.set_ylabel("target pixels [%]")
    pixels.legend(loc="lower left", ncols=3, fontsize=8)
    signal.semilogy(minutes, np.maximum(_column(rows, "median_snr"), 0.1), color="#2e8b57")
    signal.set_ylabel("signal over noise")
    contrast.plot(minutes, _column(rows, "contrast"), color="#8e5ea2")
    contrast.set(ylabel="contrast", ylim=(-0.05, 1.05), xlabel="minutes")
    for panel in figure.axes:
        panel.grid(alpha=0.3)
        panel.margins(x=0.0)
    return base64_png(figure)


def shown_epochs(rows: Sequence[Row]) -> list[tuple[str, Row]]:
    """Title and row of the best epoch, the worst in view, and the middle one of each verdict."""
    in_view = [row for row in rows if row["verdict"] != Verdict.NOT_IN_VIEW.value]
    if not in_view:
        return []

    def worth(row: Row) -> tuple[float, float]:
        return float(row["usable"] or 0.0), float(row["median_snr"] or 0.0)

    titled = [("best", max(in_view, key=worth)), ("worst", min(in_view, key=worth))]
    for kind in (Verdict.TOO_BRIGHT, Verdict.TOO_DARK, Verdict.CONFUSED, Verdict.GOOD):
        of_kind = [row for row in in_view if row["verdict"] == kind.value]
        if of_kind:
            titled.append((kind.value, of_kind[len(of_kind) // 2]))
    by_frame: dict[object, tuple[str, Row]] = {}
    for title, row in titled:
        by_frame.setdefault(row["frame"], (title, row))
    return list(by_frame.values())


def _images(work: Assignment, title: str, row: Row, simulator: Simulator) -> dict[str, object]:
    """What the page shows of one epoch; images as PNG in base64."""
    state = work.scenario.at(int(row["tai_ns"] or 0))
    capture = simulator.capture(state, work.camera, PRODUCTS)
    assert capture.radiance is not None
    assert capture.electrons is not None
    radiance = capture.radiance.radiance
    gain = min(display_gain(radiance), _MAX_GAIN)
    return {
        "title": title,
        "row": row,
        "gain": gain,
        "image": base64_png(png_bytes(display_from_radiance(radiance, gain))),
        "electrons": base64_png(electron_map(capture.electrons)),
    }
