"""A campaign as a data set of BOP (benchmark for 6D object pose estimation), scene by scene.

Millimetres; camera axes z boresight, x right, y down; pixel coordinates from the centre of the
first pixel. Silhouettes without what stands before them are traced through the pixels' centres, on
a canvas of three images by three so that a spacecraft beyond the edge counts.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, Image16, Mask
from simgl.camera.camera import Camera
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.labels import pose_in_camera
from simgl.display_images import png_bytes
from simgl.errors import ConfigError
from simgl.images import DigitalFrame, FrameInfo, TruthFrame
from simgl.output import complete_file
from simgl.rays import ray_tracer
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, SceneState

Labels = dict[str, Any]
SCENE = "bop/train/000000"
_MILLIMETRE = 1e3
_MAX_DEPTH = 65_535
# Rays that are traced at a time, some 100 MB.
_BLOCK_RAYS = 1_000_000


def check_bop(campaign: Campaign) -> None:
    """Raise ConfigError for a lens that is no pinhole, and for a target that changes its shape."""
    if campaign.joints:
        problem = f"draws {', '.join(campaign.joints)}; models of BOP are rigid"
        raise ConfigError(f"{campaign.source} [draw]", "joints", problem)
    camera = campaign.scenario.cameras[campaign.camera]
    if camera.lens.distortion is not None:
        problem = "has a distorting lens; data sets of BOP hold pinhole cameras"
        raise ConfigError(f"[camera.{camera.name}]", "", problem)


def camera_matrix(camera: Camera) -> Array:
    """(3, 3) from camera axes to pixels, (0, 0) at the centre of the first one."""
    K = camera.intrinsics.copy()
    K[:2, 2] -= 0.5
    return K


def frame_files(
    frame: int, grey: bytes, digital: DigitalFrame, truth: TruthFrame, state: SceneState
) -> tuple[dict[str, bytes], Labels]:
    """The files of a frame by path, and what the tables of the scene need of it.

    grey : PNG of the image
    """
    assert digital.info.camera is truth.info.camera
    pixels, scale = depth_pixels(truth)
    files = {f"{SCENE}/gray/{frame:06d}.png": grey}
    files[f"{SCENE}/depth/{frame:06d}.png"] = _depth_png(pixels)
    infos: list[Labels] = []
    for number, body in enumerate(state.bodies.values(), start=1):
        visible = truth.instance == number
        if not visible.any():
            continue
        silhouette = full_silhouette(truth.info, body)
        height, width = visible.shape
        inside = silhouette[height : 2 * height, width : 2 * width]
        # Where a triangle's edge meets a pixel's centre, the two ways may differ by rounding.
        inside |= visible
        name = f"{frame:06d}_{len(infos):06d}.png"
        files[f"{SCENE}/mask/{name}"] = _mask_png(inside)
        files[f"{SCENE}/mask_visib/{name}"] = _mask_png(visible)
        infos.append(_info(silhouette, inside, visible, pixels))
    return files, {"depth_scale": scale, "info": infos}


def depth_pixels(truth: TruthFrame) -> tuple[Image16, float]:
    """(height, width) depth in units of a scale, 0 for no spacecraft; and the scale [mm].

    The scale is the finest of 1, 2 and 5 times a power of ten that holds the frame's depth.
    """
    depth = _MILLIMETRE * np.maximum(truth.depth.astype(np.float64), 0.0)
    finest = max(float(depth.max()) / _MAX_DEPTH, 1e-3)
    power = 10.0 ** math.floor(math.log10(finest))
    scale = next(s for f in (1, 2, 5, 10) if (s := round(f * power, 6)) >= finest)
    return np.round(depth / scale).astype(np.uint16), scale


def full_silhouette(info: FrameInfo, body: BodyState) -> Mask:
    """(3 height, 3 width) pixels whose centres see a spacecraft that nothing stands before."""
    d = info.camera.detector
    canvas = np.zeros((3 * d.height, 3 * d.width), dtype=np.bool_)
    R, origin = pose_in_camera(info, body)
    left, top, right, bottom = _bounds(info.camera, body, R, origin, canvas.shape)
    # Of depth 1, from the pinhole, in body axes.
    R_body_from_pixels = R.T @ np.linalg.inv(camera_matrix(info.camera))
    eye, tracer = -R.T @ origin, ray_tracer(body.model.posed_mesh)
    columns = np.arange(left, right) - d.width
    height = max(_BLOCK_RAYS // max(len(columns), 1), 1)
    for first in range(top, bottom, height):
        last = min(first + height, bottom)
        x, y = np.meshgrid(columns, np.arange(first, last) - d.height)
        pixels = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
        ways = pixels @ R_body_from_pixels.T
        hits, _ = tracer.hits(np.broadcast_to(eye, ways.shape), ways)
        canvas[first:last, left:right] = (hits >= 0).reshape(x.shape)
    return canvas


def _bounds(
    camera: Camera, body: BodyState, R: Array, origin: Array, shape: tuple[int, ...]
) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of the part of the canvas that a spacecraft can be in."""
    d, points = camera.detector, body.model.posed_mesh.hull @ R.T + origin
    if points[:, 2].min() <= 0.0:
        return 0, 0, shape[1], shape[0]
    places = points @ camera_matrix(camera).T
    places = places[:, :2] / places[:, 2:] + [d.width, d.height]
    ends = np.array([shape[1], shape[0]])
    low = np.clip(np.floor(places.min(axis=0)), 0, ends).astype(int)
    high = np.clip(np.ceil(places.max(axis=0)) + 1, 0, ends).astype(int)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _info(silhouette: Mask, inside: Mask, visible: Mask, depth: Image16) -> Labels:
    """A row of scene_gt_info."""
    height, width = visible.shape
    everywhere = silhouette.copy()
    everywhere[height : 2 * height, width : 2 * width] = inside
    total, seen = int(everywhere.sum()), int(visible.sum())
    return {
        "bbox_obj": _box(everywhere, width, height),
        "bbox_visib": _box(visible, 0, 0),
        "px_count_all": total,
        "px_count_valid": int((depth[inside] > 0).sum()),
        "px_count_visib": seen,
        "visib_fract": seen / total,
    }


def _box(mask: Mask, left: int, top: int) -> list[int]:
    """x, y, width and height, the last two between the centres of the outermost pixels."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x, y = int(columns[0]), int(rows[0])
    return [x - left, y - top, int(columns[-1]) - x, int(rows[-1]) - y]


def _depth_png(pixels: Image16) -> bytes:
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, format="PNG")
    return content.getvalue()


def _mask_png(mask: Mask) -> bytes:
    return png_bytes(np.where(mask, np.uint8(255), np.uint8(0)))


def write_bop(
    folder: Path, labels: Iterable[Labels], models: Mapping[str, SpacecraftModel], camera: Camera
) -> None:
    """The tables of the scene, the camera and the models, from the labels of all frames."""
    objects = {name: number for number, name in enumerate(models, start=1)}
    K = camera_matrix(camera)
    cameras: Labels = {}
    poses: Labels = {}
    infos: Labels = {}
    for one in labels:
        image, extra = str(one["frame"]), one["bop"]
        cameras[image] = {"cam_K": K.ravel().tolist(), "depth_scale": extra["depth_scale"]}
        poses[image] = [_pose(label, objects) for label in one["spacecraft"]]
        infos[image] = extra["info"]
    scene = folder / SCENE
    _write(scene / "scene_camera.json", cameras)
    _write(scene / "scene_gt.json", poses)
    _write(scene / "scene_gt_info.json", infos)
    d = camera.detector
    focal = {"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
    _write(folder / "bop/camera.json", focal | {"width": d.width, "height": d.height})
    extents = {}
    for name, number in objects.items():
        extents[str(number)] = _write_model(
            folder / f"bop/models/obj_{number:06d}.ply", models[name]
        )
    _write(folder / "bop/models/models_info.json", extents)


def _pose(label: Mapping[str, Any], objects: Mapping[str, int]) -> Labels:
    R = Rotation.from_quat(label["q_camera_from_body_xyzw"]).as_matrix()
    return {
        "cam_R_m2c": R.ravel().tolist(),
        "cam_t_m2c": [_MILLIMETRE * x for x in label["position_camera_m"]],
        "obj_id": objects[label["name"]],
    }


def _write_model(path: Path, model: SpacecraftModel) -> dict[str, float]:
    """The mesh, joints as stored in the scenario, in millimetres; and its row of models_info."""
    mesh = model.posed_mesh.baked()
    points = _MILLIMETRE * mesh.positions.astype(np.float64)
    solid = trimesh.Trimesh(points, mesh.triangles, vertex_normals=mesh.normals, process=False)
    with complete_file(path) as temporary:
        solid.export(temporary, file_type="ply", vertex_normal=True)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    hull = points[ConvexHull(points, qhull_options="QJ").vertices]
    row = {"diameter": float(pdist(hull).max())}
    row |= {f"min_{axis}": float(x) for axis, x in zip("xyz", low, strict=True)}
    return row | {f"size_{axis}": float(x) for axis, x in zip("xyz", size, strict=True)}


def _write(path: Path, content: object) -> None:
    with complete_file(path) as temporary:
        temporary.write_text(json.dumps(content), encoding="utf-8")
