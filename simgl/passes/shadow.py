"""The Sun's shadow maps: where its light meets the casters, and where it leaves them again."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import read_by_texel
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.lru_cache import MANY, LruCache
from simgl.passes.caster_bounds import CasterBounds
from simgl.passes.caster_planes import CasterPlanes
from simgl.passes.caster_slabs import CasterSlabs
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.view.shadow_views import CELL, REACHES, ShadowMap, ShadowView

# Of the maps that are cached: a close view's and those of the Sun's next direction, 300 MB each. An
# image of more spacecraft caches as many as it needs.
MAX_BYTES = 640 << 20
# Of textures that no maps hold any more, for the next maps of these sizes: those of an image have
# several, and fresh memory has to be cleared.
_UNUSED_BYTES = MAX_BYTES // 4
# More cameras than this seldom share a state: maps that were asked for more often outlast it.
_LASTING = 4
# Views whose maps ahead are known.
_MAPS_AHEAD = 8
# Columns beside the maps, whose edges are powers of two: without them all rows of a texture would
# share a few lines of a processor's cache, and drive each other out of it. So a row of depths, and
# one of slabs, is an odd number of lines of 64 bytes.
_SPARE, _SPARE_SLABS = 16, 8
# Of the parts that a map is drawn in, those that read no other.
_READING_NO_OTHER = 2

_CASTER = Block(
    "Caster",
    3,
    np.dtype(
        [
            ("caster_clip_from_body", "f4", (4, 4)),
            ("caster_map_size", "f4"),
            # Its depth in edges of texels.
            ("caster_map_depth", "f4"),
            ("caster_padding", "f4", 2),
        ]
    ),
)


class ShadowPass:
    """Draws the casters of the maps of a view, or finds them already drawn."""

    # No offset: the lookup knows the receiver's plane. Casters far towards the Sun are flattened
    # onto the map's top.
    towards_sun = State(depth=True, depth_clamp=True, write_color=False, cull="back")
    from_sun = State(depth=True, depth_clamp=True, write_color=False, cull="front")
    # Both sides of open sheets meet the light, and leave it.
    open_sheets = State(depth=True, depth_clamp=True, write_color=False)
    # With their slopes.
    nearest_solids = State(depth=True, depth_clamp=True, cull="back")
    nearest_sheets = State(depth=True, depth_clamp=True)
    # A sheet is as thick as its depth changes over a texel, so that light which leans against the
    # map finds no gaps between its texels.
    under_sheets = State(depth=True, depth_clamp=True, depth_slopes=1.0, write_color=False)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx = ctx
        self._nearest = OutlineProgram(
            ctx, meshes, "shadow/shadow", [_CASTER], defines={"SLOPES": 1}
        )
        self._program = OutlineProgram(ctx, meshes, "shadow/shadow", [_CASTER])
        self._behind = OutlineProgram(
            ctx, meshes, "shadow/shadow", [_CASTER], {"before": 0}, {"BEHIND": 1}
        )
        self._bounds = CasterBounds(ctx)
        self._planes = CasterPlanes(ctx)
        self._slabs = CasterSlabs(ctx)
        self._caster = UniformBuffer(ctx, _CASTER)
        self._unused: list[_ShadowAtlas] = []
        self._atlases = LruCache[bytes, _ShadowAtlas](
            MANY, self._unused.append, max_bytes=MAX_BYTES
        )
        # Textures of maps that were not asked for in more casts than this hold the next new ones:
        # casters that move have new maps in each image, and fresh memory takes longer to clear
        # than maps to draw. Maps that come back all the same, those of cameras in turn, tell for
        # how long they are of use.
        self._lasts = 1
        # When maps were last asked for whose textures hold others now.
        self._replaced = LruCache[bytes, int](MANY)
        # Maps ahead, by those that are drawn and by their direction.
        self._ahead = LruCache[tuple[bytes, bytes], tuple[ShadowMap, ...]](_MAPS_AHEAD)
        self._casts = 0

    def cast(self, views: Sequence[ShadowView]) -> list[tuple[moderngl.Texture, ...]]:
        """Depths, behind, tops, planes, slabs and slopes of each view's maps, the close one right
        of the wide one.

        depths : nearest surface that faces the Sun, 0..1, and below it nearest that faces away
        behind : nearest that faces the Sun behind the one that faces away
        tops : bounds on the nearest depth around each place, see ``shadow/tops.frag``
        planes : over the casters around each place, see ``shadow/planes.frag``
        slabs : both depths together, see ``shadow/slabs.frag``; undefined without a close map, as
            the planes
        slopes : of the nearest surface, as deep as wide is 1; undefined without sheets

        Only the depths are drawn, the others by ``complete``: a renderer on the CPU waits where a
        draw reads a texture that is still being drawn. Until then it works on these, and the caller
        on whatever waits for nothing. The textures stay as they are until the next call.
        """
        self._atlases.reserve(len(views))
        self._casts += 1
        return [self._cast(view).textures for view in views]

    def complete(self, views: Sequence[ShadowView]) -> None:
        """Draw the rest of the maps of ``cast``."""
        for view in views:
            atlas = self._atlas(view.maps)
            while atlas.drawn < len(_PARTS):
                self._draw_part(view.maps, atlas)
        self._draw_ahead(views)

    def _cast(self, view: ShadowView) -> _ShadowAtlas:
        atlas = self._atlas(view.maps)
        while atlas.drawn < _READING_NO_OTHER:
            self._draw_part(view.maps, atlas)
        atlas.last_cast = self._casts
        atlas.uses += 1
        return atlas

    def _draw_ahead(self, views: Sequence[ShadowView]) -> None:
        """Draw a part of what the Sun's next direction needs, so that no frame draws all of it.

        Only where maps have lasted for a while, and where those ahead leave room for them.
        """
        if 2 * sum(_atlas_bytes(view.maps) for view in views) > MAX_BYTES:
            return
        for view in views:
            current = self._atlas(view.maps)
            if current.uses > _LASTING:
                # While the maps last, so do those ahead; if not, a frame draws what it lacks.
                maps = self._ahead.get((current.key, view.ahead_of), view.ahead)
                atlas = self._atlas(maps)
                if atlas.uses == 0:
                    atlas.last_cast = self._casts
                if atlas.drawn < len(_PARTS):
                    self._draw_part(maps, atlas)
                    return

    def _draw_part(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        _PARTS[atlas.drawn](self, maps, atlas)
        atlas.drawn += 1

    def _atlas(self, maps: Sequence[ShadowMap]) -> _ShadowAtlas:
        return self._atlases.get(_key(maps), lambda: self._free_atlas(maps), _atlas_bytes(maps))

    def _free_atlas(self, maps: Sequence[ShadowMap]) -> _ShadowAtlas:
        """An unused one of these sizes, or one that seems to be of no use any more, or a new one;
        the last of the others stay."""
        key, sizes = _key(maps), tuple(one.size for one in maps)
        last_cast = self._replaced.find(key)
        if last_cast is not None:
            self._lasts = max(self._lasts, self._casts - last_cast)
        for atlas in self._unused:
            if atlas.sizes == sizes:
                self._unused.remove(atlas)
                atlas.hold(key)
                return atlas
        for atlas in self._atlases.values():
            if atlas.sizes == sizes and self._casts - atlas.last_cast > self._lasts:
                self._atlases.pop(atlas.key)
                self._replaced.put(atlas.key, atlas.last_cast)
                atlas.hold(key)
                return atlas
        while self._unused and self._is_full:
            release_all(self._ctx, self._unused.pop(0))
        return _ShadowAtlas(self._ctx, maps)

    @property
    def _is_full(self) -> bool:
        """Whether unused textures have to go before a new one comes."""
        if len(self._unused) + len(self._atlases) >= MANY:
            return True
        return sum(atlas.nbytes for atlas in self._unused) > _UNUSED_BYTES

    def _draw_towards_sun(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        self._caster.bind()
        self._clear(atlas.depths)
        target, states, program = atlas.depths, (self.towards_sun, self.open_sheets), self._program
        # Only light past sheets is judged by slopes.
        if any(caster.both_sides for one in maps for caster in one.casters):
            target, program = atlas.nearest, self._nearest
            states = self.nearest_solids, self.nearest_sheets
        column = 0
        for one in maps:
            self._layer(one, target, (column, 0), states, program)
            column += one.size

    def _draw_from_sun(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        self._caster.bind()
        column = 0
        for one in maps:
            states = self.from_sun, self.under_sheets
            self._layer(one, atlas.depths, (column, one.size), states, self._program)
            column += one.size

    def _draw_behind(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        self._caster.bind()
        self._clear(atlas.behind)
        atlas.textures[0].use(0)
        column = 0
        for one in maps:
            states = self.towards_sun, self.open_sheets
            self._layer(one, atlas.behind, (column, 0), states, self._behind)
            column += one.size

    def _draw_bounds(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        column = columns = 0
        for one in maps:
            self._bounds.draw(atlas.textures[0], column, one.size, atlas.tops, columns)
            cone = columns + len(REACHES) * (one.size // CELL)
            self._bounds.draw_cone(one.size, atlas.tops, cone, one.inset - 2.0)
            column += one.size
            columns += one.bounds_width

    def _draw_planes(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        if len(maps) == 1:
            return
        column = 0
        for one in maps:
            self._planes.draw(atlas.textures[0], column, one.size, atlas.planes)
            column += one.size

    def _draw_slabs(self, maps: Sequence[ShadowMap], atlas: _ShadowAtlas) -> None:
        if len(maps) == 1:
            return
        depths, column = atlas.textures[0], 0
        for one in maps:
            self._slabs.draw(depths, column, one.size, atlas.slabs)
            column += one.size

    def _clear(self, target: moderngl.Framebuffer) -> None:
        self.open_sheets.apply(self._ctx, target, (0, 0, *target.size))
        target.clear(depth=1.0)

    def _layer(
        self,
        one: ShadowMap,
        target: moderngl.Framebuffer,
        corner: tuple[int, int],
        states: tuple[State, State],
        program: OutlineProgram,
    ) -> None:
        """Nearest depth of the casters' surfaces into a square of the target.

        states : for solids, and for open sheets
        """
        area = (*corner, one.size, one.size)
        for caster in one.casters:
            states[caster.both_sides].apply(self._ctx, target, area, area)
            clip = caster.clip_from_body
            depth = one.depth / one.texel
            sizes = {"caster_map_size": one.size, "caster_map_depth": depth}
            self._caster.write({"caster_clip_from_body": clip} | sizes)
            program.draw(caster.model)

    def release(self) -> None:
        """Free everything."""
        self._atlases.clear()
        shaders = (
            self._caster,
            self._bounds,
            self._planes,
            self._slabs,
            self._nearest,
            self._program,
            self._behind,
        )
        release_all(self._ctx, *self._unused, *shaders)
        self._unused.clear()


# What a map is drawn in, one after the other.
_PARTS = (
    ShadowPass._draw_towards_sun,
    ShadowPass._draw_from_sun,
    ShadowPass._draw_behind,
    ShadowPass._draw_bounds,
    ShadowPass._draw_planes,
    ShadowPass._draw_slabs,
)


class _ShadowAtlas:
    """The textures of a view's maps side by side, and what draws into them.

    key : of the maps
    drawn : parts that are drawn
    uses : frames, or tiles of them, that have asked for it
    last_cast : number of the last of these, before there is one of the last that needs it next
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, maps: Sequence[ShadowMap]) -> None:
        self.hold(_key(maps))
        self.nbytes = _atlas_bytes(maps)
        self.sizes = sizes = tuple(one.size for one in maps)
        depths = ctx.depth_texture((sum(sizes) + _SPARE, 2 * max(sizes)))
        behind = ctx.depth_texture((sum(sizes) + _SPARE, max(sizes)))
        depths.compare_func = behind.compare_func = ""
        self.depths = ctx.framebuffer(depth_attachment=depths)
        self.behind = ctx.framebuffer(depth_attachment=behind)
        columns = sum(one.bounds_width for one in maps)
        tops = ctx.texture((columns, max(sizes) // CELL), 2, dtype="f4")
        self.tops = ctx.framebuffer([tops])
        planes = ctx.texture((sum(sizes) // CELL, max(sizes) // CELL), 4, dtype="f4")
        self.planes = ctx.framebuffer([planes])
        # Only a close map has so many points to search that they are worth it.
        texels = (sum(sizes) + _SPARE_SLABS, max(sizes)) if len(sizes) > 1 else (1, 1)
        slabs = ctx.texture(texels, 2, dtype="f4")
        self.slabs = ctx.framebuffer([slabs])
        # As high as the depths that it is drawn with; its lower half stays unused.
        slopes = ctx.texture(depths.size, 2, dtype="f2")
        self.nearest = ctx.framebuffer([slopes], depths)
        self.textures = (depths, behind, tops, planes, slabs, slopes)
        for texture in self.textures:
            read_by_texel(texture)

    def hold(self, key: bytes) -> None:
        """Begin with other maps of these sizes."""
        self.key = key
        self.drawn = self.uses = self.last_cast = 0

    def release(self) -> None:
        """Free everything."""
        drawn = self.depths, self.nearest, self.behind, self.tops, self.planes, self.slabs
        for framebuffer in drawn:
            framebuffer.release()
        for texture in self.textures:
            texture.release()


def _key(maps: Sequence[ShadowMap]) -> bytes:
    """Equal keys mean equal maps."""
    return b"".join(one.key for one in maps)


def _atlas_bytes(maps: Sequence[ShadowMap]) -> int:
    """Of the textures of an atlas."""
    sizes = [one.size for one in maps]
    tops = sum(one.bounds_width for one in maps) * max(sizes) // CELL
    planes = (sum(sizes) // CELL) * (max(sizes) // CELL)
    slabs = sum(sizes) * max(sizes) if len(sizes) > 1 else 0
    # Three layers of depths, and slopes as high as two of them.
    return 4 * sum(sizes) * 5 * max(sizes) + 8 * (tops + slabs) + 16 * planes
