"""Labels of a frame for training: pose, box, keypoints with visibility, masks.

Pixel coordinates have the centre of the pixel in column i, row j at (i + 0.5, j + 0.5).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from simgl.arrays import Array, Mask
from simgl.images import FrameInfo, TruthFrame
from simgl.physics.frames import quaternion_from_matrix
from simgl.rays import ray_tracer
from simgl.scene.state import BodyState, SceneState

# Largest distance of a keypoint from its surface, as a share of the radius of the bounding sphere.
ON_SURFACE = 0.005


class Visibility(IntEnum):
    """Of a keypoint, by COCO's numbers: outside the image, hidden by a spacecraft, or seen.

    A keypoint in shadow, or of a spacecraft hidden by the Earth's limb, counts as seen where no
    spacecraft is in front of it.
    """

    OUTSIDE = 0
    HIDDEN = 1
    SEEN = 2


@dataclass(frozen=True, kw_only=True)
class Keypoint:
    """A named point in an image; None behind the camera."""

    name: str
    x_px: float | None
    y_px: float | None
    visibility: Visibility


@dataclass(frozen=True, kw_only=True)
class SpacecraftLabel:
    """A spacecraft in an image; fields are named as in the files of labels.

    q_camera_from_body_xyzw, position_camera_m : of the body frame in camera axes
    box_px : x, y, width, height of the pixels whose centre sees it
    pixels : their number
    cut_off : they touch the image's edge
    mask_run_lengths : their run lengths down the columns from the top left, alternating between
        pixels without and with it
    """

    name: str
    model: str
    q_camera_from_body_xyzw: tuple[float, float, float, float]
    position_camera_m: tuple[float, float, float]
    box_px: tuple[int, int, int, int]
    pixels: int
    cut_off: bool
    mask_run_lengths: tuple[int, ...]
    keypoints: tuple[Keypoint, ...]


def run_lengths(mask: Mask) -> tuple[int, ...]:
    """Run lengths down the columns of a mask, the first of pixels outside it (COCO)."""
    flat = mask.ravel(order="F")
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    edges = np.concatenate([[0], changes, [flat.size]])
    runs = np.diff(edges).tolist()
    return tuple([0, *runs] if flat.size and flat[0] else runs)


def spacecraft_labels(truth: TruthFrame, state: SceneState) -> tuple[SpacecraftLabel, ...]:
    """The labels of every spacecraft that the camera sees a pixel of."""
    info, instances = truth.info, truth.instance
    labels = []
    for number, (name, body) in enumerate(state.bodies.items(), start=1):
        mask = instances == number
        if mask.any():
            labels.append(_label(info, state.bodies, name, body, mask))
    return tuple(labels)


def _label(
    info: FrameInfo,
    bodies: Mapping[str, BodyState],
    name: str,
    body: BodyState,
    mask: Mask,
) -> SpacecraftLabel:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    top, left = int(rows[0]), int(columns[0])
    edges = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    R, position = pose_in_camera(info, body)
    qx, qy, qz, qw = quaternion_from_matrix(R).tolist()
    x, y, z = position.tolist()
    return SpacecraftLabel(
        name=name,
        model=body.model.name,
        q_camera_from_body_xyzw=(qx, qy, qz, qw),
        position_camera_m=(x, y, z),
        box_px=(left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1),
        pixels=int(mask.sum()),
        cut_off=bool(edges.any()),
        mask_run_lengths=run_lengths(mask),
        keypoints=keypoints(info, bodies, name),
    )


def pose_in_camera(info: FrameInfo, body: BodyState) -> tuple[Array, Array]:
    """R_camera_from_body (3, 3), and the body's origin (3,) in camera axes [m]."""
    R_camera_from_icrf = info.R_camera_from_icrf
    return (
        R_camera_from_icrf @ body.pose.R_icrf_from_body,
        R_camera_from_icrf @ (body.pose.position - info.position),
    )


def keypoints(info: FrameInfo, bodies: Mapping[str, BodyState], name: str) -> tuple[Keypoint, ...]:
    """The keypoints of one spacecraft.

    Each is hidden where the straight line to the pinhole meets any spacecraft. The line starts
    ``ON_SURFACE`` away, so that the surface that the keypoint lies on does not hide it.
    """
    body = bodies[name]
    if not body.model.keypoints:
        return ()
    R, origin = pose_in_camera(info, body)
    places = np.array(list(body.model.keypoints.values()))
    d = info.camera.detector
    seen = info.camera.project(places @ R.T + origin)
    inside = np.all((seen >= 0.0) & (seen < [d.width, d.height]), axis=1)
    hidden = _hidden(info.position, places, body, bodies)
    labelled = []
    for key, (x, y), within, behind in zip(
        body.model.keypoints, seen.tolist(), inside, hidden, strict=True
    ):
        kind = Visibility.OUTSIDE
        if within:
            kind = Visibility.HIDDEN if behind else Visibility.SEEN
        in_front = not math.isnan(x)
        labelled.append(
            Keypoint(
                name=key,
                x_px=x if in_front else None,
                y_px=y if in_front else None,
                visibility=kind,
            )
        )
    return tuple(labelled)


def _hidden(
    pinhole: Array, places: Array, body: BodyState, bodies: Mapping[str, BodyState]
) -> Mask:
    """(n,) whether a spacecraft is between places (n, 3) in body axes and the pinhole (ICRF)."""
    hidden = np.zeros(len(places), dtype=np.bool_)
    towards = body.in_body(pinhole) - places
    distance = np.linalg.norm(towards, axis=1, keepdims=True)
    directions = towards / np.maximum(distance, np.finfo(np.float64).tiny)
    start = places + ON_SURFACE * body.model.posed_mesh.radius * directions
    # Surfaces of the camera's own spacecraft at the pinhole or behind it hide nothing. Lines have
    # float32, which places their ends to some 1e-7 of their length.
    left = (1.0 - 1e-6) * distance[:, 0] - ON_SURFACE * body.model.posed_mesh.radius
    for other in bodies.values():
        if other is body:
            origins, ways = start, directions
        else:
            turn = other.pose.R_icrf_from_body.T @ body.pose.R_icrf_from_body
            shift = other.in_body(body.pose.position)
            origins, ways = start @ turn.T + shift, directions @ turn.T
        hits, along = ray_tracer(other.model.posed_mesh).hits(origins, ways)
        hidden |= (hits >= 0) & (along < left)
    return hidden
