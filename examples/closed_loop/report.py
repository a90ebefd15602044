"""The results of a flight: a page, a table, plots, a strip of images and a summary."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from examples.closed_loop.criteria import criteria, docked, facts, verdict
from examples.closed_loop.loop import Flight, Frame, ReportImage
from simgl.arrays import Array
from simgl.figures.html_page import plot_source, png_source, write_html_page
from simgl.figures.style import (
    BLUE,
    GREEN,
    LINE,
    ORANGE,
    PURPLE,
    RED,
    SHADE,
    SOFT,
    figure_style,
    plain_axes,
)
from simgl.output import complete_file

PAGE = "docking.html"
TABLE = "docking.csv"
PLOT = "docking_plot.png"
STRIP = "docking_strip.png"
SUMMARY = "docking_summary.json"
TEMPLATES = Path(__file__).parent

# So many images stand in the strip.
_STRIP_IMAGES = 12

# The first image of a server traces light between surfaces, which no other one does again.
_WARM = 2


@dataclass(frozen=True, kw_only=True)
class Summary:
    """The flight in two dozen numbers.

    distance_true_m, off_axis_m, misalignment_deg : of the camera from the board at the end
    *_error_m : rms of estimate minus truth, over the final approach where there was one
    within_3_sigma : share of all errors of position that the filter's 3 sigma hold
    first_lamp_s : when the first image by lamplight was taken; None without
    delay_s : mean age of an image when flight software had it
    """

    arrived: bool
    frames: int
    simulated_time_s: float
    distance_true_m: float
    off_axis_m: float
    misalignment_deg: float
    range_error_m: float
    lateral_error_m: float
    turn_error_deg: float
    within_3_sigma: float
    rejected_fixes: int
    blind_frames: int
    sunlit_at_end: float
    first_lamp_s: float | None
    delta_v_m_s: float
    delay_s: float
    frames_per_second: float
    render_p50_ms: float
    render_p99_ms: float
    bridge_p50_ms: float
    processing_p50_ms: float
    seed: int
    renderer: str


def summarise(flight: Flight, wall_time: float, renderer: str) -> Summary:
    """The summary of a flight that took a wall time [s] from the first to the last frame."""
    frames, last = flight.frames, flight.frames[-1]
    final = [f for f in frames if f.look.pose is not None] or frames[len(frames) // 2 :]
    errors = np.array([f.error for f in final])
    every = np.array([f.error[:3] for f in frames])
    sigmas = np.array([f.sigma[:3] for f in frames])
    lit = [f.time for f in frames if f.look.light.lamp]
    warm = frames[_WARM:] or frames
    render = np.array([f.render_time for f in warm])
    bridge = np.array([f.round_trip - f.render_time for f in warm])
    return Summary(
        arrived=flight.arrived,
        frames=len(frames),
        simulated_time_s=last.time,
        distance_true_m=round(float(flight.final[0]), 4),
        off_axis_m=round(float(np.hypot(*flight.final[1:])), 4),
        misalignment_deg=round(float(np.degrees(flight.misalignment)), 3),
        range_error_m=round(_rms(errors[:, 0]), 4),
        lateral_error_m=round(_rms(np.hypot(errors[:, 1], errors[:, 2])), 4),
        turn_error_deg=round(float(np.degrees(_rms(np.linalg.norm(errors[:, 6:], axis=1)))), 3),
        within_3_sigma=round(float(np.mean(np.abs(every) < 3.0 * sigmas)), 4),
        rejected_fixes=sum(f.look.fix is not None and not f.look.accepted for f in frames),
        blind_frames=sum(f.look.fix is None for f in frames),
        sunlit_at_end=round(last.sunlit, 4),
        first_lamp_s=min(lit) if lit else None,
        delta_v_m_s=round(last.spent, 3),
        delay_s=round(float(np.mean([f.look.age for f in frames])), 3),
        frames_per_second=round(len(frames) / wall_time, 2),
        render_p50_ms=_milliseconds(render, 50),
        render_p99_ms=_milliseconds(render, 99),
        bridge_p50_ms=_milliseconds(bridge, 50),
        processing_p50_ms=_milliseconds(np.array([f.processing for f in warm]), 50),
        seed=flight.settings.seed,
        renderer=renderer,
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _milliseconds(seconds: Array, percent: float) -> float:
    return round(1e3 * float(np.percentile(seconds, percent)), 2)


def write_report(flight: Flight, summary: Summary, folder: Path) -> list[Path]:
    """Write page, table, plot, strip and summary; returns their paths."""
    paths = [folder / name for name in (PAGE, TABLE, PLOT, STRIP, SUMMARY)]
    page, table, plot_path, strip_path, summary_path = paths
    with figure_style():
        plots, images = plot(flight), strip(flight.report_images)
        for figure, place in ((plots, plot_path), (images, strip_path)):
            with complete_file(place) as path:
                figure.savefig(path, dpi=100)
    with complete_file(table) as path, path.open("w", newline="") as file:
        rows = [row(frame) for frame in flight.frames]
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    with complete_file(summary_path) as path:
        path.write_text(json.dumps(asdict(summary), indent=2) + "\n")
    content = {
        "verdict": verdict(summary),
        "docked": docked(summary),
        "criteria": criteria(summary),
        "facts": facts(summary),
        "plots": plot_source(plots),
        "strip": png_source(strip_path.read_bytes()),
    }
    write_html_page(page, "docking.html.jinja", content, folder=TEMPLATES)
    return paths


def row(frame: Frame) -> dict[str, str]:
    """A line of the table."""
    look, error, sigma = frame.look, frame.error, frame.sigma
    kind = "markers" if look.pose is not None else "wings" if look.fix is not None else ""
    columns: dict[str, object] = {
        "time_s": f"{frame.time:g}",
        "phase": frame.phase.value,
        "distance_true_m": f"{frame.distance:.4f}",
        "fix": kind,
        "accepted": int(look.accepted),
        "markers": 0 if look.pose is None else look.pose.markers,
        "reprojection_px": "" if look.pose is None else f"{look.pose.residual_px:.4f}",
        **{f"{a}_true_m": f"{v:.4f}" for a, v in zip("xyz", frame.true[:3], strict=True)},
        **{f"{a}_error_m": f"{v:.4f}" for a, v in zip("xyz", error[:3], strict=True)},
        **{f"{a}_sigma_m": f"{v:.4f}" for a, v in zip("xyz", sigma[:3], strict=True)},
        **{
            f"turn_{a}_error_deg": f"{v:.4f}"
            for a, v in zip("xyz", np.degrees(error[6:]), strict=True)
        },
        "exposure_ms": f"{look.light.exposure * 1e3:.4f}",
        "lamp": int(look.light.lamp),
        "brightness": f"{look.brightness:.4f}",
        "sunlit": f"{frame.sunlit:.4f}",
        "image_age_s": f"{look.age:g}",
        "pointing_deg": f"{np.degrees(frame.pointing):.3f}",
        "delta_v_m_s": f"{frame.spent:.4f}",
        "render_ms": f"{frame.render_time * 1e3:.1f}",
        "round_trip_ms": f"{frame.round_trip * 1e3:.1f}",
        "processing_ms": f"{frame.processing * 1e3:.1f}",
    }
    return {key: str(value) for key, value in columns.items()}


def plot(flight: Flight) -> Figure:
    """Distance, errors with 3 sigma, light and wall time, over simulated time.

    Draw it within ``figure_style``, as ``strip``.
    """
    frames = flight.frames
    time = np.array([f.time for f in frames])
    errors = np.array([f.error for f in frames])
    sigmas = np.array([f.sigma for f in frames])
    figure = Figure(figsize=(13.5, 11.0), layout="constrained")
    cells = figure.subplots(3, 2, sharex=True).ravel()

    cells[0].plot(time, [f.distance for f in frames], color=BLUE, label="true")
    cells[0].axhline(
        flight.settings.plan.near.distance, color=SOFT, linewidth=0.8, linestyle=":",
        label="docking range",
    )  # fmt: skip
    cells[0].set_yscale("log")
    _dress(cells[0], "distance [m]", "Camera to board", frames)

    for axis, colour, name in zip(
        range(3), (BLUE, RED, GREEN), ("along track, x", "y", "z"),
        strict=True,
    ):  # fmt: skip
        cells[1 if axis == 0 else 2].plot(time, errors[:, axis], color=colour, label=name)
    for cell, wide in ((cells[1], sigmas[:, 0]), (cells[2], sigmas[:, 1:3].max(axis=1))):
        _band(cell, time, wide)
        cell.set_yscale("symlog", linthresh=0.01)
    _dress(cells[1], "error [m], linear within 1 cm", "Position along the approach", frames)
    _dress(cells[2], "error [m], linear within 1 cm", "Position across", frames)

    for axis, name in enumerate("xyz"):
        cells[3].plot(time, np.degrees(errors[:, 6 + axis]), label=f"about {name}")
    _band(cells[3], time, np.degrees(sigmas[:, 6:].max(axis=1)))
    _dress(cells[3], "error [deg]", "The target's attitude", frames)

    cells[4].plot(time, [f.look.light.exposure * 1e3 for f in frames], ".-", label="exposure [ms]")
    cells[4].plot(
        time,
        [max(f.sunlit, 1e-4) for f in frames],
        color=ORANGE,
        label="sunlight on the target [1]",
    )
    cells[4].set_yscale("log")
    cells[4].set_xlabel("time [s]")
    _dress(
        cells[4], "exposure [ms], sunlight [1]", "Exposure set by the images, and sunlight", frames
    )

    for values, name in (
        ([f.render_time for f in frames[_WARM:]], "rendering"),
        ([f.round_trip - f.render_time for f in frames[_WARM:]], "bridge"),
        ([f.processing for f in frames[_WARM:]], "image processing and filter"),
    ):
        cells[5].plot(time[_WARM:], np.array(values) * 1e3, label=name)
    cells[5].set_yscale("log")
    cells[5].set_xlabel("time [s]")
    _dress(cells[5], "wall time [ms]", "Each frame", frames)
    return figure


def _band(axes: Axes, time: Array, sigma: Array) -> None:
    axes.fill_between(
        time, -3.0 * sigma, 3.0 * sigma, color=LINE, label="3 sigma of the filter", zorder=0
    )


def _dress(axes: Axes, unit: str, title: str, frames: Sequence[Frame]) -> None:
    dark = [f.time for f in frames if f.sunlit < 0.5]
    if dark:
        axes.axvspan(dark[0], frames[-1].time, color=SHADE, linewidth=0, zorder=-1)
    for before, after in pairwise(frames):
        if before.phase is not after.phase:
            axes.axvline(after.time, color=PURPLE, linewidth=0.9, linestyle="--")
    axes.set_ylabel(unit)
    axes.set_title(title)
    axes.legend(loc="best", fontsize="small")


def strip(report_images: Sequence[ReportImage]) -> Figure:
    """A dozen of the kept images with what the chaser found in them, four in a row."""
    count = min(_STRIP_IMAGES, len(report_images))
    places = np.linspace(0, len(report_images) - 1, count).round().astype(int)
    report_images = [report_images[place] for place in places]
    columns = min(4, len(report_images))
    rows = -(-len(report_images) // columns)
    figure = Figure(figsize=(4.0 * columns, 4.4 * rows), layout="constrained")
    cells = figure.subplots(rows, columns, squeeze=False).ravel()
    for cell in cells:
        plain_axes(cell)
    for cell, report_image in zip(cells, report_images, strict=False):
        show(cell, report_image)
        cell.set_title(caption(report_image.frame), fontsize=11)
    return figure


def caption(frame: Frame) -> str:
    """Time, distance and light of an image in a line."""
    light = f"{frame.look.light.exposure * 1e3:.3g} ms" + (
        ", lamp" if frame.look.light.lamp else ""
    )
    return f"t = {frame.time:.0f} s, {frame.distance:.2f} m, {light}"


def show(axes: Axes, report_image: ReportImage) -> None:
    """Draw an image and what the chaser found in it."""
    look = report_image.frame.look
    # Square root of the signal: shot noise gets the same height everywhere, dim cells show.
    dark = float(np.percentile(report_image.dn, 2.0))
    grey = np.sqrt(np.clip(report_image.dn.astype(np.float64) - dark, 0.0, None))
    height, width = grey.shape
    views = [axes]
    silhouette = look.silhouette if look.sighting is None else None
    if silhouette is not None and silhouette.box[2] - silhouette.box[0] < width // 5:
        # A far target, enlarged below.
        inset = axes.inset_axes((0.58, 0.02, 0.4, 0.4))
        plain_axes(inset)
        inset.spines[:].set_visible(True)
        views.append(inset)
    for view in views:
        view.imshow(
            grey, cmap="gray", vmin=0.0, vmax=float(grey.max()), extent=(0, width, height, 0)
        )
        if look.sighting is not None:
            u, v = look.sighting.points.T
            view.plot(u, v, "+", color="red", markersize=5, linewidth=0.7)
        elif silhouette is not None:
            left, top, right, bottom = silhouette.box
            corner, size = (left - 2, top - 2), right - left
            box = Rectangle(
                corner, size + 4, bottom - top + 4, fill=False, color="lime", linewidth=0.8
            )
            view.add_patch(box)
            for tip in (silhouette.left_tip, silhouette.right_tip):
                if tip is not None:
                    view.plot(*tip, "|", color="orange", markersize=9)
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    if len(views) == 2 and silhouette is not None:
        left, top, right, bottom = silhouette.box
        middle_u, middle_v, half = 0.5 * (left + right), 0.5 * (top + bottom), 0.65 * (right - left)
        views[1].set_xlim(middle_u - half, middle_u + half)
        views[1].set_ylim(middle_v + half, middle_v - half)
        for spine in views[1].spines.values():
            spine.set_color("0.6")
