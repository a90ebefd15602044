"""COLMAP, nerfstudio and YOLO, read by their documented rules: points fall where simgl has them."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from PIL import Image
from scipy.spatial.transform import Rotation

from simgl import cli
from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.data_sets import check_formats
from simgl.campaign.frame_task import Format
from simgl.campaign.labels import run_lengths
from simgl.campaign.pose_formats import colmap_camera, mask_from_runs, nerfstudio_camera
from simgl.commands import application
from simgl.errors import ConfigError
from tests.campaign.small import CAMPAIGN, DRAW, small_campaign, written

FORMATS = "colmap, nerfstudio,yolo"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of two frames in the three formats."""
    folder = tmp_path_factory.mktemp("formats")
    head = CAMPAIGN.replace("frames = 12", "frames = 2")
    path = written(folder, DRAW.replace("[1.5, 12.0]", "[8.0, 12.0]"), head)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005
        words = ["simgl", "campaign", str(path), "--out", str(folder / "out"), "--format", FORMATS]
        patch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert not ended.value.code
    return folder / "out"


def stored(folder: Path, frame: int) -> Any:
    return json.loads((folder / f"labels/{frame:06d}.json").read_text())


def target_of(folder: Path, frame: int) -> Any:
    return next(s for s in stored(folder, frame)["spacecraft"] if s["name"] == "target")


POINTS = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.4], [-0.4, 0.1, 0.2]])


def in_camera(folder: Path, frame: int) -> Array:
    """``POINTS`` of the target in camera axes, by the labels."""
    label = target_of(folder, frame)
    R = Rotation.from_quat(label["q_camera_from_body_xyzw"])
    return R.apply(POINTS) + label["position_camera_m"]


def test_colmap_puts_points_where_the_labels_do(folder: Path) -> None:
    """A point X of the world is at R(q) X + t in the camera; q has the scalar first."""
    lines = (folder / "colmap/images.txt").read_text().split("\n")
    assert len(lines) == 5
    for frame in range(2):
        number, *values, camera, name = lines[2 * frame].split()
        assert (number, camera, name) == (str(frame + 1), "1", f"{frame:06d}.png")
        assert (folder / "dn8" / name).is_file()
        w, x, y, z, *t = map(float, values)
        got = Rotation.from_quat([x, y, z, w]).apply(POINTS) + t
        np.testing.assert_allclose(got, in_camera(folder, frame), atol=1e-12)
        assert lines[2 * frame + 1] == ""
    fx = 1.5e-3 / 3.75e-6
    words = (folder / "colmap/cameras.txt").read_text().split()
    assert words[:4] == ["1", "PINHOLE", "80", "60"]
    np.testing.assert_allclose([float(w) for w in words[4:]], [fx, fx, 40.0, 30.0])
    assert (folder / "colmap/points3D.txt").read_text() == ""


def test_nerfstudio_looks_along_minus_z_with_y_up(folder: Path) -> None:
    content = json.loads((folder / "nerfstudio/transforms.json").read_text())
    assert (content["camera_model"], content["w"], content["h"]) == ("OPENCV", 80, 60)
    for frame, one in enumerate(content["frames"]):
        world_from_camera = np.array(one["transform_matrix"])
        homogeneous = np.concatenate([POINTS, np.ones((3, 1))], axis=1)
        right, up, back = (np.linalg.inv(world_from_camera) @ homogeneous.T)[:3]
        expected = in_camera(folder, frame)
        np.testing.assert_allclose(np.stack([right, -up, -back], axis=1), expected, atol=1e-12)
        for key in ("file_path", "mask_path"):
            assert (folder / "nerfstudio" / one[key]).is_file()
        # The Sun, back in camera axes.
        R = Rotation.from_quat(target_of(folder, frame)["q_camera_from_body_xyzw"])
        sun = R.apply(one["sun_direction"])
        np.testing.assert_allclose(sun, stored(folder, frame)["sun_direction_camera"], atol=1e-12)


def test_masks_hold_the_pixels_of_the_target(folder: Path) -> None:
    for frame in range(2):
        mask = np.asarray(Image.open(folder / f"masks/{frame:06d}.png.png"))
        label = target_of(folder, frame)
        assert (mask == 255).sum() == label["pixels"] > 0
        assert tuple(run_lengths(mask == 255)) == tuple(label["mask_run_lengths"])


def test_runs_make_the_mask_that_they_were_made_of() -> None:
    masks = np.random.default_rng(3).random((20, 5, 7)) > 0.5
    for mask in (*masks, np.ones((5, 7), dtype=bool), np.zeros((5, 7), dtype=bool)):
        np.testing.assert_array_equal(mask_from_runs(run_lengths(mask), (5, 7)), mask)


def test_yolo_has_shares_of_the_image(folder: Path) -> None:
    data = yaml.safe_load((folder / "yolo/data.yaml").read_text())
    assert data["names"] == {0: "target", 1: "chaser"}
    count = data["kpt_shape"][0]
    for frame in range(2):
        (line,) = (folder / f"yolo/labels/{frame:06d}.txt").read_text().splitlines()
        kind, *values = map(float, line.split())
        assert kind == 0
        assert len(values) == 4 + 3 * count
        label = target_of(folder, frame)
        x, y, w, h = (v * s for v, s in zip(values, (80, 60, 80, 60), strict=False))
        assert [x - w / 2, y - h / 2, w, h] == pytest.approx(label["box_px"], abs=1e-6)
        points = np.array(values[4:]).reshape(-1, 3)
        for point, own in zip(points, label["keypoints"], strict=True):
            assert point[2] == own["visibility"]
            if own["visibility"]:
                assert point[:2] * [80, 60] == pytest.approx([own["x_px"], own["y_px"]], abs=1e-6)
        image = (folder / f"yolo/images/{frame:06d}.png").read_bytes()
        assert image == (folder / f"dn8/{frame:06d}.png").read_bytes()


RAYS = np.array([[0.0, 0.0, 1.0], [0.3, -0.2, 1.0], [-0.1, 0.2, 1.0]])


def lens(campaign: Campaign, distortion: Projection | None) -> Camera:
    camera = campaign.scenario.cameras["nav"]
    return replace(camera, lens=replace(camera.lens, distortion=distortion))


@pytest.mark.parametrize(
    ("distortion", "model"),
    [
        (None, "PINHOLE"),
        (Distortion(k1=-0.1, k2=0.02, p1=0.001, p2=-0.002), "OPENCV"),
        (Distortion(k1=-0.1, k3=0.02, k4=0.1), "FULL_OPENCV"),
        (Fisheye(k1=0.01, k4=-0.001), "OPENCV_FISHEYE"),
    ],
)
def test_lenses_are_those_of_opencv(
    tmp_path: Path, distortion: Projection | None, model: str
) -> None:
    """COLMAP's parameters are fx, fy, cx, cy and OpenCV's coefficients, in its order."""
    camera = lens(small_campaign(tmp_path), distortion)
    name, (fx, fy, cx, cy, *d) = colmap_camera(camera)
    assert name == model
    K = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    project = cv2.fisheye.projectPoints if "FISHEYE" in model else cv2.projectPoints
    zero = np.zeros(3)
    points = project(RAYS.reshape(-1, 1, 3), zero, zero, K, np.array(d or [0.0] * 4))[0]
    np.testing.assert_allclose(points.reshape(-1, 2), camera.project(RAYS), atol=1e-9)


def test_what_a_format_cannot_hold_is_one_line(tmp_path: Path) -> None:
    campaign = small_campaign(tmp_path)
    with pytest.raises(ConfigError, match=r"\[camera.nav\]: has double_sphere, which files of COL"):
        colmap_camera(lens(campaign, DoubleSphere(xi=0.1, alpha=0.5)))
    with pytest.raises(ConfigError, match=r"\[camera.nav\]: has more than 5 coefficients of dist"):
        nerfstudio_camera(lens(campaign, Distortion(k1=-0.1, k4=0.1)))
    dark = replace(campaign, write=("exr", "dn8"))
    with pytest.raises(ConfigError, match="write must begin with dn8 or view for --format yolo, g"):
        check_formats(dark, frozenset({Format.YOLO}))
    moved = replace(campaign, joints={"wing": campaign.drawn["range_m"]})
    for form in (Format.BOP, Format.COLMAP, Format.NERFSTUDIO):
        with pytest.raises(ConfigError, match=r"\[draw\]: joints draws wing; "):
            check_formats(moved, frozenset({form}))
