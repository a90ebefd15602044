"""``simgl assess``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simgl.sequence.spans import Count, Duration, Random, Seed, Start, Step, Stop
from simgl.workers.worker_options import Scheduler, Workers

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
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=A,B,... or NAME=FROM:TO:COUNT[:log], at one epoch; NAME of phase_angle_deg, "
            "sun_clock_deg, exposure_time_s, f_number. Repeated, all combinations."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report and tables of a trajectory or a sweep.")
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
    """Say how well images show a target: one epoch, a whole trajectory, or a sweep.

    Examples: simgl assess examples/approach.toml
    simgl assess examples/trajectories/files.toml --duration 5400 --count 90 --out out/report
    simgl assess examples/approach.toml --sweep phase_angle_deg=0:150:6 --sweep f_number=2,4,8
    --out out/sweep
    """
    from simgl.assess.assess_runner import one_epoch, over_axes, trajectory
    from simgl.errors import ConfigError
    from simgl.sequence.epoch_options import EpochOptions

    if sweep:
        spans = (start, stop, duration, step, count, random)
        if out is None:
            raise ConfigError("command line", "--out", "is needed for the report of a sweep")
        if any(value is not None for value in spans):
            raise ConfigError("command line", "--sweep", "is at one epoch: --at, and no span")
        over_axes(scenario, camera, target, at, sweep, (workers, scheduler), out, _console)
        return
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
