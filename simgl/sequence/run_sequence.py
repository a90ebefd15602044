"""The run of a sequence: every epoch and camera that has no row yet, files first, then the row."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from simgl import __version__
from simgl.images import saturated
from simgl.output import check_writable, write_dn_png, write_exr, write_view_png
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import quaternion_from_matrix
from simgl.progress import ProgressCallback
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Columns, Journal, Value
from simgl.sequence.video import write_mp4
from simgl.simulator import Capture, Product, Simulator


class Output(StrEnum):
    """What a sequence leaves for each frame, or over all of them."""

    DN = "dn"
    VIEW = "view"
    EXR = "exr"
    MP4 = "mp4"


_PRODUCTS = {
    Output.DN: {Product.DN},
    Output.VIEW: {Product.RADIANCE},
    Output.EXR: {Product.RADIANCE, Product.TRUTH},
    Output.MP4: {Product.RADIANCE},
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
    """Which pictures of a scenario, and what is left of each.

    epochs : [TAI ns], in order
    frame_rate : of the video [Hz]
    """

    scenario: Scenario
    cameras: tuple[str, ...]
    epochs: Sequence[int]
    outputs: frozenset[Output]
    frame_rate: int = 24

    def content(self) -> dict[str, Value]:
        """What tells this plan from another."""
        return {
            "cameras": ", ".join(self.cameras),
            "outputs": ", ".join(sorted(self.outputs)),
        } | identity(self.scenario, self.epochs)


def identity(scenario: Scenario, epochs: Sequence[int]) -> dict[str, Value]:
    """What tells one scenario at some epochs [TAI ns] from another."""
    return {
        "simgl": __version__,
        "frames": len(epochs),
        "epochs": hashlib.sha256(np.array(epochs, dtype=np.int64).tobytes()).hexdigest(),
        "scenario": fingerprint(scenario, epochs),
    }


def fingerprint(scenario: Scenario, epochs: Sequence[int]) -> str:
    """Hash of a scenario's text, its models, and its motion at the first, middle and last epoch."""
    h = hashlib.sha256()
    if scenario.source is not None:
        h.update(scenario.source.read_bytes())
    for model in scenario.models.values():
        h.update(model.mesh.digest.encode())
        h.update(repr((model.materials, model.joints)).encode())
    for tai_ns in (epochs[0], epochs[len(epochs) // 2], epochs[-1]):
        for pose in scenario.poses(tai_ns).values():
            h.update(pose.position.tobytes() + pose.R_icrf_from_body.tobytes())
    return h.hexdigest()


def row_of(frame: int, exposure: Capture) -> dict[str, Value]:
    """What the table says of a picture with its digital numbers."""
    info, digital = exposure.info, exposure.digital
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
    """Where a frame's file lies."""
    return folder / camera / f"{frame:06d}.{suffix}"


def run(
    plan: Plan, simulator: Simulator, folder: Path, report: ProgressCallback | None = None
) -> int:
    """Take every picture of a plan that its folder does not hold yet.

    report : told the pictures done and their number, those of an earlier run among them
    returns : how many were taken now
    Raises ConfigError for a folder that holds another sequence.
    """
    check_writable(folder)
    wanted = [(f, camera) for f in range(len(plan.epochs)) for camera in plan.cameras]
    with Journal(folder, plan.content(), COLUMNS, KEYS) as journal:
        done = journal.done()
        missing = [key for key in wanted if key not in done]
        for taken, (frame, camera) in enumerate(missing):
            if report is not None:
                report(len(wanted) - len(missing) + taken, len(wanted))
            exposure = _take(plan, simulator, plan.epochs[frame], camera)
            _write(plan, exposure, folder, frame)
            journal.add(row_of(frame, exposure))
        if report is not None:
            report(len(wanted), len(wanted))
        journal.export(folder / "frames.csv")
    for camera in plan.cameras if Output.MP4 in plan.outputs else ():
        pictures = [frame_path(folder, camera, f, "view.png") for f in range(len(plan.epochs))]
        write_mp4(folder / f"{camera}.mp4", pictures, plan.frame_rate)
    return len(missing)


def _take(plan: Plan, simulator: Simulator, tai_ns: int, camera: str) -> Capture:
    products = {Product.DN}.union(*(_PRODUCTS[output] for output in plan.outputs))
    during = plan.scenario.around(tai_ns)
    return simulator.capture(plan.scenario.at(tai_ns), camera, products, during=during)


def _write(plan: Plan, exposure: Capture, folder: Path, frame: int) -> None:
    camera = exposure.info.camera.name
    if Output.DN in plan.outputs:
        assert exposure.digital is not None
        write_dn_png(frame_path(folder, camera, frame, "dn.png"), exposure.digital)
    if plan.outputs & {Output.VIEW, Output.MP4}:
        assert exposure.radiance is not None
        write_view_png(frame_path(folder, camera, frame, "view.png"), exposure.radiance)
    if Output.EXR in plan.outputs:
        assert exposure.radiance is not None
        path = frame_path(folder, camera, frame, "radiance.exr")
        write_exr(path, exposure.radiance, exposure.truth)
