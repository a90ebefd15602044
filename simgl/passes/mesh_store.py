"""Spacecraft on the GPU, uploaded once for all poses and shared by the passes that draw them."""

from __future__ import annotations

from dataclasses import dataclass, field

import moderngl
import numpy as np

from simgl.arrays import IndexArray
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.gpu.vertex_buffers import DETAIL, Values, VertexBuffers
from simgl.lru_cache import MANY, LruCache
from simgl.motion.joints import Joint
from simgl.passes.shared_blocks import (
    JOINTS,
    MATERIALS,
    MAX_JOINTS,
    joint_values,
    material_values,
)
from simgl.passes.texture_store import TextureStore
from simgl.scene.materials import MAX_MATERIALS, Material
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import PosedMesh, groups_of_parts
from simgl.scene.spacecraft import SpacecraftModel


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexLighting:
    """A mesh that is finer where light varies, with the light of its vertices.

    defines : what a program needs that reads them
    """

    mesh: PosedMesh
    values: Values
    defines: tuple[str, ...]


# Of the geometries that stay on the GPU.
MAX_BYTES = 512 << 20


@dataclass(kw_only=True, eq=False)
class _JointsBlock:
    """The Joints block of a model, and the pose that it holds."""

    buffer: UniformBuffer
    written: PosedMesh | None = field(default=None)

    def release(self) -> None:
        self.buffer.release()


class MeshStore:
    """Geometries, materials and images by their content."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._textures = TextureStore(ctx)
        self._materials = LruCache[tuple[tuple[Material, ...], str], UniformBuffer](
            MANY, UniformBuffer.release
        )
        self._joints = LruCache[tuple[Joint, ...], _JointsBlock](MANY, _JointsBlock.release)
        self._geometries = LruCache[tuple[str, bytes], VertexBuffers](
            MANY, VertexBuffers.release, max_bytes=MAX_BYTES
        )

    def geometry(self, posed: PosedMesh) -> VertexBuffers:
        """The uploaded mesh, the same for all poses.

        It stays valid while it is among the last ``MANY`` and ``MAX_BYTES`` that were asked for.
        """
        groups = groups_of_parts(posed.mesh, posed.joints)
        if len(posed.joints) > MAX_JOINTS:
            groups = np.zeros_like(groups)  # they cannot move: see `joint_values`
        key = posed.mesh.digest, groups.tobytes() if posed.joints else b""
        return self._geometries.get(
            key, lambda: _geometry(self._ctx, posed.mesh, groups), posed.mesh.nbytes
        )

    def bind_joints(self, model: SpacecraftModel, posed: PosedMesh) -> None:
        """Bind the Joints block for a mesh of a model, some of which joints have moved."""
        block = self._joints.get(
            posed.joints, lambda: _JointsBlock(buffer=UniformBuffer(self._ctx, JOINTS))
        )
        if block.written is not posed:
            block.buffer.write(joint_values(model.name, posed))
            block.written = posed
        block.buffer.bind()

    def bind_materials(self, model: SpacecraftModel) -> None:
        """Bind the Materials block of a model."""

        def upload() -> UniformBuffer:
            values = material_values(model.name, model.materials, model.textures)
            buffer = UniformBuffer(self._ctx, MATERIALS)
            buffer.write(values)
            return buffer

        self._materials.get((model.materials, model.textures.digest), upload).bind()

    def bind_surface(self, model: SpacecraftModel) -> None:
        """Bind the Materials block of a model, and its images where it has any detail."""
        self.bind_materials(model)
        if "DETAILED" in model.variant:
            self._textures.bind(model.textures)

    def release(self) -> None:
        """Free all of them."""
        self._geometries.clear()
        self._materials.clear()
        self._joints.clear()
        self._textures.release()


def _geometry(ctx: moderngl.Context, mesh: Mesh, group_of_part: IndexArray) -> VertexBuffers:
    group = group_of_part[mesh.part].astype(np.uint32)
    labels = np.stack([mesh.part, mesh.material + np.uint32(MAX_MATERIALS) * group], axis=1)
    return VertexBuffers(ctx, mesh.positions, mesh.normals, labels, mesh.triangles, _details(mesh))


def _details(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.void]] | None:
    if mesh.uv is None and mesh.colour is None:
        return None
    details = np.zeros(len(mesh.positions), dtype=DETAIL)
    details["uv"] = 0.0 if mesh.uv is None else mesh.uv
    details["tint"] = 1.0 if mesh.colour is None else mesh.colour
    return details
