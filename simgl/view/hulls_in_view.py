"""Convex hulls of spacecraft: what of them a camera can see."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.camera.camera import Camera
from simgl.scene.mesh import hull_edges
from simgl.view.depth_slices import NEAREST
from simgl.view.small_targets import in_pixels


def before_the_camera(hull: Array, edges: Callable[[], IndexArray] | None = None) -> Array:
    """Points whose hull is the part of a convex hull that lies at least ``NEAREST`` away.

    edges : its ``hull_edges``, where they are known
    """
    near = hull[:, 2] < NEAREST
    if not np.any(near):
        return hull
    ends = hull_edges(hull) if edges is None else edges()
    a, b = hull[ends[near[ends[:, 0]] != near[ends[:, 1]]].T]
    share = (NEAREST - a[:, 2]) / (b[:, 2] - a[:, 2])
    return np.concatenate([hull[~near], a + share[:, None] * (b - a)])


def in_view(hull: Array, camera: Camera, margin: float) -> bool:
    """Whether no edge of the image, a margin around it [px], has all of a hull beyond it."""
    d, (x, y, depth) = camera.detector, camera.intrinsics @ hull.T
    right, down = d.width * depth - x, d.height * depth - y
    sides = depth - NEAREST, *(side + margin * depth for side in (x, right, y, down))
    return all(bool(np.any(side >= 0.0)) for side in sides)


def rows_of(hull: Array, camera: Camera) -> tuple[float, float] | None:
    """Between which rows of the image a convex hull lies, camera axes [m]; None behind it."""
    if np.all(hull[:, 2] < NEAREST):
        return None
    rows = in_pixels(before_the_camera(hull), camera)[:, 1]
    return float(rows.min()), float(rows.max())
