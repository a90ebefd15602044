"""The run of a campaign: every frame without a row, then the labels of all frames."""

from __future__ import annotations

from pathlib import Path

from simgl import __version__, assets
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.data_sets import check_formats, write_formats
from simgl.campaign.frame_task import COLUMNS, Format, RenderedFrame
from simgl.campaign.label_formats import stored_labels, write_camera, write_coco, write_speed
from simgl.output import check_writable, complete_file
from simgl.progress import ProgressCallback, silent
from simgl.sequence.journal import Identity, Journal, run_missing
from simgl.workers.frame_job import Executor


def run(
    campaign: Campaign,
    folder: Path,
    executor: Executor[RenderedFrame],
    progress: ProgressCallback = silent,
    formats: frozenset[Format] = frozenset(),
) -> tuple[int, tuple[str, ...]]:
    """Render every frame that the folder does not hold yet, then write the labels of all.

    progress : receives the frames done, including those of an earlier run, and their number
    formats : those of the executor's job
    returns : number of frames rendered now, and the OpenGL renderers of all frames
    Raises ConfigError for a folder that holds another campaign, and for a camera whose lens its
    labels cannot hold.
    """
    check_writable(folder)
    camera = campaign.scenario.cameras[campaign.camera]
    check_formats(campaign, formats)
    plan: Identity = {
        "simgl": __version__,
        "program": assets.digests(),
        "frames": campaign.frames,
        "campaign": campaign.identity,
    }
    if formats:
        plan = {**plan, "formats": ", ".join(sorted(formats))}
    with Journal(folder, plan, COLUMNS, keys=1) as journal:
        # First, since its format does not hold every lens.
        write_camera(folder / "camera.json", camera)
        done = {key for (key,) in journal.done()}
        missing = [frame for frame in range(campaign.frames) if frame not in done]

        def store(frame: RenderedFrame) -> None:
            # The row comes last: a frame with a row is complete.
            for name, content in frame.files.items():
                with complete_file(folder / name) as temporary:
                    temporary.write_bytes(content)
            journal.add(frame.row)

        run_missing(missing, campaign.frames, executor, store, progress)
        journal.export(folder / "frames.csv")
        rows = list(journal.rows())
    labels = stored_labels(folder, campaign.frames)
    write_coco(folder / "coco.json", labels, campaign.scenario.models, campaign.source.stem)
    write_speed(folder / "speed.json", rows)
    write_formats(folder, campaign, formats, rows)
    return len(missing), tuple(sorted({str(row["renderer"]) for row in rows}))
