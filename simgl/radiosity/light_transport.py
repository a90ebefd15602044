"""How light goes between the surfaces of one body and from the sky: what a bake finds out."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.environment_map import SkyRadiance
from simgl.radiosity.sky_cells import sky_cells
from simgl.rays import AnyRayTracer, RayTracer
from simgl.scene.mesh import Mesh

# Of Embree, for a triangle.
_TRACER_BYTES = 190


def by_columns(matrix: sparse.spmatrix) -> sparse.csc_matrix:
    """The same matrix as frames multiply it with a few columns, such as four bands.

    By columns each entry adds to another row; by rows each waits for the sum before it, which takes
    1.7 times as long.
    """
    columns = sparse.csc_matrix(matrix)
    columns.sort_indices()
    return columns


def matrix_nbytes(matrix: sparse.csr_matrix | sparse.csc_matrix) -> int:
    """Size of its arrays."""
    return int(matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes)


@dataclass(frozen=True, kw_only=True, eq=False)
class Between:
    """What the rigid groups of a body do to each other's light at the vertices.

    spread : (r, p) csc, mean of the patches about each vertex, on each of its sides
    light : (p, p) csc, the share of a patch's hemisphere that each patch covers with the other
        groups there, less that with its own group alone
    sky_lost : (p, c) csc, the share of it that other groups take from each cell of the sky
    sky_rays : (p, c) csc, the share of it that each cell of the sky covers, were it free
    """

    spread: sparse.csc_matrix
    light: sparse.csc_matrix
    sky_lost: sparse.csc_matrix
    sky_rays: sparse.csc_matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class GatherMatrix:
    """What each vertex gets, on each of its sides, from patches and sky; r rows in all.

    shape : (vertices, sides), whose product is r
    rows : (r,) the gather point of each
    gather : (s, p) csc, of the gather points
    sky_part : (s, c) csc, and whether it is what is seen, ``sky_part_seen`` (s,)
    sky_rays, sky_rays_row : all of the sky, and its row for each gather point
    between : where all this is of each rigid group by itself, what the others do to it
    sharpened : (s, s) csc, as of ``LightTransport``
    """

    shape: tuple[int, int]
    rows: IndexArray
    gather: sparse.csc_matrix
    sky_part: sparse.csc_matrix
    sky_part_seen: Mask
    sky_rays: sparse.csc_matrix
    sky_rays_row: IndexArray
    between: Between | None = None
    sharpened: sparse.csc_matrix | None = None

    def at_points(self, light: Array32) -> Array32:
        """(s, ...) values at gather points, of what their rays found (s, ...)."""
        return light if self.sharpened is None else self.sharpened @ light

    @cached_property
    def open_sky(self) -> tuple[sparse.csc_matrix, Array32]:
        """(s, c) csc and (s,) whose product with the sky, over that of all rays, and whose sum are
        the share of it that is seen: ``sky_part``, taken from one where it is what is not seen."""
        sign = np.where(self.sky_part_seen, np.float32(1.0), np.float32(-1.0))
        part = self.sky_part
        entries = part.data * sign[part.indices], part.indices, part.indptr
        seen = sparse.csc_matrix(entries, shape=part.shape)
        return seen, (~self.sky_part_seen).astype(np.float32)

    @cached_property
    def all_sky(self) -> Array32:
        """(b, c) ``sky_rays``, which are most cells of half a sky."""
        return self.sky_rays.toarray()


@dataclass(frozen=True, kw_only=True, eq=False)
class PatchCells:
    """Cells of patches, as gather points near them see them (simgl/radiosity/patch_cells.py).

    patch : (c,) of each cell
    points, normals : (c, 3) a place on each, just above the surface [m], and the normal there
    gather : (c, s + g) csr, share of the cosine-weighted hemisphere that a cell covers, of each
        gather point of vertices and then of grids
    """

    patch: IndexArray
    points: Array32
    normals: Array32
    gather: sparse.csr_matrix

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        arrays = self.patch, self.points, self.normals
        return sum(array.nbytes for array in arrays) + matrix_nbytes(self.gather)


@dataclass(frozen=True, kw_only=True, eq=False)
class LightGrids:
    """Finer light on some triangles (simgl/radiosity/light_grids.py).

    triangles : (t,) of the mesh
    gather : (g, p) csc, as ``sun_gather``, of the grids' gather points
    point_of_node : (t, nodes, sides) the gather point of each node; -1 where what is linear between
        the vertices holds
    row_of_node : (t, nodes, sides) of the table of what nodes get more than that, which triangles
        share along their edges; row 0 holds nothing
    """

    triangles: IndexArray
    gather: sparse.csc_matrix
    point_of_node: IndexArray
    row_of_node: IndexArray

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        arrays = self.triangles, self.point_of_node, self.row_of_node
        return sum(array.nbytes for array in arrays) + matrix_nbytes(self.gather)

    @cached_property
    def rows(self) -> int:
        """Of the table."""
        return int(self.row_of_node.max()) + 1


@dataclass(frozen=True, kw_only=True, eq=False)
class SamplePoints:
    """Sample points of all patches, coordinate by coordinate: numpy works along rows of thousands.

    patch : (n,) of each
    places, normals : (3, n) [m]
    plane : (n,) of the plane at each, along its normal from the origin [m]
    open : (n,) whether it is outside all other parts
    count : (p,) of those on each patch, 1 at least
    """

    patch: IndexArray
    places: Array32
    normals: Array32
    plane: Array32
    open: Mask
    count: IndexArray


def _no_vectors() -> Array32:
    return np.zeros((0, 3), dtype=np.float32)


def _none() -> Array32:
    return np.zeros(0, dtype=np.float32)


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
    form_factors : (p, p) csc, share of the light that leaves patch i and arrives at patch j
    sky : (p, 96) csc, share that leaves to each cell of the sky
    gather : (s, p) csc, share of a gather point's cosine-weighted hemisphere that a patch covers
    sun_gather : (s, p) csc, the same by more rays, for light that is gathered once for many frames
    sky_part : (s, 96) csc, of the rays to each cell of the sky those that meet the body or those
        that do not, whichever fill fewer cells; ``sky_part_seen`` (s,) where it is the latter
    sky_rays : (b, 96) csc, all rays to each cell; ``sky_rays_row`` (s,) is a gather point's row
    gather_point_of_vertex : (sides, v) where each vertex of the mesh gets its light
    cells : parts of patches as gather points near them see them; None where patches are even
    grids : finer light on some triangles; None where light is linear between the vertices
    means : (s + g, s + g) csc, means over gather points near each other, of vertices and then of
        grids (simgl/radiosity/near_means.py); None where what each gathers stays
    sharpened : (s, s) csc, values of gather points between which light has the means that their
        rays found (simgl/radiosity/interpolation.py); None where these means are the values
    sun_sharpened : (s + g, s + g) csc, the same with grids
    start_places, start_normals : (s + g, 3) where the rays of gather points start, in the mean [m],
        and unit normals there; none where sunlight is not gathered in advance
    start_radii : (s + g,) of these starts about their mean [m]
    """

    mesh: Mesh
    sides: int
    areas: Array32
    patch_of_side: IndexArray
    materials: Array32
    points: Array32
    normals: Array32
    point_open: Mask
    form_factors: sparse.csc_matrix
    sky: sparse.csc_matrix
    gather: sparse.csc_matrix
    sun_gather: sparse.csc_matrix
    sky_part: sparse.csc_matrix
    sky_part_seen: Mask
    sky_rays: sparse.csc_matrix
    sky_rays_row: IndexArray
    gather_point_of_vertex: IndexArray
    cells: PatchCells | None = None
    grids: LightGrids | None = None
    means: sparse.csc_matrix | None = None
    sharpened: sparse.csc_matrix | None = None
    sun_sharpened: sparse.csc_matrix | None = None
    start_places: Array32 = field(default_factory=_no_vectors)
    start_normals: Array32 = field(default_factory=_no_vectors)
    start_radii: Array32 = field(default_factory=_none)

    @property
    def digest(self) -> str:
        """Hash of what was traced, the key of anything worked out from it."""
        return self.mesh.digest

    def cells_of(self, sky: SkyRadiance) -> Array32:
        """(96, 4) radiance of the cells of the sky [W m-2 sr-1]."""
        return sky_cells(sky)

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        total = self.mesh.nbytes + _TRACER_BYTES * len(self.mesh.triangles)
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, np.ndarray):
                total += value.nbytes
            elif isinstance(value, sparse.csc_matrix):
                total += matrix_nbytes(value)
            elif isinstance(value, PatchCells | LightGrids):
                total += value.nbytes
        return total

    @cached_property
    def patch_spheres(self) -> tuple[Array32, Array32]:
        """(p, 3) and (p,): spheres that hold the sample points of each patch [m]."""
        low, high = self.points.min(axis=1), self.points.max(axis=1)
        # What float32 may leave outside is far below a millimetre.
        return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1) + np.float32(1e-3)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """(3,) lowest and highest corner of the box around the body [m]."""
        places = self.mesh.positions
        return places.min(axis=0).astype(np.float64), places.max(axis=0).astype(np.float64)

    @cached_property
    def sample_points(self) -> SamplePoints:
        """All of them, for the light of lamps."""
        places, normals = (
            np.ascontiguousarray(vectors.reshape(-1, 3).T)
            for vectors in (self.points, self.normals)
        )
        seen = self.point_open
        return SamplePoints(
            patch=np.repeat(np.arange(len(seen)), seen.shape[1]),
            places=places,
            normals=normals,
            plane=np.einsum("in,in->n", normals, places),
            open=seen.ravel(),
            count=np.maximum(seen.sum(axis=1), 1),
        )

    @cached_property
    def tracer(self) -> AnyRayTracer:
        """For the light of the Sun and of lamps."""
        return RayTracer(self.mesh)

    @cached_property
    def vertex_rows(self) -> IndexArray:
        """(v * sides,) the gather point of each vertex, on each of its sides."""
        return self.gather_point_of_vertex.T.ravel()

    @cached_property
    def of_vertices(self) -> GatherMatrix:
        """What its gather points get, and which of them each vertex of the mesh has."""
        point = self.gather_point_of_vertex
        return GatherMatrix(
            shape=(point.shape[1], point.shape[0]),
            rows=self.vertex_rows,
            gather=self.gather,
            sharpened=self.sharpened,
            sky_part=self.sky_part,
            sky_part_seen=self.sky_part_seen,
            sky_rays=self.sky_rays,
            sky_rays_row=self.sky_rays_row,
        )
