"""The assessment of a trajectory as one self-contained page: numbers, timeline, pictures, maps."""

from __future__ import annotations

import html
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simgl.assess.html_page import COLOURS, image, inline, write_page
from simgl.assess.target_background import TargetBackground
from simgl.assess.timeline import Timeline, Window
from simgl.assess.trajectory_assessment import PRODUCTS, Assignment
from simgl.assess.verdict import Verdict
from simgl.images import display_from_radiance, display_gain, png_bytes
from simgl.maps import electron_map
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.sequence.journal import Value
from simgl.simulator import Capture, Simulator

# More light than this does not help an eye; stars would come before the target.
_MOST_GAIN = 1024.0
_BEHIND = {
    TargetBackground.SPACE: "#3b4252",
    TargetBackground.LIMB: "#4f8fd0",
    TargetBackground.EARTH: "#8fb996",
    TargetBackground.MIXED: "#c9a66b",
    TargetBackground.NONE: "#c8ccd4",
}


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """An epoch that the page shows: why, and its row."""

    title: str
    row: dict[str, Value]


def write_report(
    path: Path,
    work: Assignment,
    rows: Sequence[dict[str, Value]],
    found: Timeline,
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
        "Span": f"{_utc(rows[0])} to {_utc(rows[-1])} UTC, {len(rows)} epochs",
        "Camera": f"{work.camera}: {d.width} x {d.height}, {1e3 * camera.lens.focal_length:g} mm, "
        f"f/{camera.lens.f_number:g}, {1e3 * camera.exposure_time:g} ms",
        "Target": work.target,
        "Scenario": str(work.scenario.source or work.scenario.name),
    }
    body = "".join(f"<tr><th>{k}</th><td>{html.escape(v)}</td></tr>" for k, v in facts.items())
    return f"<h1>Light on {html.escape(work.target)}</h1>\n<table>{body}</table>"


def _utc(row: dict[str, Value]) -> str:
    """A row's epoch to the second, which is what people read."""
    return str(row["utc"])[:19]


def _summary(found: Timeline) -> str:
    shares = "".join(
        f'<tr><td><span class="key" style="background:{COLOURS[v]}"></span>{v.value}</td>'
        f'<td class="n">{100.0 * share:.1f} %</td></tr>'
        for v, share in found.shares.items()
    )
    best = "".join(
        f'<tr><td>{utc_from_tai_ns(w.start_ns)[:19]}</td><td class="n">{w.duration:.0f} s</td>'
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
            f"<p>Worst epoch in view: {utc_from_tai_ns(found.worst.tai_ns)[:19]}, "
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
        f'title="{utc_from_tai_ns(w.start_ns)[:19]}: {w.verdict.value}"></div>'
        for w in windows
    )
    behind = "".join(
        f'<div style="flex:{count};background:{_BEHIND[kind]}" title="behind: {kind.value}"></div>'
        for kind, count in _runs([TargetBackground(str(row["backdrop"])) for row in rows])
    )
    keys = "".join(
        f'<span><span class="key" style="background:{colour}"></span>{kind.value}</span>'
        for kind, colour in _BEHIND.items()
        if any(row["backdrop"] == kind.value for row in rows)
    )
    return (
        f'<figure><div class="strip">{cells}</div><figcaption>Verdicts, {_utc(rows[0])} to '
        f'{_utc(rows[-1])} UTC</figcaption></figure>\n<figure><div class="strip">{behind}</div>'
        f'<figcaption class="keys">Behind the target: {keys}</figcaption></figure>'
    )


def _runs(kinds: Sequence[TargetBackground]) -> list[tuple[TargetBackground, int]]:
    """Stretches of one kind, and how many epochs each has."""
    return [(kind, len(list(same))) for kind, same in itertools.groupby(kinds)]


def _column(
    rows: Sequence[dict[str, Value]], name: str
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([np.nan if row[name] is None else float(row[name] or 0.0) for row in rows])


def _timeline(rows: Sequence[dict[str, Value]], found: Timeline) -> str:
    from matplotlib.figure import Figure

    minutes = (_column(rows, "tai_ns") - float(rows[0]["tai_ns"] or 0)) / 60e9
    figure = Figure(figsize=(10.4, 8.2), layout="constrained")
    axes = figure.subplots(5, 1, sharex=True)
    axes[0].plot(minutes, _column(rows, "phase_angle_deg"), color="#1f5fa8")
    axes[0].set_ylabel("phase angle [deg]")
    axes[1].plot(minutes, 100.0 * _column(rows, "sunlight"), color="#d08700")
    axes[1].set_ylabel("sunlight [%]")
    axes[1].set_ylim(-5.0, 105.0)
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
    axes[4].set_ylim(-0.05, 1.05)
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


def _picture(one: Chosen, exposure: Capture) -> str:
    assert exposure.radiance is not None
    assert exposure.electrons is not None
    radiance = exposure.radiance.radiance
    gain = min(display_gain(radiance), _MOST_GAIN)
    view = png_bytes(display_from_radiance(radiance, gain))
    row = one.row
    text = (
        f"{one.title}: {_utc(row)} UTC, {row['verdict']}"
        + (f" ({row['reasons']})" if row["reasons"] else "")
        + f". Range {row['range_m']:.1f} m, phase {row['phase_angle_deg']:.0f} deg, sunlight "
        f"{100.0 * float(row['sunlight'] or 0.0):.0f} %, behind it {row['backdrop']}. Exitance "
        f"{float(row['exitance_w_m2'] or 0.0):.3g} W/m2 (pi x radiance, 400-1000 nm), relative "
        f"flux {float(row['relative_flux_w_m2'] or 0.0):.3g} W/m2 (source study's definition), "
        f"median {float(row['median_electrons'] or 0.0):.4g} e-."
    )
    shown = (
        f"shown with {gain:g} times the light" if gain != 1.0 else "a sunlit white plate is white"
    )
    return (
        f'<div class="epoch"><p>{html.escape(text)}</p>\n<div class="pictures">'
        f"<figure>{image(view, 'picture')}<figcaption>Picture, {shown}</figcaption></figure>"
        f"<figure>{inline(electron_map(exposure.electrons))}"
        "<figcaption>Mean electrons before noise</figcaption></figure></div></div>"
    )


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
