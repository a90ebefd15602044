"""The Sun's shadow maps: where its light meets the casters, and where it leaves them again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.gpu.blocks import Block, UniformBuffer
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.passes.meshes import MeshStore
from simgl.passes.outline import OutlineProgram
from simgl.shadows import ShadowMap, ShadowView

# Maps kept for views that come back; a picture of more spacecraft keeps as many as it needs.
KEPT = 8

_CASTER = Block("Caster", 3, np.dtype([("caster_clip_from_body", "f4", (4, 4))]))
_TOPS = Block(
    "Tops",
    10,
    np.dtype(
        [
            # Texels across which the highest caster's penumbra reaches at the map's bottom.
            ("full_reach", "f4"),
            ("tops_padding", "f4"),
            ("tops_padding_2", "f4", 2),
        ]
    ),
)


class ShadowPass:
    """Draws the casters of the maps of a view, or finds them already drawn."""

    # No offset: the lookup knows the receiver's plane. Casters far towards the Sun are flattened
    # onto the map's top.
    towards_sun = State(depth=True, depth_clamp=True, write_color=False, cull="back")
    from_sun = State(depth=True, depth_clamp=True, write_color=False, cull="front")
    # Both sides of an open sheet meet the light, and leave it.
    open_sheets = State(depth=True, depth_clamp=True, write_color=False)
    bounds = State()

    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx = ctx
        self._program = OutlineProgram(ctx, meshes, "shadow/shadow", [_CASTER])
        self._behind = OutlineProgram(
            ctx, meshes, "shadow/shadow", [_CASTER], {"before": 0}, {"BEHIND": 1}
        )
        self._cells = FullscreenProgram(ctx, "shadow/cells", None, ["source"])
        self._tops = FullscreenProgram(ctx, "shadow/tops", _TOPS, ["fine", "coarse"])
        self._caster = UniformBuffer(ctx, _CASTER)
        self._maps: OrderedDict[bytes, _Target] = OrderedDict()

    def draw(self, views: Sequence[ShadowView]) -> list[tuple[moderngl.Texture, ...]]:
        """Depths, behind and tops of each view's whole map, and of its close one if it has one.

        depths : nearest surface that faces the Sun, 0..1, and below it nearest that faces away
        behind : the same for what lies behind the surface that faces away
        tops : bounds on the nearest depth around each place, see ``shadow/tops.frag``

        They stay as they are until the next call.
        """
        wanted = [m for v in views for m in (v.whole, v.close) if m is not None]
        for one in wanted:
            if one.key in self._maps:
                self._maps.move_to_end(one.key)
        kept = max(KEPT, len(wanted))
        for one in wanted:
            if one.key not in self._maps:
                self._maps[one.key] = self._free_map(one.size, kept)
                self._draw(one, self._maps[one.key])
        return [
            tuple(
                texture
                for one in (view.whole, view.close)
                if one is not None
                for texture in self._maps[one.key].textures
            )
            for view in views
        ]

    def _free_map(self, size: int, kept: int) -> _Target:
        if len(self._maps) >= kept:
            oldest = self._maps.popitem(last=False)[1]
            if oldest.size == size:
                return oldest
            self._ctx.detect_framebuffer(0).use()
            oldest.release()
        return _Target(self._ctx, size)

    def _draw(self, one: ShadowMap, target: _Target) -> None:
        self._caster.bind()
        self._layers(one, target.depths, self._program)
        target.textures[0].use(0)
        self._layers(one, target.behind, self._behind)
        source = target.textures[0]
        for cells in (target.fine, target.coarse):
            self.bounds.apply(self._ctx, cells, (0, 0, *cells.size))
            self._cells.draw({}, [source])
            source = _colour(cells)
        self.bounds.apply(self._ctx, target.tops, (0, 0, *target.tops.size))
        reach = {"full_reach": one.inset - 2.0}
        self._tops.draw(reach, [_colour(target.fine), _colour(target.coarse)])

    def _layers(
        self, one: ShadowMap, target: moderngl.Framebuffer, program: OutlineProgram
    ) -> None:
        """Nearest surfaces that face the Sun into the upper rows, those that face away below."""
        size = one.size
        self.open_sheets.apply(self._ctx, target, (0, 0, size, 2 * size))
        target.clear(depth=1.0)
        for row, state in ((0, self.towards_sun), (size, self.from_sun)):
            area = (0, row, size, size)
            for caster in one.casters:
                chosen = self.open_sheets if caster.model.open_sheets else state
                chosen.apply(self._ctx, target, area, area)
                self._caster.write({"caster_clip_from_body": caster.clip_from_body})
                program.draw(caster.model)

    def release(self) -> None:
        """Free everything."""
        for target in self._maps.values():
            target.release()
        self._maps.clear()
        self._caster.release()
        self._cells.release()
        self._tops.release()
        self._program.release()
        self._behind.release()


class _Target:
    """The textures of one map, and what draws into them."""

    def __init__(self, ctx: moderngl.Context, size: int) -> None:
        self.size = size
        depths, behind = (ctx.depth_texture((size, 2 * size)) for _ in range(2))
        depths.compare_func = behind.compare_func = ""
        self.depths = ctx.framebuffer(depth_attachment=depths)
        self.behind = ctx.framebuffer(depth_attachment=behind)
        edges = size // 8, size // 64
        fine, coarse = (ctx.texture((edge, edge), 1, dtype="f4") for edge in edges)
        tops = ctx.texture((edges[0] + 2 * edges[1], edges[0]), 1, dtype="f4")
        for texture in (depths, behind, fine, coarse, tops):
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.fine, self.coarse = ctx.framebuffer([fine]), ctx.framebuffer([coarse])
        self.tops = ctx.framebuffer([tops])
        self.textures = (depths, behind, tops)
        self._owned = (depths, behind, fine, coarse, tops)

    def release(self) -> None:
        """Free everything."""
        for framebuffer in (self.depths, self.behind, self.fine, self.coarse, self.tops):
            framebuffer.release()
        for texture in self._owned:
            texture.release()


def _colour(target: moderngl.Framebuffer) -> moderngl.Texture:
    texture = target.color_attachments[0]
    assert isinstance(texture, moderngl.Texture)
    return texture
