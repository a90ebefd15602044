"""``simgl campaign``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simgl.workers.worker_options import Scheduler, Workers

_console = Console()


def campaign(
    file: Annotated[Path, typer.Argument(help="Campaign file (TOML).")],
    out: Annotated[Path, typer.Option(help="Folder for the results; a started one goes on.")],
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Render frames drawn at random, on many workers, with labels to learn from.

    A run that was broken off goes on where it was. Example:
    simgl campaign examples/campaign/approach.toml --workers 2 --out out/campaign
    """
    from simgl.campaign.campaign_file import load_campaign
    from simgl.campaign.frame_task import CampaignJob
    from simgl.campaign.run_campaign import run
    from simgl.cli_progress import frame_bar, opened
    from simgl.workers.executors import hired

    loaded = load_campaign(file)
    with opened(loaded.scenario) as simulator, frame_bar() as report:
        crew = hired(CampaignJob(campaign=loaded), simulator, workers, scheduler)
        found = run(loaded, out, crew, report)
    lines = [f"{loaded.frames} frames in {out}, {found.taken} of them now; labels: {out}/coco.json"]
    if len(found.renderers) > 1:
        lines.append(f"note: taken by different renderers: {'; '.join(found.renderers)}")
    _console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)
