"""Recorded runs of Basilisk (``_UnityViz.bin``) to images, without Basilisk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from simgl.errors import AssetError, SimglError
from simgl.input_files import read_file
from simgl.output import check_writable, complete_file
from simgl_bridge.basilisk.camera_overrides import DEFAULT_OVERRIDES, CameraOverrides
from simgl_bridge.basilisk.camera_png import png_of
from simgl_bridge.basilisk.viz_messages import UnreadableError, Update, read_recording
from simgl_bridge.basilisk.viz_scene import check_base
from simgl_bridge.operator_log import OperatorLog
from simgl_bridge.render_session import RenderSession

# Some million states.
_MAX_BYTES = 4 << 30


def recorded(path: Path) -> Iterator[Update]:
    """The states of a recording, each with the epoch and settings of the ones before.

    Raises AssetError where it cannot be read, after the states before that.
    """
    data = read_file(path, _MAX_BYTES)
    last = Update()
    try:
        for update in read_recording(data):
            last = replace(
                update,
                epoch=update.epoch or last.epoch,
                settings=update.settings or last.settings,
                cameras=update.cameras or last.cameras,
            )
            yield last
    except UnreadableError as error:
        raise AssetError(f"{path}: {error}") from None


def replay(
    path: Path,
    render_session: RenderSession,
    folder: Path,
    *,
    overrides: Mapping[int, CameraOverrides],
    every: int = 1,
) -> int:
    """Write ``camera_ID_NANOSECONDS.png`` for every camera and state; returns how many.

    every : write only every n-th state

    Raises AssetError where the recording cannot be read and OutputError where nothing can be
    written; the images before that are complete.
    """
    check_base(render_session.scenario)
    warn = OperatorLog("simgl: basilisk")
    check_writable(folder)
    count = 0
    for index, update in enumerate(recorded(path)):
        if index % every:
            continue
        for config in update.cameras:
            camera = overrides.get(config.id, DEFAULT_OVERRIDES)
            try:
                png = png_of(render_session, update, config.id, camera, warn)
            except SimglError as error:
                warn(f"no image: {error}")
                continue
            name = f"camera_{config.id}_{round(update.instant.sim_time_ns):015d}.png"
            with complete_file(folder / name) as partial:
                partial.write_bytes(png)
            count += 1
    return count
