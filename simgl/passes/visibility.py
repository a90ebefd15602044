"""Which triangle of which spacecraft each sample of a tile sees."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from simgl.gpu.pipeline_state import State, clear_depth
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import Format, GrowingTarget, textures_of
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.passes.shared_blocks import (
    JOINT_RATES,
    SPACECRAFT,
    TILE,
    spacecraft_values,
    tile_values,
)
from simgl.view.raster_tiles import RasterTile

_SURFACES_UNIT, _SPLIT_UNIT = 0, 1


class VisibilityPass:
    """Draws the triangles of a tile's spacecraft at its sample grid; 0 where there is none."""

    # The grid is rotated against the image, so that its raster holds more than the tile: what
    # lies outside is cut away.
    closed = State(depth=True, cull="back", clip_planes=4)
    open_sheets = State(depth=True, clip_planes=4)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._programs: dict[tuple[str, ...], OutlineProgram] = {}
        self._program_for(())
        self._tile = UniformBuffer(ctx, TILE)
        self._spacecraft = UniformBuffer(ctx, SPACECRAFT)
        self._target = GrowingTarget(ctx, [[0]], Format("u4", 2))

    def draw(self, tile: RasterTile, spacecraft: Sequence[DrawnSpacecraft]) -> moderngl.Texture:
        """RG32UI samples of the tile, valid until the next draw."""
        size = tile.raster_size
        (target,) = self._target.covering(size)
        viewport = (0, 0, *size)
        self.closed.apply(self._ctx, target, viewport, viewport)
        target.clear(depth=1.0, viewport=viewport)
        self._tile.bind()
        self._spacecraft.bind()
        for index, clip_from_camera in enumerate(tile.slices):
            if index:
                clear_depth(self._ctx, target)
            self._tile.write(tile_values(tile, clip_from_camera))
            for drawn in spacecraft:
                model = drawn.view.model
                state = self.open_sheets if model.open_sheets else self.closed
                state.apply(self._ctx, target, viewport, viewport)
                self._spacecraft.write(spacecraft_values(drawn.view))
                self._meshes.tables(drawn.mesh).surfaces.use(_SURFACES_UNIT)
                self._draw(drawn)
        return textures_of(target)[0]

    def _draw(self, drawn: DrawnSpacecraft) -> None:
        motion, model = drawn.view.motion, drawn.view.model
        if motion is None:
            self._program_for(()).draw(model, drawn.mesh)
            return
        variant = motion.variant
        if motion.joint_rates is not None:
            self._meshes.bind_joint_rates(motion)
            variant += ("JOINTS_MOVE",)
        split = self._meshes.split(drawn.mesh, motion.bend)
        if split is None:
            self._program_for(variant).draw(model, drawn.mesh)
            return
        split.triangles.use(_SPLIT_UNIT)
        self._program_for((*variant, "SPLIT")).draw(model, drawn.mesh, split.buffers)

    def _program_for(self, variant: tuple[str, ...]) -> OutlineProgram:
        """For spacecraft that stand still, that move, and those cut finely for it."""
        if variant not in self._programs:
            samplers = {"triangle_surfaces": _SURFACES_UNIT}
            if "SPLIT" in variant:
                samplers["split_triangles"] = _SPLIT_UNIT
            self._programs[variant] = OutlineProgram(
                self._ctx,
                self._meshes,
                "visibility/visibility",
                [TILE, SPACECRAFT] + [JOINT_RATES] * ("JOINTS_MOVE" in variant),
                samplers,
                dict.fromkeys(variant, 1),
            )
        return self._programs[variant]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        for resource in (self._target, self._tile, self._spacecraft):
            resource.release()
