"""How light goes on a body whose joints stand at some values: a ``LightTransport`` like another."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray
from simgl.environment_map import (
    SkyRadiance,
    cell_radiance,
    cube_directions,
    cube_solid_angles,
)
from simgl.radiosity.hemisphere import CELLS_ACROSS, SKY_CELLS, sky_cell
from simgl.radiosity.light_transport import Between, GatherMatrix, LightTransport
from simgl.rays import AnyRayTracer, ray_tracer
from simgl.scene.posed_mesh import PosedMesh

# Directions across a cell of the sky of a group that is turned.
_LOOKS_ACROSS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class PosedTransport(LightTransport):
    """The transport of a body at a pose.

    Its mesh and what lies with its vertices are as stored; its points, normals and form factors are
    those of the pose. Its cells of the sky are those in the axes of its first group, then of its
    second ...

    key : hash of body and pose
    body : the unrefined mesh, posed
    group_turns : (g, 3, 3) body axes from those of each group
    between : what the groups do to each other's light at the vertices
    separate : the gather matrix of each group by itself
    """

    key: str
    body: PosedMesh
    group_turns: Array
    between: Between
    separate: GatherMatrix

    @property
    def digest(self) -> str:
        """Hash of body and pose, the key of anything worked out from them."""
        return self.key

    @property
    def nbytes(self) -> int:
        """Size of what it does not share with other poses."""
        arrays = [self.points, self.normals, self.point_open, *self._looks]
        for f in fields(self.between):
            arrays += _arrays(getattr(self.between, f.name))
        for matrix in (self.form_factors, self.sky):
            arrays += _arrays(matrix)
        return sum(a.nbytes for a in arrays)

    @cached_property
    def tracer(self) -> AnyRayTracer:
        """For the light of the Sun and of lamps; its structures are those of all poses."""
        return ray_tracer(self.body)

    @cached_property
    def of_vertices(self) -> GatherMatrix:
        """The rows of its gather points for each vertex of the mesh."""
        return replace(self.separate, between=self.between)

    def cells_of(self, sky: SkyRadiance) -> Array32:
        """(96 g, 4) mean radiance of the cells of the sky [W m-2 sr-1]."""
        cell, weight = self._looks
        fine = cell_radiance(sky, CELLS_ACROSS * _LOOKS_ACROSS)
        return np.asarray(np.einsum("cl,gclb->gcb", weight, fine[cell])).reshape(-1, 4)

    @cached_property
    def _looks(self) -> tuple[IndexArray, Array32]:
        """(g, 96, l) finer cells that each cell of a group looks at, and their weights (96, l)."""
        across = CELLS_ACROSS * _LOOKS_ACROSS
        directions = _by_cell(cube_directions(across))
        areas = np.broadcast_to(cube_solid_angles(across), (6, across, across))
        weight = _by_cell(areas[..., None])[..., 0]
        turned = np.einsum("gij,clj->gcli", self.group_turns, directions)
        share = weight / weight.sum(axis=1, keepdims=True)
        return sky_cell(turned, across), share.astype(np.float32)


def _by_cell(values: Array) -> Array:
    """(96, l, k) from (6, n, n, k): what lies in each cell of the sky."""
    a, b = CELLS_ACROSS, _LOOKS_ACROSS
    blocks = values.reshape(6, a, b, a, b, -1).transpose(0, 1, 3, 2, 4, 5)
    return blocks.reshape(SKY_CELLS, b * b, -1)


def _arrays(matrix: sparse.csr_matrix) -> list[Array]:
    return [matrix.data, matrix.indices, matrix.indptr]
