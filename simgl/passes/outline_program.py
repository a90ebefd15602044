"""Shaders that draw only where spacecraft are: shadow maps and truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl

from simgl.gpu.program import load_program
from simgl.gpu.uniform_blocks import Block
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shared_blocks import MATERIALS
from simgl.passes.texture_store import BASE_COLOUR_UNIT
from simgl.scene.spacecraft import SpacecraftModel


class OutlineProgram:
    """One shader in two forms; the second is for models from which images cut something away."""

    def __init__(
        self,
        ctx: moderngl.Context,
        meshes: MeshStore,
        name: str,
        blocks: Sequence[Block],
        samplers: Mapping[str, int] | None = None,
        defines: Mapping[str, int] | None = None,
    ) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._name, self._blocks = name, tuple(blocks)
        self._samplers, self._defines = dict(samplers or {}), dict(defines or {})
        self._plain = load_program(
            ctx,
            name,
            blocks=blocks,
            spare=[MATERIALS],
            samplers=self._samplers,
            defines=self._defines,
        )
        self._cut_out: moderngl.Program | None = None

    def draw(self, model: SpacecraftModel) -> None:
        """All triangles of a model."""
        geometry = self._meshes.geometry(model.mesh)
        if "CUT_OUT" not in model.variant:
            geometry.draw(self._plain)
            return
        if self._cut_out is None:
            self._cut_out = load_program(
                self._ctx,
                self._name,
                blocks=(*self._blocks, MATERIALS),
                samplers=self._samplers | {"base_colour_images": BASE_COLOUR_UNIT},
                defines=self._defines | {"CUT_OUT": 1},
            )
        self._meshes.bind_surface(model)
        geometry.draw(self._cut_out)

    def release(self) -> None:
        """Free the programs."""
        self._plain.release()
        if self._cut_out is not None:
            self._cut_out.release()
