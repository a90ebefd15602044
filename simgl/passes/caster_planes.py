"""Planes over the casters of a shadow map: slanting surfaces need not look at themselves."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import read_by_texel, textures_of
from simgl.gpu.uniform_blocks import Block
from simgl.view.shadow_views import CELL

_PLANES = Block(
    "Planes",
    10,
    np.dtype(
        [
            # Of the map in the source, and of its planes in the target.
            ("source_column", "f4"),
            ("first_column", "f4"),
            ("planes_padding", "f4", 2),
        ]
    ),
)


class CasterPlanes:
    """Draws, for each cell of a map, a plane that no caster of the cells around it stands over."""

    planes = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._cells = FullscreenProgram(ctx, "shadow/planes", _PLANES, ["source"])
        self._joined = FullscreenProgram(ctx, "shadow/planes", _PLANES, ["source"], ["JOINED"])
        # Of single cells, one for each size of map.
        self._of_cells: dict[int, moderngl.Framebuffer] = {}

    def draw(
        self, depths: moderngl.Texture, first: int, size: int, target: moderngl.Framebuffer
    ) -> None:
        """Planes of a map into as many columns of the target as the map has cells.

        depths, first, size : the map's depths, its first column and its edge [texels]
        target : RGBA32F: change of depth from one column and one row of texels to the next, and
            depth at the cell's middle; its columns are those of the depths, cell by cell
        """
        edge, column = size // CELL, first // CELL
        if edge not in self._of_cells:
            self._of_cells[edge] = _plane_target(self._ctx, edge)
        of_cells = self._of_cells[edge]
        self.planes.apply(self._ctx, of_cells, (0, 0, edge, edge))
        self._cells.draw({"source_column": first, "first_column": 0}, [depths])
        self.planes.apply(self._ctx, target, (column, 0, edge, edge))
        self._joined.draw({"source_column": 0, "first_column": column}, textures_of(of_cells))

    def release(self) -> None:
        """Free everything."""
        for target in self._of_cells.values():
            release_all(self._ctx, target, *textures_of(target))
        release_all(self._ctx, self._cells, self._joined)


def _plane_target(ctx: moderngl.Context, edge: int) -> moderngl.Framebuffer:
    texture = ctx.texture((edge, edge), 4, dtype="f4")
    read_by_texel(texture)
    return ctx.framebuffer([texture])
