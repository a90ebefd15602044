"""Resolve: the shading points of a tile averaged per pixel and laid over the background."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.camera.pinhole_fields import PinholeField
from simgl.camera.pixel_ramp import SHARP, Ramps
from simgl.gpu.compute_screen import ComputeScreen
from simgl.gpu.fullscreen import Screen, screen
from simgl.gpu.pipeline_state import ONE_MINUS_SRC1_COLOR, State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import textures_of
from simgl.gpu.screen_shader import ScreenShader
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.passes.shading_points import CELL_GROUPS, ShadingPoints
from simgl.passes.shared_blocks import TILE
from simgl.passes.view_blocks import ViewBlocks
from simgl.sample_grid import MAX_SAMPLES, rotated_sample_grid
from simgl.view.raster_tiles import RasterTile

# Along the edge of a pixel.
_MAX_CELLS = rotated_sample_grid(MAX_SAMPLES).cells_per_edge
_RESOLVE = Block(
    "Resolve",
    5,
    np.dtype(
        [
            # Columns of the 2 x 2 matrices from pixel to raster directions and back.
            ("raster_from_pixel", "f4", 4),
            ("pixel_from_raster", "f4", 4),
            # The tile's place in the image.
            ("tile_origin", "f4", 2),
            # Tile coordinates of the corner of a window's raster.
            ("window_origin", "f4", 2),
            ("cells_per_pixel", "i4"),
            ("window_samples", "f4"),
            # Width of the widest ramp between pixels [px].
            ("widest_ramp", "f4"),
            ("resolve_padding", "f4"),
            # x0, y0, x1, y1 of the image's pixels that are averaged from this tile; of a softened
            # one, whose samples are known.
            ("core", "f4", 4),
            # Width of the ramps in each band [px].
            ("ramps", "f4", 4),
            # Along an axis, the share in a pixel of each of its cells and of both neighbours'.
            ("cell_shares", "f4", (3 * _MAX_CELLS, 4)),
        ]
    ),
)


# Largest number of cells along a pixel's edge of which the samples are weighted one by one.
_FEW_CELLS = 2
# Ramp that remains where cells are nearly as wide as it [px].
_NARROWEST = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class DistortedView:
    """A part of the field of a lens that distorts, and the table of ``WarpPass.places``."""

    field: PinholeField
    places: moderngl.Texture


class ResolvePass:
    """Each pixel of a tile becomes mean of samples + (1 - covered share) x background.

    A lens that distorts moves the samples: each goes to the pixel that its line of sight ends on.
    """

    # Over what the target holds; only what is seen of that past the tile's spacecraft; added to a
    # first texture of radiance and a second one of the share that they cover.
    lays = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))
    hides = State(blend=(moderngl.ZERO, ONE_MINUS_SRC1_COLOR))
    adds = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, blocks: ViewBlocks) -> None:
        self._ctx, self._blocks = ctx, blocks
        self._block = UniformBuffer(ctx, _RESOLVE)
        self._programs: dict[tuple[str, ...], Screen | ComputeScreen] = {}

    def draw(
        self,
        tile: RasterTile,
        points: ShadingPoints,
        radiance: moderngl.Texture,
        target: moderngl.Framebuffer,
        lens: DistortedView | None = None,
        ramps: Ramps = SHARP,
        rows: tuple[int, int] | None = None,
        how: State = lays,
    ) -> None:
        """Draw a tile into a target.

        points, radiance : its shading points, and their radiance
        ramps : widths in each band of those from each pixel to its neighbours [px], at most 2
        rows : first and end of those that are drawn; None for all
        how : ``lays``, ``hides`` or ``adds``
        """
        groups = dict(zip(CELL_GROUPS, points.groups, strict=True))
        by_samples = ramps != SHARP and _is_by_samples(tile)
        if tile.window is not None:
            # A cell there has no more than four samples.
            groups = {"cell_groups": groups["cell_groups"]}
        elif lens is None and not by_samples:
            groups = {"cell_groups": groups["cell_groups"], "point_groups": points.point_groups}
        textures = groups | {"block_pages": points.block_pages, "points": radiance}
        defines = [] if tile.window is None else ["WINDOW"]
        if how is self.adds:
            defines.append("SEPARATE")
        if points.wide_pages:
            defines.append("WIDE_PAGES")
        if ramps != SHARP:
            defines.append("SOFT")
            if by_samples and tile.window is None and lens is None:
                defines.append("BY_SAMPLES")
                if points.edges is not None:
                    (textures["edges"],) = textures_of(points.edges)
                    defines.append("EDGES")
        if lens is not None:
            textures["places"] = lens.places
            defines.append("DISTORTED")
        self._blocks.bind_tile(tile)
        self._block.bind()
        for unit, texture in enumerate(textures.values()):
            texture.use(unit)
        program = self._program_for(tuple(defines), list(textures))
        values = _values(tile, ramps, by_cells=lens is None and tile.window is None)
        for core in tile.cores or (tile.core,):
            box, values["core"] = _box_and_core(tile, core, target, lens, soft=ramps != SHARP)
            if rows is not None:
                box = _in_rows(box, rows)
            self._block.write(values)
            program.draw(how, target, box)

    def _program_for(self, defines: tuple[str, ...], samplers: list[str]) -> Screen | ComputeScreen:
        if defines not in self._programs:
            units = {sampler: unit for unit, sampler in enumerate(samplers)}
            blocks, variant = [_RESOLVE, TILE], dict.fromkeys(defines, 1)
            shader = ScreenShader("resolve/resolve", 0.0, blocks, units, variant)
            self._programs[defines] = screen(self._ctx, shader)
        return self._programs[defines]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
        self._block.release()


def _with_neighbours(box: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    x, y, width, height = box
    return x - 1, y - 1, width + 2, height + 2


def _in_rows(box: tuple[int, int, int, int], rows: tuple[int, int]) -> tuple[int, int, int, int]:
    x, y, width, height = box
    first, end = max(y, rows[0]), min(y + height, rows[1])
    return x, first, width, max(end - first, 0)


def _corners(box: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    x, y, width, height = box
    return x, y, x + width, y + height


def _within(a: Sequence[float], b: Sequence[float]) -> tuple[float, ...]:
    """The part of a box x0, y0, x1, y1 within another."""
    return (*map(max, a[:2], b[:2]), *map(min, a[2:], b[2:]))


def _around(a: Sequence[float], b: Sequence[float]) -> tuple[float, ...]:
    """The smallest box x0, y0, x1, y1 around two others."""
    return (*map(min, a[:2], b[:2]), *map(max, a[2:], b[2:]))


def _box_and_core(
    tile: RasterTile,
    core: tuple[float, ...],
    target: moderngl.Framebuffer,
    lens: DistortedView | None,
    *,
    soft: bool,
) -> tuple[tuple[int, int, int, int], tuple[float, ...]]:
    """x, y, width, height of the pixels to draw, and the shader's ``core``.

    core : of the tile that is averaged; soft : with ramps between pixels
    """
    if lens is not None:
        return _distorted_box(tile, lens.field, 1 if soft else 0), core
    box = tile.x, tile.y, tile.width, tile.height
    seen = _corners(_with_neighbours(box) if soft else box)
    x0, y0, x1, y1 = (int(edge) for edge in _within(_within(core, (0, 0, *target.size)), seen))
    return (x0, y0, x1 - x0, y1 - y0), _around(tile.core, _corners(box))


def _distorted_box(tile: RasterTile, field: PinholeField, wider: int) -> tuple[int, int, int, int]:
    """x, y, width, height of the pixels that may see a tile of the pinhole's image.

    wider : than a pixel on each side [px]
    """
    low, high = np.array([tile.x, tile.y]), np.array([tile.x + tile.width, tile.y + tile.height])
    places, margin = field.places, field.reach * (1 + wider)
    inside = field.drawn & np.all((places > low - margin) & (places < high + margin), axis=-1)
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    if not rows.size:
        return 0, 0, 0, 0
    x, y = int(columns[0]), int(rows[0])
    return x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y


def _cell_shares(ramps: Array, cells: int) -> Array:
    """(3 ``_MAX_CELLS``, n) integral over each cell of a pixel's square softened by ramps.

    ramps : (n,) [px]; cells : along the edge of a pixel, whose first is in the middle third
    """
    edges = (np.arange(3 * _MAX_CELLS + 1) - _MAX_CELLS)[:, None] / cells - 0.5
    outer, inner = 0.5 * (1.0 + ramps), 0.5 * (1.0 - ramps)
    rise = [np.maximum(edges + at, 0.0) ** 2 for at in (outer, inner, -inner, -outer)]
    below = (rise[0] - rise[1] - rise[2] + rise[3]) / (2.0 * ramps)
    return np.diff(below, axis=0)


# That are tried: with the widest, a pixel sees no farther than its neighbours [px].
_TRIED = np.linspace(1e-3, 2.0, 1024)


@lru_cache(maxsize=32)
def _ramps(ramps: Ramps, cells: int, *, of_cells: bool) -> tuple[Array, Array]:
    """(4,) widths of ramps [px] as the shader takes them, and their ``_cell_shares``.

    of_cells : light and shares are means over a cell: a pixel is made of steps as wide, and is
        as wide as wanted, by its variance, with another ramp
    """
    widths = np.array(ramps)
    if of_cells:
        middles = (np.arange(3 * _MAX_CELLS) - _MAX_CELLS + 0.5) / cells - 0.5
        variances = (middles**2 + 1.0 / (12.0 * cells**2)) @ _cell_shares(_TRIED, cells)
        widths = np.interp((1.0 + widths**2) / 12.0, variances, _TRIED)
    widths = np.maximum(widths, _NARROWEST)
    return widths, _cell_shares(widths, cells)


def _is_by_samples(tile: RasterTile) -> bool:
    """Whether the samples of cells on edges are weighted one by one."""
    return tile.sample_grid.cells_per_edge <= _FEW_CELLS


def needs_edges(tile: RasterTile, ramps: Ramps) -> bool:
    """Whether the samples of a tile do not tell well enough where in a pixel surfaces end."""
    return ramps != SHARP and tile.window is None and _is_by_samples(tile)


def _values(tile: RasterTile, ramps: Ramps, *, by_cells: bool) -> dict[str, object]:
    turn, window = tile.sample_grid.turn, tile.window
    back, origin, samples = np.linalg.inv(turn), np.zeros(2), 0.0
    if window is not None:
        back = window.image_from_raster[:, :2]
        origin = window.image_from_raster[:, 2] - (tile.x, tile.y)
        samples = window.samples_per_pixel
    cells = tile.sample_grid.cells_per_edge
    widths, shares = _ramps(ramps, cells, of_cells=by_cells and not _is_by_samples(tile))
    return {
        "raster_from_pixel": turn.T.ravel(),
        "pixel_from_raster": back.T.ravel(),
        "tile_origin": (tile.x, tile.y),
        "window_origin": origin,
        "cells_per_pixel": cells,
        "window_samples": samples,
        "widest_ramp": float(widths.max()),
        "ramps": widths,
        "cell_shares": shares,
    }
