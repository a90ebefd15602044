"""Spacecraft surfaces: radiance of every sample of a tile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl

from simgl.gpu.pipeline_state import State
from simgl.gpu.program import load_program
from simgl.gpu.render_targets import GrowingTarget, textures_of
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.passes.albedo_table import LOBE_UNIT, lobe_texture
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shared_blocks import (
    CRAFT,
    JOINTS,
    LAMPS,
    MATERIALS,
    SHADOW,
    TILE,
    AirBetween,
    craft_values,
    joint_values,
    lamp_values,
    shadow_values,
    tile_values,
)
from simgl.view.frame_view import RasterTile, SpacecraftView
from simgl.view.lamp_views import LampView

EMPTY = -1.0

# The terms of a surface's radiance, in the order of the targets of shaders/surface/surface.frag.
LIGHTS = ("sun", "earth", "inter_reflected", "lamp", "emitted")

# What samples see, in the order of the targets of shaders/gbuffer/gbuffer.frag.
_SEEN = ("seen_place", "seen_shape", "seen_plane", "seen_others")
_WORN = ("worn_reflectance", "worn_emission", "worn_normal")
_SEEN_UNITS = {name: unit for unit, name in enumerate(_SEEN + _WORN)}
# In the order of the shadow pass's textures.
_SHADOW_UNITS = {"sun_depths": 7, "sun_behind": 8, "sun_tops": 9}
_SUNLIGHT_UNIT = 11
_SKY_UNITS = {"sky_cube": 12, "sky_lobes": 13, "sky_irradiance": 14}
_LAMP_UNIT = 15

_SkyTexture = moderngl.TextureCube | moderngl.Texture3D | moderngl.Texture
_LOBES = {"lobe_table": LOBE_UNIT}


def _seen(*names: str) -> dict[str, int]:
    return {name: _SEEN_UNITS[name] for name in names}


# What each variant of the shader reads besides.
_MORE_UNITS = {
    "SKY": _seen("seen_plane") | _SKY_UNITS | _LOBES,
    "EXCHANGE": _seen("seen_others") | _LOBES,
    "LAYERED": _seen("seen_plane") | _LOBES,
    "LAMPS": _seen("seen_plane") | {"lamp_maps": _LAMP_UNIT},
    "DETAILED": _seen(*_WORN),
}


class _Screen:
    """A shader over the viewport, at a depth."""

    def __init__(
        self,
        ctx: moderngl.Context,
        name: str,
        depth: float,
        blocks: Sequence[Block],
        samplers: Mapping[str, int],
        defines: Sequence[str] = (),
    ) -> None:
        self._program = load_program(
            ctx,
            name,
            vertex="common/fullscreen.vert",
            blocks=blocks,
            spare=[LAMPS, TILE, JOINTS],
            samplers=samplers,
            defines={"AT_DEPTH": depth} | dict.fromkeys(defines, 1),
        )
        self._array = ctx.vertex_array(self._program, [])

    def draw(self) -> None:
        self._array.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        self._array.release()
        self._program.release()


class SurfacePass:
    """Lights what the samples of a tile see; empty samples hold -1.

    For each spacecraft the depth buffer says which samples a draw is for, so that even a renderer
    without real branches spends on a sample only what it needs:

        0      others than the craft's own
        1      own, sunlight unknown
        0.5    own, sunlight known without search
        0.75   own, sunlight searched through the disc
        0.25   lit, of one reflection law
        0.375  lit, of several
    """

    state = State(depth=True)
    depth_only = State(depth=True, write_color=False)
    empty = State()

    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._lobes = lobe_texture(ctx)
        self._others = _Screen(ctx, "surface/own", -1.0, [CRAFT], _seen("seen_place"))
        searched = _seen("seen_place", "seen_shape", "seen_plane") | _SHADOW_UNITS
        known = {name: unit for name, unit in searched.items() if name != "sun_behind"}
        name, blocks = "surface/sunlight", [CRAFT, SHADOW]
        self._known = _Screen(ctx, name, 0.0, blocks, known)
        self._searched = _Screen(ctx, name, 0.5, blocks, searched, ["SEARCH"])
        self._lit: dict[tuple[str, ...], tuple[_Screen, ...]] = {}
        self._tile = UniformBuffer(ctx, TILE)
        self._craft = UniformBuffer(ctx, CRAFT)
        self._shadow = UniformBuffer(ctx, SHADOW)
        self._lamps = UniformBuffer(ctx, LAMPS)
        self._joints = UniformBuffer(ctx, JOINTS)
        # By the number of radiances, whole or by light; before them the sunlight's share.
        self._targets = {n: GrowingTarget(ctx, [[0], range(1, 1 + n)]) for n in (1, len(LIGHTS))}

    def draw(
        self,
        tile: RasterTile,
        seen: Sequence[moderngl.Texture],
        shadow_maps: Sequence[Sequence[moderngl.Texture]],
        skies: Sequence[Sequence[_SkyTexture]],
        exchanging: Sequence[bool],
        lamps: Sequence[LampView] = (),
        lamp_maps: moderngl.Texture | None = None,
        airs: Sequence[AirBetween | None] = (),
        *,
        apart: bool = False,
    ) -> tuple[moderngl.Texture, ...]:
        """RGBA32F samples of the tile [W m-2 sr-1], valid until the next draw.

        seen : what the samples see, in the order of the geometry pass's targets
        shadow_maps : for each spacecraft of the tile, in the order of the samplers
        skies : likewise its cube, lobes and irradiance; nothing where it has no sky
        exchanging : likewise whether its surfaces light each other
        lamp_maps : of the lamps, which light every spacecraft
        airs : before each spacecraft; none at all where nothing is given
        returns : one texture, or with ``apart`` one for each of ``LIGHTS``
        """
        size = tile.sample_grid.raster_size(tile.width, tile.height)
        sunlight, target = self._targets[len(LIGHTS) if apart else 1].covering(size)
        area = (0, 0, *size)
        self._write(tile, lamps)
        for unit, texture in enumerate(seen):
            texture.use(unit)
        textures_of(sunlight)[0].use(_SUNLIGHT_UNIT)
        self._lobes.use(LOBE_UNIT)
        if lamp_maps is not None:
            lamp_maps.use(_LAMP_UNIT)
        before = airs or [None] * len(tile.craft)
        for craft, maps, sky, exchange, air in zip(
            tile.craft, shadow_maps, skies, exchanging, before, strict=True
        ):
            self._bind(craft, tile, maps, sky, air)
            self.depth_only.apply(self._ctx, sunlight, area, area)
            sunlight.clear(depth=1.0, viewport=area)
            self._others.draw()
            self.state.apply(self._ctx, sunlight, area, area)
            self._known.draw()
            self._searched.draw()
            if craft is tile.craft[0]:
                # Not its depth, which says what to draw.
                self.empty.apply(self._ctx, target, area, area)
                target.clear(EMPTY, EMPTY, EMPTY, EMPTY, viewport=area)
            self.state.apply(self._ctx, target, area, area)
            variant = [d for d in craft.model.variant if d != "CUT_OUT"]
            present = {"SKY": sky, "EXCHANGE": exchange, "LAMPS": lamps, "APART": apart}
            present["AIR_BEFORE"] = air is not None
            variant += [define for define, there in present.items() if there]
            for screen in self._lit_for(tuple(variant)):
                screen.draw()
        return textures_of(target)

    def _write(self, tile: RasterTile, lamps: Sequence[LampView]) -> None:
        for block in (self._tile, self._craft, self._shadow, self._lamps, self._joints):
            block.bind()
        self._tile.write(tile_values(tile, tile.slices[0]))
        self._lamps.write(lamp_values(lamps))

    def _bind(
        self,
        craft: SpacecraftView,
        tile: RasterTile,
        maps: Sequence[moderngl.Texture],
        sky: Sequence[_SkyTexture],
        air: AirBetween | None,
    ) -> None:
        error = self._meshes.shape(craft.model, craft.detail).error
        self._craft.write(craft_values(craft, air, error))
        self._shadow.write(shadow_values(craft, tile.sample_grid))
        self._meshes.bind_materials(craft.model)
        if "JOINTED" in craft.model.variant:
            self._joints.write(joint_values(craft.model))
        for unit, texture in zip(_SHADOW_UNITS.values(), maps, strict=True):
            texture.use(unit)
        for unit, around in zip(_SKY_UNITS.values(), sky, strict=bool(sky)):
            around.use(unit)

    def _lit_for(self, variant: tuple[str, ...]) -> tuple[_Screen, ...]:
        """The shaders for spacecraft of a variant, without what they do not need."""
        if variant not in self._lit:
            plain = tuple(define for define in variant if define not in ("LAYERED", "JOINTED"))
            if "LAYERED" not in variant:
                self._lit[variant] = (self._lit_screen(plain, -0.5),)
            else:
                first = self._lit_screen((*plain, "PLAIN"), -0.5)
                self._lit[variant] = first, self._lit_screen(variant, -0.25)
        return self._lit[variant]

    def _lit_screen(self, variant: tuple[str, ...], depth: float) -> _Screen:
        samplers = _seen("seen_place", "seen_shape") | {"sunlight": _SUNLIGHT_UNIT}
        blocks = [CRAFT, MATERIALS]
        for define, units in _MORE_UNITS.items():
            if define in variant:
                samplers |= units
        if "LAYERED" in variant:
            blocks.append(TILE)
            if "JOINTED" in variant:
                blocks.append(JOINTS)
        if "LAMPS" in variant:
            blocks.append(LAMPS)
        return _Screen(self._ctx, "surface/surface", depth, blocks, samplers, variant)

    def release(self) -> None:
        """Free everything."""
        for target in self._targets.values():
            target.release()
        for buffer in (self._tile, self._craft, self._shadow, self._lamps, self._joints):
            buffer.release()
        self._lobes.release()
        for screen in (self._others, self._known, self._searched, *sum(self._lit.values(), ())):
            screen.release()
