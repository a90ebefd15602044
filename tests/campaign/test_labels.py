"""Labels: what a frame shows, against answers made by hand and against COCO's own reader."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import asdict, replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Mask
from simgl.campaign.label_formats import write_coco, write_speed
from simgl.campaign.labels import SpacecraftLabel, Visibility, run_lengths, spacecraft_labels
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Value
from simgl.simulator import Product, Simulator
from tests.scenes import lambert, scene

coco = pytest.importorskip("pycocotools.coco")
coco_mask = pytest.importorskip("pycocotools.mask")

# Its compiled part asks numpy's arrays in a form that numpy is about to give up.
old_numpy = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

# Body axes of the box, 2 x 1 x 1 m, seen from +z.
CORNERS = {
    "near": [1.0, 0.5, 0.5],
    "far": [1.0, 0.5, -0.5],
    "behind": [0.0, 0.0, -0.5],
    "face": [0.2, 0.0, 0.5],
    "shaded": [-0.8, 0.0, 0.5],
    "out": [9.0, 0.0, 0.5],
}


def box_behind_a_plate() -> Scenario:
    """A box 10 m before the camera; a plate halfway hides its left end."""
    made = scene(
        {
            "box": {
                "model": {"box": {"size_m": [2.0, 1.0, 1.0], "material": lambert(0.5)}},
                "position_icrf_m": [0.0, 0.0, 0.0],
            },
            "plate": {
                "model": {"plate": {"width_m": 0.5, "height_m": 2.0, "material": lambert(0.5)}},
                "position_icrf_m": [-0.5, 0.0, 5.0],
            },
        },
        {
            "position_icrf_m": [0.0, 0.0, 10.0],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "width_px": 160,
            "height_px": 120,
            "focal_length_mm": 2.4,
        },
    )
    corners = {name: np.array(place) for name, place in CORNERS.items()}
    box = replace(made.models["box"], keypoints=corners)
    return replace(made, models={**made.models, "box": box})


def labels_of(gl: moderngl.Context, scenario: Scenario) -> dict[str, SpacecraftLabel]:
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        truth = simulator.capture(state, "cam", {Product.TRUTH}).truth
    assert truth is not None
    return {label.name: label for label in spacecraft_labels(truth, state)}


@old_numpy
def test_run_lengths_are_read_back_by_coco() -> None:
    random = np.random.default_rng(3)
    for density in (0.0, 0.02, 0.5, 1.0):
        mask = random.random((37, 53)) < density
        counts = list(run_lengths(mask))
        packed = coco_mask.frPyObjects({"size": list(mask.shape), "counts": counts}, *mask.shape)
        assert np.array_equal(coco_mask.decode(packed).astype(bool), mask)
        assert np.array_equal(counts, coco_runs(mask))


def coco_runs(mask: Mask) -> list[int]:
    """By counting pixel after pixel down the columns."""
    runs, now = [0], False
    for pixel in mask.T.ravel().tolist():
        if pixel != now:
            runs.append(0)
            now = pixel
        runs[-1] += 1
    return runs


def test_pose_box_and_keypoints_of_a_box_by_hand(gl: moderngl.Context) -> None:
    label = labels_of(gl, box_behind_a_plate())["box"]
    # y of the picture runs against y of the box, z away from the camera.
    assert label.q_camera_from_body_xyzw == pytest.approx((1.0, 0.0, 0.0, 0.0))
    assert label.position_camera_m == pytest.approx((0.0, 0.0, 10.0))
    f = 2400.0 / 3.75
    near = f / 9.5
    half = near * 1.0, near * 0.5
    x, y, width, height = label.box_px
    # The left end lies behind the plate, which ends at -0.25 m, 5 m away.
    assert (x, y) == (round(80 - f * 0.25 / 5.0), round(60 - half[1]))
    assert (x + width, y + height) == (round(80 + half[0]), round(60 + half[1]))
    assert not label.cut_off
    seen = {point.name: point for point in label.keypoints}
    assert (seen["near"].x_px, seen["near"].y_px) == pytest.approx((80 + half[0], 60 - half[1]))
    assert {name: point.visibility for name, point in seen.items()} == {
        "near": Visibility.SEEN,
        "far": Visibility.HIDDEN,
        "behind": Visibility.HIDDEN,
        "face": Visibility.SEEN,
        "shaded": Visibility.HIDDEN,
        "out": Visibility.OUTSIDE,
    }


@pytest.mark.parametrize("gap", [0.0, 0.001, 0.02, 1.0])
def test_the_craft_behind_the_pinhole_hides_nothing(gl: moderngl.Context, gap: float) -> None:
    """A camera so far [m] before its carrier, of a target with a radius of 10 m."""
    made = scene(
        {
            "target": {
                "model": {"box": {"size_m": [18.0, 8.0, 4.0], "material": lambert(0.5)}},
                "position_icrf_m": [0.0, 0.0, 0.0],
            },
            "chaser": {
                "model": {"box": {"size_m": [1.0, 1.0, 1.0], "material": lambert(0.5)}},
                "position_icrf_m": [0.0, 0.0, 30.5 + gap],
            },
        },
        {
            "on": "chaser",
            "position_body_m": [0.0, 0.0, -0.5 - gap],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "focal_length_mm": 0.6,
        },
    )
    places = {"corner": np.array([9.0, 4.0, 2.0]), "back": np.array([9.0, 4.0, -2.0])}
    target = replace(made.models["target"], keypoints=places)
    label = labels_of(gl, replace(made, models={**made.models, "target": target}))["target"]
    seen = {point.name: point.visibility for point in label.keypoints}
    assert seen == {"corner": Visibility.SEEN, "back": Visibility.HIDDEN}


@old_numpy
def test_coco_file_says_the_same_to_its_own_reader(gl: moderngl.Context, tmp_path: Path) -> None:
    scenario = box_behind_a_plate()
    found = labels_of(gl, scenario)
    stored = {
        "frame": 4,
        "file": "000004.png",
        "width_px": 160,
        "height_px": 120,
        "spacecraft": [asdict(label) for label in found.values()],
    }
    write_coco(tmp_path / "coco.json", [stored], scenario.models, "two")
    with contextlib.redirect_stdout(io.StringIO()):
        read = coco.COCO(str(tmp_path / "coco.json"))
    assert read.imgs[4]["file_name"] == "000004.png"
    (box,) = read.loadAnns(read.getAnnIds(imgIds=4, catIds=read.getCatIds(["box"])))
    mask = read.annToMask(box)
    assert mask.shape == (120, 160)
    assert mask.sum() == box["area"] == found["box"].pixels
    rows, columns = np.nonzero(mask)
    left, top, width, height = box["bbox"]
    assert (left, top) == (columns.min(), rows.min())
    assert (left + width - 1, top + height - 1) == (columns.max(), rows.max())
    assert box["num_keypoints"] == 5
    assert box["keypoints"][-3:] == [0, 0, 0]
    assert len(box["keypoints"]) == 3 * len(read.cats[box["category_id"]]["keypoints"])


def test_speed_pose_projects_as_that_data_set_does(tmp_path: Path) -> None:
    """Its tools form a direction cosine matrix from (q0, q), and project with its transpose."""
    row: dict[str, Value] = {"file": "000000.png"}
    quaternion = np.array([0.1, -0.5, 0.3, 0.8])
    quaternion /= np.linalg.norm(quaternion)
    row |= {f"q_camera_from_target_{a}": v for a, v in zip("xyzw", quaternion, strict=True)}
    row |= {f"target_{a}_camera_m": v for a, v in zip("xyz", (0.4, -0.2, 9.0), strict=True)}
    write_speed(tmp_path / "speed.json", [row])
    (pose,) = json.loads((tmp_path / "speed.json").read_text())
    assert pose["filename"] == "000000.png"
    q0, q1, q2, q3 = pose["q_vbs2tango_true"]
    dcm = np.array(
        [
            [2 * (q0 * q0 + q1 * q1) - 1, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)],
            [2 * (q1 * q2 - q0 * q3), 2 * (q0 * q0 + q2 * q2) - 1, 2 * (q2 * q3 + q0 * q1)],
            [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 2 * (q0 * q0 + q3 * q3) - 1],
        ]
    )
    point = np.array([1.0, 2.0, 3.0])
    ours = Rotation.from_quat(quaternion).apply(point) + np.array([0.4, -0.2, 9.0])
    assert dcm.T @ point + pose["r_Vo2To_vbs_true"] == pytest.approx(ours)
