"""Options of commands that show something in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgl.commands.command_line import COMMAND_LINE
from simgl.errors import ConfigError

WEB_PANEL = "Browser"

WebAddress = Annotated[
    str | None,
    typer.Option(
        help="HOST:PORT of the page; 127.0.0.1:5580 if not given, and * finds a free port.",
        rich_help_panel=WEB_PANEL,
    ),
]
WebToken = Annotated[
    Path | None,
    typer.Option(
        help="File with the token that browsers must show, made if it is missing; needed to bind "
        "an address that other machines reach.",
        rich_help_panel=WEB_PANEL,
    ),
]


def refuse_without_web(address: str | None, token: Path | None) -> None:
    """Raises ConfigError for options that mean nothing without ``--web``."""
    for option, given in (("--web-address", address), ("--web-token", token)):
        if given is not None:
            raise ConfigError(COMMAND_LINE, option, "requires --web")
