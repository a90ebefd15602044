"""What a bake finds out about a body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

Floats = NDArray[np.float32]
Indices = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Transport:
    """How light goes between the surfaces of one body; nothing of it depends on the light.

    mesh : the body's mesh, finer where light varies
    sides : 2 where surfaces are lit and seen from both sides
    areas : (p,) of the patches [m2]
    region : (p,) of the c regions, the one that a patch is a piece of
    materials : (p, k) share of a patch that each material covers
    points, normals : (p, n, 3) sample points of the patches [m] and the surface's normals there
    point_open : (p, n) whether a sample point is outside all other parts
    form_factors : (p, p) csr, share of the light that leaves patch i and arrives at patch j
    sky : (p, 96) csr, share that leaves to each cell of the sky
    gather : (s, p) csr, share of a site's cosine-weighted hemisphere that a patch covers
    occluded : (s, 96) csr, of the rays to each cell of the sky those that meet the body
    whole : (b, 96) csr, all rays to each cell; ``whole_row`` (s,) says which row is a site's
    site_of_vertex : (sides, v) where each vertex of the mesh gets its light
    """

    mesh: Mesh
    sides: int
    areas: Floats
    region: Indices
    materials: Floats
    points: Floats
    normals: Floats
    point_open: NDArray[np.bool_]
    form_factors: sparse.csr_matrix
    sky: sparse.csr_matrix
    gather: sparse.csr_matrix
    occluded: sparse.csr_matrix
    whole: sparse.csr_matrix
    whole_row: Indices
    site_of_vertex: Indices

    @cached_property
    def region_mean(self) -> sparse.csr_matrix:
        """(c, p) csr, means over the patches of each region."""
        count = int(self.region.max()) + 1
        area = np.maximum(self.areas, 1e-30)
        share = area / np.bincount(self.region, area, minlength=count)[self.region]
        place = self.region, np.arange(len(area))
        return sparse.csr_matrix((share.astype(np.float32), place), shape=(count, len(area)))

    @cached_property
    def between_regions(self) -> sparse.csr_matrix:
        """(c, c) csr, share of the light that leaves region i and arrives at region j."""
        of_patch = np.arange(len(self.region)), self.region
        spread = sparse.csr_matrix((np.ones(len(self.region), dtype=np.float32), of_patch))
        return (self.region_mean @ self.form_factors @ spread).tocsr()

    @cached_property
    def tracer(self) -> RayTracer:
        """For the light of the Sun and of lamps."""
        return RayTracer(self.mesh)
