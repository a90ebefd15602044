"""Textures of one size with a depth buffer; they grow with what is drawn on them."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from simgl.gpu.release import release_all

# Sizes grow in these steps, so that a moving spacecraft does not reallocate at every frame.
_GRAIN = 256


class GrowingTarget:
    """Framebuffers over RGBA32F textures that share one depth buffer.

    groups : for each framebuffer its textures, counted from 0
    """

    def __init__(self, ctx: moderngl.Context, groups: Sequence[Sequence[int]]) -> None:
        self._ctx = ctx
        self._groups = tuple(tuple(group) for group in groups)
        self._size = (0, 0)
        self._framebuffers: list[moderngl.Framebuffer] = []
        self._textures: list[moderngl.Texture] = []
        self._depth: moderngl.Renderbuffer | None = None

    def at_least(self, size: tuple[int, int]) -> list[moderngl.Framebuffer]:
        """The framebuffer of each group, for a raster of a size."""
        if self._size[0] >= size[0] and self._size[1] >= size[1]:
            return self._framebuffers
        steps = (-(-max(have, want) // _GRAIN) for have, want in zip(self._size, size, strict=True))
        columns, rows = (_GRAIN * count for count in steps)
        self.release()
        self._size = columns, rows
        self._depth = self._ctx.depth_renderbuffer(self._size)
        for _ in range(1 + max(index for group in self._groups for index in group)):
            self._textures.append(self._ctx.texture(self._size, 4, dtype="f4"))
            self._textures[-1].filter = (moderngl.NEAREST, moderngl.NEAREST)
        for group in self._groups:
            textures = [self._textures[index] for index in group]
            self._framebuffers.append(self._ctx.framebuffer(textures, self._depth))
        return self._framebuffers

    def release(self) -> None:
        """Free everything; the next use starts anew."""
        release_all(self._ctx, *self._framebuffers, *self._textures)
        if self._depth is not None:
            self._depth.release()
        self._framebuffers, self._textures, self._depth = [], [], None
        self._size = (0, 0)


def textures_of(framebuffer: moderngl.Framebuffer) -> tuple[moderngl.Texture, ...]:
    """The textures that a framebuffer draws on."""
    return tuple(t for t in framebuffer.color_attachments if isinstance(t, moderngl.Texture))
