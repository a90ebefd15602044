"""What each sample of a tile sees of its spacecraft: place, normals, material, vertex light."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from simgl.gpu.pipeline_state import State, clear_depth
from simgl.gpu.program import load_program
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import GrowingTarget, textures_of
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shared_blocks import (
    JOINTS,
    MATERIALS,
    SPACECRAFT,
    TILE,
    spacecraft_values,
    tile_values,
)
from simgl.passes.texture_store import IMAGE_UNITS
from simgl.view.raster_tiles import RasterTile

# The first target of a sample that sees nothing; the others are left as they are.
EMPTY = -1.0
# The targets of shaders/gbuffer/gbuffer.frag; those with images and vertex colours have more.
_PLAIN, _DETAILED = 4, 7


class GBufferPass:
    """Draws the geometry and materials of the spacecraft of a tile at its sample grid."""

    # The grid is rotated against the image, so that its raster holds more than the tile: what
    # lies outside is cut away.
    closed = State(depth=True, cull="back", clip_planes=4)
    open_sheets = State(depth=True, clip_planes=4)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._tile = UniformBuffer(ctx, TILE)
        self._spacecraft = UniformBuffer(ctx, SPACECRAFT)
        self._targets = {n: GrowingTarget(ctx, [range(n)]) for n in (_PLAIN, _DETAILED)}

    def draw(
        self, tile: RasterTile, spacecraft: Sequence[DrawnSpacecraft]
    ) -> tuple[moderngl.Texture, ...]:
        """The targets of the shader in their order, RGBA32F, valid until the next draw."""
        detailed = any("DETAILED" in drawn.view.model.variant for drawn in spacecraft)
        size = tile.raster_size
        (target,) = self._targets[_DETAILED if detailed else _PLAIN].covering(size)
        viewport = (0, 0, *size)
        self.closed.apply(self._ctx, target, viewport, viewport)
        others = ((False,) * 4,) * (len(target.color_attachments) - 1)
        target.color_mask = ((True,) * 4, *others)  # type: ignore[assignment]
        target.clear(EMPTY, EMPTY, EMPTY, EMPTY, depth=1.0, viewport=viewport)
        self._tile.bind()
        self._spacecraft.bind()
        for index, clip_from_camera in enumerate(tile.slices):
            if index:
                clear_depth(self._ctx, target)
            self._tile.write(tile_values(tile, clip_from_camera))
            for drawn in spacecraft:
                model, lighting = drawn.view.model, drawn.vertex_lighting
                state = self.open_sheets if model.open_sheets else self.closed
                state.apply(self._ctx, target, viewport, viewport)
                self._spacecraft.write(spacecraft_values(drawn.view))
                variant = tuple(d for d in model.variant if d not in ("LAYERED", "JOINTED"))
                if variant:
                    self._meshes.bind_surface(model)
                mesh = model.posed_mesh if lighting is None else lighting.mesh
                if lighting is not None:
                    variant += lighting.defines
                if mesh.motion is not None:
                    self._meshes.bind_joints(model, mesh)
                    variant = (*variant, "JOINTED")
                values = None if lighting is None else lighting.values
                self._meshes.geometry(mesh).draw(self._program_for(variant), values)
        return textures_of(target)

    def _program_for(self, variant: tuple[str, ...]) -> moderngl.Program:
        """The program for models of a variant; those without images do not pay for them."""
        if variant not in self._programs:
            detailed = "DETAILED" in variant
            blocks = [TILE, SPACECRAFT]
            blocks += [MATERIALS] * detailed + [JOINTS] * ("JOINTED" in variant)
            self._programs[variant] = load_program(
                self._ctx,
                "gbuffer/gbuffer",
                blocks=blocks,
                spare=[MATERIALS, JOINTS],
                samplers=IMAGE_UNITS if detailed else {},
                defines=dict.fromkeys(variant, 1),
            )
        return self._programs[variant]

    def release(self) -> None:
        """Free everything."""
        for target in self._targets.values():
            target.release()
        for buffer in (self._tile, self._spacecraft):
            buffer.release()
        for program in self._programs.values():
            program.release()
