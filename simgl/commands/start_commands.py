"""Commands for the first hour: a project to edit, and the shipped examples."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from simgl.commands.command_line import say, say_rich
from simgl.commands.completion import example_names


def new(
    name: Annotated[Path, typer.Argument(help="Folder to make.", show_default=False)],
) -> None:
    """Write a folder with a scenario, a camera and a closed loop to edit.

    Example: simgl new first
    """
    from simgl.shipped_examples import new_project

    for path in new_project(name):
        say(path)
    say(
        "",
        shlex.join(["simgl", "render", f"{name}/scenario.toml", "--out", f"out/{name.name}"]),
        shlex.join(["python", f"{name}/loop.py"]),
    )


def example(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Example to copy, or all; without it they are listed.",
            autocompletion=example_names,
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder to copy to.")] = Path("."),
) -> None:
    """List the shipped examples, or copy one with the files that it reads.

    Example: simgl example short/radiance
    """
    from rich.table import Table

    from simgl.shipped_examples import copy_example, shipped_examples

    if name is not None:
        paths = copy_example(name, out)
        say(*paths)
        if name != "all":
            say("", shipped_examples()[name].command)
        return
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("example", no_wrap=True)
    table.add_column("what it shows")
    for shipped in shipped_examples().values():
        table.add_row(shipped.name, shipped.title)
    say_rich(table)
