"""Rectangles of the image that hold spacecraft, each with its own raster of samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.sample_grid import PIXEL_CENTRES, SampleGrid, choose_sample_grid, target_samples
from simgl.view.depth_slices import NEAREST, depth_slices
from simgl.view.hulls_in_view import before_the_camera, in_view
from simgl.view.image_box import Box, area_of, overlap, union
from simgl.view.lit_limbs import Limb, limb_boxes
from simgl.view.small_targets import CELL as WINDOW_CELL
from simgl.view.small_targets import (
    RasterWindow,
    convex_outline,
    enclosed_area,
    in_pixels,
    is_small,
    nearer,
    raster_window,
)
from simgl.view.spacecraft_view import (
    SpacecraftView,
    hull_in_camera,
    hulls_at_the_ends,
    settled_view,
)

# Beyond every image, on either side.
_BEYOND = (-1e9, 1e9)
# Of an outline seen edge on [px^2].
_MIN_AREA = 1e-9
# Of the samples that a small target needs: with so many its light is right to one percent.
_ENOUGH = 1.0 / 16.0


@dataclass(frozen=True, kw_only=True, eq=False)
class CellGrid:
    """Squares of a tile's raster, whole parts of a pixel, whose samples may share their shading.

    size : columns and rows
    raster_from_cell : (2, 3) affine map to the raster from cell coordinates
    """

    size: tuple[int, int]
    raster_from_cell: Array

    @cached_property
    def reach(self) -> float:
        """How far from a cell's middle its samples lie along an axis of the raster [texels]."""
        # With a little more for rounding.
        return float(0.5 * np.abs(self.raster_from_cell[:, :2]).sum(axis=1).max()) + 0.01

    @cached_property
    def cell_from_raster(self) -> Array:
        """(2, 2) of the map back."""
        return np.asarray(np.linalg.inv(self.raster_from_cell[:, :2]), dtype=np.float64)

    @property
    def texels(self) -> int:
        """Along the edge of the window of the raster that holds a cell's samples."""
        return int(2.0 * self.reach) + 1


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
    sight_origin : (4,) float32, the line of sight at depth 1 through the raster's corner
    cells : of the raster
    spacecraft : as they are drawn
    window : of spacecraft too small for a raster of all the pixels; these have no edges
    core : x0, y0, x1, y1 of what is averaged from it: a distorting lens's pixels by their middles
    shown : the boxes of the image that its spacecraft may be seen in, where there are cuts
    cuts : boxes of it, and the sample grid that each is drawn on; () where all of it is on its own
    cores : where not all of the core is averaged from it, the parts that are
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
    sight_origin: Array32
    cells: CellGrid
    spacecraft: tuple[SpacecraftView, ...]
    window: RasterWindow | None = None
    core: tuple[float, ...] = (*_BEYOND[:1] * 2, *_BEYOND[1:] * 2)
    shown: tuple[Box, ...] = ()
    cuts: tuple[tuple[Box, SampleGrid], ...] = ()
    cores: tuple[tuple[float, ...], ...] = ()

    @property
    def raster_size(self) -> tuple[int, int]:
        """Columns and rows of its samples."""
        if self.window is not None:
            return self.window.size
        return self.sample_grid.raster_size(self.width, self.height)


def pixel_centre_tile(spacecraft: tuple[SpacecraftView, ...], camera: Camera) -> RasterTile:
    """One tile over the whole image with a single sample at each pixel's centre."""
    d = camera.detector
    depths = np.concatenate([hull_in_camera(one)[:, 2] for one in spacecraft])
    box = 0, 0, d.width, d.height
    return tile_of(box, spacecraft, depth_slices(depths), camera, PIXEL_CENTRES)


def _float32(values: Array) -> Array32:
    return np.asarray(values, dtype=np.float32)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Target:
    """A spacecraft in view and its place in the image.

    hull : (n, 3) of what lies before the camera, camera axes [m]
    box : x0, y0, x1, y1 of the pixels that the hull can touch
    outline : (n, 2) of the hull, its ``convex_outline`` [px]
    area : of the outline [px^2]
    margin : by which it lies elsewhere where it moves [px]
    settled : where it moves, the same as it stands at its own middle's time
    """

    view: SpacecraftView
    hull: Array
    box: Box
    outline: Array
    area: float
    margin: float = 0.0
    settled: _Target | None = None

    @cached_property
    def cos_phase(self) -> float:
        """Cosine of its phase angle."""
        middle = self.hull.mean(axis=0)
        return -float(middle @ self.view.sun_direction) / float(np.linalg.norm(middle))

    @cached_property
    def samples(self) -> float:
        """That its outline needs."""
        return target_samples(self.cos_phase, float(np.sqrt(4.0 / np.pi * self.area)))

    @property
    def samples_per_pixel(self) -> float:
        """That its outline needs."""
        return self.samples / max(self.area, _MIN_AREA)

    @property
    def limb(self) -> Limb:
        """Its limb, towards the Sun's place in the image."""
        x, y, depth = self.hull.mean(axis=0)
        across, down, along = self.view.sun_direction.astype(np.float64)
        depth = max(depth, NEAREST)
        to_sun = np.array([across - along * x / depth, down - along * y / depth])
        return Limb(
            outline=self.outline,
            to_sun=to_sun,
            samples_per_pixel=self.samples_per_pixel,
            margin=self.margin,
            cos_phase=self.cos_phase,
        )

    def is_small(self, sample_budget: int) -> bool:
        """Whether that is more than a raster of pixels can hold."""
        pixels = area_of(self.box)
        return is_small(self.outline, self.area, pixels, self.samples, sample_budget)


def _target(
    view: SpacecraftView, camera: Camera, rows: tuple[int, int] | None = None
) -> _Target | None:
    """None where it is out of view.

    rows : of the image in which it is drawn; None for all
    """
    hull = hull_in_camera(view)
    bulge = 0.0 if view.motion is None else view.motion.sag(camera, float(camera.detector.height))
    if not in_view(hull, camera, bulge):
        return None
    posed = view.model.posed_mesh
    # Those of its stored points, which stay while it moves as one.
    edges = None if view.motion is not None else lambda: posed.hull_edges
    outline = convex_outline(in_pixels(before_the_camera(hull, edges), camera))
    margin, settled, low, high = 0.0, None, outline.min(axis=0), outline.max(axis=0)
    if view.motion is not None:
        settled = _target(settled_view(view), camera, rows)
        margin = view.motion.sag(camera, float(np.linalg.norm(high - low)))
        hull = np.concatenate([hull, *hulls_at_the_ends(view)])
    box = camera.detector.pixels_within(low - margin, high + margin)
    if box is not None and rows is not None:
        box = box[0], max(box[1], rows[0]), box[2], min(box[3], rows[1])
    if box is None or box[1] >= box[3]:
        return None
    return _Target(
        view=view,
        hull=hull,
        box=box,
        outline=outline,
        area=enclosed_area(outline),
        margin=margin,
        settled=settled,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """Spacecraft that share a tile, since they may hide each other."""

    targets: tuple[_Target, ...]
    box: tuple[int, int, int, int]

    @cached_property
    def hull(self) -> Array:
        return np.concatenate([one.hull for one in self.targets])

    @property
    def depths(self) -> tuple[float, float]:
        return float(self.hull[:, 2].min()), float(self.hull[:, 2].max())

    def joined(self, other: _Group) -> _Group:
        return _Group(targets=self.targets + other.targets, box=union(self.box, other.box))


def _share_pixels(a: _Group, b: _Group) -> bool:
    return overlap(a.box, b.box)


def _share_depth(a: _Group, b: _Group) -> bool:
    (near_a, far_a), (near_b, far_b) = a.depths, b.depths
    return near_a <= far_b and near_b <= far_a


def _must_share(group: _Group, small: _Group, sample_budget: int) -> bool:
    """Whether a small target is to be drawn on a group's raster.

    Laid over it by its share of a pixel, a target would hide as much of what the group shows on
    either side of an edge there, and of the shadow that it casts. It is drawn with it where the
    raster tells its light, and where they may pass through each other.
    """
    if not _share_pixels(group, small):
        return False
    (one,) = small.targets
    samples, pixels = _ENOUGH * one.samples, area_of(union(group.box, small.box))
    if not is_small(one.outline, one.area, pixels, samples, sample_budget):
        return True
    return _share_depth(group, small)


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
    rows: tuple[int, int] | None = None,
) -> tuple[RasterTile, ...]:
    """The tiles in the order in which they are laid over the image, the farthest first.

    sample_budget : geometry samples that a tile may take where ``samples_per_pixel`` is None
    samples_per_pixel : of geometry; more where spacecraft are small
    with_lamps : distances between spacecraft and lamps matter
    rows : first and end of those that are drawn; None for all
    """
    groups: list[_Group] = []
    windows: list[_Group] = []
    targets = [target for view in views if (target := _target(view, camera, rows)) is not None]
    small = {id(one) for one in targets if (one.settled or one).is_small(sample_budget)}
    for one in sorted(targets, key=lambda one: id(one) in small):
        group = _Group(targets=(one,), box=one.box)
        if id(one) not in small or any(_must_share(o, group, sample_budget) for o in groups):
            groups = _join(groups, group, _share_pixels)
        else:
            # The rows of a few pixels see it at one time.
            standing = one.settled or one
            group = _Group(targets=(standing,), box=standing.box)
            windows = _join(windows, group, _outlines_overlap)
    tiles = []
    for group in sorted([*groups, *windows], key=lambda group: -group.depths[0]):
        if group in windows:
            tiles.append(_window_tile(group, camera, with_lamps=with_lamps))
            continue
        pixels = (group.box[2] - group.box[0]) * (group.box[3] - group.box[1])
        needed = max(one.samples_per_pixel for one in group.targets)
        sample_grid = choose_sample_grid(pixels, sample_budget, samples_per_pixel, needed)
        together = tuple(one.view for one in group.targets)
        slices = depth_slices(group.hull[:, 2])
        tile = tile_of(group.box, together, slices, camera, sample_grid)
        limbs = [one.limb for one in group.targets]
        cuts = limb_boxes(group.box, sample_grid, limbs, sample_budget)
        tiles.append(replace(tile, cuts=cuts, shown=tuple(one.box for one in group.targets)))
    if rows is not None:
        core = _BEYOND[0], float(rows[0]), _BEYOND[1], float(rows[1])
        tiles = [replace(tile, core=core) for tile in tiles]
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
    samples = max(one.samples for one in group.targets)
    window = raster_window(hull, factor, camera, samples)
    slices = depth_slices(hull[:, 2])
    return tile_of(group.box, views, slices, camera, window.sample_grid, window)


def tile_of(
    box: tuple[int, int, int, int],
    spacecraft: tuple[SpacecraftView, ...],
    depths: tuple[tuple[float, float], ...],
    camera: Camera,
    sample_grid: SampleGrid,
    window: RasterWindow | None = None,
) -> RasterTile:
    """The tile of a box of the image.

    depths : of the slices, as of the tile; window : of small spacecraft
    """
    x0, y0, x1, y1 = box
    width, height = x1 - x0, y1 - y0
    shift = np.array([[1.0, 0.0, -x0], [0.0, 1.0, -y0], [0.0, 0.0, 1.0]])
    if window is None:
        raster_from_camera = sample_grid.raster_from_pixel(width) @ shift @ camera.intrinsics
        size = np.array(sample_grid.raster_size(width, height))
        per_pixel = sample_grid.cells_per_edge
        raster_from_cell = sample_grid.raster_from_pixel(width)
        raster_from_cell[:, :2] /= per_pixel
        cells = CellGrid(
            size=(per_pixel * width, per_pixel * height), raster_from_cell=raster_from_cell
        )
        edges = _edges(shift @ camera.intrinsics, width, height)
        cells_per_px = float(per_pixel)
    else:
        raster_from_camera = window.raster_from_image @ camera.intrinsics
        size = np.array(window.size)
        columns, rows_of_cells = (edge // WINDOW_CELL for edge in window.size)
        cells = CellGrid(size=(columns, rows_of_cells), raster_from_cell=WINDOW_CELL * np.eye(2, 3))
        edges = _float32(np.zeros((4, 4)))
        cells_per_px = float(np.sqrt(window.samples_per_pixel)) / WINDOW_CELL
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
    origin = np.append(camera_from_raster[:, 2], 0.0)
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
        sight_origin=_float32(origin),
        cells=cells,
        spacecraft=tuple(one.in_cells(cells_per_px) for one in spacecraft),
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
