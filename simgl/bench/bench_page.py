"""Results of the benchmark as one HTML page: tables, and plots beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simgl.bench.comparison import Change
from simgl.bench.goals import Goal, factor_spread, machine_factor, times_slower
from simgl.bench.results import Results, SceneResult
from simgl.figures.html_page import plot_source, write_html_page
from simgl.figures.style import BLUE, ORANGE, PALE, RED, SKY, figure_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Passes that share a colour as "other": together the smallest ones of all scenes.
_NAMED_PASSES = 9
_BAR_INCHES = 0.42
_WIDTH_INCHES = 10.4


def write_bench_page(
    path: Path, results: Results, goals: Sequence[Goal], changes: Sequence[Change], note: str
) -> Path:
    """Write the page; its path.

    changes : to a baseline, empty without one
    note : of a baseline from another machine
    """
    with figure_style():
        frames = plot_source(_frames_plot(results.scenes)) if results.scenes else ""
        passes = plot_source(_passes_plot(results.scenes)) if _timed(results) else ""
        peers = plot_source(_peers_plot(results)) if results.peers else ""
    content = {
        "results": results,
        "goals": goals,
        "any_goal": any(goal.value is not None for goal in goals),
        "f": machine_factor(results),
        "f_spread": factor_spread(results),
        "changes": changes,
        "note": note,
        "frames_plot": frames,
        "passes_plot": passes,
        "peers_plot": peers,
        "times_slower": {peer.name: times_slower(results, peer.name) for peer in results.peers},
    }
    write_html_page(path, "bench_report.html.jinja", content)
    return path


def _timed(results: Results) -> list[SceneResult]:
    return [scene for scene in results.scenes if scene.passes_ms]


def _label(scene: SceneResult) -> str:
    return f"{scene.name}, {scene.step_s:g} s{', bridge' if scene.through_bridge else ''}"


def _figure(bars: int) -> tuple[Figure, Axes]:
    """A panel of horizontal bars, the first one on top."""
    from matplotlib.figure import Figure

    size = (_WIDTH_INCHES, 1.1 + _BAR_INCHES * bars)
    figure = Figure(figsize=size, layout="constrained")
    panel = figure.subplots()
    panel.invert_yaxis()
    panel.grid(axis="x", alpha=0.3)
    panel.set_axisbelow(True)
    return figure, panel


def _frames_plot(scenes: Sequence[SceneResult]) -> Figure:
    """A bar to the median of each scene, a line from it to p99, a point at the worst."""
    figure, panel = _figure(len(scenes))
    rows = np.arange(len(scenes))
    p50, p99, worst = (
        np.array([getattr(scene.frame_ms, name) for scene in scenes])
        for name in ("p50", "p99", "worst")
    )
    colours = [SKY if scene.through_bridge else BLUE for scene in scenes]
    panel.barh(rows, p50, color=colours, height=0.7, label="p50")
    panel.hlines(rows, p50, p99, color=ORANGE, linewidth=2.5, label="p50 to p99")
    panel.plot(worst, rows, ".", color=RED, label="worst")
    panel.set_yticks(rows, [_label(scene) for scene in scenes])
    # From a tenth of the fastest, so that its bar has a length.
    panel.set(xscale="log", xlabel="frame time [ms]", xlim=(0.3 * p50.min(), 1.3 * worst.max()))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_formatter("")
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _passes_plot(scenes: Sequence[SceneResult]) -> Figure:
    """The passes of each scene, stacked, as shares of their sum."""
    timed = [scene for scene in scenes if scene.passes_ms]
    figure, panel = _figure(len(timed))
    rows = np.arange(len(timed))
    sums = np.array([max(sum(scene.passes_ms.values()), 1e-9) for scene in timed])
    names = dict.fromkeys(name for scene in timed for name in scene.passes_ms)
    shares = {name: np.array([s.passes_ms.get(name, 0.0) for s in timed]) / sums for name in names}
    largest = sorted(shares, key=lambda name: -float(shares[name].max()))[:_NAMED_PASSES]
    left = np.zeros(len(timed))
    for number, name in enumerate(name for name in names if name in largest):
        share = 100.0 * shares[name]
        panel.barh(rows, share, left=left, height=0.7, color=f"C{number}", label=name)
        left += share
    panel.barh(rows, 100.0 - left, left=left, height=0.7, color=PALE, label="other")
    panel.set_yticks(
        rows, [f"{_label(s)}: {total:.0f} ms" for s, total in zip(timed, sums, strict=True)]
    )
    panel.set(xlabel="share of the time in passes [%]", xlim=(0.0, 100.0))
    figure.legend(loc="outside lower center", ncols=5, fontsize=8)
    return figure


def _peers_plot(results: Results) -> Figure:
    """A frame of each renderer, and simgl's of source_600."""
    simgl = results.scene("source_600", 0.1)
    bars = {f"{p.name}, {p.width} x {p.height}": 1e3 * p.seconds for p in results.peers}
    if simgl is not None:
        bars = {"simgl, source_600": simgl.frame_ms.p50} | bars
    figure, panel = _figure(len(bars))
    rows = np.arange(len(bars))
    values = np.array(list(bars.values()))
    colours = [BLUE if name.startswith("simgl") else PALE for name in bars]
    panel.barh(rows, values, color=colours, height=0.7)
    panel.set_yticks(rows, list(bars))
    panel.set(xscale="log", xlabel="frame time [ms]", xlim=(0.3 * values.min(), 2.0 * values.max()))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_formatter("")
    return figure
