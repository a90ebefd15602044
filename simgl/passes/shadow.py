"""The Sun's shadow maps: where its light meets the casters, and where it leaves them again."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.lru_cache import MANY, LruCache
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.view.shadow_views import ShadowMap, ShadowView

# Of the maps that are cached; an image of more spacecraft caches as many as it needs.
MAX_BYTES = 256 << 20

_CASTER = Block(
    "Caster",
    3,
    np.dtype(
        [
            ("caster_clip_from_body", "f4", (4, 4)),
            ("caster_map_size", "f4"),
            ("caster_padding", "f4"),
            ("caster_padding_2", "f4", 2),
        ]
    ),
)
# Edges of the cells that bounds are kept for [texels].
_CELLS = (8, 16, 32, 64)

_TOPS = Block(
    "Tops",
    10,
    np.dtype(
        [
            # Texels across which the highest caster's penumbra reaches at the map's bottom.
            ("full_reach", "f4"),
            # Of the map in the source, or of its bounds in the target.
            ("first_column", "f4"),
            # 1 where the source is a map, 0 where it holds cells.
            ("from_map", "f4"),
            # What a cell spans of the source.
            ("cell_across", "f4"),
        ]
    ),
)


class ShadowPass:
    """Draws the casters of the maps of a view, or finds them already drawn."""

    # No offset: the lookup knows the receiver's plane. Casters far towards the Sun are flattened
    # onto the map's top.
    towards_sun = State(depth=True, depth_clamp=True, write_color=False, cull="back")
    from_sun = State(depth=True, depth_clamp=True, write_color=False, cull="front")
    # Both sides of an open atlas meet the light, and leave it.
    open_sheets = State(depth=True, depth_clamp=True, write_color=False)
    bounds = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx = ctx
        self._program = OutlineProgram(ctx, meshes, "shadow/shadow", [_CASTER])
        self._behind = OutlineProgram(
            ctx, meshes, "shadow/shadow", [_CASTER], {"before": 0}, {"BEHIND": 1}
        )
        self._cells = FullscreenProgram(ctx, "shadow/cells", _TOPS, ["source"])
        self._tops = FullscreenProgram(ctx, "shadow/tops", _TOPS, ["cells"])
        self._cone = FullscreenProgram(ctx, "shadow/tops", _TOPS, ["cells"], ["CONE"])
        self._caster = UniformBuffer(ctx, _CASTER)
        self._unused: list[_ShadowAtlas] = []
        self._atlases = LruCache[bytes, _ShadowAtlas](
            MANY, self._unused.append, max_bytes=MAX_BYTES
        )

    def cast(self, views: Sequence[ShadowView]) -> list[tuple[moderngl.Texture, ...]]:
        """Depths, behind and tops of each view's maps, the close one right of the wide one.

        depths : nearest surface that faces the Sun, 0..1, and below it nearest that faces away
        behind : nearest that faces the Sun behind the one that faces away
        tops : bounds on the nearest depth around each place, see ``shadow/tops.frag``

        Only the depths are drawn, the others by ``complete``: a renderer on the CPU waits where a
        draw reads a texture that is still being drawn. Until then it works on these, and the caller
        on whatever waits for nothing. The textures stay as they are until the next call.
        """
        self._atlases.reserve(len(views))
        return [self._atlas(view).textures for view in views]

    def complete(self, views: Sequence[ShadowView]) -> None:
        """Draw the rest of the maps of ``cast``."""
        for view in views:
            atlas = self._atlas(view)
            if not atlas.complete:
                self._complete(view, atlas)

    def _atlas(self, view: ShadowView) -> _ShadowAtlas:
        return self._atlases.get(_key(view), lambda: self._cast(view), _atlas_bytes(view.maps))

    def _free_atlas(self, maps: Sequence[ShadowMap]) -> _ShadowAtlas:
        """A new one, or an unused one of these sizes."""
        sizes = tuple(one.size for one in maps)
        for atlas in self._unused:
            if atlas.sizes == sizes:
                self._unused.remove(atlas)
                return atlas
        release_all(self._ctx, *self._unused)
        self._unused.clear()
        return _ShadowAtlas(self._ctx, maps)

    def _cast(self, view: ShadowView) -> _ShadowAtlas:
        atlas = self._free_atlas(view.maps)
        self._caster.bind()
        self._clear(atlas.depths)
        column = 0
        for one in view.maps:
            self._layer(one, atlas.depths, (column, 0), self.towards_sun, self._program)
            self._layer(one, atlas.depths, (column, one.size), self.from_sun, self._program)
            column += one.size
        atlas.complete = False
        return atlas

    def _complete(self, view: ShadowView, atlas: _ShadowAtlas) -> None:
        self._caster.bind()
        self._clear(atlas.behind)
        atlas.textures[0].use(0)
        column = 0
        for one in view.maps:
            self._layer(one, atlas.behind, (column, 0), self.towards_sun, self._behind)
            column += one.size
        column = columns = 0
        programs = (self._tops,) * len(_CELLS) + (self._cone,)
        for one, cells in zip(view.maps, atlas.cells, strict=True):
            source, where = atlas.textures[0], _where(column=column, from_map=True, across=8)
            for size, level in zip(_CELLS, cells, strict=True):
                if level is not cells[0]:
                    source, where = _colour(cells[0]), _where(column=0, across=size // _CELLS[0])
                self.bounds.apply(self._ctx, level, (0, 0, *level.size))
                self._cells.draw(where, [source])
            for level, program in zip((*cells, cells[-1]), programs, strict=True):
                area = (columns, 0, *level.size)
                self.bounds.apply(self._ctx, atlas.tops, area)
                where = _where(column=columns, full_reach=one.inset - 2.0)
                program.draw(where, [_colour(level)])
                columns += level.size[0]
            column += one.size
        atlas.complete = True

    def _clear(self, target: moderngl.Framebuffer) -> None:
        self.open_sheets.apply(self._ctx, target, (0, 0, *target.size))
        target.clear(depth=1.0)

    def _layer(
        self,
        one: ShadowMap,
        target: moderngl.Framebuffer,
        corner: tuple[int, int],
        state: State,
        program: OutlineProgram,
    ) -> None:
        """Nearest depth of the casters' surfaces into a square of the target."""
        area = (*corner, one.size, one.size)
        for caster in one.casters:
            chosen = self.open_sheets if caster.model.open_sheets else state
            chosen.apply(self._ctx, target, area, area)
            clip = caster.clip_from_body
            self._caster.write({"caster_clip_from_body": clip, "caster_map_size": one.size})
            program.draw(caster.model)

    def release(self) -> None:
        """Free everything."""
        self._atlases.clear()
        for atlas in self._unused:
            atlas.release()
        self._unused.clear()
        self._caster.release()
        self._cells.release()
        self._tops.release()
        self._cone.release()
        self._program.release()
        self._behind.release()


class _ShadowAtlas:
    """The textures of a view's maps side by side, and what draws into them.

    complete : whether all are drawn, not only those that read no other
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, maps: Sequence[ShadowMap]) -> None:
        self.complete = False
        self.sizes = sizes = tuple(one.size for one in maps)
        depths = ctx.depth_texture((sum(sizes), 2 * max(sizes)))
        behind = ctx.depth_texture((sum(sizes), max(sizes)))
        depths.compare_func = behind.compare_func = ""
        self.depths = ctx.framebuffer(depth_attachment=depths)
        self.behind = ctx.framebuffer(depth_attachment=behind)
        edges = [[size // cell for cell in _CELLS] for size in sizes]
        cells = [[ctx.texture((e, e), 2, dtype="f4") for e in levels] for levels in edges]
        tops = ctx.texture((sum(one.bounds_width for one in maps), max(sizes) // 8), 2, dtype="f4")
        self.cells = [[ctx.framebuffer([level]) for level in levels] for levels in cells]
        self.tops = ctx.framebuffer([tops])
        self.textures = (depths, behind, tops)
        self._owned = (depths, behind, tops, *(level for levels in cells for level in levels))
        for texture in self._owned:
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)

    def release(self) -> None:
        """Free everything."""
        levels = (level for levels in self.cells for level in levels)
        for framebuffer in (self.depths, self.behind, self.tops, *levels):
            framebuffer.release()
        for texture in self._owned:
            texture.release()


def _atlas_bytes(maps: Sequence[ShadowMap]) -> int:
    """Of the textures of an atlas."""
    sizes = [one.size for one in maps]
    cells = sum((size // cell) ** 2 for size in sizes for cell in _CELLS)
    tops = sum(one.bounds_width for one in maps) * max(sizes) // 8
    return 4 * sum(sizes) * 3 * max(sizes) + 8 * (cells + tops)


def _key(view: ShadowView) -> bytes:
    return b"".join(one.key for one in view.maps)


def _where(
    *, column: int, full_reach: float = 0.0, from_map: bool = False, across: int = 0
) -> dict[str, float]:
    return {
        "first_column": column,
        "full_reach": full_reach,
        "from_map": from_map,
        "cell_across": across,
    }


def _colour(target: moderngl.Framebuffer) -> moderngl.Texture:
    texture = target.color_attachments[0]
    assert isinstance(texture, moderngl.Texture)
    return texture
