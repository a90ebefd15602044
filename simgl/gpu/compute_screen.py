"""Full-screen draws by compute shaders, for GPUs that draw with few of their units."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl

from simgl.gpu.compute_glsl import BLENDS, DEPTH_TESTS, DEPTHS_UNIT, ROWS_BINDING, WORKGROUP
from simgl.gpu.pipeline_state import State
from simgl.gpu.program import load_compute_shader
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import textures_of
from simgl.gpu.screen_shader import ScreenShader


@dataclass(frozen=True, eq=False)
class Depths:
    """What compute shaders have in place of a depth buffer.

    texture : R32F
    rows : a buffer whose first word is the end of the rows that are drawn; None for all
    """

    texture: moderngl.Texture
    rows: moderngl.Buffer | None = None


class ComputeScreen:
    """A shader run for each pixel, as ``Screen`` draws it."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, shader: ScreenShader) -> None:
        self._ctx, self._depth = ctx, shader.depth
        self._program = load_compute_shader(
            ctx,
            shader.name,
            blocks=shader.blocks,
            spare=shader.spare,
            samplers=shader.samplers,
            defines=shader.defines,
        )
        # What it does not use it does not have.
        self._parameters = set(self._program)
        self._given: dict[str, object] = {}

    def draw(
        self,
        state: State,
        target: moderngl.Framebuffer,
        area: tuple[int, int, int, int],
        depths: Depths | None = None,
        *,
        opposite: bool = False,
    ) -> None:
        """As ``Screen.draw``; of the state, the depth, the colours and the blending count."""
        self._give("drawn_area", area)
        self._give("drawn_depth", 0.5 + 0.5 * (-self._depth if opposite else self._depth))
        self._give("depth_test", DEPTH_TESTS[state.depth_func] if state.depth else 0)
        self._give("writes_depth", int(state.depth and not state.keep_depth))
        self._give("blending", BLENDS[state.blend])
        if state.write_color:
            for unit, texture in enumerate(textures_of(target)):
                texture.bind_to_image(unit)
        end = None if depths is None else depths.rows
        self._give("ends_with_rows", int(end is not None))
        if end is not None:
            end.bind_to_storage_buffer(ROWS_BINDING)
        if depths is not None:
            depths.texture.bind_to_image(DEPTHS_UNIT)
        columns, rows = (-(-size // WORKGROUP) for size in area[2:])
        if columns * rows:
            self._program.run(columns, rows)
            # Whatever comes next may read it in any way.
            self._ctx.memory_barrier()

    def _give(self, name: str, value: object) -> None:
        if name in self._parameters and self._given.get(name) != value:
            self._program[name] = value
            self._given[name] = value

    def release(self) -> None:
        """Free everything."""
        self._program.release()
