"""Depth slices in which nothing is seen are told from those in which something is.

Truth: points all over a triangle, of which some lie in the pyramid that a tile sees up to a depth,
or none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.arrays import Array
from simgl.scene.mesh import Mesh, plate
from simgl.view.empty_slices import is_free
from simgl.view.frame_view import frame_view
from simgl.view.raster_tiles import RasterTile
from tests.scenes import lambert, scene

FAR = 0.2
FIRST = np.zeros(1, dtype=np.uint32)


def tile() -> RasterTile:
    """Of an image that a wall fills, 65 x 50 deg."""
    wall = {"plate": {"width_m": 9.0, "height_m": 9.0, "material": lambert(0.5)}}
    camera = {
        "width_px": 64,
        "height_px": 48,
        "pixel_pitch_um": 100.0,
        "focal_length_mm": 5.0,
        "position_icrf_m": [0.0, 0.0, 2.0],
        "boresight": [0.0, 0.0, -1.0],
        "up": [0.0, 1.0, 0.0],
    }
    found = scene({"wall": {"model": wall, "position_icrf_m": [0.0, 0.0, 0.0]}}, camera)
    (only,) = frame_view(found.at(found.epoch_tai_ns), "cam", sample_budget=100_000).tiles
    return only


def triangle(corners: Array) -> Mesh:
    """Of corners (3, 3), camera axes."""
    one = np.arange(3, dtype=np.uint32)[None]
    return replace(plate(1.0, 1.0), positions=_padded(corners), triangles=one)


def _padded(corners: Array) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """A plate has four corners."""
    return np.vstack([corners, corners[:1]]).astype(np.float32)


def is_seen(corners: Array) -> bool:
    """Whether a point of it is in the image nearer than ``FAR``."""
    i, j = (n.ravel() / 80.0 for n in np.mgrid[:81, :81])
    inside = i + j <= 1.0
    weights = np.stack([1.0 - i - j, i, j], axis=1)[inside]
    x, y, z = (weights @ corners).T
    return bool(((z > 0.0) & (z < FAR) & (np.abs(x) < 0.64 * z) & (np.abs(y) < 0.48 * z)).any())


def test_what_is_seen_is_never_missed_and_most_of_what_is_not_is_told() -> None:
    """Triangles as large as the pyramid is long, and ten times larger, around it."""
    seen_by, random = tile(), np.random.default_rng(3)
    free_of = {True: 0, False: 0}
    count_of = {True: 0, False: 0}
    for size in (0.2, 2.0):
        for _ in range(400):
            middle = random.normal(scale=0.3, size=3)
            corners = middle + random.normal(scale=size, size=(3, 3))
            seen = is_seen(corners)
            count_of[seen] += 1
            free_of[seen] += is_free(seen_by, FAR, triangle(corners), np.eye(4), FIRST)
    assert count_of[True] > 30
    assert free_of[True] == 0
    assert free_of[False] > 0.8 * count_of[False]


def test_a_wall_beside_the_line_of_sight_is_not_in_the_way() -> None:
    """From behind the camera to far before it, and past the image's edge up to 0.3 m."""
    x = 0.64 * 0.3
    wall = np.array([[x, -9.0, -5.0], [x, 9.0, -5.0], [x, 0.0, 9.0]])
    assert is_free(tile(), FAR, triangle(wall), np.eye(4), FIRST)
    assert not is_free(tile(), 0.35, triangle(wall), np.eye(4), FIRST)
