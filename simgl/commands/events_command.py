"""``simgl events``: what an event camera sees along a trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgl.cli_progress import activity, load, opened
from simgl.commands.command_line import COMMAND_LINE, say, with_option_groups
from simgl.commands.render_commands import ScenarioFile, camera_names
from simgl.errors import ConfigError
from simgl.sequence.epoch_options import SpanOptions


@with_option_groups
def events(
    scenario: ScenarioFile,
    camera: Annotated[str, typer.Option(help="Camera with an event_sensor.")],
    out: Annotated[Path, typer.Option(help="File to write: .h5, .aedat4 or .npz.")],
    span: SpanOptions,
    step: Annotated[
        float, typer.Option(help="Longest time between sub-frames, in seconds.")
    ] = 0.01,
) -> None:
    """Record the events of an event camera along a trajectory.

    Sub-frames are more frequent where the image moves by more than half a pixel. Example:
    simgl events examples/event_camera/docking.toml --camera dvs --duration 0.2 --out out/run.h5
    """
    from simgl.sequence.epochs import span as chosen_span
    from simgl.sequence.epochs import step_ns
    from simgl.sequence.event_files import EventSource, check_event_file, write_events
    from simgl.sequence.event_stream import EventSpan, check_event_camera, event_stream

    check_event_file(out)
    loaded = load(scenario)
    camera_names(loaded, [camera])
    check_event_camera(loaded, camera)
    step_time = step_ns("--step", step)
    start, stop = chosen_span(loaded, span)
    if stop == start:
        raise ConfigError(COMMAND_LINE, "--to", "must be later than the start")
    watched = EventSpan(camera=camera, start=start, stop=stop, step=step_time)
    with opened(loaded) as simulator, activity("drawing sub-frames") as progress:
        source = EventSource(
            camera=loaded.cameras[camera],
            scenario=loaded.name,
            seed=loaded.seed,
            start=start,
            renderer=simulator.renderer_name,
        )
        on, off = write_events(out, source, event_stream(simulator, watched, progress))
    say(f"{on} ON and {off} OFF events in {out}")
