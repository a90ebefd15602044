"""Rectangles of the image that hold spacecraft, each with its own raster of samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.sample_grid import PIXEL_CENTRES, SampleGrid, choose_sample_grid
from simgl.view.small_targets import (
    RasterWindow,
    in_pixels,
    is_small,
    nearer,
    outline_area,
    raster_window,
)
from simgl.view.spacecraft_view import SpacecraftView, hull_in_camera

# Nothing closer to the pinhole than this is drawn [m].
NEAREST = 0.01
# One 24-bit depth buffer covers distances up to this ratio: steps of 4e-6 of the distance.
SLICE_RATIO = 64.0


# Low x and y, high x and y [px].
Box = tuple[int, int, int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class RasterTile:
    """A rectangle of the image that holds spacecraft, drawn on its own sample grid.

    x, y, width, height : pixels
    edges : (4, 4) float32, normals of the planes through the pinhole and the rectangle's edges,
        half a pixel outside it; towards its inside, the last column unused
    depths : nearest and farthest of each depth slice [m], the farthest slice first
    slices : clip_from_camera (4, 4) float32 of each
    sample_steps : (2, 4) float32, of the line of sight at depth 1 from a sample to the next along
        rows and along columns of the sample grid's raster, camera axes, the last column unused
    spacecraft : as they are drawn
    window : of spacecraft too small for a raster of all the pixels; these have no edges
    owned : low x and y, high x and y; a lens that distorts draws from this tile the pixels whose
        middles lie in there
    """

    x: int
    y: int
    width: int
    height: int
    sample_grid: SampleGrid
    edges: Array32
    depths: tuple[tuple[float, float], ...]
    slices: tuple[Array32, ...]
    sample_steps: Array32
    spacecraft: tuple[SpacecraftView, ...]
    owned: Box
    window: RasterWindow | None = None

    @property
    def raster_size(self) -> tuple[int, int]:
        """Columns and rows of its samples."""
        if self.window is not None:
            return self.window.size
        return self.sample_grid.raster_size(self.width, self.height)


def parts(tile: RasterTile, camera: Camera, max_samples: int, reach: int = 0) -> list[RasterTile]:
    """A tile cut into tiles whose rasters hold no more samples than that each, a pixel at least.

    reach : to which a pixel of a lens that distorts sees around its middle [px of ``camera``]; the
        tiles then overlap by it, but own different pixels
    """
    box = tile.x, tile.y, tile.x + tile.width, tile.y + tile.height
    return _parts(replace(tile, owned=_grown(box, reach)), box, camera, max_samples, reach)


def _parts(
    tile: RasterTile, full: Box, camera: Camera, max_samples: int, reach: int
) -> list[RasterTile]:
    columns, rows = tile.raster_size
    x0, y0, x1, y1 = tile.owned
    width, height = x1 - x0, y1 - y0
    if columns * rows <= max_samples or max(width, height) == 1:
        return [tile]
    x, y = x0 + width // 2, y0 + height // 2
    halves = ((x0, y0, x, y1), (x, y0, x1, y1))
    if width < height:
        halves = ((x0, y0, x1, y), (x0, y, x1, y1))
    cut = []
    for half in halves:
        seen = _grown(half, reach)
        box = (
            max(seen[0], full[0]),
            max(seen[1], full[1]),
            min(seen[2], full[2]),
            min(seen[3], full[3]),
        )
        part = _tile(box, tile.spacecraft, tile.depths, camera, tile.sample_grid)
        cut += _parts(replace(part, owned=half), full, camera, max_samples, reach)
    return cut


def _grown(box: Box, by: int) -> Box:
    return box[0] - by, box[1] - by, box[2] + by, box[3] + by


def pixel_centre_tile(spacecraft: tuple[SpacecraftView, ...], camera: Camera) -> RasterTile:
    """One tile over the whole image with a single sample at each pixel's centre."""
    d = camera.detector
    depths = np.concatenate([hull_in_camera(one)[:, 2] for one in spacecraft])
    box = 0, 0, d.width, d.height
    return _tile(box, spacecraft, _depth_slices(depths), camera, PIXEL_CENTRES)


def _float32(values: Array) -> Array32:
    return np.asarray(values, dtype=np.float32)


def _before_the_camera(hull: Array) -> Array:
    """Points whose hull is the part of a convex hull that lies at least ``NEAREST`` away."""
    near = hull[:, 2] < NEAREST
    if not np.any(near):
        return hull
    back, front = hull[near][:, None], hull[~near][None, :]
    # Where each line from a point in front to one behind crosses the nearest plane.
    share = (NEAREST - back[..., 2]) / (front[..., 2] - back[..., 2])
    crossing = back + share[..., None] * (front - back)
    return np.concatenate([hull[~near], crossing.reshape(-1, 3)])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Target:
    """A spacecraft in view and its place in the image.

    hull : (n, 3) of what lies before the camera, camera axes [m]
    box : x0, y0, x1, y1 of the pixels that the hull can touch
    outline : (n, 2) of the hull [px]
    area : of the outline [px^2]
    """

    view: SpacecraftView
    hull: Array
    box: Box
    outline: Array
    area: float


def _target(view: SpacecraftView, camera: Camera) -> _Target | None:
    """None where it is out of view."""
    hull = hull_in_camera(view)
    if np.all(hull[:, 2] < NEAREST):
        return None
    outline = in_pixels(_before_the_camera(hull), camera)
    box = camera.detector.pixels_within(outline.min(axis=0), outline.max(axis=0))
    if box is None:
        return None
    return _Target(view=view, hull=hull, box=box, outline=outline, area=outline_area(outline))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """Spacecraft that share a tile, since they may hide each other."""

    targets: tuple[_Target, ...]
    box: Box

    @cached_property
    def hull(self) -> Array:
        return np.concatenate([one.hull for one in self.targets])

    @property
    def depths(self) -> tuple[float, float]:
        return float(self.hull[:, 2].min()), float(self.hull[:, 2].max())

    def joined(self, other: _Group) -> _Group:
        return _Group(targets=self.targets + other.targets, box=_union(self.box, other.box))


def _share_pixels(a: _Group, b: _Group) -> bool:
    return _overlap(a.box, b.box)


def _share_pixels_and_depth(a: _Group, b: _Group) -> bool:
    (near_a, far_a), (near_b, far_b) = a.depths, b.depths
    return _share_pixels(a, b) and near_a <= far_b and near_b <= far_a


def _outlines_overlap(a: _Group, b: _Group) -> bool:
    (low_a, high_a), (low_b, high_b) = (
        (min_max.min(axis=0), min_max.max(axis=0))
        for min_max in (np.concatenate([t.outline for t in g.targets]) for g in (a, b))
    )
    return bool(np.all(low_a <= high_b) and np.all(low_b <= high_a))


def _join(
    groups: list[_Group], group: _Group, touch: Callable[[_Group, _Group], bool]
) -> list[_Group]:
    """The groups with one more, which those that it touches have joined."""
    rest = list(groups)
    while touching := [one for one in rest if touch(one, group)]:
        for one in touching:
            rest.remove(one)
            group = one.joined(group)
    return [*rest, group]


def raster_tiles(
    views: list[SpacecraftView],
    camera: Camera,
    sample_budget: int,
    samples_per_pixel: int | None,
    *,
    with_lamps: bool,
) -> tuple[RasterTile, ...]:
    """The tiles in the order in which they are laid over the image, the farthest first.

    sample_budget : geometry samples that a tile may take where ``samples_per_pixel`` is None
    samples_per_pixel : of geometry; more where spacecraft are small
    with_lamps : distances between spacecraft and lamps matter
    """
    groups: list[_Group] = []
    windows: list[_Group] = []
    targets = [target for view in views if (target := _target(view, camera)) is not None]
    small = {id(one) for one in targets if is_small(one.outline, one.area)}
    for one in sorted(targets, key=lambda one: id(one) in small):
        group = _Group(targets=(one,), box=one.box)
        if id(one) not in small or any(_share_pixels_and_depth(other, group) for other in groups):
            groups = _join(groups, group, _share_pixels)
        else:
            windows = _join(windows, group, _outlines_overlap)
    tiles = []
    for group in sorted([*groups, *windows], key=lambda group: -group.depths[0]):
        if group in windows:
            tiles.append(_window_tile(group, camera, with_lamps=with_lamps))
            continue
        pixels = (group.box[2] - group.box[0]) * (group.box[3] - group.box[1])
        smallest = min(one.area for one in group.targets)
        sample_grid = choose_sample_grid(pixels, sample_budget, samples_per_pixel, smallest)
        together = tuple(one.view for one in group.targets)
        slices = _depth_slices(group.hull[:, 2])
        tiles.append(_tile(group.box, together, slices, camera, sample_grid))
    return tuple(tiles)


def _window_tile(group: _Group, camera: Camera, *, with_lamps: bool) -> RasterTile:
    """Small spacecraft on a raster that covers nothing else."""
    views, hull, factor = tuple(one.view for one in group.targets), group.hull, 1.0
    # Nearer, other spacecraft and lamps would stand at another distance.
    if len(views) == 1 and not with_lamps:
        factor = nearer(hull)
        step = (1.0 / factor - 1.0) * hull.mean(axis=0)
        matrix = views[0].camera_from_body.astype(np.float64)
        matrix[:3, 3] += step
        views, hull = (replace(views[0], camera_from_body=_float32(matrix)),), hull + step
    window = raster_window(hull, factor, camera)
    slices = _depth_slices(hull[:, 2])
    return _tile(group.box, views, slices, camera, window.sample_grid, window)


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _union(a: Box, b: Box) -> Box:
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def _tile(
    box: Box,
    spacecraft: tuple[SpacecraftView, ...],
    depths: tuple[tuple[float, float], ...],
    camera: Camera,
    sample_grid: SampleGrid,
    window: RasterWindow | None = None,
) -> RasterTile:
    x0, y0, x1, y1 = box
    width, height = x1 - x0, y1 - y0
    shift = np.array([[1.0, 0.0, -x0], [0.0, 1.0, -y0], [0.0, 0.0, 1.0]])
    if window is None:
        raster_from_camera = sample_grid.raster_from_pixel(width) @ shift @ camera.intrinsics
        size = np.array(sample_grid.raster_size(width, height))
        edges = _edges(shift @ camera.intrinsics, width, height)
    else:
        raster_from_camera = window.raster_from_image @ camera.intrinsics
        size = np.array(window.size)
        edges = _float32(np.zeros((4, 4)))
    rows = 2.0 * raster_from_camera / size[:, None] - np.array([0.0, 0.0, 1.0])
    slices = []
    for near, far in depths:
        clip = np.zeros((4, 4))
        clip[:2, :3] = rows
        clip[2, 2:] = (far + near) / (far - near), -2.0 * far * near / (far - near)
        clip[3, 2] = 1.0
        slices.append(_float32(clip))
    camera_from_raster = np.linalg.inv(np.vstack([raster_from_camera, [0.0, 0.0, 1.0]]))
    steps = np.zeros((2, 4))
    steps[:, :3] = camera_from_raster[:, :2].T
    return RasterTile(
        x=x0,
        y=y0,
        width=width,
        height=height,
        sample_grid=sample_grid,
        edges=edges,
        depths=depths,
        slices=tuple(slices),
        sample_steps=_float32(steps),
        spacecraft=spacecraft,
        owned=box,
        window=window,
    )


def _edges(tile_from_camera: Array, width: int, height: int) -> Array32:
    """The planes of a tile's edges as rows.

    tile_from_camera : (3, 3), to homogeneous pixels from the tile's corner
    """
    x, y, one = tile_from_camera
    edges = np.zeros((4, 4))
    edges[:, :3] = x + 0.5 * one, (width + 0.5) * one - x, y + 0.5 * one, (height + 0.5) * one - y
    return _float32(edges)


def _depth_slices(depths: Array) -> tuple[tuple[float, float], ...]:
    """Near and far of the depth slices that hold the given depths [m], farthest first."""
    near = max(float(depths.min()) * 0.999, NEAREST)
    far = max(float(depths.max()) * 1.001, 2.0 * near)
    count = int(np.ceil(np.log(far / near) / np.log(SLICE_RATIO)))
    edges = np.geomspace(near, far, count + 1)
    # Neighbours overlap by 1e-4, so that rounding leaves no crack between them.
    return tuple((float(a), float(b) * 1.0001) for a, b in pairwise(edges))[::-1]
