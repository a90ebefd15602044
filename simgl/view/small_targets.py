"""Spacecraft that are too small in the image for the sample grid of its pixels.

A raster that covers the spacecraft alone, and not the pixels that it touches, puts enough samples
on one of any size. From far away the spacecraft is drawn as if it stood nearer on the same line of
sight, where float32 resolves it; its image then shrinks about its middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.sample_grid import MAX_SAMPLES, SampleGrid, rotated_sample_grid

# Samples along the edge of a cell: no more samples in it than a texel holds groups.
CELL = 2
# Of the loops over rows of cells, over cells, and a branch in each (shaders/resolve/resolve.frag):
# llvmpipe ends those of a pixel and its neighbours after 65,535.
_MAX_TURNS = 50_000
# Length over width up to which samples are as many along as across.
_THINNEST = 1e3
# Where all of an outline is one point, its extent [px]; float64 still tells samples in it apart.
_POINT = 1e-6
# Of an outline seen edge on, over the square of its extent.
_MIN_AREA = 1e-6
# Larger spacecraft fill most of the pixels that they touch.
_LARGEST = 4.0
# At so many times its radius, float32 places a spacecraft to 1 % of its radius in depth.
_FARTHEST_RADII = 1e5


@dataclass(frozen=True, kw_only=True, eq=False)
class RasterWindow:
    """The raster of small spacecraft.

    size : columns and rows, of whole cells
    raster_from_image : (2, 3) affine map from pixel coordinates of what is drawn
    image_from_raster : (2, 3) affine map to the pixel coordinates where it is seen
    samples_per_pixel : where it is seen
    """

    size: tuple[int, int]
    sample_grid: SampleGrid
    raster_from_image: Array
    image_from_raster: Array
    samples_per_pixel: float


def in_pixels(points: Array, camera: Camera) -> Array:
    """(n, 2) pixel coordinates of points (n, 3) before the camera [m]."""
    middle = np.array(camera.principal_point)
    return points[:, :2] / points[:, 2:] * camera.focal_length_px + middle


def outline_area(outline: Array) -> float:
    """Area of the convex hull of points (n, 2); 0 where they lie on a line."""
    extent = np.ptp(outline, axis=0)
    if np.any(extent == 0.0):
        return 0.0
    try:
        # Scaled, since points far from the origin and close together look flat.
        return float(
            scipy.spatial.ConvexHull((outline - outline[0]) / extent).volume * np.prod(extent)
        )
    except scipy.spatial.QhullError:
        return 0.0


def is_small(outline: Array, area: float, pixels: int, samples: float, sample_budget: int) -> bool:
    """Whether the finest sample grid of pixels is too coarse for an outline (n, 2) [px].

    pixels, sample_budget : that the outline touches, and samples that may be spent on them
    samples : that the outline needs
    """
    extent = np.ptp(outline, axis=0)
    finest = min(sample_budget / pixels, MAX_SAMPLES)
    return bool(np.all(extent < _LARGEST)) and area * finest < samples


def nearer(hull: Array) -> float:
    """By how much a hull (n, 3), camera axes [m], is to be drawn nearer."""
    middle = hull.mean(axis=0)
    radius = float(np.linalg.norm(hull - middle, axis=1).max())
    return max(1.0, float(np.linalg.norm(middle)) / (_FARTHEST_RADII * radius))


def _squared(outline: Array) -> Array:
    """(2, 2) matrix of determinant 1 that makes an outline (n, 2) about as wide as long."""
    _, extents, axes = np.linalg.svd(outline - outline.mean(axis=0), full_matrices=False)
    # Far enough away float64 leaves one point of it.
    longest = max(float(extents[0]), _POINT)
    stretch = float(np.sqrt(longest / max(float(extents[1]), longest / _THINNEST)))
    # Turned, not mirrored: front faces stay so.
    across = stretch * float(np.sign(np.linalg.det(axes)))
    return np.array([[1.0 / stretch], [across]]) * axes


def raster_window(drawn: Array, factor: float, camera: Camera, samples: float) -> RasterWindow:
    """The raster around a hull.

    drawn : (n, 3) where it is drawn, camera axes [m]
    factor : by which that is nearer than where it is seen
    samples : that its outline needs
    """
    outline = in_pixels(drawn, camera)
    middle = in_pixels(drawn.mean(axis=0, keepdims=True), camera)[0]
    # Along and across a thin one, as many samples: an even lattice along its edges would miss them.
    squared = _squared(outline)
    outline = outline @ squared.T
    longest = max(float(np.ptp(outline, axis=0).max()), _POINT)
    density = samples / max(outline_area(outline), _MIN_AREA * longest**2)
    while True:
        grid = rotated_sample_grid(density)
        places = outline @ grid.turn.T
        low = places.min(axis=0) - 1.0
        cells = np.ceil((places.max(axis=0) + 1.0 - low) / CELL).astype(int)
        # Thin spacecraft fill little of their raster.
        turns = cells[1] * (1 + 2 * cells[0])
        if turns <= _MAX_TURNS:
            break
        density *= 0.99 * _MAX_TURNS / turns
    raster_from_image = grid.turn @ squared
    back = np.linalg.inv(raster_from_image)
    return RasterWindow(
        size=(CELL * int(cells[0]), CELL * int(cells[1])),
        sample_grid=grid,
        raster_from_image=np.column_stack([raster_from_image, -low]),
        image_from_raster=np.column_stack([back / factor, middle + (back @ low - middle) / factor]),
        samples_per_pixel=grid.scale**2 * factor**2,
    )
