"""``simgl bench``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from simgl.cli_progress import activity
from simgl.commands.command_line import COMMAND_LINE, say, say_rich
from simgl.commands.completion import bench_scenes, bench_sets
from simgl.errors import ConfigError
from simgl.interruption import set_result_so_far


def bench(
    json: Annotated[Path | None, typer.Option(help="Write the results to this file too.")] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a page with plots, index.html, into this folder.")
    ] = None,
    of_set: Annotated[
        str | None,
        typer.Option(
            "--set",
            help="What to measure: short (default), goals, gpu, peers or full.",
            autocompletion=bench_sets,
        ),
    ] = None,
    scene: Annotated[
        list[str] | None,
        typer.Option(help="Only these scenes, instead of a set.", autocompletion=bench_scenes),
    ] = None,
    frames: Annotated[int, typer.Option(min=5, help="Timed frames of each scene.")] = 60,
    seconds: Annotated[
        float, typer.Option(min=0.1, help="Time limit of a scene's frames; at least 5 are timed.")
    ] = 10.0,
    step: Annotated[
        float | None,
        typer.Option(
            min=0.0, help="Seconds from frame to frame; 1 if not given, or those of the set."
        ),
    ] = None,
    baseline: Annotated[
        Path | None, typer.Option(help="Compare with the JSON file of an earlier run.")
    ] = None,
    fail_slower: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="PERCENT", help="Exit status 1 where a scene is slower by more."
        ),
    ] = None,
    peers_python: Annotated[
        str, typer.Option(help="Python interpreter that has the other renderers.")
    ] = sys.executable,
) -> None:
    """Time frames and passes, start-up and memory, and compare them.

    Example: simgl bench --json bench.json
    """
    from simgl.bench.bench_page import write_bench_page
    from simgl.bench.bench_tables import all_tables
    from simgl.bench.comparison import compare, different_machine, slower_than
    from simgl.bench.goals import all_goals, results_document
    from simgl.bench.results import read_results
    from simgl.bench.run_bench import run
    from simgl.bench.scenes import DEFAULT_SET, chosen_set, set_of_scenes
    from simgl.output import check_writable, complete_file

    if scene and of_set is not None:
        raise ConfigError(COMMAND_LINE, "--scene", "and --set exclude each other")
    if fail_slower is not None and baseline is None:
        raise ConfigError(COMMAND_LINE, "--fail-slower", "needs --baseline")
    chosen = set_of_scenes(scene) if scene else chosen_set(of_set or DEFAULT_SET)
    if step is not None:
        chosen = chosen.with_step(step)
    before = None if baseline is None else read_results(baseline)
    if report is not None:
        check_writable(report)
    result = "no times are kept" if json is None else f"times so far are in {json}"
    set_result_so_far(lambda: f"{result}, the same command begins again")
    with activity("bench") as progress:
        for results in run(
            chosen, frames=frames, limit_s=seconds, peers_python=peers_python, progress=progress
        ):
            if json is not None:
                with complete_file(json) as temporary:
                    temporary.write_bytes(results_document(results))
    changes = [] if before is None else compare(results, before)
    note = "" if before is None else different_machine(results, before)
    goals = all_goals(results)
    say_rich(*all_tables(results, goals, changes, note))
    if report is not None:
        say(write_bench_page(report / "index.html", results, goals, changes, note))
    slower = [] if fail_slower is None else slower_than(changes, fail_slower)
    if slower or results.failed:
        raise typer.Exit(1)
