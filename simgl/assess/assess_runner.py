"""What ``simgl assess`` does."""

from __future__ import annotations

import math
from pathlib import Path

from rich.console import Console

from simgl.assess.report import write_report
from simgl.assess.sweep import Sweep, run_sweep
from simgl.assess.sweep_axes import parse_axes
from simgl.assess.sweep_report import write_sweep_report
from simgl.assess.target_light import assess_frame
from simgl.assess.timeline import course
from simgl.assess.trajectory_assessment import PRODUCTS, assignment, moments, run
from simgl.assess.verdict import Verdict, verdict
from simgl.cli_progress import frame_bar, opened
from simgl.scenario.loader import load_scenario
from simgl.sequence.epoch_options import EpochOptions, epoch_at
from simgl.workers.executors import hired


def one_epoch(
    path: Path, camera: str | None, target: str | None, at: str | None, console: Console
) -> None:
    """Assess one picture and say what was found."""
    scenario = load_scenario(path)
    epoch = epoch_at(scenario, at)
    work = assignment(scenario, camera, target, [epoch])
    state = scenario.at(epoch)
    with opened(scenario) as simulator:
        exposure = simulator.capture(state, work.camera, PRODUCTS)
    found = assess_frame(exposure, state, work.target, work.limits)
    judged, reasons = verdict(found, work.limits)
    contrast = "no background" if found.contrast is None else f"{found.contrast:.2f}"
    better = found.better_exposure
    wanted = "no light" if better is None else f"{better:.3g} times this one"
    console.print(
        f"verdict               {judged.value}{': ' if reasons else ''}{'; '.join(reasons)}\n"
        f"range                 {found.range:.2f} m\n"
        f"phase angle           {math.degrees(found.phase_angle):.1f} deg\n"
        f"Sun to boresight      {math.degrees(found.sun_to_boresight):.1f} deg\n"
        f"sunlight on target    {100 * found.sunlight:.1f} %\n"
        f"behind the target     {found.backdrop.value}, contrast {contrast}\n"
        f"target's pixels       {found.target_pixels}{', cut off' if found.cut_off else ''}\n"
        f"saturated dark usable {100 * found.saturated:.1f} % {100 * found.dark:.1f} % "
        f"{100 * found.usable:.1f} %\n"
        f"median signal/noise   {found.median_snr:.1f}\n"
        f"exitance              {found.exitance:.0f} W/m2 (pi x radiance, 400-1000 nm)\n"
        f"relative flux         {found.relative_flux:.0f} W/m2 (source study's definition)\n"
        f"better exposure       {wanted}",
        highlight=False,
        soft_wrap=True,
    )


def trajectory(
    path: Path,
    camera: str | None,
    target: str | None,
    options: EpochOptions,
    hands: tuple[int | None, str | None],
    out: Path,
    console: Console,
) -> None:
    """Assess a trajectory and leave a report and tables.

    hands : workers on this machine, or the address of a scheduler of others
    """
    scenario = load_scenario(path)
    named = assignment(scenario, camera, target, [])
    epochs = options.epochs(scenario, named.camera, named.target)
    work = assignment(scenario, camera, target, epochs)
    report = out / "report.html"
    with opened(scenario) as simulator:
        with frame_bar() as bar:
            rows = run(work, hired(work, simulator, *hands), out, bar)
        found = course(moments(rows))
        write_report(report, work, rows, found, simulator)
    shares = ", ".join(f"{100 * s:.0f} % {v.value}" for v, s in found.shares.items() if s)
    console.print(
        f"{len(rows)} epochs: {shares}\n{report}", highlight=False, markup=False, soft_wrap=True
    )


def over_axes(
    path: Path,
    camera: str | None,
    target: str | None,
    at: str | None,
    axes: list[str],
    hands: tuple[int | None, str | None],
    out: Path,
    console: Console,
) -> None:
    """Assess one epoch over Sun angles and settings of the camera; leave a report and tables.

    axes : as ``parse_axes`` reads them
    hands : workers on this machine, or the address of a scheduler of others
    """
    scenario = load_scenario(path)
    work = assignment(scenario, camera, target, [epoch_at(scenario, at)])
    sweep = Sweep(work, parse_axes(axes))
    with opened(scenario) as simulator, frame_bar() as bar:
        rows = run_sweep(sweep, hired(sweep, simulator, *hands), out, bar)
    write_sweep_report(out / "report.html", sweep, rows)
    good = sum(row["verdict"] == Verdict.GOOD.value for row in rows)
    console.print(
        f"{len(rows)} points, {good} good\n{out / 'report.html'}",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )
