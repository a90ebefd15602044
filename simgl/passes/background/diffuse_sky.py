"""Light between the stars, behind everything else."""

from __future__ import annotations

import moderngl

from simgl.gpu.pipeline_state import State
from simgl.gpu.program import load_program
from simgl.gpu.release import all_or_nothing
from simgl.view.celestial import DiffuseSky


class DiffuseSkyPass:
    """Fills an image with the radiance of a coarse grid: as fast as a clear, nearly."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = load_program(
            ctx, "diffuse_sky/diffuse_sky", blocks=[], samplers={"nodes": 0}
        )
        self._array = ctx.vertex_array(self._program, [])
        self._nodes: moderngl.Texture | None = None

    def draw(self, sky: DiffuseSky, target: moderngl.Framebuffer) -> None:
        """Replace what an RGBA32F target holds [W m-2 sr-1]."""
        nodes = self._of_size(sky.columns, sky.rows)
        nodes.write(sky.radiance.tobytes())
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        nodes.use(0)
        cells = (sky.columns - 1) * (sky.rows - 1)
        self._array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=cells)

    def _of_size(self, columns: int, rows: int) -> moderngl.Texture:
        if self._nodes is None or self._nodes.size != (columns, rows):
            if self._nodes is not None:
                self._nodes.release()
            self._nodes = self._ctx.texture((columns, rows), 4, dtype="f4")
            self._nodes.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return self._nodes

    def release(self) -> None:
        """Free everything."""
        if self._nodes is not None:
            self._nodes.release()
        self._array.release()
        self._program.release()
