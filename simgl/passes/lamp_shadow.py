"""Lamp shadows: one map for each lamp, side by side in one texture."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.passes.shared_blocks import MAX_LAMPS, lamp_corner
from simgl.view.lamp_views import MAP_SIZE, LampView

# Of a map, besides itself (LAMP_LEVELS of shaders/surface/lamp.glsl).
_LEVELS = 9

_CASTER = Block("LampCaster", 13, np.dtype([("lamp_clip_from_body", "f4", (4, 4))]))


class LampShadowPass:
    """Draws the casters of each lamp, or finds them already drawn."""

    # Depth only sorts; what is looked up is 1 / z.
    facing = State(depth=True, cull="back")
    leaving = State(depth=True, cull="front")
    both_sides = State(depth=True)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx = ctx
        self._program = OutlineProgram(ctx, meshes, "lamp_shadow/lamp_shadow", [_CASTER])
        self._caster = UniformBuffer(ctx, _CASTER)
        self._target: moderngl.Framebuffer | None = None
        self._drawn: list[bytes | None] = [None] * MAX_LAMPS

    def draw(self, lamps: Sequence[LampView]) -> moderngl.Texture | None:
        """The maps, 1 / z [m-1] of the nearest caster and 0 where there is none; None: no lamps."""
        if not lamps:
            return None
        target = self._made_target()
        for index, lamp in enumerate(lamps):
            if self._drawn[index] != lamp.key:
                # Until it is drawn: what was there before goes with the first draw.
                self._drawn[index] = None
                self._draw(index, lamp, target)
                self._drawn[index] = lamp.key
        maps = target.color_attachments[0]
        assert isinstance(maps, moderngl.Texture)
        return maps

    def _draw(self, index: int, lamp: LampView, target: moderngl.Framebuffer) -> None:
        column, row = lamp_corner(index)
        self._caster.bind()
        self._layer(lamp, target, (column, row), self.facing)
        if lamp.hard_near > 0.0:
            self._layer(lamp, target, (column, row + 2 * MAP_SIZE), self.leaving)
            self._fill_levels(target, (column, row))

    def _layer(
        self, lamp: LampView, target: moderngl.Framebuffer, corner: tuple[int, int], closed: State
    ) -> None:
        """Nearest surfaces into a square of the target; closed: which of a closed body."""
        area = (*corner, MAP_SIZE, MAP_SIZE)
        self.both_sides.apply(self._ctx, target, area, area)
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0, viewport=area)
        for caster in lamp.casters:
            state = self.both_sides if caster.both_sides else closed
            state.apply(self._ctx, target, area, area)
            self._caster.write({"lamp_clip_from_body": caster.clip_from_body})
            self._program.draw(caster.model)

    def _fill_levels(self, target: moderngl.Framebuffer, corner: tuple[int, int]) -> None:
        """The nearest of 2 x 2, 4 x 4 ... texels of a map, down to 2 x 2 of them."""
        maps = target.color_attachments[0]
        assert isinstance(maps, moderngl.Texture)
        raw = target.read((*corner, MAP_SIZE, MAP_SIZE), components=1, dtype="f4")
        nearest = np.frombuffer(raw, dtype="<f4").reshape(MAP_SIZE, MAP_SIZE)
        for level in range(1, _LEVELS + 1):
            nearest = np.maximum(nearest[::2], nearest[1::2])
            nearest = np.maximum(nearest[:, ::2], nearest[:, 1::2])
            size, x, y = len(nearest), corner[0] >> level, corner[1] >> level
            maps.write(np.ascontiguousarray(nearest), viewport=(x, y, size, size), level=level)

    def _made_target(self) -> moderngl.Framebuffer:
        if self._target is None:
            columns, rows = (c + MAP_SIZE for c in lamp_corner(MAX_LAMPS - 1))
            # Below the maps, where light leaves the casters.
            maps = self._ctx.texture((columns, 2 * rows), 1, dtype="f4")
            maps.build_mipmaps(0, _LEVELS)
            maps.filter = (moderngl.NEAREST_MIPMAP_NEAREST, moderngl.NEAREST)
            depth = self._ctx.depth_renderbuffer((columns, 2 * rows))
            self._target = self._ctx.framebuffer([maps], depth)
        return self._target

    def release(self) -> None:
        """Free everything."""
        if self._target is not None:
            self._target.color_attachments[0].release()
            assert self._target.depth_attachment is not None
            self._target.depth_attachment.release()
            self._target.release()
        self._caster.release()
        self._program.release()
