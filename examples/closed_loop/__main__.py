"""Fly the docking: ``python -m examples.closed_loop --out out/demo``."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from simgl_bridge import BodyPose, Client, Image, launched_server

from examples.closed_loop.camera import Pinhole
from examples.closed_loop.exposure import Light
from examples.closed_loop.loop import CAMERA, LAMP, Flight, Frame, Settings, fly
from examples.closed_loop.monte_carlo import statistics, write_monte_carlo
from examples.closed_loop.report import Summary, summarise, write_report
from simgl import Scenario, SimglError, load_scenario
from simgl.output import check_writable

SCENARIO = Path(__file__).parents[1] / "docking.toml"
# Nothing of a run's noise may be that of another's.
NOISE_SEED = 1000
console = Console(highlight=False, soft_wrap=True)


def main(
    out: Annotated[Path, typer.Option(help="Folder for the results.")],
    frames: Annotated[
        int | None, typer.Option(min=3, help="Stop after so many images; else at docking range.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the start and all random errors.")] = 1,
    runs: Annotated[
        int, typer.Option(min=1, help="More than one: Monte Carlo over as many seeds.")
    ] = 1,
    period: Annotated[float, typer.Option(min=1.0, help="Seconds between images.")] = 5.0,
) -> None:
    """A CubeSat docks with Space Rider by what its camera shows, from 120 m into an eclipse.

    Example: python -m examples.closed_loop --out out/demo

    Example: python -m examples.closed_loop --out out/monte_carlo --runs 10 --period 8
    """
    check_writable(out)
    scenario = load_scenario(SCENARIO)
    flights: list[Flight] = []
    summaries: list[Summary] = []
    paths: list[Path] = []
    with launched_server(SCENARIO) as (_, address):
        for index in range(runs):
            settings = Settings(seed=seed + index, image_period=float(round(period)), images=frames)
            flight, summary = _one(scenario, address, settings)
            _say(summary)
            flights.append(flight)
            summaries.append(summary)
            paths = write_report(flights[0], summaries[0], out)
            if runs > 1:
                # After each run: what is done stays, whatever ends the rest.
                paths += write_monte_carlo(flights, summaries, out, _machine(summary))
    if runs > 1:
        table = statistics(summaries)
        console.print(f"{table['arrived']} of {table['runs']} runs arrived.")
    for path in paths:
        console.print(str(path))


def _machine(summary: Summary) -> str:
    load = os.getloadavg()[0]
    return f"{summary.renderer}, {os.cpu_count()} cores, load {load:.1f}, {_date()}"


def _date() -> str:
    return time.strftime("%Y-%m-%d", time.gmtime())


def _one(scenario: Scenario, address: str, settings: Settings) -> tuple[Flight, Summary]:
    """One flight over the bridge, with noise of its own."""
    with Client(address, timeout_s=120.0, name="closed_loop") as client:
        client.configure(seed=NOISE_SEED + settings.seed)
        card = next(c for c in client.welcome.cameras if c.name == CAMERA)

        def take_image(
            tai_ns: int, bodies: Mapping[str, BodyPose], light: Light, moving: bool
        ) -> Image:
            # The client raises unless the server echoes this very time and state.
            lamps = {LAMP: float(light.lamp)}
            return client.render(tai_ns, CAMERA, bodies, light.exposure, lamps=lamps, moving=moving)

        columns = (BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(*columns, console=console, transient=True) as progress:
            task = progress.add_task("searching", total=1.0)

            def on_frame(frame: Frame) -> None:
                length = settings.plan.near.distance
                first = 120.0
                done = 1.0 - (frame.distance - length) / (first - length)
                light = "lamp" if frame.look.light.lamp else "Sun"
                sigma = 3.0 * float(frame.sigma[0])
                progress.update(
                    task,
                    completed=min(max(done, 0.0), 1.0),
                    description=f"t = {frame.time:4.0f} s, {frame.distance:7.2f} m, error "
                    f"{frame.error[0]:+.3f} (3 sigma {sigma:.3f}) m, {light}",
                )

            start = time.perf_counter()
            flight = fly(scenario, Pinhole.from_card(card), take_image, settings, on_frame)
            wall_time = time.perf_counter() - start
        return flight, summarise(flight, wall_time, client.welcome.renderer)


def _say(summary: Summary) -> None:
    ending = "is at docking range" if summary.arrived else "is still on its way"
    console.print(
        f"Seed {summary.seed}: the chaser {ending}: {summary.distance_true_m:.3f} m from the "
        f"board, {1e3 * summary.off_axis_m:.0f} mm off its axis, {summary.misalignment_deg:.2f} "
        f"deg askew, after {summary.simulated_time_s:.0f} s and {summary.delta_v_m_s:.2f} m/s.\n"
        f"Estimate by markers: {1e3 * summary.range_error_m:.1f} mm rms along, "
        f"{1e3 * summary.lateral_error_m:.1f} mm across, {summary.turn_error_deg:.2f} deg; "
        f"{100 * summary.within_3_sigma:.1f} % of errors within 3 sigma.\n"
        f"{summary.frames} frames at {summary.frames_per_second:.1f} a second, end to end; "
        f"rendering {summary.render_p50_ms:.0f} ms, bridge {summary.bridge_p50_ms:.1f} ms, "
        f"flight software {summary.processing_p50_ms:.0f} ms (medians)."
    )


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"closed_loop: {error}", file=sys.stderr)
        sys.exit(2)
