"""What a bake finds out about a body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from scipy import sparse

from simgl.arrays import Array32, IndexArray, Mask
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh


@dataclass(frozen=True, kw_only=True, eq=False)
class LightTransport:
    """How light goes between the surfaces of one body; nothing of it depends on the light.

    mesh : the body's mesh, finer where light varies
    sides : 2 where surfaces are lit and seen from both sides
    areas : (p,) of the patches [m2]
    patch_of_side : (m * sides,) patch of each triangle's front, then of each one's back
    materials : (p, k) share of a patch that each material covers
    points, normals : (p, n, 3) sample points of the patches [m] and the surface's normals there
    point_open : (p, n) whether a sample point is outside all other parts
    form_factors : (p, p) csr, share of the light that leaves patch i and arrives at patch j
    sky : (p, 96) csr, share that leaves to each cell of the sky
    gather : (s, p) csr, share of a site's cosine-weighted hemisphere that a patch covers
    sky_part : (s, 96) csr, of the rays to each cell of the sky those that meet the body or those
        that do not, whichever fill fewer cells; ``sky_part_seen`` (s,) where it is the latter
    whole : (b, 96) csr, all rays to each cell; ``whole_row`` (s,) says which row is a site's
    site_of_vertex : (sides, v) where each vertex of the mesh gets its light
    """

    mesh: Mesh
    sides: int
    areas: Array32
    patch_of_side: IndexArray
    materials: Array32
    points: Array32
    normals: Array32
    point_open: Mask
    form_factors: sparse.csr_matrix
    sky: sparse.csr_matrix
    gather: sparse.csr_matrix
    sky_part: sparse.csr_matrix
    sky_part_seen: Mask
    whole: sparse.csr_matrix
    whole_row: IndexArray
    site_of_vertex: IndexArray

    @cached_property
    def tracer(self) -> RayTracer:
        """For the light of the Sun and of lamps."""
        return RayTracer(self.mesh)
