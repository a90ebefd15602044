"""``simgl record``: a run as a recording of ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgl.cli_progress import activity, load, opened
from simgl.commands.command_line import say, with_option_groups
from simgl.commands.render_commands import Cameras, ScenarioFile, camera_names
from simgl.sequence.epoch_options import EpochOptions, EventOptions


@with_option_groups
def record(
    scenario: ScenarioFile,
    mcap: Annotated[Path, typer.Option(help="MCAP file to write; an existing one is replaced.")],
    epochs: EpochOptions,
    event: EventOptions,
    camera: Cameras = None,
    depth: Annotated[bool, typer.Option("--depth", help="Also depth images (32FC1).")] = False,
) -> None:
    """Record a trajectory as ROS 2 messages: images, calibrations, frames and clock.

    Example:
    simgl record examples/trajectories/files.toml --mcap out/run.mcap --duration 20 --step 2
    """
    from simgl.ros2.mcap_recording import Recording
    from simgl.ros2.mcap_recording import record as write
    from simgl.sequence.epochs import epochs as chosen_epochs

    loaded = load(scenario)
    names = camera_names(loaded, camera)
    recording = Recording(
        scenario=loaded,
        cameras=names,
        epochs=chosen_epochs(loaded, epochs, names[0], event),
        depth=depth,
    )
    with opened(loaded) as simulator, activity("drawing frames") as progress:
        count = write(recording, simulator, mcap, progress)
    say(f"{count} messages in {mcap}")
