"""A campaign for COLMAP, nerfstudio and YOLO: cameras about the target, masks, boxes and keypoints.

The world of COLMAP and nerfstudio is the target's body frame [m]. The centre of the first pixel is
(0.5, 0.5) in all of them, as in simgl.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, Mask
from simgl.camera.calibration_text import calibration_of, opencv_coefficients
from simgl.camera.camera import Camera
from simgl.camera.projections import Fisheye
from simgl.campaign.campaign_file import Campaign
from simgl.display_images import png_bytes
from simgl.errors import ConfigError
from simgl.output import complete_file
from simgl.sequence.journal import Value

Labels = dict[str, Any]
Rows = Sequence[Mapping[str, Value]]
_EIGHT_BITS = ("dn8", "view")


def check_rigid(campaign: Campaign, form: str) -> None:
    """Raise ConfigError for a target whose shape is drawn."""
    if campaign.joints:
        problem = f"draws {', '.join(campaign.joints)}; the target of {form} data is rigid"
        raise ConfigError(f"{campaign.source} [draw]", "joints", problem)


def colmap_camera(camera: Camera) -> tuple[str, tuple[float, ...]]:
    """COLMAP's model of a camera and its parameters; ConfigError for a lens without one."""
    fx, fy, cx, cy = _pinhole(camera, "COLMAP")
    distortion = camera.lens.distortion
    if distortion is None:
        return "PINHOLE", (fx, fy, cx, cy)
    if isinstance(distortion, Fisheye):
        return "OPENCV_FISHEYE", (fx, fy, cx, cy, *astuple(distortion))
    values = _coefficients(camera, "COLMAP", 8)
    if any(values[4:]):
        return "FULL_OPENCV", (fx, fy, cx, cy, *values)
    return "OPENCV", (fx, fy, cx, cy, *values[:4])


def nerfstudio_camera(camera: Camera) -> Labels:
    """The keys of a camera in transforms.json; ConfigError for a lens that it does not hold."""
    fx, fy, cx, cy = _pinhole(camera, "nerfstudio")
    d, distortion = camera.detector, camera.lens.distortion
    keys: Labels = {"w": d.width, "h": d.height, "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy}
    if isinstance(distortion, Fisheye):
        names = ("k1", "k2", "k3", "k4")
        its = dict(zip(names, astuple(distortion), strict=True))
        return {"camera_model": "OPENCV_FISHEYE", **keys, **its}
    k1, k2, p1, p2, k3 = _coefficients(camera, "nerfstudio", 5)
    return {"camera_model": "OPENCV", **keys, "k1": k1, "k2": k2, "k3": k3, "p1": p1, "p2": p2}


def _pinhole(camera: Camera, tool: str) -> tuple[float, float, float, float]:
    (fx, skew, cx), (_, fy, cy), _ = camera.intrinsics.tolist()
    if skew != 0.0:
        _cannot(camera, f"has skew, which {tool} cannot hold")
    return fx, fy, cx, cy


def _coefficients(camera: Camera, tool: str, count: int) -> tuple[float, ...]:
    """So many coefficients in OpenCV's order; ConfigError where further ones are not 0."""
    values = opencv_coefficients(camera.name, calibration_of(camera), tool)
    if any(values[count:]):
        _cannot(camera, f"has more than {count} coefficients of distortion, which {tool} has not")
    return (*values[:count], *([0.0] * (count - len(values))))


def _cannot(camera: Camera, problem: str) -> None:
    raise ConfigError(f"[camera.{camera.name}]", "", problem)


def _pose(row: Mapping[str, Value]) -> tuple[Array, Array]:
    """R_camera_from_target (3, 3), and the target's origin (3,) in camera axes [m]."""
    q = np.array([row[f"q_camera_from_target_{axis}"] for axis in "xyzw"], dtype=np.float64)
    t = np.array([row[f"target_{axis}_camera_m"] for axis in "xyz"], dtype=np.float64)
    return Rotation.from_quat(q).as_matrix(), t


def mask_name(file: str) -> str:
    """Path of an image's mask below the campaign's folder, as COLMAP names them."""
    return f"masks/{file}.png"


def write_masks(folder: Path, labels: Iterable[Labels], target: str) -> None:
    """The target's visible pixels, white, as an image for each frame."""
    for one in labels:
        size = int(one["height_px"]), int(one["width_px"])
        lengths = [s["mask_run_lengths"] for s in one["spacecraft"] if s["name"] == target]
        mask = mask_from_runs(lengths[0], size) if lengths else np.zeros(size, dtype=np.bool_)
        _write(folder / mask_name(one["file"]), png_bytes(255 * mask.astype(np.uint8)))


def mask_from_runs(lengths: Sequence[int], size: tuple[int, int]) -> Mask:
    """(height, width) mask of COCO's run lengths down the columns."""
    inside = np.arange(len(lengths)) % 2 == 1
    flat: Mask = np.repeat(inside, lengths)
    return flat.reshape(size[1], size[0]).T


def write_colmap(folder: Path, rows: Rows, camera: Camera) -> None:
    """COLMAP's model as text: one camera, its poses, no points."""
    model, parameters = colmap_camera(camera)
    numbers = " ".join(repr(float(value)) for value in parameters)
    d = camera.detector
    _write_lines(folder / "colmap/cameras.txt", [f"1 {model} {d.width} {d.height} {numbers}"])
    lines = []
    for number, row in enumerate(rows, start=1):
        R, t = _pose(row)
        x, y, z, w = Rotation.from_matrix(R).as_quat().tolist()
        values = " ".join(repr(float(value)) for value in (w, x, y, z, *t))
        # The line after each image lists its points.
        lines += [f"{number} {values} 1 {row['file']}", ""]
    _write_lines(folder / "colmap/images.txt", lines)
    _write_lines(folder / "colmap/points3D.txt", [])


def write_nerfstudio(folder: Path, rows: Rows, camera: Camera, kind: str, *, depth: bool) -> None:
    """nerfstudio's transforms.json, from camera to world with OpenGL's camera axes.

    kind : of the images, a folder of the campaign
    depth : name a depth image of each frame too

    ``sun_direction`` is further to its format: towards the Sun in the world's axes.
    """
    frames = []
    for frame, row in enumerate(rows):
        R, t = _pose(row)
        world_from_camera = np.eye(4)
        # x right, y up, z backward.
        world_from_camera[:3, :3] = R.T @ np.diag([1.0, -1.0, -1.0])
        world_from_camera[:3, 3] = -R.T @ t
        sun = np.array([row[f"sun_direction_camera_{axis}"] for axis in "xyz"], dtype=np.float64)
        entry: Labels = {
            "file_path": f"../{kind}/{row['file']}",
            "mask_path": f"../{mask_name(str(row['file']))}",
            "transform_matrix": world_from_camera.tolist(),
            "sun_direction": (R.T @ sun).tolist(),
        }
        if depth:
            entry["depth_file_path"] = nerfstudio_depth_name(frame)
        frames.append(entry)
    content = {**nerfstudio_camera(camera), "frames": frames}
    _write(folder / "nerfstudio/transforms.json", json.dumps(content).encode())


def nerfstudio_depth_name(frame: int) -> str:
    """Path of a frame's depth image below the folder of transforms.json."""
    return f"depth/{frame:06d}.npy"


def check_yolo(campaign: Campaign) -> None:
    """Raise ConfigError without keypoints, and without images of 8 bits."""
    if campaign.write[0] not in _EIGHT_BITS:
        problem = f"must begin with dn8 or view for --format yolo, got {campaign.write[0]}"
        raise ConfigError(str(campaign.source), "write", problem)
    if not any(model.keypoints for model in campaign.scenario.models.values()):
        problem = "has no model with keypoints, which --format yolo needs"
        raise ConfigError(str(campaign.source), "scenario", problem)


def write_yolo(folder: Path, labels: Iterable[Labels], campaign: Campaign) -> None:
    """YOLO's data for poses: images, a line for each spacecraft, and ``data.yaml``.

    Class, box and keypoints in shares of the image's size. A class with fewer keypoints than
    another ends with zeros.
    """
    models = campaign.scenario.models
    count = max(len(model.keypoints) for model in models.values())
    classes = {name: number for number, name in enumerate(models)}
    for one in labels:
        image = (folder / campaign.write[0] / one["file"]).read_bytes()
        _write(folder / "yolo/images" / one["file"], image)
        lines = [_yolo_line(label, one, classes, count) for label in one["spacecraft"]]
        _write_lines(folder / f"yolo/labels/{Path(one['file']).stem}.txt", lines)
    names = [f"  {number}: {json.dumps(name)}" for name, number in classes.items()]
    head = ["path: .", "train: images", "val: images", f"kpt_shape: [{count}, 3]", "names:"]
    _write_lines(folder / "yolo/data.yaml", [*head, *names])


def _yolo_line(
    label: Mapping[str, Any], one: Labels, classes: Mapping[str, int], count: int
) -> str:
    width, height = one["width_px"], one["height_px"]
    x, y, w, h = label["box_px"]
    values = [(x + 0.5 * w) / width, (y + 0.5 * h) / height, w / width, h / height]
    words = [str(classes[label["name"]]), *(f"{value:.9g}" for value in values)]
    for point in label["keypoints"]:
        if point["visibility"] == 0:
            words += ["0", "0", "0"]
        else:
            place = point["x_px"] / width, point["y_px"] / height
            words += [*(f"{value:.9g}" for value in place), str(point["visibility"])]
    missing = count - len(label["keypoints"])
    return " ".join([*words, *(["0", "0", "0"] * missing)])


def _write_lines(path: Path, lines: Sequence[str]) -> None:
    _write(path, "".join(f"{line}\n" for line in lines).encode())


def _write(path: Path, content: bytes) -> None:
    with complete_file(path) as temporary:
        temporary.write_bytes(content)
