"""Commands: groups of options are dataclasses, and ``simgl --help`` starts without the renderer."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

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


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_commands_import_what_is_slow_only_when_they_run(path: Path) -> None:
    names = set(imported_at_start_up(ast.parse(path.read_text(encoding="utf-8"))))
    others = {n for n in names if n.partition(".")[0] not in sys.stdlib_module_names}
    heavy = {n for n in others if n not in LIGHT and n.partition(".")[0] not in LIGHT}
    assert not {n for n in heavy if not n.startswith("simgl.commands")}
