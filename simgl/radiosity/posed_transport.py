"""How light goes on a body whose joints stand at some values: a ``LightTransport`` like another."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray
from simgl.environment_map import SkyRadiance, cell_radiance, cube_directions
from simgl.radiosity.hemisphere import sky_cell
from simgl.radiosity.light_transport import Between, GatherMatrix, LightTransport
from simgl.radiosity.sky_cells import FINE_ACROSS, balanced, parts_of_cells
from simgl.rays import AnyRayTracer, ray_tracer
from simgl.scene.posed_mesh import PosedMesh


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
        arrays = [self.points, self.normals, self.point_open, self._looks]
        for f in fields(self.between):
            arrays += _arrays(getattr(self.between, f.name))
        for matrix in (self.form_factors, self.sky):
            arrays += _arrays(matrix)
        return sum(a.nbytes for a in arrays)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """(3,) lowest and highest corner of the box around the body at its pose [m]."""
        return self.body.hull.min(axis=0), self.body.hull.max(axis=0)

    @cached_property
    def tracer(self) -> AnyRayTracer:
        """For the light of the Sun and of lamps; its structures are those of all poses."""
        return ray_tracer(self.body)

    @cached_property
    def of_vertices(self) -> GatherMatrix:
        """What its gather points get, and which of them each vertex of the mesh has."""
        return replace(self.separate, between=self.between)

    def cells_of(self, sky: SkyRadiance) -> Array32:
        """(96 g, 4) radiance of the cells of the sky [W m-2 sr-1]."""
        return balanced(cell_radiance(sky, FINE_ACROSS)[self._looks]).reshape(-1, 4)

    @cached_property
    def _looks(self) -> IndexArray:
        """(g, 96, l) parts of cells in body axes at which those of each group's cells look."""
        directions = cube_directions(FINE_ACROSS).reshape(-1, 3)[parts_of_cells()]
        turned = np.einsum("gij,clj->gcli", self.group_turns, directions)
        return sky_cell(turned, FINE_ACROSS)


def _arrays(matrix: sparse.csc_matrix) -> list[Array]:
    return [matrix.data, matrix.indices, matrix.indptr]
