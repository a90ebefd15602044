"""Spacecraft on the GPU, uploaded once and shared by the passes that draw them."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.gpu.vertex_buffers import DETAIL, Values, VertexBuffers
from simgl.lru_cache import LruCache
from simgl.passes.shared_blocks import MATERIALS, MAX_MATERIALS, material_values
from simgl.passes.texture_store import TextureStore
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexLighting:
    """A mesh that is finer where light varies, with the light of its vertices.

    defines : what a program needs that reads them
    """

    mesh: Mesh
    values: Values
    defines: tuple[str, ...]


# A joint that moves makes a new mesh each frame. No frame draws more than some dozens.
KEPT = 256


class MeshStore:
    """Geometries, materials and images by their content."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._textures = TextureStore(ctx)
        self._materials: dict[tuple[tuple[Material, ...], str], UniformBuffer] = {}
        self._geometries = LruCache[str, VertexBuffers](KEPT, VertexBuffers.release)

    def geometry(self, mesh: Mesh) -> VertexBuffers:
        """The uploaded mesh, good for as long as it is among the last ``KEPT`` asked for."""
        return self._geometries.get(mesh.digest, lambda: _geometry(self._ctx, mesh))

    def bind_materials(self, model: SpacecraftModel) -> None:
        """Bind the Materials block of a model."""
        key = model.materials, model.textures.digest
        if key not in self._materials:
            self._materials[key] = UniformBuffer(self._ctx, MATERIALS)
            values = material_values(model.name, model.materials, model.textures)
            self._materials[key].write(values)
        self._materials[key].bind()

    def bind_surface(self, model: SpacecraftModel) -> None:
        """Bind the Materials block of a model, and its images where it has any detail."""
        self.bind_materials(model)
        if "DETAILED" in model.variant:
            self._textures.bind(model.textures)

    def release(self) -> None:
        """Free all of them."""
        self._geometries.clear()
        for buffer in self._materials.values():
            buffer.release()
        self._materials.clear()
        self._textures.release()


def _geometry(ctx: moderngl.Context, mesh: Mesh) -> VertexBuffers:
    joint = 0 if mesh.joint is None else mesh.joint
    labels = np.stack([mesh.part, mesh.material + MAX_MATERIALS * joint], axis=1)
    return VertexBuffers(ctx, mesh.positions, mesh.normals, labels, mesh.triangles, _details(mesh))


def _details(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.void]] | None:
    if mesh.uv is None and mesh.colour is None:
        return None
    details = np.zeros(len(mesh.positions), dtype=DETAIL)
    details["uv"] = 0.0 if mesh.uv is None else mesh.uv
    details["tint"] = 1.0 if mesh.colour is None else mesh.colour
    return details
