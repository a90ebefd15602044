"""Depth and normals in the data sets that hold them, and shards of WebDataset."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import webdataset
from PIL import Image

from simgl.arrays import AnyArray, Array, Mask
from simgl.campaign import webdataset_format
from simgl.campaign.campaign_file import load_campaign
from simgl.campaign.frame_task import CampaignJob, Format
from simgl.campaign.run_campaign import run
from simgl.errors import ConfigError
from simgl.simulator import Simulator
from simgl.workers.executors import run_serial
from tests.campaign.small import CAMPAIGN, DRAW, written

FORMATS = frozenset({Format.COLMAP, Format.NERFSTUDIO, Format.WEBDATASET})
HEAD = CAMPAIGN.replace("frames = 12", 'frames = 3\nwrite = ["dn16", "exr", "truth"]')
NEAR = DRAW.replace("[1.5, 12.0]", "[2.5, 5.0]")
# Of 1.5 mm and pixels of 3.75 um.
FOCAL_PX = 400.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of three frames, two of them in the first shard."""
    folder = tmp_path_factory.mktemp("maps")
    job = CampaignJob(campaign=load_campaign(written(folder, NEAR, HEAD)), formats=FORMATS)
    with pytest.MonkeyPatch.context() as patch, Simulator(job.scenario) as simulator:
        patch.setattr(webdataset_format, "FRAMES_PER_SHARD", 2)
        run(job.campaign, folder / "out", run_serial(job, simulator), formats=FORMATS)
    return folder / "out"


def truth(folder: Path, frame: int) -> dict[str, Array]:
    with np.load(folder / f"truth/{frame:06d}.npz") as stored:
        return dict(stored)


@pytest.fixture(scope="module")
def faces(folder: Path) -> list[tuple[Mask, Array, Array]]:
    """Of each frame: where a pixel and its neighbours see one face, points and normals."""
    made = []
    for frame in range(3):
        t = truth(folder, frame)
        depth, normals = t["depth_m"].astype(np.float64), t["normals_camera"]
        y, x = np.indices(depth.shape)
        rays = np.stack([(x + 0.5 - 40.0) / FOCAL_PX, (y + 0.5 - 30.0) / FOCAL_PX], axis=-1)
        points = depth[..., np.newaxis] * np.concatenate([rays, np.ones((60, 80, 1))], axis=-1)
        same = np.ones_like(depth, dtype=bool)
        for shift, axis in ((1, 0), (1, 1)):
            neighbour = np.roll(normals, -shift, axis)
            same &= np.abs(neighbour - normals).max(axis=-1) < 1e-6
            same &= np.roll(t["part_id"], -shift, axis) == t["part_id"]
        made.append((same & (depth > 0.0), points, normals))
    return made


def test_neighbours_on_a_face_differ_by_a_step_perpendicular_to_its_normal(
    faces: list[tuple[Mask, Array, Array]],
) -> None:
    for same, points, normals in faces:
        assert same.sum() > 50
        for axis in (0, 1):
            step = np.roll(points, -1, axis) - points
            off_plane = np.abs((step * normals).sum(axis=-1))[same]
            # Two faces of one normal may lie side by side; float32 leaves 1e-6 of the distance.
            assert np.median(off_plane) < 1e-6
            assert np.mean(off_plane < 1e-5) > 0.95
        # A surface that is seen faces the camera.
        assert ((points * normals).sum(axis=-1)[same] < 0.0).all()


def test_exr_has_depth_and_normals_too(folder: Path) -> None:
    with OpenEXR.File(str(folder / "exr/000000.exr"), separate_channels=True) as file:
        channels = {name: c.pixels for name, c in file.parts[0].channels.items()}
    stored = truth(folder, 0)
    np.testing.assert_array_equal(channels["Z"], stored["depth_m"])
    normals = np.stack([channels[f"normal.{axis}"] for axis in "XYZ"], axis=-1)
    np.testing.assert_array_equal(normals, stored["normals_camera"])


def test_colmap_reads_its_maps_by_columns(folder: Path) -> None:
    """As COLMAP's scripts/python/read_write_dense.py does: Fortran order, then transposed."""

    def read(path: Path) -> AnyArray:
        width, height, channels, rest = path.read_bytes().split(b"&", 3)
        shape = int(width), int(height), int(channels)
        values = np.frombuffer(rest, dtype=np.float32).reshape(shape, order="F")
        return values.transpose(1, 0, 2)

    for frame in range(3):
        stereo = folder / "colmap/stereo"
        depth = read(stereo / f"depth_maps/{frame:06d}.png.geometric.bin")
        normals = read(stereo / f"normal_maps/{frame:06d}.png.geometric.bin")
        np.testing.assert_array_equal(depth[..., 0], truth(folder, frame)["depth_m"])
        np.testing.assert_array_equal(normals, truth(folder, frame)["normals_camera"])


def test_nerfstudio_scales_depth_to_metres(folder: Path) -> None:
    content = json.loads((folder / "nerfstudio/transforms.json").read_text())
    for frame, entry in enumerate(content["frames"]):
        depth = 1e-3 * np.load(folder / "nerfstudio" / entry["depth_file_path"])
        np.testing.assert_allclose(depth, truth(folder, frame)["depth_m"], rtol=1e-6)


# WebDataset leaves its files to the garbage collector.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_webdataset_reads_the_shards_by_its_own_decoders(folder: Path) -> None:
    names = sorted(path.name for path in (folder / "webdataset").iterdir())
    assert names == ["000000.tar", "000001.tar"]
    pattern = str(folder / "webdataset/{000000..000001}.tar")
    decoded = webdataset.WebDataset(pattern, shardshuffle=False).decode(_sixteen_bits())
    samples: list[dict[str, Any]] = list(decoded)
    assert [sample["__key__"] for sample in samples] == ["000000", "000001", "000002"]
    for frame, sample in enumerate(samples):
        stored = np.asarray(Image.open(folder / f"dn16/{frame:06d}.png"))
        np.testing.assert_array_equal(sample["dn16.png"], stored)
        np.testing.assert_array_equal(
            sample["truth.npz"]["depth_m"], truth(folder, frame)["depth_m"]
        )
        assert sample["json"]["frame"] == sample["json"]["frame_row"]["frame"] == frame


def _sixteen_bits() -> Callable[[str, bytes], Any]:
    """WebDataset's own decoder of PNG makes 8 bits of 16."""

    def decode(key: str, content: bytes) -> Any:
        if not key.endswith(".png"):
            return None
        return np.asarray(Image.open(io.BytesIO(content)))

    return decode


def test_a_repeated_run_writes_the_same_shards(folder: Path) -> None:
    first = (folder / "webdataset/000001.tar").read_bytes()
    job = CampaignJob(campaign=load_campaign(folder.parent / "campaign.toml"), formats=FORMATS)
    with pytest.MonkeyPatch.context() as patch, Simulator(job.scenario) as simulator:
        patch.setattr(webdataset_format, "FRAMES_PER_SHARD", 2)
        run(job.campaign, folder, run_serial(job, simulator), formats=FORMATS)
    assert (folder / "webdataset/000001.tar").read_bytes() == first


def test_labels_need_an_image_first(tmp_path: Path) -> None:
    path = written(tmp_path, DRAW, CAMPAIGN.replace("[draw]", 'write = ["truth", "dn8"]\n[draw]'))
    with pytest.raises(ConfigError, match="write must begin with an image: dn8, dn16, view or exr"):
        load_campaign(path)
