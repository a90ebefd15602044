"""Tiles cut into parts: along lit limbs, and where they hold more samples than are lit at once."""

from __future__ import annotations

from dataclasses import replace

from simgl.camera.camera import Camera
from simgl.sample_grid import SampleGrid
from simgl.view.image_box import Box
from simgl.view.raster_tiles import RasterTile, tile_of


def parts(tile: RasterTile, camera: Camera, max_samples: int, margin: int = 0) -> list[RasterTile]:
    """A tile cut into tiles of no more samples than that each, without margins; a pixel at least.

    margin : pixels that they hold beyond the cuts; no more than ``core`` is averaged from each
    """
    averaged = [box for box, grid in tile.cuts if grid == tile.sample_grid]
    finer = [(box, grid) for box, grid in tile.cuts if grid != tile.sample_grid]
    edges = tile.x, tile.y, tile.x + tile.width, tile.y + tile.height
    coarse = []
    if averaged or not finer:
        for core in _cut(edges, tile.sample_grid, max_samples):
            part = _part(tile, core, tile.sample_grid, margin, camera)
            shown = [_within(box, core) for box in averaged]
            cores = tuple(_core(tile, box) for box in shown if box[0] < box[2] and box[1] < box[3])
            coarse.append(replace(part, cores=cores))
    return coarse + [
        _part(tile, core, grid, margin, camera)
        for box, grid in finer
        for core in _cut(box, grid, max_samples)
    ]


def _within(a: Box, b: Box) -> Box:
    return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])


def _overlap(a: Box, b: Box) -> bool:
    x0, y0, x1, y1 = _within(a, b)
    return x0 < x1 and y0 < y1


def _grown(box: Box) -> Box:
    """By a pixel: a sample grid is turned against the pixels."""
    return box[0] - 1, box[1] - 1, box[2] + 1, box[3] + 1


def _cut(box: Box, sample_grid: SampleGrid, max_samples: int) -> list[Box]:
    """A box cut into halves, quarters and so on of no more samples than that each."""
    x0, y0, x1, y1 = box
    w, h = x1 - x0, y1 - y0
    columns, rows = sample_grid.raster_size(w, h)
    if columns * rows <= max_samples or max(w, h) == 1:
        return [box]
    if w >= h:
        halves = (x0, y0, x0 + w // 2, y1), (x0 + w // 2, y0, x1, y1)
    else:
        halves = (x0, y0, x1, y0 + h // 2), (x0, y0 + h // 2, x1, y1)
    return [part for half in halves for part in _cut(half, sample_grid, max_samples)]


def _part(
    tile: RasterTile, core: Box, sample_grid: SampleGrid, margin: int, camera: Camera
) -> RasterTile:
    x0, y0 = tile.x, tile.y
    x1, y1 = x0 + tile.width, y0 + tile.height
    a, b, c, d = core
    box = max(a - margin, x0), max(b - margin, y0), min(c + margin, x1), min(d + margin, y1)
    seen = _grown(box)
    spacecraft = tuple(
        view
        for view, shown in zip(tile.spacecraft, tile.shown, strict=True)
        if _overlap(shown, seen)
    )
    part = tile_of(box, spacecraft or tile.spacecraft, tile.depths, camera, sample_grid)
    return replace(part, core=_core(tile, core))


def _core(tile: RasterTile, box: Box) -> tuple[float, ...]:
    """What is averaged from a box of a tile: pixels across the tile's own edges belong to it."""
    edges = tile.x, tile.y, tile.x + tile.width, tile.y + tile.height
    ends = zip(box, edges, tile.core, strict=True)
    return tuple(far if at == edge else at for at, edge, far in ends)
