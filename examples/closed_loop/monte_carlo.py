"""Many flights over seeds: where they start, what they miss, how true the filter is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from examples.closed_loop.loop import Flight
from examples.closed_loop.report import Summary, document, inline_image
from simgl.arrays import Array
from simgl.output import complete_file

PAGE = "monte_carlo.html"
PLOT = "monte_carlo.png"
SUMMARY = "monte_carlo.json"

# What is worth a mean and a worst case.
_FIGURES = (
    "distance_true_m",
    "off_axis_m",
    "misalignment_deg",
    "range_error_m",
    "lateral_error_m",
    "turn_error_deg",
    "within_3_sigma",
    "rejected_fixes",
    "blind_frames",
    "delta_v_m_s",
    "simulated_time_s",
)


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
    with complete_file(plot_path) as path:
        plot(flights).savefig(path, dpi=100)
    with complete_file(summary_path) as path:
        runs = [asdict(s) for s in summaries]
        content = {"machine": machine, "statistics": table, "runs": runs}
        path.write_text(json.dumps(content, indent=2) + "\n")
    head = "<tr><th></th><th>mean</th><th>deviation</th><th>least</th><th>most</th></tr>"
    rows = [
        f"<tr><th>{name}</th>"
        + "".join(f'<td class="n">{value:g}</td>' for value in column.values())
        + "</tr>"
        for name, column in table.items()
        if isinstance(column, dict)
    ]
    body = [
        f"<p>{table['arrived']} of {table['runs']} runs arrived. {machine}.</p>",
        "<table>",
        head,
        *rows,
        "</table>",
        inline_image(plot_path),
    ]
    with complete_file(page) as path:
        path.write_text(document("Docking: Monte Carlo over seeds", body))
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
    b.plot([f.distance for f in flights[0].frames], bound, color="black", linewidth=0.8,
           linestyle=":", label="3 sigma, first run")  # fmt: skip
    a.set(yscale="log", xlabel="time [s]", ylabel="m", title="Camera to board")
    b.set(xscale="log", yscale="log", xlabel="distance [m]", ylabel="m",
          title="Error of position")  # fmt: skip
    b.invert_xaxis()
    b.legend(fontsize="small")
    c.axhline(6.0, color="black", linewidth=0.8, label="expected mean, 6")
    # Chi-square of 6 degrees of freedom exceeds this once in 1000.
    c.axhline(22.5, color="black", linewidth=0.8, linestyle=":", label="99.9 %")
    c.set(yscale="log", xlabel="time [s]", title="Squared error over the filter's covariance")
    c.legend(fontsize="small")
    d.set(
        xlabel="across [mm]",
        ylabel="towards the board's foot [mm]",
        title="Where the camera ends, off the axis",
    )
    d.axhline(0.0, color="grey", linewidth=0.6)
    d.axvline(0.0, color="grey", linewidth=0.6)
    d.set_aspect("equal", adjustable="datalim")
    for cell in (a, b, c, d):
        cell.grid(alpha=0.3)
    return figure
