"""The run of a campaign: every frame that has no row yet, from whoever takes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simgl import __version__
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.frame_task import COLUMNS, KEYS, Taken
from simgl.campaign.label_formats import stored_labels, write_camera, write_coco, write_speed
from simgl.output import check_writable, complete_file
from simgl.progress import ProgressCallback
from simgl.sequence.journal import Journal, Value
from simgl.workers.frame_job import Crew


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """taken : frames now; renderers : that frames were ever taken by."""

    taken: int
    renderers: tuple[str, ...]


def run(
    campaign: Campaign, folder: Path, crew: Crew[Taken], report: ProgressCallback | None = None
) -> Outcome:
    """Take every frame that the folder does not hold yet, then write the labels of all.

    report : told the frames done and their number, those of an earlier run among them
    Raises ConfigError for a folder that holds another campaign.
    """
    check_writable(folder)
    content: dict[str, Value] = {
        "simgl": __version__,
        "frames": campaign.frames,
        "campaign": campaign.digest,
    }
    with Journal(folder, content, COLUMNS, KEYS) as journal:
        done = {key for (key,) in journal.done()}
        missing = [frame for frame in range(campaign.frames) if frame not in done]
        if report is not None:
            report(campaign.frames - len(missing), campaign.frames)
        if missing:
            with crew as taking:
                for count, taken in enumerate(taking(missing), start=1):
                    _keep(folder, taken, journal)
                    if report is not None:
                        report(campaign.frames - len(missing) + count, campaign.frames)
        journal.export(folder / "frames.csv")
        rows = list(journal.rows())
    labels = stored_labels(folder, campaign.frames)
    write_coco(folder / "coco.json", labels, campaign.scenario.models, campaign.source.stem)
    write_speed(folder / "speed.json", rows)
    write_camera(folder / "camera.json", campaign.scenario.cameras[campaign.camera])
    renderers = sorted({str(row["renderer"]) for row in rows})
    return Outcome(taken=len(missing), renderers=tuple(renderers))


def _keep(folder: Path, taken: Taken, journal: Journal) -> None:
    """Its files, then its row: a frame with a row is complete."""
    for name, content in taken.files.items():
        with complete_file(folder / name) as temporary:
            temporary.write_bytes(content)
    journal.add(taken.row)
