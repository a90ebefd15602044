"""Full-screen draws: a fragment shader over a viewport, or a compute shader over its pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl

from simgl.gpu.compute_screen import ComputeScreen, Depths
from simgl.gpu.context import begin_draws, prefers_compute
from simgl.gpu.pipeline_state import State
from simgl.gpu.program import FULLSCREEN, load_program
from simgl.gpu.release import all_or_nothing
from simgl.gpu.screen_shader import ScreenShader
from simgl.gpu.triangles import Triangles
from simgl.gpu.uniform_blocks import Block, UniformBuffer


class Screen:
    """A shader, drawn as one triangle over an area."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, shader: ScreenShader) -> None:
        self._ctx = ctx
        self._program = load_program(
            ctx,
            shader.name,
            vertex=FULLSCREEN,
            blocks=shader.blocks,
            spare=shader.spare,
            samplers=shader.samplers,
            defines={"AT_DEPTH": shader.depth} | dict(shader.defines),
        )
        self._triangle = Triangles(ctx, self._program)

    def draw(
        self,
        state: State,
        target: moderngl.Framebuffer,
        area: tuple[int, int, int, int],
        depths: Depths | None = None,
        *,
        opposite: bool = False,
    ) -> None:
        """Over an area of a target, with what is bound.

        area : x, y, width, height [pixels]
        depths : in place of the target's depth buffer, only for a ``ComputeScreen``
        opposite : at the opposite depth
        """
        assert depths is None
        state.apply(self._ctx, target, area, area)
        self._triangle.draw(3, first=3 * opposite)
        begin_draws(self._ctx)

    def release(self) -> None:
        """Free everything."""
        self._triangle.release()
        self._program.release()


def screen(ctx: moderngl.Context, shader: ScreenShader) -> Screen | ComputeScreen:
    """A ``Screen``, or the same as a compute shader where that is faster."""
    return ComputeScreen(ctx, shader) if prefers_compute(ctx) else Screen(ctx, shader)


# Of two or three dimensions.
Texture = moderngl.Texture | moderngl.Texture3D


class FullscreenProgram:
    """The shader ``NAME.frag``, drawn as one triangle over the current viewport.

    shared : blocks that it reads besides, bound by whoever owns them
    defines : of the variant
    """

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        name: str,
        block: Block,
        samplers: Sequence[str],
        defines: Sequence[str] | Mapping[str, int] = (),
        *,
        shared: Sequence[Block] = (),
    ) -> None:
        self._program = load_program(
            ctx,
            name,
            vertex=FULLSCREEN,
            blocks=[block, *shared],
            samplers=samplers,
            defines=defines if isinstance(defines, Mapping) else dict.fromkeys(defines, 1),
        )
        self._triangle = Triangles(ctx, self._program)
        self._block = UniformBuffer(ctx, block)

    def draw(self, values: Mapping[str, Any], textures: Sequence[Texture]) -> None:
        """Fill the block, bind the textures in the order of the samplers, and draw."""
        self._block.write(values)
        self._block.bind()
        for unit, texture in enumerate(textures):
            texture.use(unit)
        self._triangle.draw(3)

    def release(self) -> None:
        """Free everything."""
        self._triangle.release()
        self._block.release()
        self._program.release()
