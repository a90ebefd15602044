"""``simgl thermal``: temperatures of a spacecraft along a trajectory."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simgl.cli_progress import activity, load, opened
from simgl.commands.command_line import COMMAND_LINE, say, with_option_groups
from simgl.commands.render_commands import ScenarioFile, camera_names
from simgl.errors import ConfigError, did_you_mean
from simgl.sequence.epoch_options import SpanOptions

if TYPE_CHECKING:
    from simgl.simulator import Simulator
    from simgl.thermal.scene_temperatures import Temperatures


class InitialState(StrEnum):
    """The state that a run begins with."""

    STEADY = "steady"
    PERIODIC = "periodic"


@with_option_groups
def thermal(
    scenario: ScenarioFile,
    out: Annotated[Path, typer.Option(help="Folder for the table and the heat maps.")],
    span: SpanOptions,
    step: Annotated[
        float | None,
        typer.Option(help="Seconds between epochs; the scenario's if not given."),
    ] = None,
    spacecraft: Annotated[
        str | None, typer.Option(help="Whose temperatures; the first if not given.")
    ] = None,
    initial: Annotated[
        InitialState,
        typer.Option(
            help="Start: steady state of the first epoch, or the periodic state of the span."
        ),
    ] = InitialState.STEADY,
    camera: Annotated[
        str | None, typer.Option(help="A thermal camera: also its image of the last epoch.")
    ] = None,
) -> None:
    """Integrate the temperatures of a spacecraft along its trajectory.

    Writes NAME.thermal.csv with each part's temperatures, and NAME.thermal.png, a heat map of the
    last epoch in K; with --camera the files of simgl render for it. Example:
    simgl thermal examples/servicer.toml --duration 600 --out out/thermal
    """
    from simgl.figures.heat_map import write_heat_map, write_temperatures
    from simgl.output import check_writable
    from simgl.sequence.epochs import regular
    from simgl.sequence.epochs import span as chosen_span
    from simgl.thermal.history import thermal_history

    loaded = load(scenario)
    names = list(loaded.models)
    if not names:
        raise ConfigError(str(scenario), "spacecraft", "is missing; temperatures need one")
    name = names[0] if spacecraft is None else spacecraft
    if name not in names:
        problem = f'"{name}" is not in {scenario}; {did_you_mean(name, names)}'
        raise ConfigError(COMMAND_LINE, "--spacecraft", problem)
    step = loaded.thermal_step if step is None else step
    if not 0.01 <= step <= 3600.0:
        raise ConfigError(COMMAND_LINE, "--step", f"must lie in 0.01..3600 s, got {step:g}")
    first, last = chosen_span(loaded, span)
    if last == first:
        raise ConfigError(COMMAND_LINE, "--to", "must be later than the start")
    epochs = list(dict.fromkeys([*regular(first, last, round(step * 1e9)), last]))
    if camera is not None:
        camera_names(loaded, [camera])
        if loaded.cameras[camera].thermal is None:
            problem = f'"{camera}" sees visible light; a thermal one has [camera.{camera}.thermal]'
            raise ConfigError(COMMAND_LINE, "--camera", problem)
    check_writable(out)
    bodies = {}
    with opened(loaded) as simulator:
        with activity("tracing how the surfaces see each other") as progress:
            for other in names if camera is not None else [name]:
                body = simulator.thermal_bodies.of(other, loaded.models[other], progress)
                progress.begin_stage(f"heat of {other} along the trajectory")
                history = thermal_history(
                    body, loaded, epochs, simulator.skies, initial.value, progress
                )
                bodies[other] = body, list(history)
            body, states = bodies[name]
            table, image = out / f"{name}.thermal.csv", out / f"{name}.thermal.png"
            write_temperatures(table, body, states)
            write_heat_map(image, body, states[-1])
            paths = [table, image]
        if camera is not None:
            last_states = {other: of_body[-1] for other, (_, of_body) in bodies.items()}
            paths += _image(simulator, camera, epochs[-1], last_states, out)
    coldest, hottest = (
        f(float(f(s.temperatures[: body.patch_count])) for s in states) for f in (min, max)
    )
    say(
        f"{len(states)} epochs, {body.patch_count} patches: {coldest:.1f} to {hottest:.1f} K",
        f"state {states[-1].digest}, {states[-1].history}",
        *paths,
    )


def _image(
    simulator: Simulator, camera: str, tai_ns: int, temperatures: Temperatures, folder: Path
) -> list[Path]:
    """The files of a thermal camera's image."""
    from simgl.figures.maps import write_maps
    from simgl.output import write_capture
    from simgl.products import Product

    products = {Product.DN, Product.THERMAL, Product.TRUTH}
    state = simulator.scenario.at(tai_ns)
    capture = simulator.capture(state, camera, products, temperatures=temperatures)
    return [*write_capture(capture, folder, camera), *write_maps(capture, folder, camera)]
