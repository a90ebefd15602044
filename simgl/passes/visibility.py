"""Which triangle of which spacecraft each sample of a tile sees."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.arrays import AnyArray, Array, UIntArray
from simgl.gpu.context import is_software
from simgl.gpu.mesh_tables import table
from simgl.gpu.pipeline_state import State, clear_depth, part_to_clear
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import Format, GrowingTarget, textures_of
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.passes.shared_blocks import JOINT_RATES, SPACECRAFT, TILE
from simgl.passes.view_blocks import ViewBlocks
from simgl.scene.facing_triangles import facing_triangles
from simgl.view.empty_slices import is_free
from simgl.view.raster_tiles import RasterTile

_DRAWN_UNIT = 0


class VisibilityPass:
    """Draws the triangles of a tile's spacecraft at its sample grid; 0 where there is none."""

    # The grid is rotated against the image, so that its raster holds more than the tile: what
    # lies outside is cut away.
    closed = State(depth=True, cull="back", clip_planes=4)
    open_sheets = State(depth=True, clip_planes=4)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore, blocks: ViewBlocks) -> None:
        self._ctx, self._meshes, self._blocks = ctx, meshes, blocks
        # A CPU renderer transforms vertices in the thread that draws, while its others wait.
        self._chooses = is_software(ctx)
        self._programs: dict[tuple[str, ...], OutlineProgram] = {}
        self._program_for(())
        self._target = GrowingTarget(ctx, [range(2)], Format("u4"))

    def draw(
        self, tile: RasterTile, spacecraft: Sequence[DrawnSpacecraft]
    ) -> tuple[moderngl.Texture, ...]:
        """R32UI triangles and surfaces of the tile's samples, in the order of ``SEEN``; valid
        until the next draw."""
        size = tile.raster_size
        (target,) = self._target.covering(size)
        viewport = (0, 0, *size)
        cleared = part_to_clear(target, viewport)
        self.closed.apply(self._ctx, target, cleared, cleared)
        target.clear(depth=1.0, viewport=cleared)
        facing = [self._facing(drawn, tile) for drawn in spacecraft]
        for index in range(len(tile.slices)):
            seen = list(zip(spacecraft, facing, strict=True))
            if index:
                seen = [(d, numbers) for d, numbers in seen if _reaches(d, numbers, tile, index)]
                if not seen:
                    continue
                clear_depth(self._ctx, target)
            self._blocks.bind_tile(tile, index)
            for drawn, numbers in seen:
                model = drawn.view.model
                state = self.open_sheets if model.open_sheets else self.closed
                state.apply(self._ctx, target, viewport, viewport)
                self._blocks.bind_spacecraft(drawn)
                self._draw(drawn, numbers)
        return textures_of(target)

    def _draw(self, drawn: DrawnSpacecraft, numbers: UIntArray | None) -> None:
        """The triangles of some numbers; of None all."""
        motion, model = drawn.view.motion, drawn.view.model
        variant: tuple[str, ...] = ()
        split = None
        if motion is not None:
            variant = motion.variant
            if motion.joint_rates is not None:
                self._meshes.bind_joint_rates(motion)
                variant += ("JOINTS_MOVE",)
            split = self._meshes.split(drawn.mesh, motion.bend)
        program = self._program_for(variant)
        if numbers is None:
            rows = self._meshes.tables(drawn.mesh).drawn if split is None else split.drawn
            rows.use(_DRAWN_UNIT)
            program.draw(model, drawn.mesh, None if split is None else split.buffers)
            return
        if not numbers.size:
            return
        if split is None:
            buffers, triangles = None, drawn.mesh.mesh.triangles.take(numbers, axis=0)
        else:
            buffers = split.buffers
            triangles, numbers = split.parts_of(numbers)
        # A new one, for OpenGL waits with writing one that it yet has to read.
        rows = table(self._ctx, self._meshes.tables(drawn.mesh).drawn_rows(numbers))
        rows.use(_DRAWN_UNIT)
        program.draw(model, drawn.mesh, buffers, triangles)
        rows.release()

    def _facing(self, drawn: DrawnSpacecraft, tile: RasterTile) -> UIntArray | None:
        """(k,) numbers of the triangles that may turn their front to the camera, without many that
        a tile does not see; None for all."""
        motion = drawn.view.motion
        if drawn.view.model.open_sheets or not self._chooses:
            return None
        if motion is None:
            camera_from_body = drawn.view.camera_from_body.astype(np.float64)
            camera = -camera_from_body[:3, :3].T @ camera_from_body[:3, 3]
            sides = _unit_rows(tile.edges[:, :3]) @ camera_from_body[:3, :3]
            return facing_triangles(drawn.mesh, camera[None], sides=sides)
        if motion.joint_rates is not None:
            return None
        return facing_triangles(drawn.mesh, *motion.camera_in_body)

    def _program_for(self, variant: tuple[str, ...]) -> OutlineProgram:
        """For spacecraft that stand still, and that move."""
        if variant not in self._programs:
            self._programs[variant] = OutlineProgram(
                self._ctx,
                self._meshes,
                "visibility/visibility",
                [TILE, SPACECRAFT] + [JOINT_RATES] * ("JOINTS_MOVE" in variant),
                {"drawn_triangles": _DRAWN_UNIT},
                dict.fromkeys(variant, 1),
            )
        return self._programs[variant]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._target.release()


def _reaches(
    drawn: DrawnSpacecraft, numbers: UIntArray | None, tile: RasterTile, index: int
) -> bool:
    """Whether a spacecraft may be seen in a depth slice, or nearer.

    numbers : of its triangles that may be seen; None for all
    """
    if numbers is None or drawn.view.motion is not None or drawn.mesh.motion is not None:
        return True
    pose = drawn.view.camera_from_body.astype(np.float64)
    return not is_free(tile, tile.depths[index][1], drawn.mesh.mesh, pose, numbers)


def _unit_rows(rows: AnyArray) -> Array:
    """(n, 3) of length 1; those of length 0 stay."""
    rows = rows.astype(np.float64)
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-30))
