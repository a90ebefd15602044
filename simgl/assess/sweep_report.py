"""The page of a sweep: heat maps of verdicts, usable share and signal over noise."""

from __future__ import annotations

import html
import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize

from simgl.arrays import Array, Mask
from simgl.assess.html_page import COLOURS, inline, write_page
from simgl.assess.sweep import Row, Sweep, swept
from simgl.assess.sweep_axes import CAMERA_AXES, SUN_AXES, Axis
from simgl.assess.verdict import Verdict
from simgl.physics.ephemeris import utc_from_tai_ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Sheets of heat maps that a page shows, one for each combination of all axes but two.
_MOST_SHEETS = 24
# Settings that the summary lists.
_LISTED = 5
# Numbers along an axis and in cells that can still be read.
_MOST_LABELS, _MOST_CELLS = 12, 12
_WORDS = {
    "phase_angle_deg": "phase angle [deg]",
    "sun_clock_deg": "Sun clockwise from the top [deg]",
    "exposure_time_s": "exposure [s]",
    "f_number": "f-number",
}


def write_sweep_report(path: Path, sweep: Sweep, rows: Sequence[Row]) -> None:
    """One HTML file that needs no other."""
    work = sweep.work
    sections = [_head(sweep, rows), _summary(sweep, rows), _sheets(sweep, rows)]
    write_page(path, f"{work.scenario.name}: light on {work.target}, swept", sections)


def _head(sweep: Sweep, rows: Sequence[Row]) -> str:
    work = sweep.work
    camera = work.scenario.cameras[work.camera]
    d = camera.detector
    (tai_ns,) = work.epochs
    first = rows[0]
    facts = {
        "Epoch": f"{utc_from_tai_ns(tai_ns)} UTC",
        "Camera": f"{work.camera}: {d.width} x {d.height}, {1e3 * camera.lens.focal_length:g} mm, "
        f"f/{camera.lens.f_number:g}, {camera.exposure_time:g} s where not swept",
        "Target": f"{work.target}, {float(first['range_m'] or 0.0):.1f} m away, "
        f"{first['target_pixels']} pixels, behind it {first['backdrop']}",
        "Swept": "; ".join(
            f"{_WORDS[axis.name]} {', '.join(f'{v:.3g}' for v in axis.values)}"
            for axis in sweep.axes
        ),
        "Scenario": str(work.scenario.source or work.scenario.name),
    }
    body = "".join(f"<tr><th>{k}</th><td>{html.escape(v)}</td></tr>" for k, v in facts.items())
    return f"<h1>Light on {html.escape(work.target)}, swept</h1>\n<table>{body}</table>"


def _summary(sweep: Sweep, rows: Sequence[Row]) -> str:
    counts = Counter(str(row["verdict"]) for row in rows)
    shares = "".join(
        f'<tr><td><span class="key" style="background:{COLOURS[v]}"></span>{v.value}</td>'
        f'<td class="n">{100.0 * counts[v.value] / len(rows):.1f} %</td></tr>'
        for v in Verdict
    )
    parts = [f"<h2>Verdict</h2>\n<table>{shares}</table>"]
    camera = [axis for axis in sweep.axes if axis.name in CAMERA_AXES]
    if camera and len(camera) < len(sweep.axes):
        parts.append(_settings(sweep, camera, rows))
    return "\n".join(parts)


def _settings(sweep: Sweep, axes: Sequence[Axis], rows: Sequence[Row]) -> str:
    """The settings that are good for the most directions of the Sun, the best signal first."""
    by_setting: dict[tuple[float, ...], list[Row]] = {}
    for row in rows:
        by_setting.setdefault(tuple(swept(row, axis) for axis in axes), []).append(row)

    def worth(setting: tuple[float, ...]) -> tuple[float, float]:
        own = by_setting[setting]
        good = sum(row["verdict"] == Verdict.GOOD.value for row in own)
        return good, float(np.median([float(row["median_snr"] or 0.0) for row in own]))

    best = sorted(by_setting, key=worth, reverse=True)[:_LISTED]
    if worth(best[0])[0] == 0:
        return "<p>No setting is good for any direction of the Sun.</p>"
    titles = "".join(f"<th>{_WORDS[axis.name]}</th>" for axis in axes)
    body = "".join(
        "<tr>"
        + "".join(f'<td class="n">{value:.3g}</td>' for value in setting)
        + f'<td class="n">{worth(setting)[0]:.0f} of {len(sweep.lights)}</td>'
        + f'<td class="n">{worth(setting)[1]:.0f}</td></tr>'
        for setting in best
    )
    return (
        "<p>Settings that are good for the most directions of the Sun</p>\n"
        f"<table><tr>{titles}<th>good</th><th>median signal over noise</th></tr>{body}</table>"
    )


def _sheets(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Heat maps over two axes, a sheet for each combination of the others."""
    across, down, others = _layout(sweep.axes)
    parts = ["<h2>Over the axes</h2>"]
    combinations = list(itertools.product(*(axis.values for axis in others)))
    for values in combinations[:_MOST_SHEETS]:
        own = [
            row
            for row in rows
            if all(swept(row, axis) == v for axis, v in zip(others, values, strict=True))
        ]
        title = ", ".join(
            f"{_WORDS[axis.name]} {value:.3g}" for axis, value in zip(others, values, strict=True)
        )
        if title:
            parts.append(f"<p>{html.escape(title)}</p>")
        parts.append(inline(_sheet(across, down, own)))
    left = len(combinations) - _MOST_SHEETS
    if left > 0:
        parts.append(f"<p>{left} more combinations are in the table, frames.csv.</p>")
    return "\n".join(parts)


def _layout(axes: Sequence[Axis]) -> tuple[Axis, Axis | None, list[Axis]]:
    """The axis across, the one down, and the rest: a direction of the Sun down where there is one,
    the longest axes drawn."""
    if len(axes) == 1:
        return axes[0], None, []
    ranked = sorted(axes, key=lambda axis: -len(axis.values))
    chosen = [axis for axis in axes if axis in ranked[:2]]
    sun = [axis for axis in chosen if axis.name in SUN_AXES]
    down = sun[0] if sun else chosen[0]
    (across,) = [axis for axis in chosen if axis is not down]
    return across, down, [axis for axis in axes if axis not in chosen]


def _sheet(across: Axis, down: Axis | None, rows: Sequence[Row]) -> Figure:
    from matplotlib.figure import Figure

    shape = (1 if down is None else len(down.values), len(across.values))
    cells: dict[tuple[int, int], Mapping[str, object]] = {}
    for row in rows:
        j = 0 if down is None else down.values.index(swept(row, down))
        cells[j, across.values.index(swept(row, across))] = row
    verdicts = list(Verdict)

    def grid(name: str) -> Array:
        return np.array(
            [
                [float(cells[j, i][name] or 0.0) for i in range(shape[1])]  # type: ignore[arg-type]
                for j in range(shape[0])
            ]
        )

    judged = np.array(
        [
            [verdicts.index(Verdict(str(cells[j, i]["verdict"]))) for i in range(shape[1])]
            for j in range(shape[0])
        ]
    )
    figure = Figure(figsize=(10.4, 1.7 + 0.42 * max(shape[0], 3)), layout="constrained")
    one, two, three = figure.subplots(1, 3, sharey=True)
    colours = ListedColormap([COLOURS[v] for v in verdicts])
    drawn = one.imshow(
        judged,
        aspect="auto",
        cmap=colours,
        norm=BoundaryNorm(np.arange(len(verdicts) + 1) - 0.5, len(verdicts)),
    )
    bar = figure.colorbar(drawn, ax=one, location="bottom", ticks=range(len(verdicts)))
    bar.ax.set_xticklabels([v.value.replace(" with", "\nwith") for v in verdicts], fontsize=6)
    one.set_title("verdict", fontsize=10)
    usable = 100.0 * grid("usable")
    drawn = two.imshow(usable, aspect="auto", cmap="gray", norm=Normalize(0.0, 100.0))
    figure.colorbar(drawn, ax=two, location="bottom", label="target pixels [%]")
    two.set_title("usable", fontsize=10)
    _numbers(two, usable, usable > 50.0)
    signal = np.maximum(grid("median_snr"), 1.0)
    top = max(float(signal.max()), 10.0)
    drawn = three.imshow(signal, aspect="auto", cmap="gray", norm=LogNorm(1.0, top))
    figure.colorbar(drawn, ax=three, location="bottom", label="median over the target")
    three.set_title("signal over noise", fontsize=10)
    _numbers(three, signal, signal > top**0.5)
    for plot in (one, two, three):
        _ticks(plot, across, down)
    return figure


def _numbers(plot: Axes, values: Array, bright: Mask) -> None:
    """The values in their cells, where there is room for them."""
    if values.shape[1] > _MOST_CELLS:
        return
    for (j, i), value in np.ndenumerate(values):
        colour = "black" if bright[j, i] else "white"
        plot.text(i, j, f"{value:.0f}", ha="center", va="center", fontsize=6.5, color=colour)


def _ticks(plot: Axes, across: Axis, down: Axis | None) -> None:
    def labelled(axis: Axis) -> list[int]:
        step = -(-len(axis.values) // _MOST_LABELS)
        return list(range(0, len(axis.values), step))

    places = labelled(across)
    texts = [f"{across.values[i]:.3g}" for i in places]
    plot.set_xticks(places, texts, fontsize=7, rotation=45 if len(places) > 5 else 0)
    plot.set_xlabel(_WORDS[across.name], fontsize=8)
    if down is None:
        plot.set_yticks([])
        return
    places = labelled(down)
    plot.set_yticks(places, [f"{down.values[i]:.3g}" for i in places], fontsize=7)
    if plot.get_subplotspec() is not None and plot.get_subplotspec().is_first_col():  # type: ignore[union-attr]
        plot.set_ylabel(_WORDS[down.name], fontsize=8)
