"""Depth and normals of a campaign's frames as COLMAP and nerfstudio read them."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from simgl.arrays import Array32
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.frame_task import file_name
from simgl.campaign.pose_formats import nerfstudio_depth_name
from simgl.output import complete_file

# nerfstudio's depth_unit_scale_factor, 1e-3, turns it into metres again.
_MILLIMETRE = np.float32(1e3)


def write_colmap_maps(folder: Path, campaign: Campaign) -> None:
    """COLMAP's dense maps ``colmap/stereo/*_maps/IMAGE.geometric.bin``.

    They are of images without distortion. Depth along the boresight [m] and normals in camera
    axes, 0 where there is no spacecraft.
    """
    for frame, depth, normals in _stored_maps(folder, campaign):
        image = Path(file_name(campaign.write[0], frame)).name
        for kind, values in (("depth", depth[..., np.newaxis]), ("normal", normals)):
            path = folder / f"colmap/stereo/{kind}_maps/{image}.geometric.bin"
            _write(path, _colmap_array(values))


def write_nerfstudio_depth(folder: Path, campaign: Campaign) -> None:
    """Depth along the boresight [mm], float32, 0 where there is no spacecraft."""
    for frame, depth, _ in _stored_maps(folder, campaign):
        buffer = io.BytesIO()
        np.save(buffer, depth * _MILLIMETRE)
        _write(folder / "nerfstudio" / nerfstudio_depth_name(frame), buffer.getvalue())


def _stored_maps(folder: Path, campaign: Campaign) -> Iterator[tuple[int, Array32, Array32]]:
    for frame in range(campaign.frames):
        with np.load(folder / file_name("truth", frame)) as stored:
            yield frame, stored["depth_m"], stored["normals_camera"]


def _colmap_array(values: Array32) -> bytes:
    """``width&height&channels&``, then float32, row by row, one channel after the other."""
    height, width, channels = values.shape
    planes = np.ascontiguousarray(np.moveaxis(values, -1, 0), dtype="<f4")
    return f"{width}&{height}&{channels}&".encode() + planes.tobytes()


def _write(path: Path, content: bytes) -> None:
    with complete_file(path) as temporary:
        temporary.write_bytes(content)
