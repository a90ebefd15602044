"""``simgl campaign``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

_console = Console()


def campaign(
    file: Annotated[Path, typer.Argument(help="Campaign file (TOML).")],
    out: Annotated[Path, typer.Option(help="Folder for the results; a started one goes on.")],
    workers: Annotated[
        int | None,
        typer.Option(min=1, max=1024, help="Processes on this machine; 1 needs no Dask."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, instead of --workers.")
    ] = None,
) -> None:
    """Render frames drawn at random, on many workers, with labels to learn from.

    A run that was broken off goes on where it was. Example:
    simgl campaign examples/campaign/approach.toml --workers 2 --out out/campaign
    """
    from simgl.campaign.description import load_campaign
    from simgl.campaign.run import Crew, in_this_process, run
    from simgl.errors import ConfigError
    from simgl.progress import bake_bar, frame_bar

    if workers is not None and scheduler is not None:
        raise ConfigError("command line", "--scheduler", "brings its own workers; leave --workers")
    loaded = load_campaign(file)
    with bake_bar() as progress, frame_bar() as report:
        crew: Crew
        if scheduler is None and workers in (None, 1):
            crew = in_this_process(loaded, progress)
        else:
            try:
                from simgl.campaign.crew import distant_crew, local_crew
            except ImportError:
                problem = 'needs Dask: pip install "simgl[campaign]"'
                raise ConfigError("command line", "--workers", problem) from None
            crew = (
                local_crew(loaded, workers or 1)
                if scheduler is None
                else distant_crew(loaded, scheduler)
            )
        found = run(loaded, out, crew, report)
    lines = [f"{loaded.frames} frames in {out}, {found.taken} of them now; labels: {out}/coco.json"]
    if len(found.renderers) > 1:
        lines.append(f"note: taken by different renderers: {'; '.join(found.renderers)}")
    _console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)
