"""Shadow maps: depth along the sunlight, one map for each spacecraft that receives shadow."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.gpu.blocks import Block, UniformBuffer
from simgl.gpu.program import load_program
from simgl.gpu.state import State
from simgl.passes.meshes import MeshStore
from simgl.view import ShadowView

# Texels along an edge: 6 mm on a craft of 13 m.
SIZE = 2048
# Maps kept for views that come back; a picture of more spacecraft keeps as many as it needs.
KEPT = 8

_CASTER = Block("Caster", 3, np.dtype([("caster_light_from_body", "f4", (4, 4))]))


class ShadowPass:
    """Draws the casters of a ShadowView into a depth texture, or finds it already drawn."""

    # Both sides cast, so that an open sheet does. No offset: the lookup knows the receiver's plane.
    # Casters far towards the Sun are flattened onto the map's front, which keeps its depth fine.
    state = State(depth=True, depth_clamp=True, write_color=False)

    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._program = load_program(ctx, "shadow/shadow", blocks=[_CASTER])
        self._caster = UniformBuffer(ctx, _CASTER)
        self._maps: OrderedDict[bytes, moderngl.Framebuffer] = OrderedDict()

    def draw(self, views: Sequence[ShadowView]) -> list[moderngl.Texture]:
        """The depth texture of each view: nearest caster, 0..1 along the light.

        They stay as they are until the next call.
        """
        for view in views:
            if view.key in self._maps:
                self._maps.move_to_end(view.key)
        kept = max(KEPT, len(views))
        for view in views:
            if view.key not in self._maps:
                self._maps[view.key] = self._free_map(kept)
                self._draw(view, self._maps[view.key])
        return [self._texture(view.key) for view in views]

    def _texture(self, key: bytes) -> moderngl.Texture:
        texture = self._maps[key].depth_attachment
        assert isinstance(texture, moderngl.Texture)
        return texture

    def _free_map(self, kept: int) -> moderngl.Framebuffer:
        if len(self._maps) >= kept:
            return self._maps.popitem(last=False)[1]
        depth = self._ctx.depth_texture((SIZE, SIZE))
        depth.compare_func = ""
        depth.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return self._ctx.framebuffer(depth_attachment=depth)

    def _draw(self, view: ShadowView, target: moderngl.Framebuffer) -> None:
        self.state.apply(self._ctx, target, (0, 0, SIZE, SIZE))
        target.clear(depth=1.0)
        self._caster.bind()
        for caster in view.casters:
            self._caster.write({"caster_light_from_body": caster.light_from_body})
            self._meshes.geometry(caster.model.mesh).draw(self._program)

    def release(self) -> None:
        """Free everything."""
        for target in self._maps.values():
            assert target.depth_attachment is not None
            target.depth_attachment.release()
            target.release()
        self._maps.clear()
        self._caster.release()
        self._program.release()
