"""A campaign as WebDataset shards: tar files, in which files of one name belong together.

Format: github.com/webdataset/webdataset. A name ends at its first dot; what follows says how a
reader decodes the file.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from simgl.campaign.campaign_file import Campaign
from simgl.campaign.frame_task import file_name
from simgl.output import complete_file
from simgl.sequence.journal import Value

# A shard of an 8-bit image of 1 Mpx with labels is then some 100 MB.
FRAMES_PER_SHARD = 500


def write_webdataset(
    folder: Path,
    campaign: Campaign,
    labels: Iterable[Mapping[str, Any]],
    rows: Iterable[Mapping[str, Value]],
) -> None:
    """Write the shards ``webdataset/000000.tar`` ...: the files of ``write``, labels and row.

    A kind's file is ``FRAME.KIND.SUFFIX``, such as ``000000.dn8.png``; ``FRAME.json`` holds the
    labels, and the row of the table under ``frame_row``. Two runs give the same bytes.
    """
    numbered = enumerate(zip(labels, rows, strict=True))
    for shard in range(-(-campaign.frames // FRAMES_PER_SHARD)):
        frames = range(
            shard * FRAMES_PER_SHARD, min((shard + 1) * FRAMES_PER_SHARD, campaign.frames)
        )
        path = folder / f"webdataset/{shard:06d}.tar"
        with complete_file(path) as temporary, tarfile.open(temporary, "w") as archive:
            for _, (frame, (label, row)) in zip(frames, numbered, strict=False):
                for kind in campaign.write:
                    stored = Path(file_name(kind, frame))
                    content = (folder / stored).read_bytes()
                    _add(archive, f"{frame:06d}.{kind}{stored.suffix}", content)
                document = {**label, "frame_row": dict(row)}
                _add(archive, f"{frame:06d}.json", json.dumps(document).encode())


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    # Without time and owner, which differ from run to run.
    entry = tarfile.TarInfo(name)
    entry.size = len(content)
    archive.addfile(entry, io.BytesIO(content))
