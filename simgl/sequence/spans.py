"""Options of the command line that say which epochs of a trajectory."""

from __future__ import annotations

from typing import Annotated

import typer

Start = Annotated[
    str | None, typer.Option("--from", help="UTC; the scenario's epoch if not given.")
]
Stop = Annotated[str | None, typer.Option("--to", help="UTC of the end.")]
Duration = Annotated[float | None, typer.Option(help="Instead of --to, in seconds.")]
Step = Annotated[float | None, typer.Option(help="Seconds between epochs.")]
Count = Annotated[int | None, typer.Option(help="So many epochs at equal steps.")]
Random = Annotated[int | None, typer.Option(help="So many epochs at random.")]
Seed = Annotated[int, typer.Option(help="Of --random.")]
