"""The labels of a campaign in the formats of COCO and SPEED+."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from simgl.camera.calibration_text import calibration_of, opencv_coefficients
from simgl.camera.camera import Camera
from simgl.campaign.frame_task import label_name
from simgl.output import complete_file
from simgl.scene.spacecraft import SpacecraftModel
from simgl.sequence.journal import Value

Labels = dict[str, Any]


def stored_labels(folder: Path, frames: int) -> Iterator[Labels]:
    """The labels of each frame, in order."""
    for frame in range(frames):
        yield json.loads((folder / label_name(frame)).read_text())


def write_coco(
    path: Path, labels: Iterable[Labels], models: Mapping[str, SpacecraftModel], description: str
) -> None:
    """COCO's object keypoints and instances: one category per spacecraft, masks as run lengths.

    Boxes and keypoints count pixels from the image's top left corner; the centre of the first pixel
    is (0.5, 0.5). A keypoint outside the image is 0, 0, 0.
    """
    categories = {name: number for number, name in enumerate(models, start=1)}
    images: list[Labels] = []
    annotations: list[Labels] = []
    for one in labels:
        size = one["height_px"], one["width_px"]
        images.append(
            {"id": one["frame"], "file_name": one["file"], "height": size[0], "width": size[1]}
        )
        for label in one["spacecraft"]:
            points = label["keypoints"]
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": one["frame"],
                    "category_id": categories[label["name"]],
                    "bbox": label["box_px"],
                    "area": label["pixels"],
                    "iscrowd": 0,
                    "segmentation": {"size": size, "counts": label["mask_run_lengths"]},
                    "keypoints": [value for point in points for value in _coco_point(point)],
                    "num_keypoints": sum(point["visibility"] > 0 for point in points),
                }
            )
    content = {
        "info": {"description": description},
        "images": images,
        "annotations": annotations,
        "categories": [
            {
                "id": categories[name],
                "name": name,
                "supercategory": "spacecraft",
                "keypoints": list(model.keypoints),
                "skeleton": [],
            }
            for name, model in models.items()
        ],
    }
    _write(path, content)


def _coco_point(point: Mapping[str, Any]) -> tuple[float, float, int]:
    if point["visibility"] == 0:
        return 0, 0, 0
    return point["x_px"], point["y_px"], point["visibility"]


def write_speed(path: Path, rows: Iterable[Mapping[str, Value]]) -> None:
    """The target's pose in every frame, with the names of the SPEED+ data set.

    ``r_Vo2To_vbs_true`` is the origin of the target's body in camera axes [m]. A point p of the
    body is at r + R(q) p in camera axes, with R(q) the rotation of the Hamilton quaternion q,
    scalar first. (SPEED's tools build R(q) transposed and transpose it again before projecting.)
    Camera axes: z boresight, x right, y down.
    """
    content = [
        {
            "filename": row["file"],
            "q_vbs2tango_true": [row[f"q_camera_from_target_{axis}"] for axis in "wxyz"],
            "r_Vo2To_vbs_true": [row[f"target_{axis}_camera_m"] for axis in "xyz"],
        }
        for row in rows
    ]
    _write(path, content)


def write_camera(path: Path, camera: Camera) -> None:
    """The camera with the names of SPEED+'s ``camera.json``, in pixels and metres.

    Distortion is OpenCV's, in its order. Raises ConfigError for another model.
    """
    d, its = camera.detector, calibration_of(camera)
    ccx, ccy = its.principal_point
    content = {
        "Nu": d.width,
        "Nv": d.height,
        "ppx": d.pixel_pitch,
        "ppy": d.pixel_pitch,
        "fx": camera.lens.focal_length,
        "fy": camera.lens.focal_length * camera.lens.aspect,
        "ccx": ccx,
        "ccy": ccy,
        "cameraMatrix": camera.intrinsics.tolist(),
        "distCoeffs": list(opencv_coefficients(camera.name, its, "SPEED+")),
    }
    _write(path, content)


def _write(path: Path, content: object) -> None:
    with complete_file(path) as temporary:
        temporary.write_text(json.dumps(content), encoding="utf-8")
