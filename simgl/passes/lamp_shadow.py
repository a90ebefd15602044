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

_CASTER = Block("LampCaster", 13, np.dtype([("lamp_clip_from_body", "f4", (4, 4))]))


class LampShadowPass:
    """Draws the casters of each lamp, or finds them already drawn."""

    # Depth only sorts; what is looked up is 1 / z.
    facing = State(depth=True, cull="back")
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
        area = (*lamp_corner(index), MAP_SIZE, MAP_SIZE)
        self.both_sides.apply(self._ctx, target, area, area)
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0, viewport=area)
        self._caster.bind()
        for caster in lamp.casters:
            state = self.both_sides if caster.both_sides else self.facing
            state.apply(self._ctx, target, area, area)
            self._caster.write({"lamp_clip_from_body": caster.clip_from_body})
            self._program.draw(caster.model)

    def _made_target(self) -> moderngl.Framebuffer:
        if self._target is None:
            columns, rows = (c + MAP_SIZE for c in lamp_corner(MAX_LAMPS - 1))
            maps = self._ctx.texture((columns, rows), 1, dtype="f4")
            maps.filter = (moderngl.NEAREST, moderngl.NEAREST)
            depth = self._ctx.depth_renderbuffer((columns, rows))
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
