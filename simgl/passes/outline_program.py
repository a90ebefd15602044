"""Shaders that draw only where spacecraft are: shadow maps, truth and visibility."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl

from simgl.arrays import UIntArray
from simgl.gpu.program import load_program
from simgl.gpu.uniform_blocks import Block
from simgl.gpu.vertex_buffers import VertexBuffers
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shared_blocks import JOINT_RATES, JOINTS, MATERIALS
from simgl.passes.texture_store import BASE_COLOUR_UNIT
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.spacecraft import SpacecraftModel

# What a model's variant means for its outline, with the block that it reads.
_VARIANTS = {"CUT_OUT": MATERIALS, "JOINTED": JOINTS}


class OutlineProgram:
    """One shader in as many variants as models need."""

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
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._program_for(())

    def draw(
        self,
        model: SpacecraftModel,
        mesh: PosedMesh | None = None,
        geometry: VertexBuffers | None = None,
        triangles: UIntArray | None = None,
    ) -> None:
        """The triangles of a model.

        mesh : to draw instead of the model's own
        geometry : that stands for the mesh
        triangles : (k, 3) corners of those that are drawn; None for all
        """
        mesh = mesh or model.posed_mesh
        variant = tuple(define for define in model.variant if define == "CUT_OUT")
        if mesh.motion is not None:
            variant = (*variant, "JOINTED")
        if "CUT_OUT" in variant:
            self._meshes.bind_surface(model)
        if "JOINTED" in variant:
            self._meshes.bind_joints(model, mesh)
        (geometry or self._meshes.geometry(mesh)).draw(self._program_for(variant), triangles)

    def _program_for(self, variant: tuple[str, ...]) -> moderngl.Program:
        if variant not in self._programs:
            cut_out = "CUT_OUT" in variant
            self._programs[variant] = load_program(
                self._ctx,
                self._name,
                blocks=(*self._blocks, *(_VARIANTS[define] for define in variant)),
                spare=[*_VARIANTS.values(), JOINT_RATES],
                samplers=self._samplers
                | ({"base_colour_images": BASE_COLOUR_UNIT} if cut_out else {}),
                defines=self._defines | dict.fromkeys(variant, 1),
            )
        return self._programs[variant]

    def release(self) -> None:
        """Free the programs."""
        for program in self._programs.values():
            program.release()
