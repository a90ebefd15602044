"""Results of the benchmark as tables for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table

from simgl.bench.comparison import Change
from simgl.bench.goals import Goal, factor_spread, machine_factor
from simgl.bench.results import Results


def tables(results: Results) -> Group:
    """Frame times, passes, start-up, tables of the Earth, other renderers, failures."""
    parts: list[RenderableType] = [_frames(results), _processes(results), _passes(results)]
    start = results.start_up
    if start.help is not None or start.warm is not None or start.cold is not None:
        parts.append(_start(results))
    if results.tables:
        parts.append(_earth_tables(results))
    if results.peers or results.absent_peers:
        parts.append(_peers(results))
    notes = [f"[red]failed[/] {name}: {reason}" for name, reason in results.failed.items()]
    notes += [f"[yellow]absent[/] {name}: {why}" for name, why in results.absent_peers.items()]
    return Group(*parts, *notes)


def _table(title: str, left: Sequence[str], right: Sequence[str] = ()) -> Table:
    """Columns of text, then of numbers; without rules, since frame times need all 80 characters."""
    table = Table(title=title, box=None, padding=(0, 2, 0, 0), title_justify="left")
    for name in left:
        table.add_column(name, no_wrap=True)
    for name in right:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _frames(results: Results) -> Table:
    title = f"simgl {results.version} on {results.machine}\n{results.renderer}\nframe times in ms"
    numbers = ("size", "step", "link", "p50", "p95", "p99", "worst", "p99/p50", "fps")
    frames = _table(title, ["scene"], numbers)
    for scene in results.scenes:
        ms = scene.frame_ms
        frames.add_row(
            scene.name,
            f"{scene.width}x{scene.height}",
            f"{scene.step_s:g} s",
            "yes" if scene.through_bridge else "no",
            *(f"{value:.0f}" for value in (ms.p50, ms.p95, ms.p99, ms.worst)),
            f"{ms.steadiness:.2f}",
            f"{1e3 / ms.mean:.3g}",
        )
    return frames


def _processes(results: Results) -> Table:
    table = _table(
        "process of each scene: start to first DN, resident memory",
        ["scene"],
        ["first DN, s", "peak MB", "steady MB"],
    )
    for scene in results.scenes:
        if scene.memory_mb is not None and scene.first_frame_s is not None:
            memory = scene.memory_mb
            numbers = (f"{memory.peak:.0f}", f"{memory.steady:.0f}")
            table.add_row(scene.name, f"{scene.first_frame_s:.1f}", *numbers)
    return table


def _passes(results: Results) -> Table:
    timed = [scene for scene in results.scenes if scene.passes_ms]
    # Two scenes with the same name have other steps.
    names = [f"{scene.name}\n{scene.step_s:g} s" for scene in timed]
    passes = _table("passes, median ms", ["pass"], names)
    for name in dict.fromkeys(name for scene in timed for name in scene.passes_ms):
        cells = [scene.passes_ms.get(name) for scene in timed]
        passes.add_row(name, *("" if ms is None else f"{ms:.1f}" for ms in cells))
    return passes


def _start(results: Results) -> Table:
    table = _table("start of a process", ["until"], ["s"])
    start = results.start_up
    for name, seconds in {
        "the end of simgl --help": start.help,
        "the first DN of source_600, warm caches": start.warm,
        "the same, cold caches": start.cold,
    }.items():
        if seconds is not None:
            table.add_row(name, f"{seconds:.2f}")
    return table


def _earth_tables(results: Results) -> Table:
    made = _table("tables of the Earth, made once", ["table"], ["MB", "s"])
    for table in results.tables:
        made.add_row(table.name, f"{table.bytes / 1e6:.1f}", f"{table.seconds:.1f}")
    return made


def _peers(results: Results) -> Table:
    title = "other renderers, the target of source_600 before a black sky"
    table = _table(title, ["renderer"], ["size", "s", "rms difference", "correlation"])
    for peer in results.peers:
        difference = peer.difference
        table.add_row(
            f"{peer.name} {peer.version}",
            f"{peer.width}x{peer.height}",
            f"{peer.seconds:.3g}",
            "" if difference is None else f"{difference.rms:.3f}",
            "" if difference is None else f"{difference.correlation:.4f}",
        )
    return table


def factor_text(results: Results) -> str:
    """f, and between what its processes found it."""
    f, spread = machine_factor(results), factor_spread(results)
    if f is None:
        return "f is not known without pyrender"
    between = "" if spread is None else f" ({spread[0]:.2f} to {spread[1]:.2f} by process)"
    return f"f = {f:.2f}{between}"


def goals_table(results: Results, goals: Sequence[Goal]) -> Table:
    """Goals of what was measured; times are allowed f times the goal."""
    factor = factor_text(results)
    numbers = ["here", "goal", "goal x f", "ratio", "met"]
    table = _table(f"goals, {factor}", ["what"], numbers)
    marks = {None: "", True: "[green]yes[/]", False: "[red]no[/]"}
    for goal in goals:
        if goal.value is None:
            continue
        shown = [goal.value, goal.goal, goal.allowed]
        table.add_row(
            f"{goal.name}{f' [{goal.unit}]' if goal.unit else ''}".replace("[", r"\["),
            *("" if value is None else f"{value:.4g}" for value in shown),
            "" if goal.ratio is None else f"{goal.ratio:.2f}",
            marks[goal.met],
        )
    return table


def comparison_table(changes: Sequence[Change]) -> Table:
    """Frames and passes in both runs; what is slower or faster beyond the noise is marked."""
    numbers = ["before", "now", "ratio", "noise", ""]
    table = _table("compared with the baseline, median ms", ["scene", "pass"], numbers)
    for change in changes:
        scene = change.scene
        mark = "[red]slower[/]" if change.slower else "[green]faster[/]" if change.faster else ""
        table.add_row(
            f"{scene.name} {scene.step_s:g} s{' link' if scene.through_bridge else ''}"
            if change.of_pass is None
            else "",
            change.of_pass or "",
            f"{change.before_ms:.1f}",
            f"{change.now_ms:.1f}",
            f"{change.ratio:.2f}",
            f"{min(100 * change.noise, 999):.0f} %",
            mark,
        )
    return table


def all_tables(
    results: Results, goals: Sequence[Goal], changes: Sequence[Change], note: str
) -> list[RenderableType]:
    """What the command prints."""
    parts: list[RenderableType] = [tables(results)]
    if any(goal.value is not None for goal in goals):
        parts.append(goals_table(results, goals))
    if changes:
        parts.append(comparison_table(changes))
    if note:
        parts.append(f"[yellow]Another machine or renderer:[/] {note}")
    return parts
