"""Truth: depth and part of what each pixel's centre sees."""

from __future__ import annotations

import moderngl

from simgl.gpu.pipeline_state import State, clear_depth
from simgl.gpu.release import all_or_nothing
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.passes.shared_blocks import SPACECRAFT, TILE
from simgl.passes.view_blocks import ViewBlocks
from simgl.view.raster_tiles import RasterTile

# Attachments of a target that wants normals too.
_WITH_NORMALS = 3


class TruthPass:
    """Draws depth along the boresight [m], instance * 65536 + part + 1, and normals in camera axes
    where there is a third attachment; all 0 where empty."""

    state = State(depth=True)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore, blocks: ViewBlocks) -> None:
        self._ctx, self._blocks = ctx, blocks
        self._plain = OutlineProgram(ctx, meshes, "truth/truth", [TILE, SPACECRAFT])
        self._with_normals = OutlineProgram(
            ctx, meshes, "truth/truth", [TILE, SPACECRAFT], defines={"NORMALS": 1}
        )

    def draw(self, tile: RasterTile | None, target: moderngl.Framebuffer) -> None:
        """Fill a target of R32F, R32UI and, if wanted, RGBA32F attachments with depth; None draws
        nothing."""
        normals = len(target.color_attachments) == _WITH_NORMALS
        program = self._with_normals if normals else self._plain
        viewport = (0, 0, *target.size)
        self.state.apply(self._ctx, target, viewport)
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        if tile is None:
            return
        for index in range(len(tile.slices)):
            if index:
                clear_depth(self._ctx, target)
            self.state.apply(self._ctx, target, viewport)
            self._blocks.bind_tile(tile, index)
            for view in tile.spacecraft:
                self._blocks.bind_view(view)
                program.draw(view.model)

    def release(self) -> None:
        """Free everything."""
        for resource in (self._plain, self._with_normals):
            resource.release()
