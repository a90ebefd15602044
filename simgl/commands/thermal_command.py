"""``simgl thermal``: temperatures of a spacecraft along a trajectory."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from simgl.cli_progress import activity, load
from simgl.commands.command_line import COMMAND_LINE, say, with_option_groups
from simgl.commands.render_commands import ScenarioFile, camera_names
from simgl.errors import ConfigError, did_you_mean
from simgl.sequence.epoch_options import SpanOptions


class InitialState(StrEnum):
    """The state that a run begins with."""

    STEADY = "steady"
    PERIODIC = "periodic"


@with_option_groups
def thermal(
    scenario: ScenarioFile,
    out: Annotated[Path, typer.Option(help="Folder for the table and the heat maps.")],
    span: SpanOptions,
    step: Annotated[float, typer.Option(help="Seconds between epochs.")] = 30.0,
    spacecraft: Annotated[
        str | None, typer.Option(help="Whose temperatures; the first if not given.")
    ] = None,
    initial: Annotated[
        InitialState,
        typer.Option(help="Steady state of the first epoch, or as if the span repeated."),
    ] = InitialState.STEADY,
    camera: Annotated[
        str | None, typer.Option(help="Also its thermal image of the last epoch.")
    ] = None,
    detector: Annotated[
        str, typer.Option(help="Of --camera: bolometer_lwir or insb_mwir.")
    ] = "bolometer_lwir",
    patches: Annotated[int, typer.Option(min=20, max=6000, help="Patches, about.")] = 1500,
) -> None:
    """Integrate the temperatures of a spacecraft along its trajectory.

    Writes NAME.thermal.csv with each part's temperatures, and NAME.thermal.png, a heat map of the
    last epoch in K; with --camera, CAMERA.infrared.exr, .dn.png and .map.png. Example:
    simgl thermal examples/servicer.toml --duration 600 --camera beside --out out/thermal
    """
    from simgl.heat_map import write_heat_map, write_infrared, write_temperatures
    from simgl.output import check_writable
    from simgl.sequence.epochs import regular
    from simgl.sequence.epochs import span as chosen_span
    from simgl.thermal.body import thermal_body
    from simgl.thermal.history import thermal_history
    from simgl.thermal.infrared_detector import load_infrared_detector

    loaded = load(scenario)
    names = list(loaded.models)
    if not names:
        raise ConfigError(str(scenario), "spacecraft", "is missing; temperatures need one")
    name = names[0] if spacecraft is None else spacecraft
    if name not in names:
        raise ConfigError(COMMAND_LINE, "--spacecraft", f'"{name}": {did_you_mean(name, names)}')
    if not 0.01 <= step <= 3600.0:
        raise ConfigError(COMMAND_LINE, "--step", f"must lie in 0.01..3600 s, got {step:g}")
    first, last = chosen_span(loaded, span)
    if last == first:
        raise ConfigError(COMMAND_LINE, "--to", "must be later than the start")
    epochs = list(dict.fromkeys([*regular(first, last, round(step * 1e9)), last]))
    if camera is not None:
        camera_names(loaded, [camera])
    pixels = load_infrared_detector(detector)
    check_writable(out)
    bodies = {}
    with activity("tracing how the surfaces see each other") as progress:
        for other in names if camera is not None else [name]:
            body = thermal_body(other, loaded.models[other], patches)
            progress.begin_stage(f"heat of {other} along the trajectory")
            states = list(thermal_history(body, loaded, epochs, initial.value, progress))
            bodies[other] = body, states
        body, states = bodies[name]
        table, image = out / f"{name}.thermal.csv", out / f"{name}.thermal.png"
        write_temperatures(table, body, states)
        write_heat_map(image, body, states[-1])
        paths = [table, image]
        if camera is not None:
            progress.begin_stage("thermal image")
            last_states = {other: (b, of_body[-1]) for other, (b, of_body) in bodies.items()}
            paths += write_infrared(
                out, loaded.at(epochs[-1]), camera, last_states, pixels, loaded.seed
            )
    coldest, hottest = (
        f(float(f(s.temperatures[: body.patch_count])) for s in states) for f in (min, max)
    )
    say(
        f"{len(states)} epochs, {body.patch_count} patches: {coldest:.1f} to {hottest:.1f} K",
        f"state {states[-1].digest}, {states[-1].history}",
        *paths,
    )
