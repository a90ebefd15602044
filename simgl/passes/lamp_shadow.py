"""Lamp shadows: one map for each lamp, side by side in one texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import moderngl
import numpy as np

from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import read_by_texel, textures_of
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.passes.caster_bounds import CasterBounds
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.passes.shared_blocks import LAMP_BOUNDS, MAX_LAMPS
from simgl.view.lamp_views import MAP_SIZE, LampView
from simgl.view.shadow_views import CELL

# Columns beside the maps, whose edges are powers of two: a row of the texture is an odd number of
# lines of a processor's cache, for which rows would compete otherwise.
_SPARE = 8

_CASTER = Block("LampCaster", 13, np.dtype([("lamp_clip_from_body", "f4", (4, 4))]))


class LampShadowPass:
    """Draws the casters of each lamp, or finds them already drawn."""

    # Depth only sorts; what is looked up is 1 / z, both of a texel at once.
    facing = State(depth=True, cull="back", channels="rba")
    leaving = State(depth=True, cull="front", channels="g")

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx = ctx
        self._program = OutlineProgram(ctx, meshes, "lamp_shadow/lamp_shadow", [_CASTER])
        self._caster = UniformBuffer(ctx, _CASTER)
        self._bounds = CasterBounds(ctx)
        self._maps: moderngl.Framebuffer | None = None
        self._tops: moderngl.Framebuffer | None = None
        self._drawn: list[bytes | None] = [None] * MAX_LAMPS

    def draw(self, lamps: Sequence[LampView]) -> tuple[moderngl.Texture, ...]:
        """The lamps' maps and bounds on them; none where there are no lamps.

        maps : side by side, in red 1 / z [m-1] of the nearest caster and 0 where there is none; in
            green where light first leaves a solid again; in blue and alpha the slopes of red, to
            the next column and row [m-1]
        bounds : of each map's 1 / z, ``CasterBounds``
        """
        if not lamps:
            return ()
        maps, tops = self._made_targets()
        for index, lamp in enumerate(lamps):
            if self._drawn[index] != lamp.key:
                # Until it is drawn: what was there before goes with the first draw.
                self._drawn[index] = None
                self._draw(index, lamp, maps, tops)
                self._drawn[index] = lamp.key
        return (*textures_of(maps), *textures_of(tops))

    def _draw(
        self, index: int, lamp: LampView, maps: moderngl.Framebuffer, tops: moderngl.Framebuffer
    ) -> None:
        column = index * MAP_SIZE
        self._caster.bind()
        self._layer(lamp, maps, column, self.facing)
        if lamp.hard_near > 0.0:
            self._layer(lamp, maps, column, self.leaving)
            (nearest,) = textures_of(maps)
            self._bounds.draw(nearest, column, MAP_SIZE, tops, index * LAMP_BOUNDS)

    def _layer(
        self, lamp: LampView, target: moderngl.Framebuffer, column: int, closed: State
    ) -> None:
        """Nearest surfaces into a square of the target; closed: which of a closed body."""
        area = (column, 0, MAP_SIZE, MAP_SIZE)
        both_sides = replace(closed, cull=None)
        both_sides.apply(self._ctx, target, area, area)
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0, viewport=area)
        for caster in lamp.casters:
            state = both_sides if caster.both_sides else closed
            state.apply(self._ctx, target, area, area)
            self._caster.write({"lamp_clip_from_body": caster.clip_from_body})
            self._program.draw(caster.model)

    def _made_targets(self) -> tuple[moderngl.Framebuffer, moderngl.Framebuffer]:
        if self._maps is None:
            size = MAX_LAMPS * MAP_SIZE + _SPARE, MAP_SIZE
            nearest = self._ctx.texture(size, 4, dtype="f4")
            read_by_texel(nearest)
            self._maps = self._ctx.framebuffer([nearest], self._ctx.depth_renderbuffer(size))
        if self._tops is None:
            tops = self._ctx.texture((MAX_LAMPS * LAMP_BOUNDS, MAP_SIZE // CELL), 2, dtype="f4")
            read_by_texel(tops)
            self._tops = self._ctx.framebuffer([tops])
        return self._maps, self._tops

    def release(self) -> None:
        """Free everything."""
        for target in (self._maps, self._tops):
            if target is not None:
                for texture in textures_of(target):
                    texture.release()
                if target.depth_attachment is not None:
                    target.depth_attachment.release()
                target.release()
        self._caster.release()
        self._bounds.release()
        self._program.release()
