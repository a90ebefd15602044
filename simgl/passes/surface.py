"""Spacecraft surfaces: radiance of every sample of a tile."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from simgl.errors import ConfigError
from simgl.gpu.blocks import UniformBuffer
from simgl.gpu.program import load_program
from simgl.gpu.state import State, clear_depth
from simgl.passes.blocks import (
    CRAFT,
    LAMPS,
    MATERIALS,
    SHADOW,
    TILE,
    AirBetween,
    craft_values,
    lamp_values,
    shadow_values,
    tile_values,
)
from simgl.passes.lobes import LOBE_UNIT, lobe_texture
from simgl.passes.meshes import MeshStore, VertexLighting
from simgl.passes.textures import IMAGE_UNITS
from simgl.view.frame import Tile
from simgl.view.lamps import LampView

# Targets grow in these steps, so that a moving spacecraft does not reallocate at every frame.
_GRAIN = 256

EMPTY = -1.0

# The terms of a surface's radiance, in the order of the targets of shaders/surface/surface.frag.
LIGHTS = ("sun", "earth", "inter_reflected", "lamp", "emitted")

# In the order of the shadow pass's textures.
_SHADOW_UNITS = {
    "sun_depths": 0,
    "sun_behind": 1,
    "sun_tops": 2,
}
_BLOCKS = (TILE, CRAFT, SHADOW, MATERIALS)
_SKY_UNIT = 4

_SkyTexture = moderngl.TextureCube | moderngl.Texture3D | moderngl.Texture
_LAMP_UNIT = 7
_LOBES = {"lobe_table": LOBE_UNIT}
# What each variant of the shader reads besides.
_MORE_UNITS = {
    "SKY": {"sky_cube": 4, "sky_lobes": 5, "sky_irradiance": 6} | _LOBES,
    "EXCHANGE": _LOBES,
    "LAYERED": _LOBES,
    "LAMPS": {"lamp_maps": _LAMP_UNIT},
    "DETAILED": IMAGE_UNITS,
}


class SurfacePass:
    """Draws the spacecraft of a tile on its sampling lattice; empty samples hold -1."""

    # The lattice is turned against the image, so that its raster holds more than the tile: what
    # lies outside is cut away.
    closed = State(depth=True, cull="back", clip_planes=4)
    open_sheets = State(depth=True, clip_planes=4)

    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._lobes = lobe_texture(ctx)
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._program_for(())
        self._tile = UniformBuffer(ctx, TILE)
        self._craft = UniformBuffer(ctx, CRAFT)
        self._shadow = UniformBuffer(ctx, SHADOW)
        self._lamps = UniformBuffer(ctx, LAMPS)
        # By the number of their colour attachments.
        self._targets: dict[int, moderngl.Framebuffer] = {}

    def draw(
        self,
        tile: Tile,
        shadow_maps: Sequence[Sequence[moderngl.Texture]],
        skies: Sequence[Sequence[_SkyTexture]],
        lightings: Sequence[VertexLighting | None],
        lamps: Sequence[LampView] = (),
        lamp_maps: moderngl.Texture | None = None,
        airs: Sequence[AirBetween | None] = (),
        *,
        apart: bool = False,
    ) -> tuple[moderngl.Texture, ...]:
        """RGBA32F samples of the tile [W m-2 sr-1], valid until the next draw.

        shadow_maps : for each spacecraft of the tile, in the order of the samplers
        skies : likewise its cube, lobes and irradiance; nothing where it has no sky
        lightings : likewise what its own surfaces do to its light; None where they do nothing
        lamp_maps : of the lamps, which light every spacecraft
        airs : before each spacecraft; none at all where nothing is given
        returns : one texture, or with ``apart`` one for each of ``LIGHTS``
        """
        size = tile.lattice.raster_size(tile.width, tile.height)
        target = self._sized_target(size, len(LIGHTS) if apart else 1)
        viewport = (0, 0, *size)
        self.closed.apply(self._ctx, target, viewport, viewport)
        target.clear(EMPTY, EMPTY, EMPTY, EMPTY, depth=1.0, viewport=viewport)
        self._tile.bind()
        self._craft.bind()
        self._shadow.bind()
        self._lamps.bind()
        self._lamps.write(lamp_values(lamps))
        if lamp_maps is not None:
            lamp_maps.use(_LAMP_UNIT)
        self._lobes.use(LOBE_UNIT)
        for index, clip_from_camera in enumerate(tile.slices):
            if index:
                clear_depth(self._ctx, target)
            self._tile.write(tile_values(tile, clip_from_camera))
            for craft, maps, sky, own, air in zip(
                tile.craft,
                shadow_maps,
                skies,
                lightings,
                airs or [None] * len(tile.craft),
                strict=True,
            ):
                state = self.open_sheets if craft.model.open_sheets else self.closed
                state.apply(self._ctx, target, viewport, viewport)
                self._craft.write(craft_values(craft, air))
                self._meshes.bind_surface(craft.model)
                self._shadow.write(shadow_values(craft, tile.lattice))
                for unit, texture in zip(_SHADOW_UNITS.values(), maps, strict=True):
                    texture.use(unit)
                for unit, around in enumerate(sky, start=_SKY_UNIT):
                    around.use(unit)
                variant = craft.model.variant + _lights(sky, lamps)
                variant += ("APART",) if apart else ()
                variant += ("AIR_BEFORE",) if air is not None else ()
                if own is None:
                    program = self._program_for(variant)
                    self._meshes.geometry(craft.model.mesh).draw(program)
                else:
                    program = self._program_for(variant + own.defines)
                    self._meshes.geometry(own.mesh).draw(program, own.values)
        return tuple(t for t in target.color_attachments if isinstance(t, moderngl.Texture))

    def _program_for(self, variant: tuple[str, ...]) -> moderngl.Program:
        """The program for models of a variant; those without images do not pay for them."""
        if variant not in self._programs:
            samplers = dict(_SHADOW_UNITS)
            for define, units in _MORE_UNITS.items():
                if define in variant:
                    samplers |= units
            self._programs[variant] = load_program(
                self._ctx,
                "surface/surface",
                blocks=(*_BLOCKS, LAMPS) if "LAMPS" in variant else _BLOCKS,
                spare=[LAMPS],
                samplers=samplers,
                defines=dict.fromkeys(variant, 1),
            )
        return self._programs[variant]

    def _sized_target(self, size: tuple[int, int], attachments: int) -> moderngl.Framebuffer:
        target = self._targets.get(attachments)
        have = target.size if target is not None else (0, 0)
        if target is not None and have[0] >= size[0] and have[1] >= size[1]:
            return target
        self._release_target(attachments)
        largest = int(self._ctx.info["GL_MAX_TEXTURE_SIZE"])
        if max(size) > largest:
            problem = f"needs a raster of {size[0]} x {size[1]} samples, {largest} are possible"
            raise ConfigError("[render]", "samples_per_pixel", f"{problem}; ask for fewer")
        grown = tuple(
            min(-(-max(h, s) // _GRAIN) * _GRAIN, largest) for h, s in zip(have, size, strict=True)
        )
        colours = []
        for _ in range(attachments):
            colours.append(self._ctx.texture(grown, 4, dtype="f4"))  # type: ignore[arg-type]
            colours[-1].filter = (moderngl.NEAREST, moderngl.NEAREST)
        depth = self._ctx.depth_renderbuffer(grown)  # type: ignore[arg-type]
        self._targets[attachments] = self._ctx.framebuffer(colours, depth)
        return self._targets[attachments]

    def _release_target(self, attachments: int) -> None:
        target = self._targets.pop(attachments, None)
        if target is not None:
            for colour in target.color_attachments:
                colour.release()
            assert target.depth_attachment is not None
            target.depth_attachment.release()
            target.release()

    def release(self) -> None:
        """Free everything."""
        for attachments in tuple(self._targets):
            self._release_target(attachments)
        for buffer in (self._tile, self._craft, self._shadow, self._lamps):
            buffer.release()
        self._lobes.release()
        for program in self._programs.values():
            program.release()


def _lights(sky: Sequence[_SkyTexture], lamps: Sequence[LampView]) -> tuple[str, ...]:
    """Defines of the lights that a spacecraft needs besides the Sun's."""
    present = {"SKY": sky, "LAMPS": lamps}
    return tuple(define for define, there in present.items() if there)
