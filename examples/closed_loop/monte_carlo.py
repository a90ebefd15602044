"""Many flights over seeds: where they start, what they miss, how true the filter is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from examples.closed_loop.criteria import docked
from examples.closed_loop.loop import Flight
from examples.closed_loop.report import TEMPLATES, Summary
from simgl.arrays import Array
from simgl.figures.html_page import plot_source, write_html_page
from simgl.figures.style import INK, SOFT, figure_style
from simgl.output import complete_file

PAGE = "monte_carlo.html"
PLOT = "monte_carlo.png"
SUMMARY = "monte_carlo.json"

# What is worth a mean and a worst case: in words, and its unit.
_FIGURES = {
    "distance_true_m": ("camera's distance from the board at the end", "m"),
    "off_axis_m": ("camera off the board's axis at the end", "m"),
    "misalignment_deg": ("camera's axis against the board's at the end", "deg"),
    "range_error_m": ("error along the approach, rms", "m"),
    "lateral_error_m": ("error across, rms", "m"),
    "turn_error_deg": ("error of the target's attitude, rms", "deg"),
    "within_3_sigma": ("errors of position within 3 sigma", "1"),
    "rejected_fixes": ("fixes rejected by the filter", "images"),
    "blind_frames": ("images without a fix", "images"),
    "delta_v_m_s": ("velocity change", "m/s"),
    "simulated_time_s": ("flight time", "s"),
}


def statistics(summaries: Sequence[Summary]) -> dict[str, object]:
    """How many arrived, and mean, deviation and extremes of each figure over the runs."""
    table: dict[str, object] = {
        "runs": len(summaries),
        "arrived": sum(s.arrived for s in summaries),
    }
    for name in _FIGURES:
        values = np.array([getattr(s, name) for s in summaries], dtype=np.float64)
        table[name] = {
            "mean": round(float(values.mean()), 4),
            "deviation": round(float(values.std()), 4),
            "least": round(float(values.min()), 4),
            "most": round(float(values.max()), 4),
        }
    return table


def normalised_errors(flight: Flight) -> Array:
    """(frame,) squared error of place and turn over the filter's covariance; 6 on average."""
    keep = [0, 1, 2, 6, 7, 8]
    values = []
    for frame in flight.frames:
        error, covariance = frame.error[keep], frame.covariance[np.ix_(keep, keep)]
        values.append(float(error @ np.linalg.solve(covariance, error)))
    return np.array(values)


def write_monte_carlo(
    flights: Sequence[Flight], summaries: Sequence[Summary], folder: Path, machine: str
) -> list[Path]:
    """Write page, plot and summary; returns their paths."""
    page, plot_path, summary_path = (folder / name for name in (PAGE, PLOT, SUMMARY))
    table = statistics(summaries)
    with figure_style(), complete_file(plot_path) as path:
        plots = plot(flights)
        plots.savefig(path, dpi=100)
    with complete_file(summary_path) as path:
        runs = [asdict(s) for s in summaries]
        content = {"machine": machine, "statistics": table, "runs": runs}
        path.write_text(json.dumps(content, indent=2) + "\n")
    shown = {
        "docked": sum(docked(s) for s in summaries),
        "runs": len(summaries),
        "table": [(*_FIGURES[name], table[name]) for name in _FIGURES],
        "plots": plot_source(plots),
        "machine": machine,
    }
    write_html_page(page, "monte_carlo.html.jinja", shown, folder=TEMPLATES)
    return [page, plot_path, summary_path]


def plot(flights: Sequence[Flight]) -> Figure:
    """Distances, errors against distance, how true the filter is, and where all runs end."""
    figure = Figure(figsize=(13.5, 9.0), layout="constrained")
    a, b, c, d = figure.subplots(2, 2).ravel()
    for flight in flights:
        time = [f.time for f in flight.frames]
        distance = np.array([f.distance for f in flight.frames])
        label = f"seed {flight.settings.seed}"
        a.plot(time, distance, linewidth=0.9, label=label)
        b.plot(distance, [np.linalg.norm(f.error[:3]) for f in flight.frames], linewidth=0.8)
        c.plot(time, normalised_errors(flight), linewidth=0.8)
        d.plot(1e3 * flight.final[1], 1e3 * flight.final[2], "o", label=label)
    bound = [3.0 * np.linalg.norm(f.sigma[:3]) for f in flights[0].frames]
    b.plot([f.distance for f in flights[0].frames], bound, color=INK, linewidth=0.8,
           linestyle=":", label="3 sigma, first run")  # fmt: skip
    a.set(yscale="log", xlabel="time [s]", ylabel="distance [m]", title="Camera to board")
    b.set(xscale="log", yscale="log", xlabel="distance [m]", ylabel="error [m]",
          title="Error of position")  # fmt: skip
    b.invert_xaxis()
    b.legend(fontsize="small")
    c.axhline(6.0, color=INK, linewidth=0.8, label="expected mean, 6")
    # Chi-square of 6 degrees of freedom exceeds this once in 1000.
    c.axhline(22.5, color=INK, linewidth=0.8, linestyle=":", label="99.9 %")
    c.set(yscale="log", xlabel="time [s]", ylabel="normalised squared error [1]",
          title="Consistency of the filter (NEES)")  # fmt: skip
    c.legend(fontsize="small")
    d.set(
        xlabel="across [mm]",
        ylabel="towards the board's foot [mm]",
        title="Where the camera ends, off the axis",
    )
    d.axhline(0.0, color=SOFT, linewidth=0.6)
    d.axvline(0.0, color=SOFT, linewidth=0.6)
    d.set_aspect("equal", adjustable="datalim")
    return figure
