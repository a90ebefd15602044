"""``simgl assess``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simgl.cli_progress import activity, load, opened
from simgl.commands.command_line import (
    COMMAND_LINE,
    Json,
    WorkerOptions,
    resumable,
    say,
    say_json,
    with_option_groups,
)
from simgl.commands.completion import scenario_files
from simgl.errors import ConfigError
from simgl.progress import begin_stage
from simgl.sequence.epoch_options import EpochOptions

if TYPE_CHECKING:
    from simgl.scenario.scenario import Scenario


@with_option_groups
def assess(
    scenario: Annotated[
        Path, typer.Argument(help="Scenario file (TOML).", autocompletion=scenario_files)
    ],
    epochs: EpochOptions,
    workers: WorkerOptions,
    camera: Annotated[
        str | None, typer.Option(help="Camera name; that of the table assess, or the first.")
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(help="Spacecraft; that of the table assess, or the first."),
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
    by: Annotated[
        str | None, typer.Option(help="Author of the report; the login name if not given.")
    ] = None,
    json: Json = False,
) -> None:
    """Assess how well images show a target: one epoch, a whole trajectory, or a sweep.

    Examples: simgl assess examples/approach.toml
    simgl assess examples/trajectories/files.toml --duration 5400 --count 90 --out out/report
    simgl assess examples/approach.toml --sweep phase_angle_deg=0:150:6 --sweep f_number=2,4,8
    --out out/sweep
    """
    if sweep:
        if out is None:
            raise ConfigError(COMMAND_LINE, "--out", "is needed for the report of a sweep")
        if epochs != EpochOptions(seed=epochs.seed):
            raise ConfigError(COMMAND_LINE, "--sweep", "is at one epoch: --at, and no span")
        _sweep(load(scenario), camera, target, at, sweep, workers, out, json)
    elif out is None:
        if epochs != EpochOptions() or workers != WorkerOptions() or by is not None:
            raise ConfigError(COMMAND_LINE, "--out", "is needed for a trajectory and its report")
        _one_epoch(load(scenario), camera, target, at, json)
    elif at is not None:
        raise ConfigError(COMMAND_LINE, "--at", "is one epoch; --out is for a trajectory")
    else:
        _trajectory(load(scenario), camera, target, epochs, workers, out, by, json)


def _one_epoch(
    scenario: Scenario, camera: str | None, target: str | None, at: str | None, json: bool
) -> None:
    """Assess one image and print the assessment."""
    from simgl.assess.target_light import assess_frame
    from simgl.assess.trajectory_assessment import assessment_document, assignment
    from simgl.assess.verdict import assessment_text
    from simgl.sequence.epochs import epoch_at

    epoch = epoch_at(scenario, at)
    work = assignment(scenario, camera, target, [epoch])
    with opened(scenario) as simulator, activity(f"drawing {work.camera}"):
        state, capture = work.capture(simulator, epoch)
    assessment = assess_frame(capture, state, work.target, work.limits)
    if json:
        say_json(assessment_document(work, assessment))
    else:
        say(assessment_text(assessment, work.limits))


def _trajectory(
    scenario: Scenario,
    camera: str | None,
    target: str | None,
    epochs: EpochOptions,
    workers: WorkerOptions,
    out: Path,
    by: str | None,
    json: bool,
) -> None:
    """Assess a trajectory; write a report and tables. Exit status 1 for a broken requirement."""
    from dataclasses import replace

    from simgl.assess.report import write_report
    from simgl.assess.requirement_check import (
        check_requirements,
        checks_document,
        checks_text,
        passed,
    )
    from simgl.assess.timeline import timeline, timeline_document
    from simgl.assess.trajectory_assessment import assignment, moments, run, run_document
    from simgl.assess.uncertainty_bands import bands_document, bands_text, uncertainty_bands
    from simgl.assess.uncertainty_draws import draws_of, run_draws
    from simgl.sequence.epochs import epochs as chosen_epochs
    from simgl.workers.executors import select_executor

    work = assignment(scenario, camera, target, [])
    if work.is_thermal and scenario.uncertainty is not None:
        problem = f'requires visible light; camera "{work.camera}" sees thermal radiation'
        raise ConfigError(str(scenario.source or scenario.name), "uncertainty", problem)
    work = replace(work, epochs=chosen_epochs(scenario, epochs, work.camera))
    report = out / "report.html"
    resumable(out, len(work.epochs), "epochs")
    with opened(scenario) as simulator, activity("drawing frames") as progress:
        executor = select_executor(work, simulator, workers.workers, workers.scheduler)
        rows = run(work, executor, out, progress)
        checks = check_requirements(scenario.requirements, rows)
        bands, draws = None, draws_of(work, rows, checks)
        if draws is not None:
            begin_stage(progress, "drawing uncertainties")
            drawing = select_executor(draws, simulator, workers.workers, workers.scheduler)
            drawn = run_draws(draws, drawing, out / "uncertainty", progress)
            bands = uncertainty_bands(draws, rows, drawn)
        begin_stage(progress, "writing the report")
        summary = timeline(moments(rows))
        write_report(report, work, rows, summary, simulator, checks, by, bands)
    if json:
        document = run_document(work, rows, report) | timeline_document(summary)
        say_json({**document, **checks_document(checks), **bands_document(bands)})
    else:
        shares = ", ".join(f"{100 * s:.0f} % {v.value}" for v, s in summary.shares.items() if s)
        say(f"{len(rows)} epochs: {shares}", *checks_text(checks), *bands_text(bands), report)
    if not passed(checks):
        raise typer.Exit(1)


def _sweep(
    scenario: Scenario,
    camera: str | None,
    target: str | None,
    at: str | None,
    axes: list[str],
    workers: WorkerOptions,
    out: Path,
    json: bool,
) -> None:
    """Assess one epoch over Sun angles and camera settings; write a report and tables."""
    from simgl.assess.sweep import Sweep, run_sweep
    from simgl.assess.sweep_axes import parse_axes
    from simgl.assess.sweep_report import write_sweep_report
    from simgl.assess.trajectory_assessment import assignment, run_document
    from simgl.assess.verdict import Verdict
    from simgl.sequence.epochs import epoch_at
    from simgl.workers.executors import select_executor

    work = assignment(scenario, camera, target, [epoch_at(scenario, at)])
    if work.is_thermal:
        problem = f'requires visible light; camera "{work.camera}" sees thermal radiation'
        raise ConfigError(COMMAND_LINE, "--sweep", problem)
    sweep = Sweep(work, parse_axes(axes))
    resumable(out, len(sweep.sun_directions) * len(sweep.settings), "points")
    with opened(scenario) as simulator, activity("drawing frames") as progress:
        executor = select_executor(sweep, simulator, workers.workers, workers.scheduler)
        rows = run_sweep(sweep, executor, out, progress)
    report = out / "report.html"
    write_sweep_report(report, sweep, rows)
    if json:
        say_json(run_document(work, rows, report))
        return
    good = sum(row["verdict"] == Verdict.GOOD.value for row in rows)
    say(f"{len(rows)} points, {good} good", report)
