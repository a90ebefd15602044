"""Spacecraft on the GPU, uploaded once for all poses and shared by the passes that draw them."""

from __future__ import annotations

from dataclasses import dataclass, field

import moderngl
import numpy as np

from simgl.arrays import IndexArray, UIntArray
from simgl.gpu.mesh_tables import MeshTables, table
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.gpu.vertex_buffers import DETAIL, VertexBuffers
from simgl.lru_cache import MANY, LruCache
from simgl.motion.joints import Joint
from simgl.passes.shared_blocks import (
    JOINT_RATES,
    JOINTS,
    MATERIALS,
    MAX_JOINTS,
    joint_rate_values,
    joint_values,
    material_values,
)
from simgl.passes.texture_store import TextureStore
from simgl.scene.materials import MAX_MATERIALS
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import PosedMesh, groups_of_parts
from simgl.scene.smooth_surfaces import curvatures, smooth_surfaces
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.split_mesh import SplitMesh, longest_edge, split_mesh
from simgl.view.row_clock import PoseMotion


@dataclass(frozen=True, kw_only=True, eq=False)
class GridLight:
    """Finer light on some triangles.

    of_triangle : one texel for each: 1 and the number of its grid, 0 without one
    rows : one for each node and side: its place in ``light``
    light : irradiance more than is linear between the vertices [W m-2]
    """

    of_triangle: moderngl.Texture
    rows: moderngl.Texture
    light: moderngl.Texture


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexLighting:
    """A mesh that is finer where light varies, with the light of its vertices.

    light : two texels for each vertex and side: irradiance from other surfaces [W m-2]; what they
        leave of the Earth's
    defines : what a program needs that reads them
    grids : finer light, None for none
    """

    mesh: PosedMesh
    light: moderngl.Texture
    defines: tuple[str, ...]
    grids: GridLight | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class SplitGeometry:
    """An uploaded mesh whose long edges are cut.

    drawn : of its triangles (``MeshTables.drawn_rows``)
    mesh : that
    """

    buffers: VertexBuffers
    drawn: moderngl.Texture
    mesh: SplitMesh

    def parts_of(self, numbers: UIntArray) -> tuple[UIntArray, UIntArray]:
        """The corners (k, 3) of the parts of some triangles, and (k,) of which each is a part.

        numbers : (n,) in the whole mesh
        """
        source = self.mesh.triangle
        wanted = np.zeros(int(source.max(initial=0)) + 1, dtype=bool)
        wanted[numbers] = True
        chosen = np.flatnonzero(wanted.take(source))
        return self.mesh.mesh.triangles.take(chosen, axis=0), source.take(chosen)

    def release(self) -> None:
        """Free both."""
        self.buffers.release()
        self.drawn.release()


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
        self._materials = LruCache[str, UniformBuffer](MANY, UniformBuffer.release)
        self._joints = LruCache[tuple[Joint, ...], _JointsBlock](MANY, _JointsBlock.release)
        self._geometries = LruCache[tuple[str, bytes], VertexBuffers](
            MANY, VertexBuffers.release, max_bytes=MAX_BYTES
        )
        self._tables = LruCache[tuple[str, bytes], MeshTables](
            MANY, MeshTables.release, max_bytes=MAX_BYTES
        )
        self._split = LruCache[tuple[str, bytes, float], SplitGeometry](
            MANY, SplitGeometry.release, max_bytes=MAX_BYTES
        )
        self._joint_rates = UniformBuffer(ctx, JOINT_RATES)

    def geometry(self, posed: PosedMesh) -> VertexBuffers:
        """The uploaded mesh, the same for all poses.

        It stays valid while it is among the last ``MANY`` and ``MAX_BYTES`` that were asked for.
        """
        return self._geometries.get(
            _key(posed),
            lambda: _geometry(self._ctx, posed.mesh, _groups(posed)),
            posed.mesh.nbytes,
        )

    def tables(self, posed: PosedMesh) -> MeshTables:
        """The mesh as textures, the same for all poses; valid as long as ``geometry``."""
        return self._tables.get(
            _key(posed),
            lambda: _tables(self._ctx, posed.mesh, _groups(posed)),
            posed.mesh.nbytes,
        )

    def split(self, posed: PosedMesh, longest: float) -> SplitGeometry | None:
        """The uploaded mesh, its edges cut where they are longer than that [m].

        Lengths are rounded down to a power of two. None where no edge is as long.
        """
        longest = 2.0 ** float(np.floor(np.log2(longest)))
        if longest_edge(posed.mesh) <= longest:
            return None
        return self._split.get(
            (*_key(posed), longest),
            lambda: self._split_geometry(split_mesh(posed.mesh, longest), posed, _groups(posed)),
            posed.mesh.nbytes,
        )

    def _split_geometry(
        self, split: SplitMesh, posed: PosedMesh, groups: IndexArray
    ) -> SplitGeometry:
        return SplitGeometry(
            buffers=_geometry(self._ctx, split.mesh, groups),
            drawn=table(self._ctx, self.tables(posed).drawn_rows(split.triangle)),
            mesh=split,
        )

    def bind_joint_rates(self, motion: PoseMotion) -> None:
        """Bind the JointRates block of a spacecraft whose joints move."""
        self._joint_rates.write(joint_rate_values(motion))
        self._joint_rates.bind()

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

        self._materials.get(model.surface_digest, upload).bind()

    def bind_surface(self, model: SpacecraftModel) -> None:
        """Bind the Materials block of a model, and its images where it has any detail."""
        self.bind_materials(model)
        if "DETAILED" in model.variant:
            self._textures.bind(model.textures)

    def release(self) -> None:
        """Free all of them."""
        self._geometries.clear()
        self._tables.clear()
        self._split.clear()
        self._joint_rates.release()
        self._materials.clear()
        self._joints.clear()
        self._textures.release()


def _key(posed: PosedMesh) -> tuple[str, bytes]:
    """Equal for meshes that are uploaded alike."""
    return posed.mesh.digest, _groups(posed).tobytes() if posed.joints else b""


def _groups(posed: PosedMesh) -> IndexArray:
    """(parts,) rigid group of each part."""
    groups = groups_of_parts(posed.mesh, posed.joints)
    # More than the block holds cannot move: see `joint_values`.
    return np.zeros_like(groups) if len(posed.joints) > MAX_JOINTS else groups


def _label(mesh: Mesh, group_of_part: IndexArray) -> UIntArray:
    """(n,) material, and from bit 6 on the rigid group."""
    group = group_of_part[mesh.part].astype(np.uint32)
    return mesh.material + np.uint32(MAX_MATERIALS) * group


def _tables(ctx: moderngl.Context, mesh: Mesh, group_of_part: IndexArray) -> MeshTables:
    return MeshTables(
        ctx,
        mesh.positions,
        mesh.normals,
        _label(mesh, group_of_part),
        mesh.triangles,
        smooth_surfaces(mesh),
        curvatures(mesh),
        _details(mesh),
    )


def _geometry(ctx: moderngl.Context, mesh: Mesh, group_of_part: IndexArray) -> VertexBuffers:
    labels = np.stack([mesh.part, _label(mesh, group_of_part)], axis=1)
    return VertexBuffers(ctx, mesh.positions, mesh.normals, labels, mesh.triangles, _details(mesh))


def _details(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.void]] | None:
    if mesh.uv is None and mesh.colour is None:
        return None
    details = np.zeros(len(mesh.positions), dtype=DETAIL)
    details["uv"] = 0.0 if mesh.uv is None else mesh.uv
    details["tint"] = 1.0 if mesh.colour is None else mesh.colour
    return details
