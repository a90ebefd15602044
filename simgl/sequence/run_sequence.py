"""The run of a sequence: each epoch and camera without a row, files first, then the row."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from simgl import __version__, assets
from simgl.content_digest import content_digest
from simgl.images import saturated
from simgl.output import check_writable, write_dn_png, write_light, write_view
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import quaternion_from_matrix
from simgl.progress import ProgressCallback, silent
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Columns, Identity, Journal, Row, Value
from simgl.simulator import Capture, Product, Simulator, products_of
from simgl.video import write_mp4


class Output(StrEnum):
    """Files that a sequence writes for each frame, or, as MP4, for all of them."""

    DN = "dn"
    VIEW = "view"
    EXR = "exr"
    MP4 = "mp4"


# Of these a camera has those for its light.
_PRODUCTS = {
    Output.DN: {Product.DN},
    Output.VIEW: {Product.RADIANCE, Product.THERMAL},
    Output.EXR: {Product.RADIANCE, Product.THERMAL, Product.TRUTH},
    Output.MP4: {Product.RADIANCE, Product.THERMAL},
}

COLUMNS: Columns = {
    "frame": int,
    "camera": str,
    "utc": str,
    "tai_ns": int,
    "exposure_time_s": float,
    "camera_x_gcrf_m": float,
    "camera_y_gcrf_m": float,
    "camera_z_gcrf_m": float,
    "q_camera_from_icrf_x": float,
    "q_camera_from_icrf_y": float,
    "q_camera_from_icrf_z": float,
    "q_camera_from_icrf_w": float,
    "sun_direction_icrf_x": float,
    "sun_direction_icrf_y": float,
    "sun_direction_icrf_z": float,
    "saturated_pixels": int,
    "dn_sha256": str,
}
KEYS = 2


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Which frames of a scenario to render, and which files to write.

    epochs : [TAI ns], in order
    frame_rate : of the video [Hz]
    """

    scenario: Scenario
    cameras: tuple[str, ...]
    epochs: Sequence[int]
    outputs: frozenset[Output]
    frame_rate: int = 24

    def content(self) -> Identity:
        """Identity of the plan, for its journal."""
        return {
            "cameras": ", ".join(self.cameras),
            "outputs": ", ".join(sorted(self.outputs)),
        } | identity(self.scenario, self.epochs)


def identity(scenario: Scenario, epochs: Sequence[int]) -> dict[str, Value | Mapping[str, str]]:
    """Identity of a scenario at some epochs [TAI ns], for a journal."""
    return {
        "simgl": __version__,
        "program": assets.digests(),
        "frames": len(epochs),
        "epochs": hashlib.sha256(np.array(epochs, dtype=np.int64).tobytes()).hexdigest(),
        "scenario": fingerprint(scenario, scenario.inputs, scenario.source),
    }


def fingerprint(
    scenario: Scenario, inputs: Mapping[Path, str], source: Path | None
) -> dict[str, str]:
    """Digests of all files that a scenario was read from, and of all that it holds.

    inputs : digests by path
    source : file whose folder others are named from
    """
    folder = (source or Path("scenario.toml")).resolve().parent
    files = {_name(path.resolve(), folder): digest for path, digest in inputs.items()}
    return files | {"what it holds in memory": content_digest(replace(scenario, source=None))}


def _name(path: Path, folder: Path) -> str:
    """A file's name from a folder, so that all may move together; shipped ones from simgl's."""
    for root, name in ((assets.models(), "simgl/models"), (assets.data(), "simgl/data")):
        if path.is_relative_to(root):
            return f"{name}/{path.relative_to(root).as_posix()}"
    return os.path.relpath(path, folder)


def row_of(frame: int, capture: Capture) -> Row:
    """The table's row of a capture with digital numbers."""
    info, digital = capture.info, capture.digital
    assert digital is not None
    x, y, z = info.position.tolist()
    qx, qy, qz, qw = quaternion_from_matrix(info.R_camera_from_icrf).tolist()
    sun_x, sun_y, sun_z = info.sun_direction_icrf.tolist()
    values: list[Value] = [
        frame,
        info.camera.name,
        utc_from_tai_ns(info.epoch_tai_ns),
        info.epoch_tai_ns,
        info.camera.exposure_time,
        *(x, y, z),
        *(qx, qy, qz, qw),
        *(sun_x, sun_y, sun_z),
        int(saturated(digital.dn, info.camera.detector).sum()),
        hashlib.sha256(np.ascontiguousarray(digital.dn).tobytes()).hexdigest(),
    ]
    return dict(zip(COLUMNS, values, strict=True))


def frame_path(folder: Path, camera: str, frame: int, suffix: str) -> Path:
    """Path of a frame's file."""
    return folder / camera / f"{frame:06d}.{suffix}"


def run(plan: Plan, simulator: Simulator, folder: Path, progress: ProgressCallback = silent) -> int:
    """Render every frame of a plan that its folder does not hold yet.

    progress : receives the frames complete, including those of an earlier run, and their number
    returns : how many were rendered now
    Raises ConfigError for a folder that holds another sequence.
    """
    check_writable(folder)
    wanted = [(f, camera) for f in range(len(plan.epochs)) for camera in plan.cameras]
    with Journal(folder, plan.content(), COLUMNS, KEYS) as journal:
        done = journal.done()
        missing = [key for key in wanted if key not in done]
        for count, (frame, camera) in enumerate(missing):
            progress(len(wanted) - len(missing) + count, len(wanted))
            capture = _capture(plan, simulator, plan.epochs[frame], camera)
            _write(plan, capture, folder, frame)
            journal.add(row_of(frame, capture))
        progress(len(wanted), len(wanted))
        journal.export(folder / "frames.csv")
    for camera in plan.cameras if Output.MP4 in plan.outputs else ():
        images = [frame_path(folder, camera, f, "view.png") for f in range(len(plan.epochs))]
        write_mp4(folder / f"{camera}.mp4", images, plan.frame_rate)
    return len(missing)


def _capture(plan: Plan, simulator: Simulator, tai_ns: int, camera: str) -> Capture:
    wanted = {Product.DN}.union(*(_PRODUCTS[output] for output in plan.outputs))
    wanted &= products_of(plan.scenario.cameras[camera])
    return simulator.capture_at(tai_ns, camera, wanted)


def _write(plan: Plan, capture: Capture, folder: Path, frame: int) -> None:
    camera = capture.info.camera.name
    if Output.DN in plan.outputs:
        assert capture.digital is not None
        write_dn_png(frame_path(folder, camera, frame, "dn.png"), capture.digital)
    if plan.outputs & {Output.VIEW, Output.MP4}:
        write_view(frame_path(folder, camera, frame, "view.png"), capture)
    if Output.EXR in plan.outputs:
        kind = "radiance" if capture.thermal is None else "thermal"
        write_light(frame_path(folder, camera, frame, f"{kind}.exr"), capture)
