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
from simgl_bridge import BodyPose, Client, Image, launched_server

from examples.closed_loop.camera import Pinhole
from examples.closed_loop.criteria import docked, verdict
from examples.closed_loop.exposure import Light
from examples.closed_loop.film import write_film
from examples.closed_loop.loop import CAMERA, LAMP, Flight, Settings, fly
from examples.closed_loop.monte_carlo import write_monte_carlo
from examples.closed_loop.narration import Narrator
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
    film: Annotated[bool, typer.Option("--film", help="Also write docking.webp.")] = False,
) -> None:
    """A CubeSat docks with Space Rider by what its camera shows, from 120 m into an eclipse.

    Example: python -m examples.closed_loop --out out/demo

    Example: python -m examples.closed_loop --out out/monte_carlo --runs 10 --period 8
    """
    check_writable(out)
    scenario = load_scenario(SCENARIO)
    flights: list[Flight] = []
    summaries: list[Summary] = []
    report: list[Path] = []
    of_all: list[Path] = []
    console.print(
        f"Starting the image server for {SCENARIO.name}: simgl serve, in a process of its own."
    )
    with launched_server(SCENARIO) as (_, address):
        for index in range(runs):
            settings = Settings(seed=seed + index, image_period=float(round(period)), images=frames)
            flight, summary = _one(scenario, address, settings)
            _say(summary)
            flights.append(flight)
            summaries.append(summary)
            # After each run: what is done stays, whatever ends the rest.
            if index == 0:
                report = write_report(flight, summary, out)
            if runs > 1:
                of_all = write_monte_carlo(flights, summaries, out, _machine(summary))
    if film:
        write_film(flights[0].report_images, out)
    pages = [str(path) for path in (*report, *of_all) if path.suffix == ".html"]
    if runs > 1:
        count = sum(docked(summary) for summary in summaries)
        line = f"{count} of {runs} flights met all criteria: DOCKED"
    else:
        line = verdict(summaries[0])
    console.print(f"{line}. Open {' and '.join(pages)}")


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

        narrator = Narrator(console, start=120.0, end=settings.plan.near.distance)
        with narrator.telling():
            start = time.perf_counter()
            flight = fly(scenario, Pinhole.from_card(card), take_image, settings, narrator.frame)
            wall_time = time.perf_counter() - start
        return flight, summarise(flight, wall_time, client.welcome.renderer)


def _say(summary: Summary) -> None:
    console.print(
        f"Seed {summary.seed}, {summary.frames} images at {summary.frames_per_second:.1f} a "
        f"second, end to end: rendering {summary.render_p50_ms:.0f} ms, bridge "
        f"{summary.bridge_p50_ms:.1f} ms, flight software {summary.processing_p50_ms:.0f} ms "
        f"(medians).\n"
        f"Estimate against truth: {1e3 * summary.range_error_m:.1f} mm rms along, "
        f"{1e3 * summary.lateral_error_m:.1f} mm across, {summary.turn_error_deg:.2f} deg; "
        f"{100 * summary.within_3_sigma:.1f} % of the position errors within 3 sigma; "
        f"{summary.delta_v_m_s:.2f} m/s spent."
    )


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"closed_loop: {error}", file=sys.stderr)
        sys.exit(2)
