"""The commands together: their names, further ones of other packages, and what errors become."""

from __future__ import annotations

import logging
import os
import sys
import warnings
from importlib.metadata import entry_points
from typing import Annotated

import typer
from rich.console import Console

from simgl.commands import inspection_commands, render_commands, start_commands
from simgl.commands.assess_command import assess
from simgl.commands.bench_command import bench
from simgl.commands.command_line import end_without_reader, say, with_quiet
from simgl.commands.events_command import events
from simgl.commands.record_command import record
from simgl.commands.ros2_command import ros2
from simgl.commands.thermal_command import thermal
from simgl.commands.usage_line import usage_line
from simgl.errors import SimglError

app = typer.Typer(
    help="Camera images of spacecraft in low Earth orbit, in physical units.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
camera_app = typer.Typer(help="Test a camera, or export its calibration.", no_args_is_help=True)
model_app = typer.Typer(help="Check a model, or look at it from all sides.", no_args_is_help=True)

COMMANDS = (
    inspection_commands.doctor,
    start_commands.new,
    start_commands.example,
    render_commands.render,
    render_commands.sequence,
    record,
    ros2,
    events,
    render_commands.exposure,
    assess,
    thermal,
    bench,
    inspection_commands.view,
    render_commands.campaign,
)
BUILT_IN = {"camera", "model"} | {command.__name__ for command in COMMANDS}
for command in COMMANDS:
    app.command()(with_quiet(command))
app.add_typer(camera_app, name="camera")
app.add_typer(model_app, name="model")
camera_app.command("test")(with_quiet(inspection_commands.camera_test))
camera_app.command("export")(with_quiet(inspection_commands.camera_export))
model_app.command("check")(with_quiet(inspection_commands.model_check))
model_app.command("turntable")(with_quiet(inspection_commands.model_turntable))


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    if version:
        from simgl import __version__

        say(__version__)
        raise typer.Exit


def run() -> None:
    """Run the command that the arguments of this process name.

    A SimglError, a file that fails or a word that no command knows becomes one line on stderr and
    exit status 2.
    """
    _silence_libraries()
    # Typer prints help by a console of its own, which would end with status 1.
    Console.on_broken_pipe = _on_broken_pipe  # type: ignore[assignment, method-assign]
    try:
        _load_further_commands()
        sys.exit(app(prog_name="simgl", standalone_mode=False) or 0)
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:
        # Of a file that no user names, such as a temporary one.
        print(f"simgl: {error.filename or 'system'}: {error.strerror or error}", file=sys.stderr)
        sys.exit(2)
    except Exception as error:
        line = usage_line(error)
        if line is None:
            raise
        if line:
            print(f"simgl: {line}", file=sys.stderr)
        sys.exit(2)


def _on_broken_pipe(console: Console) -> None:
    console.quiet = True
    end_without_reader()


def _silence_libraries() -> None:
    """Leave stderr to simgl: its users cannot act on warnings about how simgl uses libraries."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(logging.Formatter("simgl: %(message)s"))
        logging.lastResort.addFilter(_is_of_simgl)
    # Where a computer has no GPU, Mesa looks for one aloud before it draws on the CPU.
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")


def _is_of_simgl(record: logging.LogRecord) -> bool:
    return record.name.partition(".")[0] in ("simgl", "simgl_bridge")


def _load_further_commands() -> None:
    """Commands of other packages join through the entry-point group ``simgl.commands``.

    They are imported only where they may be needed: for help, or for a name that is not ours.
    """
    # What a shell asks to be completed comes by environment variables.
    words = os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS")
    given = words.split()[1:2] if words else sys.argv[1:2]
    if not BUILT_IN.isdisjoint(given):
        return
    for entry in entry_points(group="simgl.commands"):
        app.command(name=entry.name)(with_quiet(entry.load()))
