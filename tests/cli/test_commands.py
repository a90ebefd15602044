"""Commands: groups of options are dataclasses, and ``simgl --help`` starts without the renderer."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer.main import get_command
from typer.testing import CliRunner

from simgl.commands import application
from simgl.commands.command_line import with_option_groups

PACKAGE = Path(__file__).parents[2] / "simgl"
FILES = [PACKAGE / "cli.py", *sorted((PACKAGE / "commands").glob("*.py"))]
LIGHT = {
    "simgl", "simgl.assets", "simgl.cli_progress", "simgl.errors", "simgl.interruption",
    "simgl.progress", "simgl.sequence.epoch_options", "rich", "typer"
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Light:
    """A group of two options."""

    power: Annotated[float, typer.Option(help="In watts.")] = 5.0
    colour: Annotated[str | None, typer.Option("--tint")] = None


def test_a_group_of_options_is_its_fields() -> None:
    received: list[object] = []

    @with_option_groups
    def lamp(name: str, light: Light, angle: float = 20.0) -> None:
        """Switch a lamp on."""
        received.extend([name, light, angle])

    app = typer.Typer()
    app.command()(lamp)
    result = CliRunner().invoke(app, ["spot", "--power", "7", "--tint", "red", "--angle", "3"])
    assert result.exit_code == 0, result.output
    assert received == ["spot", Light(power=7.0, colour="red"), 3.0]
    received.clear()
    assert CliRunner().invoke(app, ["spot"]).exit_code == 0
    assert received == ["spot", Light(), 20.0]
    text = CliRunner().invoke(app, ["--help"]).output
    assert "Switch a lamp on." in text
    assert "In watts." in text


def imported_at_start_up(tree: ast.Module) -> Iterator[str]:
    """Modules that a file's own statements import, those for type checkers excepted."""
    for node in tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module


def test_no_help_holds_what_would_be_read_as_markup() -> None:
    """Rich takes a word in brackets for a style and leaves it out."""

    further = typer.Typer()
    for entry in entry_points(group="simgl.commands"):
        further.command(name=entry.name)(entry.load())
    texts = [text for app in (application.app, further) for text in help_texts(get_command(app))]
    assert len(texts) > 100
    assert not [text for text in texts if re.search(r"\[[a-z#/@]", text)]


def help_texts(command: Any) -> Iterator[str]:
    """Of a command, its parameters, and the commands within it."""
    yield command.help or ""
    for parameter in command.params:
        yield getattr(parameter, "help", None) or ""
    for inner in getattr(command, "commands", {}).values():
        yield from help_texts(inner)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_commands_import_what_is_slow_only_when_they_run(path: Path) -> None:
    names = set(imported_at_start_up(ast.parse(path.read_text(encoding="utf-8"))))
    others = {n for n in names if n.partition(".")[0] not in sys.stdlib_module_names}
    heavy = {n for n in others if n not in LIGHT and n.partition(".")[0] not in LIGHT}
    assert not {n for n in heavy if not n.startswith("simgl.commands")}
