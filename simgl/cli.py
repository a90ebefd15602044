"""The command line. Bad input gives one clear line and exit code 2."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points
from typing import Annotated

import typer

from simgl.commands import inspection_commands, render_commands
from simgl.commands.assess_command import assess
from simgl.commands.command_line import say
from simgl.errors import SimglError

app = typer.Typer(
    help="Camera images of spacecraft in low Earth orbit, in physical units.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
camera_app = typer.Typer(help="Cameras by themselves.", no_args_is_help=True)
model_app = typer.Typer(help="Models by themselves.", no_args_is_help=True)

COMMANDS = (
    inspection_commands.doctor,
    render_commands.render,
    render_commands.sequence,
    render_commands.exposure,
    assess,
    inspection_commands.bench,
    inspection_commands.view,
    render_commands.campaign,
)
BUILT_IN = {"camera", "model"} | {command.__name__ for command in COMMANDS}
for command in COMMANDS:
    app.command()(command)
app.add_typer(camera_app, name="camera")
app.add_typer(model_app, name="model")
camera_app.command("test")(inspection_commands.camera_test)
model_app.command("check")(inspection_commands.model_check)
model_app.command("turntable")(inspection_commands.model_turntable)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    if version:
        from simgl import __version__

        say(__version__)
        raise typer.Exit


def _load_further_commands() -> None:
    """Commands of other packages join through the entry-point group ``simgl.commands``.

    They are imported only where they may be needed: for help, or for a name that is not ours.
    """
    if not BUILT_IN.isdisjoint(sys.argv[1:2]):
        return
    for entry in entry_points(group="simgl.commands"):
        app.command(name=entry.name)(entry.load())


def main() -> None:
    """Entry point: run a command, turn a SimglError into one line and exit code 2."""
    try:
        _load_further_commands()
        app()
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
