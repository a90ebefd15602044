"""Spacecraft surfaces: radiance of every sample of a tile."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from simgl.errors import ConfigError
from simgl.gpu.blocks import UniformBuffer
from simgl.gpu.program import load_program
from simgl.gpu.state import State, clear_depth
from simgl.passes.blocks import CRAFT, MATERIALS, TILE, craft_values, material_values
from simgl.passes.meshes import MeshStore
from simgl.scene.materials import Material
from simgl.view import CraftView, Tile

# Targets grow in these steps, so that a moving spacecraft does not reallocate at every frame.
_GRAIN = 256

EMPTY = -1.0


class SurfacePass:
    """Draws the spacecraft of a tile on its sampling lattice; empty samples hold -1."""

    closed = State(depth=True, cull="back")
    open_sheets = State(depth=True)

    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._program = load_program(
            ctx, "surface/surface", blocks=[TILE, CRAFT, MATERIALS], samplers=["shadow_map"]
        )
        self._tile = UniformBuffer(ctx, TILE)
        self._craft = UniformBuffer(ctx, CRAFT)
        self._materials: dict[tuple[Material, ...], UniformBuffer] = {}
        self._target: moderngl.Framebuffer | None = None

    def draw(self, tile: Tile, shadow_maps: Sequence[moderngl.Texture]) -> moderngl.Texture:
        """RGBA32F samples of the tile [W m-2 sr-1], valid until the next draw.

        shadow_maps : one for each spacecraft of the tile
        """
        size = tile.lattice.raster_size(tile.width, tile.height)
        target = self._sized_target(size)
        viewport = (0, 0, *size)
        self.closed.apply(self._ctx, target, viewport, viewport)
        target.clear(EMPTY, EMPTY, EMPTY, EMPTY, depth=1.0, viewport=viewport)
        self._tile.bind()
        self._craft.bind()
        for index, clip_from_camera in enumerate(tile.slices):
            if index:
                clear_depth(self._ctx, target)
            self._tile.write({"clip_from_camera": clip_from_camera})
            for craft, shadow_map in zip(tile.craft, shadow_maps, strict=True):
                state = self.open_sheets if craft.model.open_sheets else self.closed
                state.apply(self._ctx, target, viewport, viewport)
                self._craft.write(craft_values(craft))
                self._material_buffer(craft).bind()
                shadow_map.use(0)
                self._meshes.geometry(craft.model.mesh).draw(self._program)
        texture = target.color_attachments[0]
        assert isinstance(texture, moderngl.Texture)
        return texture

    def _material_buffer(self, craft: CraftView) -> UniformBuffer:
        key = craft.model.materials
        if key not in self._materials:
            buffer = UniformBuffer(self._ctx, MATERIALS)
            buffer.write(material_values(craft.model.name, craft.model.materials))
            self._materials[key] = buffer
        return self._materials[key]

    def _sized_target(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        have = self._target.size if self._target is not None else (0, 0)
        if have[0] >= size[0] and have[1] >= size[1]:
            assert self._target is not None
            return self._target
        self._release_target()
        largest = int(self._ctx.info["GL_MAX_TEXTURE_SIZE"])
        if max(size) > largest:
            problem = f"needs a raster of {size[0]} x {size[1]} samples, {largest} are possible"
            raise ConfigError("[render]", "samples_per_pixel", f"{problem}; ask for fewer")
        grown = tuple(
            min(-(-max(h, s) // _GRAIN) * _GRAIN, largest) for h, s in zip(have, size, strict=True)
        )
        color = self._ctx.texture(grown, 4, dtype="f4")  # type: ignore[arg-type]
        color.filter = (moderngl.NEAREST, moderngl.NEAREST)
        depth = self._ctx.depth_renderbuffer(grown)  # type: ignore[arg-type]
        self._target = self._ctx.framebuffer([color], depth)
        return self._target

    def _release_target(self) -> None:
        if self._target is not None:
            self._target.color_attachments[0].release()
            assert self._target.depth_attachment is not None
            self._target.depth_attachment.release()
            self._target.release()
            self._target = None

    def release(self) -> None:
        """Free everything."""
        self._release_target()
        for buffer in (self._tile, self._craft, *self._materials.values()):
            buffer.release()
        self._program.release()
