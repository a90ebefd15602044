"""The page of a sweep: heat maps of verdicts, usable share and signal over noise."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simgl.arrays import Array, Mask
from simgl.assess.assessment_page import COLOURS, write_page
from simgl.assess.sweep import Sweep, swept
from simgl.assess.sweep_axes import CAMERA_AXES, SUN_AXES, Axis
from simgl.assess.verdict import Verdict
from simgl.figures.html_page import plot_source
from simgl.figures.style import figure_style
from simgl.sequence.journal import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Heat maps that a page shows, one for each combination of all axes but two.
_MAX_HEAT_MAPS = 24
# Settings that the summary lists.
_LISTED = 5
# Numbers along an axis and in cells that can still be read.
_MAX_LABELS, _MAX_CELLS = 12, 12
_TITLES = {
    "phase_angle_deg": "phase angle [deg]",
    "sun_clock_deg": "Sun clockwise from the top [deg]",
    "exposure_time_s": "exposure [s]",
    "f_number": "f-number",
}


@dataclass(frozen=True, kw_only=True)
class RatedSetting:
    """A setting of the camera, and how many directions of the Sun it is good for."""

    values: tuple[float, ...]
    good: int
    median_snr: float


def write_sweep_report(path: Path, sweep: Sweep, rows: Sequence[Row]) -> None:
    """One HTML file that needs no other."""
    counts = Counter(str(row["verdict"]) for row in rows)
    camera_axes = [axis for axis in sweep.axes if axis.name in CAMERA_AXES]
    has_sun_axes = len(camera_axes) < len(sweep.axes)
    across, down, others = _layout(sweep.axes)
    combinations = list(itertools.product(*(axis.values for axis in others)))
    write_page(
        path,
        "sweep_report.html.jinja",
        sweep.work,
        rows=rows,
        swept="; ".join(
            f"{_TITLES[axis.name]} {', '.join(f'{v:.3g}' for v in axis.values)}"
            for axis in sweep.axes
        ),
        shares={verdict: counts[verdict.value] / len(rows) for verdict in Verdict},
        setting_titles=[_TITLES[axis.name] for axis in camera_axes],
        best_settings=best_settings(camera_axes, rows) if camera_axes and has_sun_axes else [],
        sun_directions=len(sweep.sun_directions),
        heat_maps=list(_heat_maps(across, down, others, combinations[:_MAX_HEAT_MAPS], rows)),
        omitted=len(combinations) - _MAX_HEAT_MAPS,
    )


def best_settings(axes: Sequence[Axis], rows: Sequence[Row]) -> list[RatedSetting]:
    """The settings that are good for the most directions of the Sun, the best signal first."""
    by_setting: dict[tuple[float, ...], list[Row]] = {}
    for row in rows:
        by_setting.setdefault(tuple(swept(row, axis) for axis in axes), []).append(row)
    rated = [
        RatedSetting(
            values=values,
            good=sum(row["verdict"] == Verdict.GOOD.value for row in of_setting),
            median_snr=float(np.median([float(row["median_snr"] or 0.0) for row in of_setting])),
        )
        for values, of_setting in by_setting.items()
    ]
    return sorted(rated, key=lambda one: (one.good, one.median_snr), reverse=True)[:_LISTED]


def _heat_maps(
    across: Axis,
    down: Axis | None,
    others: Sequence[Axis],
    combinations: Sequence[tuple[float, ...]],
    rows: Sequence[Row],
) -> Iterator[tuple[str, str]]:
    """Title and plot, as SVG, over two axes for each combination of the others."""
    for combination in combinations:
        fixed = list(zip(others, combination, strict=True))
        of_map = [row for row in rows if all(swept(row, axis) == value for axis, value in fixed)]
        title = ", ".join(f"{_TITLES[axis.name]} {value:.3g}" for axis, value in fixed)
        with figure_style():
            plot = plot_source(_heat_map(across, down, of_map))
        yield title, plot


def _layout(axes: Sequence[Axis]) -> tuple[Axis, Axis | None, list[Axis]]:
    """The axis across, the one down, and the rest.

    The two longest are drawn, a direction of the Sun down where there is one.
    """
    if len(axes) == 1:
        return axes[0], None, []
    ranked = sorted(axes, key=lambda axis: -len(axis.values))
    chosen = [axis for axis in axes if axis in ranked[:2]]
    sun = [axis for axis in chosen if axis.name in SUN_AXES]
    down = sun[0] if sun else chosen[0]
    (across,) = [axis for axis in chosen if axis is not down]
    return across, down, [axis for axis in axes if axis not in chosen]


def _heat_map(across: Axis, down: Axis | None, rows: Sequence[Row]) -> Figure:
    from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
    from matplotlib.figure import Figure

    height, width = (1 if down is None else len(down.values), len(across.values))
    cells: dict[tuple[int, int], Row] = {}
    for row in rows:
        j = 0 if down is None else down.values.index(swept(row, down))
        cells[j, across.values.index(swept(row, across))] = row

    def grid(name: str) -> Array:
        values = [float(cells[j, i][name] or 0.0) for j in range(height) for i in range(width)]
        return np.array(values).reshape(height, width)

    kinds = list(Verdict)
    verdicts = [
        [kinds.index(Verdict(str(cells[j, i]["verdict"]))) for i in range(width)]
        for j in range(height)
    ]
    figure = Figure(figsize=(10.4, 1.7 + 0.42 * max(height, 3)), layout="constrained")
    left, middle, right = figure.subplots(1, 3, sharey=True)
    drawn = left.imshow(
        verdicts,
        aspect="auto",
        cmap=ListedColormap([COLOURS[kind] for kind in kinds]),
        norm=BoundaryNorm(np.arange(len(kinds) + 1) - 0.5, len(kinds)),
    )
    bar = figure.colorbar(drawn, ax=left, location="bottom", ticks=range(len(kinds)))
    bar.ax.set_xticklabels([kind.value.replace(" with", "\nwith") for kind in kinds], fontsize=6)
    left.set_title("verdict", fontsize=10)
    left.grid(False)
    usable, signal = 100.0 * grid("usable"), np.maximum(grid("median_snr"), 1.0)
    top = max(float(signal.max()), 10.0)
    for panel, title, label, values, norm, middle_value in (
        (middle, "usable", "target pixels [%]", usable, Normalize(0.0, 100.0), 50.0),
        (right, "signal over noise", "median over the target", signal, LogNorm(1.0, top), top**0.5),
    ):
        drawn = panel.imshow(values, aspect="auto", norm=norm)
        figure.colorbar(drawn, ax=panel, location="bottom", label=label)
        panel.set_title(title, fontsize=10)
        panel.grid(False)
        _numbers(panel, values, values > middle_value)
    for panel in (left, middle, right):
        _ticks(panel, across, down)
    left.set_ylabel("" if down is None else _TITLES[down.name], fontsize=8)
    return figure


def _numbers(plot: Axes, values: Array, bright: Mask) -> None:
    """Write the values into their cells where there is room."""
    if values.shape[1] > _MAX_CELLS:
        return
    for (j, i), value in np.ndenumerate(values):
        colour = "black" if bright[j, i] else "white"
        plot.text(i, j, f"{value:.0f}", ha="center", va="center", fontsize=6.5, color=colour)


def _ticks(plot: Axes, across: Axis, down: Axis | None) -> None:
    def labelled(axis: Axis) -> list[int]:
        step = -(-len(axis.values) // _MAX_LABELS)
        return list(range(0, len(axis.values), step))

    places = labelled(across)
    texts = [f"{across.values[i]:.3g}" for i in places]
    plot.set_xticks(places, texts, fontsize=7, rotation=45 if len(places) > 5 else 0)
    plot.set_xlabel(_TITLES[across.name], fontsize=8)
    if down is None:
        plot.set_yticks([])
        return
    places = labelled(down)
    plot.set_yticks(places, [f"{down.values[i]:.3g}" for i in places], fontsize=7)
