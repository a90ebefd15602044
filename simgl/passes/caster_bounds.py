"""Bounds on the casters of a shadow map, so that a receiver need not look where none can matter."""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import read_by_texel, textures_of
from simgl.gpu.uniform_blocks import Block
from simgl.view.shadow_views import CELL, REACHES

_TOPS = Block(
    "Tops",
    10,
    np.dtype(
        [
            # Texels across which the highest caster's penumbra reaches at the map's bottom.
            ("full_reach", "f4"),
            # Of the map in the source, or of its bounds in the target.
            ("first_column", "f4"),
            # Of the squares that make a larger one: cells to the lower and the higher ones.
            ("square_low", "f4"),
            ("square_high", "f4"),
        ]
    ),
)


class _Square(NamedTuple):
    """Bounds on a square of cells around each cell, each made of four smaller squares.

    reach : of the square around its cell, in cells; 0.5 for two by two cells
    source : reach of the smaller ones, 0 for the cells themselves
    low, high : how far they lie from the cell
    """

    reach: float
    source: float
    low: int
    high: int


_SQUARES = (
    _Square(0.5, 0, 0, 1),
    _Square(1, 0.5, -1, 0),
    _Square(2, 1, -1, 1),
    _Square(3, 2, -1, 1),
    _Square(4, 2, -2, 2),
    _Square(6, 4, -2, 2),
    _Square(8, 4, -4, 4),
    _Square(12, 8, -4, 4),
    _Square(16, 8, -8, 8),
    _Square(24, 16, -8, 8),
    _Square(32, 16, -16, 16),
)


class CasterBounds:
    """Draws, for each cell of a map, the least and the largest value in squares around it."""

    bounds = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._cells = FullscreenProgram(ctx, "shadow/cells", _TOPS, ["source"])
        self._squares = FullscreenProgram(ctx, "shadow/tops", _TOPS, ["cells"])
        self._cone = FullscreenProgram(ctx, "shadow/tops", _TOPS, ["cells"], ["CONE"])
        # One for each size of map.
        self._scratch: dict[int, _Scratch] = {}

    def draw(
        self,
        source: moderngl.Texture,
        first: int,
        size: int,
        target: moderngl.Framebuffer,
        columns: int,
    ) -> None:
        """The squares of ``REACHES`` side by side.

        source, first, size : the map's values, its first column and its edge [texels]
        columns : first one in the target, RG32F
        """
        edge = size // CELL
        if edge not in self._scratch:
            self._scratch[edge] = _Scratch(self._ctx, edge)
        squares = self._scratch[edge].squares
        self._draw(self._cells, squares[0], (0, edge), source, first_column=first)
        for square in _SQUARES:
            (smaller,) = textures_of(squares[square.source])
            low, high = square.low, square.high
            if square.reach in squares:
                span = 0, edge
                self._draw(self._squares, squares[square.reach], span, smaller, low=low, high=high)
            if square.reach in REACHES:
                span = columns + REACHES.index(square.reach) * edge, edge
                self._draw(
                    self._squares, target, span, smaller, first_column=span[0], low=low, high=high
                )

    def draw_cone(
        self, size: int, target: moderngl.Framebuffer, column: int, full_reach: float
    ) -> None:
        """Bounds on what can stand between 8 x 8 cells and the Sun's disc; for the last map drawn.

        column : first one in the target
        full_reach : texels across which the highest caster's penumbra reaches at the map's bottom
        """
        scratch = self._scratch[size // CELL]
        span = column, size // CELL // 8
        (cells,) = textures_of(scratch.squares[0])
        self._draw(self._cells, scratch.coarse, (0, span[1]), cells)
        (coarse,) = textures_of(scratch.coarse)
        self._draw(self._cone, target, span, coarse, first_column=column, full_reach=full_reach)

    def _draw(
        self,
        program: FullscreenProgram,
        target: moderngl.Framebuffer,
        span: tuple[int, int],
        source: moderngl.Texture,
        *,
        first_column: int = 0,
        low: int = 0,
        high: int = 0,
        full_reach: float = 0.0,
    ) -> None:
        """Bounds onto a square of a target; span: its first column and its edge."""
        self.bounds.apply(self._ctx, target, (span[0], 0, span[1], span[1]))
        where = {
            "first_column": first_column,
            "square_low": low,
            "square_high": high,
            "full_reach": full_reach,
        }
        program.draw(where, [source])

    def release(self) -> None:
        """Free everything."""
        release_all(self._ctx, *self._scratch.values(), self._cells, self._squares, self._cone)


class _Scratch:
    """What the bounds of a map are made of.

    squares : bounds by their reach, those that others are made of
    coarse : of cells 8 times as large
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, edge: int) -> None:
        sources = {square.source for square in _SQUARES}
        self.squares = {reach: _bounds_target(ctx, edge) for reach in sorted(sources)}
        self.coarse = _bounds_target(ctx, edge // 8)

    def release(self) -> None:
        """Free everything."""
        for target in (*self.squares.values(), self.coarse):
            for texture in textures_of(target):
                texture.release()
            target.release()


def _bounds_target(ctx: moderngl.Context, edge: int) -> moderngl.Framebuffer:
    texture = ctx.texture((edge, edge), 2, dtype="f4")
    read_by_texel(texture)
    return ctx.framebuffer([texture])
