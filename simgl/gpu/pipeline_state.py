"""The complete OpenGL state of a pass; nothing is inherited from the pass before."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import moderngl

# A framebuffer of any attachments; the alias keeps signatures short.
Target = moderngl.Framebuffer

# GL 3.3 core, absent from moderngl's names.
SRC1_COLOR = 0x88F9
ONE_MINUS_SRC1_COLOR = 0x88FA
DEPTH_CLAMP = 0x864F
CLIP_DISTANCE0 = 0x3000
_CLIP_PLANES = 4


@dataclass(frozen=True, kw_only=True)
class State:
    """What a draw depends on besides its program and textures.

    depth : test and write depth
    depth_func : of the test: "<", ">", "!=", or "1" which always passes
    keep_depth : test, but write none
    depth_clamp : what lies outside the depth range is drawn at its end, not cut off
    depth_slopes : surfaces are drawn farther away, by so many times the change of their depth from
        texel to texel
    cull : "back", "front" or None
    blend : (source, destination) factors, or None
    write_color : write the colour attachments
    channels : of these, those to write
    clip_planes : so many of gl_ClipDistance cut what is drawn
    """

    depth: bool = False
    depth_func: str = "<"
    keep_depth: bool = False
    depth_clamp: bool = False
    depth_slopes: float = 0.0
    cull: str | None = None
    blend: tuple[int, int] | None = None
    write_color: bool = True
    channels: str = "rgba"
    clip_planes: int = 0

    @cached_property
    def _color_mask(self) -> tuple[bool, bool, bool, bool]:
        red, green, blue, alpha = (self.write_color and one in self.channels for one in "rgba")
        return red, green, blue, alpha

    @cached_property
    def _flags(self) -> int:
        flags = moderngl.NOTHING
        if self.depth:
            flags |= moderngl.DEPTH_TEST
        if self.cull is not None:
            flags |= moderngl.CULL_FACE
        if self.blend is not None:
            flags |= moderngl.BLEND
        return flags

    def apply(
        self,
        ctx: moderngl.Context,
        target: Target,
        viewport: tuple[int, int, int, int],
        scissor: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Bind the target and set every piece of state; viewport and scissor in pixels."""
        target.viewport = viewport
        target.scissor = scissor  # type: ignore[assignment]
        if attachments := target.color_attachments:
            one, count = self._color_mask, len(attachments)
            target.color_mask = one if count == 1 else (one,) * count  # type: ignore[assignment]
        target.depth_mask = self.depth and not self.keep_depth
        # After its settings: those of a framebuffer that is bound already may not reach OpenGL.
        target.use()
        ctx.enable_only(self._flags)
        if self.depth_clamp:
            ctx.enable_direct(DEPTH_CLAMP)
        else:
            ctx.disable_direct(DEPTH_CLAMP)
        for plane in range(_CLIP_PLANES):
            switch = ctx.enable_direct if plane < self.clip_planes else ctx.disable_direct
            switch(CLIP_DISTANCE0 + plane)
        ctx.depth_func = self.depth_func
        ctx.cull_face = self.cull or "back"
        # Row 0 of every target is the top of the image, which mirrors the winding.
        ctx.front_face = "cw"
        ctx.blend_func = self.blend or (moderngl.ONE, moderngl.ZERO)
        ctx.blend_equation = moderngl.FUNC_ADD  # type: ignore[assignment]
        ctx.polygon_offset = self.depth_slopes, 0.0
        ctx.wireframe = False


def part_to_clear(target: Target, area: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    """What is cleared before draws over an area of a target: all of it, or the area alone.

    llvmpipe clears a whole target in less than half the time that it takes for one but for an edge.
    """
    full = 0, 0, *target.size
    return full if 2 * area[2] * area[3] >= full[2] * full[3] else area


def clear_depth(ctx: moderngl.Context, target: Target) -> None:
    """Reset the depth of a target to the far plane, keeping its colours."""
    area = 0, 0, *target.size
    State(depth=True, write_color=False).apply(ctx, target, area, area)
    target.clear(depth=1.0, viewport=area)
