"""A spacecraft as others near it see it: where it gathers light, and where it sends it from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.gather_points import LIFT, face_normals, unit_rows
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.occlusion import inside_others
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.reflection_laws import ReflectionLaws
from simgl.radiosity.transport_store import lit_mesh
from simgl.rays import AnyRayTracer, RayTracer, ray_tracer
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel


@dataclass(frozen=True, kw_only=True, eq=False)
class NearBody:
    """A spacecraft with its transport, as others near it see it, in its own axes.

    laws : of its materials
    standing : (s,) of ``standing_rows``
    """

    model: SpacecraftModel
    transport: LightTransport
    laws: ReflectionLaws
    standing: IndexArray

    @property
    def key(self) -> tuple[str, str, str]:
        """Equal for equal bodies at equal poses."""
        return self.transport.digest, self.model.posed_mesh.digest, self.model.surface_digest

    @cached_property
    def places(self) -> tuple[Array32, Array32, IndexArray]:
        """(s, 3) places that gather light and their normals, and which one each row of vertex and
        side takes (r,)."""
        mesh = lit_mesh(self.model, self.transport)
        place, normal = (
            rows[self.standing] for rows in _lifted(mesh.baked(), self.transport.sides)
        )
        of_row = self.transport.vertex_rows
        return place, normal, np.unique(of_row, return_inverse=True)[1].ravel()

    @cached_property
    def samples(self) -> tuple[Array32, Array32, Array, IndexArray]:
        """(n, 3) sample points of its patches that are outside other parts and the normals there,
        their parts of the area [m2] and their numbers among all (n,)."""
        transport = self.transport
        number = np.flatnonzero(transport.point_open)
        area = (transport.areas / SAMPLES)[number // SAMPLES].astype(np.float64)
        points, normals = (a.reshape(-1, 3) for a in (transport.points, transport.normals))
        return points[number], normals[number], area, number

    def patches_met(self, origins: Array32, ways: Array32) -> IndexArray:
        """(n,) the patch that each ray (n, 3) meets first; -1 for none, and from within."""
        patch = np.full(len(origins), -1)
        if not self.transport.form_factors.nnz or len(origins) == 0:
            return patch
        tracer, faces = self._surface
        triangle, _ = tracer.hits(origins, ways)
        met = np.flatnonzero(triangle >= 0)
        side = triangle[met].astype(np.int64)
        back = np.einsum("ij,ij->i", faces[side], ways[met]) > 0.0
        if self.transport.sides == 1:
            met, side = met[~back], side[~back]
        else:
            side += len(faces) * back
        patch[met] = self.transport.patch_of_side[side]
        return patch

    @cached_property
    def _surface(self) -> tuple[AnyRayTracer, Array32]:
        """The triangles of its patches, for rays, and their normals (m, 3)."""
        mesh = lit_mesh(self.model, self.transport)
        return ray_tracer(mesh), face_normals(mesh.baked())[0].astype(np.float32)


def standing_rows(transport: LightTransport) -> IndexArray:
    """(s,) for each gather point the row of a vertex and side that stands for it.

    Vertices of one gather point lie side by side; those inside other parts do not stand for it
    where another one does. Where joints move parts, they stay as they are.
    """
    place, normal = _lifted(transport.mesh, transport.sides)
    hidden = np.zeros(len(place), dtype=np.bool_)
    if transport.sides == 1 and transport.form_factors.nnz:
        mesh, tracer = transport.mesh, RayTracer(transport.mesh)
        hidden = inside_others(mesh, tracer, place.astype(np.float64), normal.astype(np.float64))
    # Rows of a vertex lie beside each other; places, side after side.
    of_place = transport.gather_point_of_vertex.ravel()
    order = np.lexsort((hidden, of_place))
    return order[np.unique(of_place[order], return_index=True)[1]]


def _lifted(mesh: Mesh, sides: int) -> tuple[Array32, Array32]:
    """(sides * v, 3) the vertices of a mesh, just above each of its sides, and normals there."""
    lift = np.float32(LIFT * mesh.radius)
    outwards = unit_rows(mesh.normals.astype(np.float64)).astype(np.float32)
    normal = np.concatenate([np.float32(side) * outwards for side in (1.0, -1.0)[:sides]])
    return np.concatenate([mesh.positions] * sides) + lift * normal, normal
