"""Spacecraft that are too small in the image for the sample grid of its pixels.

A raster that covers the spacecraft alone, and not the pixels that it touches, puts enough samples
on one of any size. From far away the spacecraft is drawn as if it stood nearer on the same line of
sight, where float32 resolves it; its image then shrinks about its middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.physics.frames import norm
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
# Directions whose farthest points tell where an outline of many points can be.
_TURNS = np.arange(16) * (np.pi / 8.0)
_DIRECTIONS = np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=-1)
_MANY = 200
# Points of a product: for more, BLAS may wake its threads, which keep a core busy for as long as a
# frame takes.
_AT_ONCE = 1 << 13
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
    # Coordinate by coordinate: numpy is slow along rows of two.
    x, y, depth = points.T
    scale = camera.focal_length_px / depth
    across, down = camera.principal_point
    return np.stack([x * scale + across, y * scale + down]).T


def _parts(outline: Array) -> list[Array]:
    """Points (n, 2) in parts that a product takes at once."""
    return [outline[start : start + _AT_ONCE] for start in range(0, len(outline), _AT_ONCE)]


def _farthest(outline: Array) -> Array:
    """The corners of the polygon of the points (n, 2) farthest out along directions."""
    while True:
        parts = _parts(outline)
        outline = np.concatenate([p[np.argmax(_DIRECTIONS @ p.T, axis=1)] for p in parts])
        if len(parts) == 1:
            return outline


def _outer(outline: Array) -> Array:
    """The corners of the polygon of the points (n, 2) farthest out along directions, and those that
    are not within it.

    They have the same convex hull.
    """
    farthest = _farthest(outline)
    along = np.roll(farthest, -1, axis=0) - farthest
    inwards = np.stack([-along[:, 1], along[:, 0]], axis=1)
    limits = np.sum(inwards * farthest, axis=1)[:, None]
    outside = [(inwards @ part.T < limits).any(axis=0) for part in _parts(outline)]
    beyond = outline[np.concatenate(outside)]
    return np.concatenate([farthest, _without_dents(beyond, farthest.mean(axis=0))])


def _without_dents(points: Array, middle: Array) -> Array:
    """Points (n, 2) in the order of their angles about a place within their hull, while there are
    many without those that dent the polygon: each lies in the triangle of its neighbours and that
    place, so it is no corner of the hull."""
    x, y = (points - middle).T
    order = np.argsort(np.arctan2(y, x))
    points = points[order]
    while len(points) > _MANY:
        along = np.diff(points, axis=0, append=points[:1])
        before = np.roll(along, 1, axis=0)
        convex = before[:, 0] * along[:, 1] >= before[:, 1] * along[:, 0]
        if convex.all():
            break
        points = points[convex]
    return points


def _chain(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Of points, sorted and different: the side of their convex hull from the first to the last on
    which y is largest."""
    corners: list[tuple[float, float]] = []
    for x, y in points:
        while len(corners) > 1:
            (x0, y0), (x1, y1) = corners[-2:]
            if (x1 - x0) * (y - y1) - (y1 - y0) * (x - x1) < 0.0:
                break
            # What lies below the line between two others is no part of it.
            corners.pop()
        corners.append((x, y))
    return corners


def convex_outline(outline: Array) -> Array:
    """(m, 2) corners of the convex hull of points (n, 2) in order, to the left of each its outside;
    two where all lie on a line."""
    # About one of them, for far from the origin rounding would show.
    first = outline[0]
    outline = outline - first
    if len(outline) > _MANY:
        outline = _outer(outline)
    # In lists: numpy takes longer for so few.
    points = sorted({(x, y) for x, y in outline.tolist()})
    around = _chain(points)[:-1] + _chain(points[::-1])[:-1]
    return np.asarray(first + np.array(around).reshape(-1, 2))


def enclosed_area(corners: Array) -> float:
    """Area that a ``convex_outline`` (n, 2) encloses; 0 of a line."""
    (x, y), (next_x, next_y) = (corners - corners[:1]).T, np.roll(corners - corners[:1], -1, 0).T
    return 0.5 * abs(float(np.sum(x * next_y - next_x * y)))


def outline_area(outline: Array) -> float:
    """Area of the convex hull of points (n, 2); 0 where they lie on a line."""
    return enclosed_area(convex_outline(outline))


def is_small(outline: Array, area: float, pixels: int, samples: float, sample_budget: int) -> bool:
    """Whether the finest sample grid of pixels is too coarse for an outline (n, 2) [px].

    pixels, sample_budget : that the outline touches, and samples that may be spent on them
    samples : that the outline needs
    """
    finest = min(sample_budget / pixels, MAX_SAMPLES)
    return area * finest < samples and bool(np.all(np.ptp(outline, axis=0) < _LARGEST))


def nearer(hull: Array) -> float:
    """By how much a hull (n, 3), camera axes [m], is to be drawn nearer."""
    middle = hull.mean(axis=0)
    radius = float(np.linalg.norm(hull - middle, axis=1).max())
    return max(1.0, norm(middle) / (_FARTHEST_RADII * radius))


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
