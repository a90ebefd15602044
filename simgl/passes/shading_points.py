"""Shading points of a tile: what passes hand each other, and how they draw over all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import moderngl

from simgl.gpu.fullscreen import Screen
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block
from simgl.passes.shared_blocks import JOINTS, LAMPS, MATERIALS, TILE

# Groups of a cell that have a shading point each, and cells along the edge of a block
# (shaders/gbuffer/blocks.glsl).
LAYERS, BLOCK = 8, 32
# Texture units: of the groups, and of the layers of each block.
GROUPS = {"cell_groups": 16, "more_groups": 17}
_BLOCKS = {"block_layers": 18}


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadingPoints:
    """Shading points of a tile, one layer of cells above the other; valid until the next tile.

    cells : columns and rows of a layer
    visibility : of the visibility pass
    groups : two RGBA32UI, of each cell the samples of each of its groups
    block_layers : R32UI, how many layers each block of cells has
    textures : in the order of the targets of shaders/gbuffer/gbuffer.frag, RGBA32F
    framebuffer : of the textures
    depth : of the same size: what passes are to draw of a spacecraft
    """

    cells: tuple[int, int]
    visibility: moderngl.Texture
    groups: tuple[moderngl.Texture, ...]
    block_layers: moderngl.Texture
    textures: tuple[moderngl.Texture, ...]
    framebuffer: moderngl.Framebuffer
    depth: moderngl.Renderbuffer

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of all layers."""
        return self.cells[0], LAYERS * self.cells[1]

    @property
    def vertices(self) -> int:
        """Of the blocks of all layers."""
        columns, rows = blocks_of(self.cells)
        return 6 * LAYERS * columns * rows

    def bind(self) -> None:
        """Bind what every shader of points reads."""
        for unit, texture in zip(GROUPS.values(), self.groups, strict=True):
            texture.use(unit)
        self.block_layers.use(_BLOCKS["block_layers"])


def blocks_of(cells: tuple[int, int]) -> tuple[int, int]:
    """Columns and rows of the blocks of so many cells."""
    return -(-cells[0] // BLOCK), -(-cells[1] // BLOCK)


class PointShader:
    """A shader over the shading points of a tile, at a depth; TILE is bound."""

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        name: str,
        depth: float,
        blocks: Sequence[Block],
        samplers: Mapping[str, int],
        defines: Mapping[str, int] | None = None,
    ) -> None:
        self._screen = Screen(
            ctx,
            name,
            depth,
            [TILE, *blocks],
            dict(samplers) | _BLOCKS,
            defines,
            spare=[LAMPS, MATERIALS, JOINTS],
            vertex="gbuffer/blocks.vert",
        )

    def draw(self, points: ShadingPoints) -> None:
        """Over all layers that there are."""
        self._screen.draw(points.vertices)

    def release(self) -> None:
        """Free everything."""
        self._screen.release()
