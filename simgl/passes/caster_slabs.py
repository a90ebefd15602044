"""The depths of a shadow map side by side: one look tells a search both of a place."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block

_SLABS = Block(
    "Slabs",
    10,
    np.dtype([("map_size", "f4"), ("slabs_padding", "f4"), ("slabs_padding_2", "f4", 2)]),
)


class CasterSlabs:
    """Draws, for each texel of a map, where the light meets the casters and leaves them again.

    A renderer on the CPU spends on a look at one channel what it spends on a look at both. What
    few looks ask for would drive what they all need out of its cache.
    """

    slabs = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "shadow/slabs", _SLABS, ["depths"])

    def draw(
        self,
        depths: moderngl.Texture,
        first: int,
        size: int,
        target: moderngl.Framebuffer,
    ) -> None:
        """The texels of a map into those of the target.

        depths, first, size : the map's, its first column and its edge [texels]
        target : RG32F, depths in that order
        """
        self.slabs.apply(self._ctx, target, (first, 0, size, size))
        self._program.draw({"map_size": size}, [depths])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
