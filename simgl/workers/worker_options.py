"""Options of the command line that say who takes the frames."""

from __future__ import annotations

from typing import Annotated

import typer

Workers = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Processes on this machine; more than 1 need Dask."),
]
Scheduler = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, instead of --workers.")
]
