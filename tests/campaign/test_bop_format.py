"""A data set of BOP by the rules of its format: poses, depth, silhouettes and boxes."""

from __future__ import annotations

import io
import json
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
import trimesh
from PIL import Image

from simgl import cli
from simgl.arrays import AnyArray
from simgl.campaign.bop_format import SCENE, camera_matrix, depth_pixels, frame_files
from simgl.commands import application
from simgl.images import TruthFrame
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Capture, Product, Simulator
from tests.campaign.small import CAMPAIGN, DRAW, written


def box(x: float, y: float, z: float, size: float) -> dict[str, Any]:
    return {
        "position_icrf_m": [x, y, z],
        "model": {"box": {"size_m": [size] * 3, "material": {"reflectance": 0.5}}},
    }


# Camera axes: x right is ICRF's x, y down is ICRF's y, z is the boresight.
FAR, NEAR = box(2.0, 0.0, 10.0, 4.0), box(0.5, 0.0, 4.0, 1.0)


def scene(**spacecraft: dict[str, Any]) -> dict[str, Any]:
    camera = {
        "position_icrf_m": [0.0, 0.0, 0.0],
        "boresight": [0.0, 0.0, 1.0],
        "up": [0.0, -1.0, 0.0],
        "width_px": 64,
        "height_px": 48,
        "focal_length_px": 80.0,
    }
    return {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {"direction_icrf": [0.0, 0.0, -1.0]},
        "earth": {"shape": "none"},
        "spacecraft": spacecraft,
        "camera": {"nav": camera},
        "render": {"samples_per_pixel": 5, "inter_reflection": False},
    }


def taken(gl: moderngl.Context, data: dict[str, Any]) -> tuple[Capture, dict[str, bytes], Any]:
    """A capture, its files without the folder, and what its tables hold."""
    scenario = scenario_from_dict(data)
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        capture = simulator.capture(state, "nav", {Product.DN, Product.TRUTH})
    assert capture.digital is not None
    assert capture.truth is not None
    files, extra = frame_files(7, b"grey", capture.digital, capture.truth, state)
    return capture, {name.removeprefix(f"{SCENE}/"): c for name, c in files.items()}, extra


def pixels(content: bytes) -> AnyArray:
    return np.asarray(Image.open(io.BytesIO(content)))


def truth_of(capture: Capture) -> TruthFrame:
    assert capture.truth is not None
    return capture.truth


def test_a_hidden_part_belongs_to_the_silhouette(gl: moderngl.Context) -> None:
    """Of the far box alone simgl draws what the rays say of it behind the near one."""
    both, files, extra = taken(gl, scene(far=FAR, near=NEAR))
    serial, _, _ = taken(gl, scene(far=FAR))
    full, visible = pixels(files["mask/000007_000000.png"]), pixels(
        files["mask_visib/000007_000000.png"]
    )  # fmt: skip
    np.testing.assert_array_equal(full == 255, truth_of(serial).instance == 1)
    np.testing.assert_array_equal(visible == 255, truth_of(both).instance == 1)
    far, near = extra["info"]
    assert far["px_count_visib"] < (full == 255).sum() == far["px_count_valid"]
    assert near["visib_fract"] == 1.0
    assert far["visib_fract"] == far["px_count_visib"] / far["px_count_all"]


def test_a_box_beyond_the_edge_keeps_its_size(gl: moderngl.Context) -> None:
    """Its face, 8 m ahead, 0 to 4 m right and 2 m up and down: columns 32 to 72, rows 4 to 44.

    Pixels whose centres lie inside: 32 to 71 of 64 columns, 4 to 43; widths count from centre to
    centre.
    """
    _, _, extra = taken(gl, scene(far=FAR))
    (info,) = extra["info"]
    assert info["bbox_obj"] == [32, 4, 39, 39]
    assert info["bbox_visib"] == [32, 4, 31, 39]
    assert info["px_count_all"] == 40 * 40
    assert info["px_count_visib"] == 32 * 40


def test_depth_is_in_millimetres_by_the_scale(gl: moderngl.Context) -> None:
    capture, files, extra = taken(gl, scene(near=NEAR))
    scale = extra["depth_scale"]
    depth = pixels(files["depth/000007.png"])
    assert depth.dtype == np.uint16
    # The face of the near box, 3.5 m ahead: 0.0534 mm a step at least, so 0.1.
    assert scale == 0.1
    np.testing.assert_array_equal(np.unique(depth), [0, 35_000])
    np.testing.assert_array_equal(depth == 0, truth_of(capture).depth == 0.0)


def test_the_scale_is_the_finest_that_holds_the_depth(gl: moderngl.Context) -> None:
    truth = truth_of(taken(gl, scene(near=NEAR))[0])
    cases = [(0.0, 0.001), (6.0, 0.1), (6.5536, 0.2), (131.0, 2.0), (500.0, 10.0)]
    for metres, scale in cases:
        stored, given = depth_pixels(replace(truth, depth=np.full_like(truth.depth, metres)))
        assert given == pytest.approx(scale)
        # float32 of 500 m steps by 0.03 mm.
        assert np.abs(stored * given - 1e3 * metres).max() <= 0.5 * scale + 0.03


def test_a_campaign_becomes_a_data_set(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Model points, in millimetres, fall into their silhouette by K (R p + t)."""
    head = CAMPAIGN.replace("frames = 12", "frames = 2")
    draw = DRAW.replace("[1.5, 12.0]", "[8.0, 12.0]")
    assert draw != DRAW
    path, out = written(tmp_path, draw, head), tmp_path / "out"
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))
    monkeypatch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005

    def run(*more: str) -> int:
        monkeypatch.setattr(sys, "argv", ["simgl", "campaign", str(path), "--out", str(out), *more])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return int(ended.value.code or 0)

    assert run("--format", "bop") == 0
    scene_folder = out / SCENE
    cameras, poses, infos = (
        json.loads((scene_folder / f"scene_{name}.json").read_text())
        for name in ("camera", "gt", "gt_info")
    )
    assert list(cameras) == list(poses) == list(infos) == ["0", "1"]
    model = trimesh.load(out / "bop/models/obj_000001.ply", process=False)
    assert isinstance(model, trimesh.Trimesh)
    extents = json.loads((out / "bop/models/models_info.json").read_text())["1"]
    assert extents["size_x"] == pytest.approx(np.ptp(model.vertices[:, 0]), rel=1e-5)
    longest = np.linalg.norm(model.vertices[:, None] - model.vertices[None], axis=2).max()
    assert extents["diameter"] == pytest.approx(longest, rel=1e-5)
    for image, (pose, *_) in poses.items():
        K = np.array(cameras[image]["cam_K"]).reshape(3, 3)
        R, t = np.array(pose["cam_R_m2c"]).reshape(3, 3), np.array(pose["cam_t_m2c"])
        assert np.linalg.det(R) == pytest.approx(1.0)
        places = (model.vertices @ R.T + t) @ K.T
        places = places[:, :2] / places[:, 2:]
        left, top, width, height = infos[image][0]["bbox_obj"]
        # A circle of radius 0.71 px holds a centre; in a corner of 60 deg the farthest point of
        # the largest such circle is 2.1 px from the tip.
        assert np.abs(places.min(axis=0) - [left, top]).max() <= 2.1
        assert np.abs(places.max(axis=0) - [left + width, top + height]).max() <= 2.1
        mask = np.asarray(Image.open(scene_folder / f"mask_visib/{int(image):06d}_000000.png"))
        assert (mask == 255).sum() == infos[image][0]["px_count_visib"]
        grey = np.asarray(Image.open(scene_folder / f"gray/{int(image):06d}.png"))
        assert grey.shape == mask.shape == (60, 80)
    # Without the data set it is another campaign.
    assert run() == 2


def test_what_bop_cannot_hold_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path)
    text = (tmp_path / "scene.toml").read_text()
    bent = text.replace(
        "focal_length_mm = 1.5", "focal_length_mm = 1.5\noptics = { distortion = { k1 = -0.1 } }"
    )
    assert bent != text
    (tmp_path / "scene.toml").write_text(bent)
    for word, complaint in (
        ("bop", "[camera.nav]: has a distorting lens; data sets of BOP hold pinhole cameras"),
        ("bob", 'command line: --format has no "bob"; did you mean "bop"?'),
    ):
        words = ["simgl", "campaign", str(path), "--out", str(tmp_path / "o"), "--format", word]
        monkeypatch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert ended.value.code == 2
        assert complaint in capsys.readouterr().err


def test_pixels_count_from_the_centre_of_the_first() -> None:
    camera = scenario_from_dict(scene(near=NEAR)).cameras["nav"]
    np.testing.assert_array_equal(camera_matrix(camera)[:2, 2], [31.5, 23.5])
