"""``simgl assess``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simgl.crew.options import Scheduler, Workers
from simgl.sequence.spans import Count, Duration, Random, Seed, Start, Step, Stop

_console = Console()


def assess(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    camera: Annotated[
        str | None, typer.Option(help="Camera name; that of the table assess, or the first.")
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Spacecraft to look for; that of the table assess, or first.")
    ] = None,
    at: Annotated[str | None, typer.Option(help="One UTC epoch instead of a trajectory.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report and tables of a trajectory.")
    ] = None,
    start: Start = None,
    stop: Stop = None,
    duration: Duration = None,
    step: Step = None,
    count: Count = None,
    random: Random = None,
    seed: Seed = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Say how well images show a target: one epoch, or with --out a whole trajectory.

    Examples: simgl assess examples/approach.toml
    simgl assess examples/trajectories/files.toml --duration 5400 --count 90 --out out/report
    """
    from simgl.assess.command import one_epoch, trajectory
    from simgl.errors import ConfigError
    from simgl.sequence.options import EpochOptions

    if out is None:
        one_epoch(scenario, camera, target, at, _console)
        return
    if at is not None:
        raise ConfigError("command line", "--at", "is one epoch; --out is for a trajectory")
    options = EpochOptions(
        start=start,
        stop=stop,
        duration_s=duration,
        step_s=step,
        count=count,
        random=random,
        seed=seed,
    )
    trajectory(scenario, camera, target, options, (workers, scheduler), out, _console)
