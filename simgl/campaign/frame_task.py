"""One frame of a campaign: its files as bytes, and its row of the table."""

from __future__ import annotations

import hashlib
import io
import json
import math
import tempfile
from collections.abc import Mapping, Set
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from simgl.arrays import Image8
from simgl.campaign import bop_format
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.frame_scene import FrameScene, frame_scene
from simgl.campaign.labels import pose_in_camera, spacecraft_labels
from simgl.display_images import png_bytes
from simgl.images import DigitalFrame, saturated
from simgl.output import write_dn_png, write_light, write_view
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import quaternion_from_matrix, unit
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Columns, Row, Value
from simgl.simulator import Capture, Product, Simulator

COLUMNS: Columns = {
    "frame": int,
    "file": str,
    "utc": str,
    "tai_ns": int,
    "noise_seed": int,
    "exposure_time_s": float,
    "f_number": float,
    "range_m": float,
    "phase_angle_deg": float,
    "sunlight": float,
    "target_x_camera_m": float,
    "target_y_camera_m": float,
    "target_z_camera_m": float,
    "q_camera_from_target_x": float,
    "q_camera_from_target_y": float,
    "q_camera_from_target_z": float,
    "q_camera_from_target_w": float,
    "sun_direction_camera_x": float,
    "sun_direction_camera_y": float,
    "sun_direction_camera_z": float,
    "target_pixels": int,
    "saturated_pixels": int,
    "dn_sha256": str,
    "renderer": str,
}

_SUFFIXES = {"dn8": "png", "dn16": "png", "view": "png", "exr": "exr", "truth": "npz"}


class Format(StrEnum):
    """Data sets that a campaign can be written as, besides COCO and SPEED+."""

    BOP = "bop"
    COLMAP = "colmap"
    NERFSTUDIO = "nerfstudio"
    WEBDATASET = "webdataset"
    YOLO = "yolo"


@dataclass(frozen=True, kw_only=True)
class RenderedFrame:
    """A finished frame.

    files : content by path below the campaign's folder
    row : by ``COLUMNS``
    """

    files: Mapping[str, bytes]
    row: Row


@dataclass(frozen=True, kw_only=True)
class CampaignJob:
    """A campaign as a job for workers.

    formats : further data sets that frames are written for
    """

    campaign: Campaign
    formats: frozenset[Format] = frozenset()

    @property
    def scenario(self) -> Scenario:
        """Scenario that the simulators are opened for."""
        return self.campaign.scenario

    def render(self, simulator: Simulator, frame: int) -> RenderedFrame:
        """A frame's random scene, rendered; the same bytes on any worker at any time."""
        campaign = self.campaign
        scene = frame_scene(campaign, frame)
        products = {Product.DN, Product.TRUTH}
        if {"view", "exr"} & set(campaign.write):
            seen = scene.state.cameras[campaign.camera].camera
            products.add(Product.RADIANCE if seen.thermal is None else Product.THERMAL)
        if "truth" in campaign.write:
            products.add(Product.NORMALS)
        capture = captured(simulator, campaign, scene, products)
        files = {file_name(kind, frame): _content(kind, capture) for kind in campaign.write}
        labels = _labels(campaign, scene, capture)
        if Format.BOP in self.formats:
            assert capture.digital is not None
            assert capture.truth is not None
            grey = _content("dn8", capture)
            more, labels["bop"] = bop_format.frame_files(
                frame, grey, capture.digital, capture.truth, scene.state
            )
            files |= more
        files[label_name(frame)] = json.dumps(labels, indent=1).encode()
        return RenderedFrame(files=files, row=frame_row(campaign, scene, capture))


def captured(
    simulator: Simulator, campaign: Campaign, scene: FrameScene, products: Set[Product]
) -> Capture:
    """What a campaign's camera takes of a frame's scene, with the frame's own noise."""
    return simulator.capture(
        scene.state, campaign.camera, products, during=scene.during, seed=scene.seed
    )


def file_name(kind: str, frame: int) -> str:
    """Path of a frame's file below the campaign's folder."""
    return f"{kind}/{frame:06d}.{_SUFFIXES[kind]}"


def label_name(frame: int) -> str:
    """Path of a frame's labels below the campaign's folder."""
    return f"labels/{frame:06d}.json"


def eight_bits(frame: DigitalFrame) -> Image8:
    """(height, width) the eight leading bits of the digital numbers."""
    return (frame.dn >> (frame.info.camera.detector.bits - 8)).astype(np.uint8)


def _content(kind: str, capture: Capture) -> bytes:
    """The bytes of one kind of file."""
    digital = capture.digital
    assert digital is not None
    if kind == "dn8":
        return png_bytes(eight_bits(digital))
    if kind == "truth":
        return _truth_bytes(capture)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"frame.{_SUFFIXES[kind]}"
        if kind == "dn16":
            write_dn_png(path, digital)
        else:
            write = write_light if kind == "exr" else write_view
            write(path, capture)
        return path.read_bytes()


def _truth_bytes(capture: Capture) -> bytes:
    """Depth, normals and part of each pixel's centre, compressed."""
    truth, normals = capture.truth, capture.normals
    assert truth is not None
    assert normals is not None
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer, depth_m=truth.depth, normals_camera=normals.normals, part_id=truth.part_id
    )
    return buffer.getvalue()


def _labels(campaign: Campaign, scene: FrameScene, capture: Capture) -> dict[str, object]:
    info, truth = capture.info, capture.truth
    assert truth is not None
    detector = info.camera.detector
    return {
        "frame": scene.frame,
        "file": Path(file_name(campaign.write[0], scene.frame)).name,
        "utc": utc_from_tai_ns(info.epoch_tai_ns),
        "width_px": detector.width,
        "height_px": detector.height,
        "sun_direction_camera": (info.R_camera_from_icrf @ info.sun_direction_icrf).tolist(),
        "spacecraft": [asdict(label) for label in spacecraft_labels(truth, scene.state)],
    }


def frame_row(campaign: Campaign, scene: FrameScene, capture: Capture) -> Row:
    """The row of a frame, by ``COLUMNS``."""
    info, state = capture.info, scene.state
    assert capture.digital is not None
    assert capture.truth is not None
    dn = capture.digital.dn
    body = state.bodies[campaign.target]
    sun = state.sun.seen_from(body.pose.position).direction_icrf
    towards = unit(info.position - body.pose.position)
    R, position = pose_in_camera(info, body)
    instance = list(state.bodies).index(campaign.target) + 1
    values: list[Value] = [
        scene.frame,
        Path(file_name(campaign.write[0], scene.frame)).name,
        utc_from_tai_ns(info.epoch_tai_ns),
        info.epoch_tai_ns,
        scene.seed,
        info.camera.exposure_time,
        info.camera.lens.f_number,
        float(np.linalg.norm(position)),
        math.degrees(math.atan2(float(np.linalg.norm(np.cross(sun, towards))), sun @ towards)),
        state.sunlit_share(body.pose.position),
        *position.tolist(),
        *quaternion_from_matrix(R).tolist(),
        *(info.R_camera_from_icrf @ info.sun_direction_icrf).tolist(),
        int((capture.truth.instance == instance).sum()),
        int(saturated(dn, info.camera.detector).sum()),
        hashlib.sha256(np.ascontiguousarray(dn).tobytes()).hexdigest(),
        info.renderer,
    ]
    return dict(zip(COLUMNS, values, strict=True))
