"""What a flight leaves behind: a table, a plot, a strip of pictures and a summary."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from examples.closed_loop.loop import Flight, Frame, Picture
from simgl.output import complete_file

TABLE = "approach.csv"
PLOT = "approach_plot.png"
STRIP = "approach_strip.png"
SUMMARY = "approach_summary.json"

COLUMNS = (
    "time_s",
    *(f"{axis}_true_m" for axis in "xyz"),
    *(f"{axis}_estimated_m" for axis in "xyz"),
    *(f"{axis}_sigma_m" for axis in "xyz"),
    "range_true_m",
    "range_measured_m",
    "range_estimated_m",
    "range_sigma_m",
    "accepted",
    "delta_v_m_s",
)


@dataclass(frozen=True, kw_only=True)
class Summary:
    """The flight in a dozen numbers.

    miss_m : true distance from the hold point after the last frame
    rms_* : estimate against truth over the second half of the flight
    """

    arrived: bool
    frames: int
    frames_per_second: float
    simulated_time_s: float
    range_true_m: float
    range_estimated_m: float
    range_sigma_m: float
    miss_m: float
    rms_range_error_m: float
    rms_lateral_error_m: float
    rejected_frames: int
    delta_v_m_s: float
    seed: int
    renderer: str


def summarise(flight: Flight, wall_time: float, renderer: str) -> Summary:
    """The summary of a flight that took a wall time [s] from the first to the last frame."""
    frames, last = flight.frames, flight.frames[-1]
    half = frames[len(frames) // 2 :]
    errors = np.array([f.estimated[:3] - f.true[:3] for f in half])
    return Summary(
        arrived=flight.arrived,
        frames=len(frames),
        frames_per_second=round(len(frames) / wall_time, 2),
        simulated_time_s=last.time,
        range_true_m=round(last.true_range, 4),
        range_estimated_m=round(last.estimated_range, 4),
        range_sigma_m=round(last.range_sigma, 4),
        miss_m=round(float(flight.miss[-1]), 4),
        rms_range_error_m=round(_rms([f.estimated_range - f.true_range for f in half]), 4),
        rms_lateral_error_m=round(_rms(np.hypot(errors[:, 1], errors[:, 2]).tolist()), 4),
        rejected_frames=sum(not f.accepted for f in frames),
        delta_v_m_s=round(last.delta_v, 4),
        seed=flight.settings.seed,
        renderer=renderer,
    )


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def write_report(flight: Flight, summary: Summary, folder: Path) -> list[Path]:
    """Write table, plot, strip and summary; returns their paths."""
    paths = [folder / name for name in (TABLE, PLOT, STRIP, SUMMARY)]
    with complete_file(paths[0]) as path, path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(_row(frame) for frame in flight.frames)
    for figure, place in ((plot(flight), paths[1]), (strip(flight.pictures), paths[2])):
        with complete_file(place) as path:
            figure.savefig(path, dpi=100)
    with complete_file(paths[3]) as path:
        path.write_text(json.dumps(asdict(summary), indent=2) + "\n")
    return paths


def _row(frame: Frame) -> list[str]:
    lengths = [
        *frame.true[:3],
        *frame.estimated[:3],
        *frame.position_sigma,
        frame.true_range,
        np.nan if frame.measured_range is None else frame.measured_range,
        frame.estimated_range,
        frame.range_sigma,
    ]
    return [
        f"{frame.time:g}",
        *(f"{value:.4f}" for value in lengths),
        str(int(frame.accepted)),
        f"{frame.delta_v:.5f}",
    ]


def plot(flight: Flight) -> Figure:
    """Range, its error, the error across the line of sight and the velocity spent, over time."""
    frames = flight.frames
    time = np.array([f.time for f in frames])
    true = np.array([f.true[:3] for f in frames])
    estimated = np.array([f.estimated[:3] for f in frames])
    sigma = np.array([f.position_sigma for f in frames])
    range_true = np.array([f.true_range for f in frames])
    range_error = np.array([f.estimated_range for f in frames]) - range_true
    range_sigma = np.array([f.range_sigma for f in frames])
    measured = np.array([np.nan if f.measured_range is None else f.measured_range for f in frames])

    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    (a, b), (c, d) = figure.subplots(2, 2, sharex=True)
    a.plot(time, range_true, color="black", label="true")
    a.plot(time, range_true + range_error, "--", color="tab:orange", label="estimated")
    a.axhline(flight.settings.plan.hold, color="grey", linewidth=0.8, linestyle=":", label="hold")
    _dress(a, "range [m]", "Range between the body origins")

    b.plot(time, measured - range_true, ".", markersize=2.5, color="tab:blue", label="image alone")
    b.plot(time, range_error, color="tab:orange", label="estimate")
    _band(b, time, range_sigma)
    b.set_yscale("symlog", linthresh=0.1)
    b.set_yticks([-10, -1, -0.1, 0, 0.1, 1, 10], ["-10", "-1", "-0.1", "0", "0.1", "1", "10"])
    _dress(b, "error [m], linear within 0.1 m", "Range error, estimated - true")

    for axis, name, colour in ((1, "across track, y", "tab:green"), (2, "down, z", "tab:purple")):
        c.plot(time, estimated[:, axis] - true[:, axis], color=colour, linewidth=0.9, label=name)
    _band(c, time, sigma[:, 1:].max(axis=1))
    c.set_xlabel("time [s]")
    _dress(c, "error [m]", "Lateral error in LVLH, estimated - true")

    spent = [f.delta_v for f in frames]
    d.plot(time, spent, drawstyle="steps-post", color="tab:red", label="spent")
    d.set_xlabel("time [s]")
    _dress(d, "velocity change [m/s]", "Thrusters")
    return figure


def _band(axes: Axes, time: np.ndarray, sigma: np.ndarray) -> None:
    axes.fill_between(
        time, -3.0 * sigma, 3.0 * sigma, color="0.85", label="3 sigma of the filter", zorder=0
    )


def _dress(axes: Axes, unit: str, title: str) -> None:
    axes.set_ylabel(unit)
    axes.set_title(title)
    axes.grid(alpha=0.3)
    axes.legend(loc="best", fontsize="small")


def strip(pictures: list[Picture]) -> Figure:
    """The kept images with what the chaser found in them, four in a row."""
    columns = min(4, len(pictures))
    rows = -(-len(pictures) // columns)
    figure = Figure(figsize=(4.0 * columns, 4.25 * rows), layout="constrained")
    cells = figure.subplots(rows, columns, squeeze=False).ravel()
    figure.supxlabel(
        "green: what was found; orange: wing tips; red: the target's origin by the filter. "
        "Grey is the square root of the signal.",
        fontsize="medium",
    )
    for cell in cells:
        cell.set_axis_off()
    for cell, picture in zip(cells, pictures, strict=False):
        _show(cell, picture)
        cell.set_title(f"t = {picture.time:.0f} s, estimated {picture.estimated_range:.1f} m")
    return figure


def _show(axes: Axes, picture: Picture) -> None:
    # Square root of the signal: shot noise gets the same height everywhere, dim cells show.
    signal = picture.dn.astype(np.float64) - np.median(picture.dn)
    grey = np.sqrt(np.clip(signal, 0.0, None))
    height, width = grey.shape
    views = [axes]
    if picture.silhouette is not None:
        left, top, right, bottom = picture.silhouette.box
        size = right - left
        if size < width // 7:
            # A far target, enlarged below.
            inset = axes.inset_axes((0.61, 0.02, 0.37, 0.37))
            inset.set_xticks([])
            inset.set_yticks([])
            views.append(inset)
    for view in views:
        view.imshow(
            grey, cmap="gray", vmin=0.0, vmax=float(grey.max()), extent=(0, width, height, 0)
        )
        if picture.silhouette is not None:
            corner = (left - 2, top - 2)
            box = Rectangle(
                corner, size + 4, bottom - top + 4, fill=False, color="lime", linewidth=0.8
            )
            view.add_patch(box)
            for tip in (picture.silhouette.left_tip, picture.silhouette.right_tip):
                if tip is not None:
                    view.plot(*tip, "|", color="orange", markersize=9)
        view.plot(*picture.centre, "+", color="red", markersize=9)
    if len(views) == 2:
        middle_u, middle_v, half = 0.5 * (left + right), 0.5 * (top + bottom), 0.65 * size
        views[1].set_xlim(middle_u - half, middle_u + half)
        views[1].set_ylim(middle_v + half, middle_v - half)
        for spine in views[1].spines.values():
            spine.set_color("0.6")
