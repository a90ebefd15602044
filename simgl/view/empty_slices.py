"""Depth slices of a tile in which nothing is seen: they need neither a draw nor a clear."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, UIntArray
from simgl.scene.mesh import Mesh
from simgl.view.raster_tiles import RasterTile

# As a part of distances: by so much rounding moves a place against a plane.
_ROUNDING = 1e-5


def is_free(tile: RasterTile, far: float, mesh: Mesh, pose: Array, numbers: UIntArray) -> bool:
    """Whether no triangle reaches into what a tile sees up to a depth: a pyramid from the pinhole.

    far : the depth [m]
    mesh : whose joints are as stored
    pose : (4, 4) camera_from_body
    numbers : (k,) of the triangles that may be seen

    By planes that keep both apart: those of the pyramid's sides and base, and the triangle's own.
    Some triangles beside an edge of the pyramid are taken for seen.
    """
    to_camera = pose.astype(np.float32)
    x, y, z = mesh.positions.T
    depth = to_camera[2, 0] * x + to_camera[2, 1] * y + (to_camera[2, 2] * z + to_camera[2, 3])
    triangles = mesh.triangles.take(numbers, axis=0)
    a, b, c = (depth.take(triangles[:, corner]) for corner in range(3))
    nearest, farthest = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    in_range = (nearest < far) & (farthest > 0.0)
    corners = mesh.positions[triangles[in_range]].astype(np.float64)
    corners = corners @ pose[:3, :3].T + pose[:3, 3]
    slack = _ROUNDING * np.abs(corners).max(initial=far)
    sides = tile.edges[:, :3].astype(np.float64)
    sides /= np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-30)
    separate = (corners @ sides.T < -slack).all(axis=1).any(axis=1)
    first, second, third = np.moveaxis(corners[~separate], 1, 0)
    across = np.cross(second - first, third - first)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    places = np.vstack([np.zeros(3), far * _corner_sights(tile)])
    before = across @ places.T - np.einsum("ij,ij->i", across, first)[:, None]
    one_side = (before > slack).all(axis=1) | (before < -slack).all(axis=1)
    return bool(one_side.all())


def _corner_sights(tile: RasterTile) -> Array:
    """(4, 3) lines of sight at depth 1 through the corners of a raster, which holds the tile."""
    columns, rows = tile.raster_size
    places = np.array([[0, 0], [columns, 0], [0, rows], [columns, rows]], dtype=np.float64)
    return np.asarray(tile.sight_origin[:3] + places @ tile.sample_steps[:, :3])
