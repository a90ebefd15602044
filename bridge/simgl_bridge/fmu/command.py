"""``simgl fmu``: a camera of a scenario as a functional mock-up unit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgl.commands.command_line import say
from simgl.commands.completion import scenario_files
from simgl.errors import ConfigError
from simgl_bridge.bind_address import DEFAULT_ADDRESS


def fmu(
    scenario: Annotated[
        Path, typer.Argument(help="Scenario file (TOML).", autocompletion=scenario_files)
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="FMU file; an existing one is replaced.")
    ],
    camera: Annotated[
        str | None, typer.Option(help="Camera name; optional if there is only one.")
    ] = None,
    body: Annotated[
        list[str] | None,
        typer.Option(
            help="Spacecraft whose pose the importer sets; all if not given. The others follow the "
            "scenario."
        ),
    ] = None,
    sun: Annotated[
        bool,
        typer.Option(
            "--sun",
            help="The importer also sets the Sun's position; it otherwise follows from the epoch.",
        ),
    ] = False,
    address: Annotated[
        str, typer.Option(help="Where a running simgl serve is looked for; a parameter of the FMU.")
    ] = DEFAULT_ADDRESS,
) -> None:
    """Write a camera as an FMU (FMI 3.0, co-simulation), for Simulink, Dymola, OpenModelica, FMPy.

    Inputs are poses, joints, lamps and exposure; outputs the image, its hash and its times. The
    FMU uses a running simgl serve, or starts one.

    Example: simgl fmu approach.toml --out camera.fmu
    """
    from simgl.cli_progress import load
    from simgl_bridge.fmu.archive import camera_model, write_fmu

    if out.suffix != ".fmu":
        raise ConfigError("simgl fmu", "--out", f'must end in .fmu, got "{out}"')
    model = camera_model(
        load(scenario),
        camera=camera,
        bodies=None if body is None else tuple(body),
        sends_sun=sun,
        address=address,
    )
    written = write_fmu(model, out)
    count = sum(v.causality == "input" for v in written.variables)
    binary = f"binary for {written.platform}" if written.platform else "sources only"
    say(f"{out}: camera {model.camera}, {count} inputs, {binary}")
    if written.problem:
        say(f"no binary: {written.problem}; importers compile the sources")
    if written.needs_libzmq:
        say("pyzmq brings no libzmq here: importers of the binary need libzmq.so.5")
