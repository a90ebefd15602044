"""Spacecraft meshes on the GPU, uploaded once and shared by the passes that draw them."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.geometry import Geometry
from simgl.scene.mesh import Mesh


class MeshStore:
    """Geometries by the content of their mesh."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._geometries: dict[str, Geometry] = {}

    def geometry(self, mesh: Mesh) -> Geometry:
        """The uploaded mesh."""
        if mesh.digest not in self._geometries:
            labels = np.stack([mesh.part, mesh.material], axis=1)
            self._geometries[mesh.digest] = Geometry(
                self._ctx, mesh.positions, mesh.normals, labels, mesh.triangles
            )
        return self._geometries[mesh.digest]

    def release(self) -> None:
        """Free all of them."""
        for geometry in self._geometries.values():
            geometry.release()
        self._geometries.clear()
