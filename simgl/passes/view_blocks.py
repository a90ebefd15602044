"""Uniform blocks of tiles and spacecraft: written once, and bound by each pass that reads them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar

import moderngl

from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.lru_cache import LruCache
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.shared_blocks import (
    SHADOW,
    SPACECRAFT,
    TILE,
    AirBetween,
    shadow_values,
    spacecraft_values,
    tile_values,
)
from simgl.sample_grid import SampleGrid
from simgl.view.raster_tiles import RasterTile
from simgl.view.spacecraft_view import SpacecraftView

# Of each block, the last of an image that stay written: more than most have tiles and spacecraft.
_CACHED = 16

_Key = TypeVar("_Key", bound=Hashable)


class _Written(Generic[_Key]):
    """The buffers of one block, by what they hold."""

    def __init__(self, ctx: moderngl.Context, block: Block) -> None:
        self._ctx, self._block = ctx, block
        self._unused: list[UniformBuffer] = []
        self._buffers = LruCache[_Key, UniformBuffer](_CACHED, self._unused.append)

    def bind(self, key: _Key, values: Callable[[], dict[str, Any]]) -> None:
        def written() -> UniformBuffer:
            content = values()
            buffer = self._unused.pop() if self._unused else UniformBuffer(self._ctx, self._block)
            buffer.write(content)
            return buffer

        self._buffers.get(key, written).bind()

    def forget(self) -> None:
        self._buffers.clear()

    def release(self) -> None:
        self._buffers.clear()
        while self._unused:
            self._unused.pop().release()


class ViewBlocks:
    """Binds the blocks of what is drawn; those of the same object are packed and uploaded once."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._tiles = _Written[tuple[RasterTile, int]](ctx, TILE)
        self._spacecraft = _Written[tuple[SpacecraftView, AirBetween | None]](ctx, SPACECRAFT)
        self._shadows = _Written[tuple[SpacecraftView, SampleGrid]](ctx, SHADOW)

    def begin(self) -> None:
        """Forget what an earlier image has written; its buffers serve the next one."""
        for written in (self._tiles, self._spacecraft, self._shadows):
            written.forget()

    def bind_tile(self, tile: RasterTile, depth_slice: int = 0) -> None:
        """The Tile block for one of the depth slices of a tile."""
        self._tiles.bind((tile, depth_slice), lambda: tile_values(tile, tile.slices[depth_slice]))

    def bind_spacecraft(self, drawn: DrawnSpacecraft) -> None:
        """The Spacecraft block, with the air before it."""
        self.bind_view(drawn.view, drawn.air)

    def bind_view(self, view: SpacecraftView, air: AirBetween | None = None) -> None:
        """The same of a spacecraft of which nothing else is known."""
        self._spacecraft.bind((view, air), lambda: spacecraft_values(view, air))

    def bind_shadow(self, view: SpacecraftView, sample_grid: SampleGrid) -> None:
        """The Shadow block of a spacecraft that is drawn on a sample grid."""
        self._shadows.bind((view, sample_grid), lambda: shadow_values(view, sample_grid))

    def release(self) -> None:
        """Free the buffers."""
        for written in (self._tiles, self._spacecraft, self._shadows):
            written.release()
