"""The assessment of a trajectory as one self-contained page: numbers, timeline, pictures, maps."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LogNorm

from simgl.assess.course import Course, Window
from simgl.assess.criteria import Verdict
from simgl.assess.page import COLOURS, image, inline, write_page
from simgl.assess.run import PRODUCTS, Assignment
from simgl.images import display_from_radiance, display_gain, png_bytes
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.sequence.journal import Value
from simgl.simulator import Exposure, Simulator

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """An epoch that the page shows: why, and its row."""

    title: str
    row: dict[str, Value]


def write_report(
    path: Path,
    work: Assignment,
    rows: Sequence[dict[str, Value]],
    found: Course,
    simulator: Simulator,
) -> None:
    """One HTML file that needs no other."""
    sections = [
        _head(work, rows),
        _summary(found),
        _timeline(rows, found),
        _pictures(work, _chosen(rows), simulator),
        _criteria(work),
    ]
    write_page(path, f"{work.scenario.name}: light on {work.target}", sections)


def _head(work: Assignment, rows: Sequence[dict[str, Value]]) -> str:
    camera = work.scenario.cameras[work.camera]
    d = camera.detector
    facts = {
        "Span": f"{rows[0]['utc']} to {rows[-1]['utc']} UTC, {len(rows)} epochs",
        "Camera": f"{work.camera}: {d.width} x {d.height}, {1e3 * camera.lens.focal_length:g} mm, "
        f"f/{camera.lens.f_number:g}, {camera.exposure_time:g} s",
        "Target": work.target,
        "Scenario": str(work.scenario.source or work.scenario.name),
    }
    body = "".join(f"<tr><th>{k}</th><td>{html.escape(v)}</td></tr>" for k, v in facts.items())
    return f"<h1>Light on {html.escape(work.target)}</h1>\n<table>{body}</table>"


def _summary(found: Course) -> str:
    shares = "".join(
        f'<tr><td><span class="key" style="background:{COLOURS[v]}"></span>{v.value}</td>'
        f'<td class="n">{100.0 * share:.1f} %</td></tr>'
        for v, share in found.shares.items()
    )
    best = "".join(
        f'<tr><td>{utc_from_tai_ns(w.start_ns)}</td><td class="n">{w.duration:.0f} s</td>'
        f'<td class="n">{w.epochs} epochs</td></tr>'
        for w in found.best
    )
    parts = [f"<h2>Verdict</h2>\n<table>{shares}</table>"]
    if best:
        parts.append(f"<p>Longest good stretches, from</p><table>{best}</table>")
    else:
        parts.append("<p>No epoch is good.</p>")
    if found.worst is not None:
        parts.append(
            f"<p>Worst epoch in view: {utc_from_tai_ns(found.worst.tai_ns)}, "
            f"{100.0 * found.worst.usable:.0f} % of the target usable.</p>"
        )
    if found.advice:
        items = "".join(f"<li>{html.escape(text)}</li>" for text in found.advice)
        parts.append(f"<p>What would help</p><ul>{items}</ul>")
    return "\n".join(parts)


def _strip(windows: Sequence[Window], rows: Sequence[dict[str, Value]]) -> str:
    """A bar along time, a colour for each verdict."""
    cells = "".join(
        f'<div style="flex:{w.epochs};background:{COLOURS[w.verdict]}" '
        f'title="{utc_from_tai_ns(w.start_ns)}: {w.verdict.value}"></div>'
        for w in windows
    )
    ends = f"<figcaption>{rows[0]['utc']} to {rows[-1]['utc']} UTC</figcaption>"
    return f'<figure><div class="strip">{cells}</div>{ends}</figure>'


def _column(
    rows: Sequence[dict[str, Value]], name: str
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([np.nan if row[name] is None else float(row[name] or 0.0) for row in rows])


def _timeline(rows: Sequence[dict[str, Value]], found: Course) -> str:
    from matplotlib.figure import Figure

    minutes = (_column(rows, "tai_ns") - float(rows[0]["tai_ns"] or 0)) / 60e9
    figure = Figure(figsize=(10.4, 8.2), layout="constrained")
    axes = figure.subplots(5, 1, sharex=True)
    axes[0].plot(minutes, _column(rows, "phase_angle_deg"), color="#1f5fa8")
    axes[0].set_ylabel("phase angle [deg]")
    axes[1].plot(minutes, 100.0 * _column(rows, "sunlight"), color="#d08700")
    axes[1].set_ylabel("sunlight [%]")
    shares = [100.0 * _column(rows, name) for name in ("usable", "dark", "saturated")]
    kinds = (Verdict.GOOD, Verdict.TOO_DARK, Verdict.TOO_BRIGHT)
    axes[2].stackplot(
        minutes,
        shares,
        labels=["usable", "dark", "saturated"],
        colors=[COLOURS[kind] for kind in kinds],
    )
    axes[2].set_ylabel("target pixels [%]")
    axes[2].legend(loc="lower left", ncols=3, fontsize=8)
    signal = np.maximum(_column(rows, "median_snr"), 0.1)
    axes[3].semilogy(minutes, signal, color="#2e8b57")
    axes[3].set_ylabel("signal over noise")
    axes[4].plot(minutes, _column(rows, "contrast"), color="#8e5ea2")
    axes[4].set_ylabel("contrast")
    axes[4].set_ylim(-0.02, 1.02)
    axes[4].set_xlabel("minutes")
    for one in axes:
        one.grid(alpha=0.3)
        one.margins(x=0.0)
    return "<h2>Along the trajectory</h2>\n" + _strip(found.windows, rows) + inline(figure)


def _chosen(rows: Sequence[dict[str, Value]]) -> list[Chosen]:
    """The best epoch, the worst in view, and the middle one of each other verdict."""
    seen = [row for row in rows if row["verdict"] != Verdict.NOT_IN_VIEW.value]
    if not seen:
        return []

    def worth(row: dict[str, Value]) -> tuple[float, float]:
        return float(row["usable"] or 0.0), float(row["median_snr"] or 0.0)

    chosen = [Chosen(title="best", row=max(seen, key=worth))]
    chosen.append(Chosen(title="worst", row=min(seen, key=worth)))
    for kind in (Verdict.TOO_BRIGHT, Verdict.TOO_DARK, Verdict.CONFUSED, Verdict.GOOD):
        of_kind = [row for row in seen if row["verdict"] == kind.value]
        if of_kind:
            chosen.append(Chosen(title=kind.value, row=of_kind[len(of_kind) // 2]))
    taken: dict[Value, Chosen] = {}
    for one in chosen:
        taken.setdefault(one.row["frame"], one)
    return list(taken.values())


def _pictures(work: Assignment, chosen: Sequence[Chosen], simulator: Simulator) -> str:
    parts = ["<h2>Pictures</h2>"]
    for one in chosen:
        tai_ns = int(one.row["tai_ns"] or 0)
        exposure = simulator.capture(work.scenario.at(tai_ns), work.camera, PRODUCTS)
        parts.append(_picture(one, exposure))
    if len(parts) == 1:
        parts.append("<p>The target is never in view.</p>")
    return "\n".join(parts)


def _picture(one: Chosen, exposure: Exposure) -> str:
    assert exposure.radiance is not None
    assert exposure.electrons is not None
    radiance = exposure.radiance.radiance
    gain = display_gain(radiance)
    view = png_bytes(display_from_radiance(radiance, gain))
    row = one.row
    text = (
        f"{one.title}: {row['utc']} UTC, {row['verdict']}"
        + (f" ({row['reasons']})" if row["reasons"] else "")
        + f". Range {row['range_m']:.1f} m, phase {row['phase_angle_deg']:.0f} deg, sunlight "
        f"{100.0 * float(row['sunlight'] or 0.0):.0f} %, behind it {row['backdrop']}. Relative "
        f"flux {float(row['relative_flux_w_m2'] or 0.0):.3g} W/m2 (source study's definition), "
        f"median {float(row['median_electrons'] or 0.0):.4g} e-."
    )
    shown = (
        f"shown with {gain:g} times the light" if gain != 1.0 else "a sunlit white plate is white"
    )
    return (
        f'<p>{html.escape(text)}</p>\n<div class="pictures">'
        f"<figure>{image(view)}<figcaption>Picture, {shown}</figcaption></figure>"
        f"<figure>{inline(_electron_map(exposure))}"
        "<figcaption>Mean electrons; the top of the scale is a full pixel</figcaption></figure>"
        "</div>"
    )


def _electron_map(exposure: Exposure) -> Figure:
    from matplotlib.figure import Figure

    assert exposure.electrons is not None
    electrons = exposure.electrons.electrons
    detector = exposure.info.camera.detector
    figure = Figure(
        figsize=(5.2, 5.2 * electrons.shape[0] / electrons.shape[1]), layout="constrained"
    )
    axes = figure.subplots()
    scale = LogNorm(vmin=1.0, vmax=detector.full_well)
    drawn = axes.imshow(np.maximum(electrons, 1.0), cmap="gray", norm=scale)
    axes.set_axis_off()
    figure.colorbar(drawn, ax=axes, label="e-", shrink=0.85)
    return figure


def _criteria(work: Assignment) -> str:
    limits = work.limits
    lines = {
        "pixels of the target": f"at least {limits.least_pixels}",
        "saturated": f"at most {100.0 * limits.most_saturated:g} % of them",
        "dark": f"at most {100.0 * limits.most_dark:g} % of them (signal below 3 times its noise)",
        "signal over noise": f"at least {limits.least_snr:g}, median of the target",
        "contrast": f"at least {limits.least_contrast:g}, |t - b| / (t + b) of median electrons of "
        "the target and of the pixels beside it",
    }
    body = "".join(f"<tr><th>{k}</th><td>{html.escape(v)}</td></tr>" for k, v in lines.items())
    return f"<h2>Criteria of a good picture</h2>\n<table>{body}</table>"
