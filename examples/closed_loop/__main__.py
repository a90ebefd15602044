"""Fly the approach: ``python -m examples.closed_loop --out out/demo``."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from simgl_bridge import BodyPose, Client, launched_server

from examples.closed_loop.loop import Flight, Frame, Settings, TakeImage, fly
from examples.closed_loop.report import summarise, write_report
from examples.closed_loop.vision import Image, Pinhole
from simgl import Scenario, SimglError, load_scenario
from simgl.output import check_writable
from simgl.physics.frames import Pose

SCENARIO = Path(__file__).parents[1] / "approach.toml"
console = Console(highlight=False, soft_wrap=True)


def main(
    out: Annotated[Path, typer.Option(help="Folder for the results.")],
    frames: Annotated[int, typer.Option(min=10, help="Frames, 3 s apart.")] = 300,
    seed: Annotated[int, typer.Option(min=0, help="Of all random errors of the craft.")] = 1,
) -> None:
    """A CubeSat approaches Space Rider from 200 m to 20 m by what its camera shows.

    Example: python -m examples.closed_loop --out out/demo
    """
    check_writable(out)
    scenario = load_scenario(SCENARIO)
    with (
        launched_server(SCENARIO) as (_, address),
        Client(address, timeout_s=60.0, name="closed_loop") as client,
    ):
        card = next(c for c in client.welcome.cameras if c.name == "navcam")
        camera = Pinhole(
            width=card.width,
            height=card.height,
            focal_length=card.focal_length_px,
            cx=card.cx,
            cy=card.cy,
            pedestal_dn=card.pedestal_dn,
        )

        def take_image(tai_ns: int, bodies: dict[str, Pose]) -> Image:
            # The client raises unless the server echoes this very time and state.
            sent = {name: BodyPose.from_pose(pose) for name, pose in bodies.items()}
            return client.render(tai_ns, "navcam", sent).dn

        console.print(f"image server {address}, {client.welcome.renderer}")
        start = time.perf_counter()
        settings = Settings(frames=frames, seed=seed)
        flight = _fly_with_progress(scenario, camera, take_image, settings)
        wall_time = time.perf_counter() - start
        summary = summarise(flight, wall_time, client.welcome.renderer)

    paths = write_report(flight, summary, out)
    ending = "holds" if summary.arrived else "is still on its way"
    console.print(
        f"The chaser {ending}: {summary.range_true_m:.2f} m from the target, "
        f"{summary.miss_m:.2f} m from the hold point.\n"
        f"Estimate, second half: {summary.rms_range_error_m:.3f} m rms in range, "
        f"{summary.rms_lateral_error_m:.3f} m across; {summary.rejected_frames} frames rejected.\n"
        f"Velocity change {summary.delta_v_m_s:.2f} m/s. {summary.frames} frames at "
        f"{summary.frames_per_second:.1f} frames per second, end to end."
    )
    for path in paths:
        console.print(str(path))


def _fly_with_progress(
    scenario: Scenario, camera: Pinhole, take_image: TakeImage, settings: Settings
) -> Flight:
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("searching", total=settings.frames)

        def on_frame(frame: Frame) -> None:
            progress.update(
                task,
                advance=1,
                description=f"range {frame.true_range:6.1f} m, estimated "
                f"{frame.estimated_range:6.1f} +- {frame.range_sigma:.2f} m",
            )

        return fly(scenario, camera, take_image, settings, on_frame)


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"closed_loop: {error}", file=sys.stderr)
        sys.exit(2)
