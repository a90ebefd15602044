"""Bake: trace how the surfaces of one body see each other and the sky."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.progress import ProgressCallback, silent
from simgl.radiosity.gather_points import (
    BURIED,
    GAP,
    LIFT,
    GatherPoints,
    GatherRays,
    Places,
    cast,
    counts,
    face_normals,
    gather_points_of,
    middle_and_radius,
    nearest_open,
    places_of,
)
from simgl.radiosity.hemisphere import CELLS_ACROSS, cosine_directions, frames, sky_cell, spins
from simgl.radiosity.interpolation import sharpened, sun_sharpened
from simgl.radiosity.light_grids import light_grids
from simgl.radiosity.light_transport import LightTransport, by_columns
from simgl.radiosity.near_means import near_means
from simgl.radiosity.occlusion import moved_into_open
from simgl.radiosity.patch_cells import CellIndex, SeenCells, cell_index, patch_cells
from simgl.radiosity.patches import SAMPLES, Patches, cluster
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.shared_points import GATHER_POINTS
from simgl.radiosity.sun_gather import cells_seen
from simgl.rays import RayTracer
from simgl.scene.convex_hull import convex_hull
from simgl.scene.mesh import Mesh


@dataclass(frozen=True, kw_only=True)
class BakeSettings:
    """Fineness of a bake.

    patches : about as many, which lights shine on, and which vertices and each other look at
    patch_rays : cosine-weighted rays of a patch, a multiple of its sample points
    gather_rays : the same of a vertex
    sun_rays : and for the light of the Sun, which is gathered once for many frames; where they are
        more, those before are among them
    added_triangles : about as many more, where surfaces are near to each other
    cells : of each patch, for what is near it (simgl/radiosity/patch_cells.py)
    grids : triangles with finer light (simgl/radiosity/light_grids.py)
    grid_rays : of each node of those
    edge_share : edges shorter than this share of the body's radius stay
    """

    patches: int = 8000
    patch_rays: int = 96
    gather_rays: int = 256
    sun_rays: int = 768
    added_triangles: int = 6_000
    cells: int = 64
    grids: int = 8_000
    grid_rays: int = 128
    edge_share: float = 1.0 / 60.0


def sees_itself(mesh: Mesh, sides: int) -> bool:
    """Whether any surface of a body may face another one: not for convex and for flat bodies.

    A closed surface is convex where it has the area and the volume of its hull.
    """
    points = mesh.positions.astype(np.float64)
    hull = convex_hull(points)
    if hull is None:
        return False
    if sides == 2:
        return True
    a, b, c = np.moveaxis(points[mesh.triangles], 1, 0)
    volume = (
        float(
            np.einsum(
                "ij,ij->",
                a - mesh.centre,
                np.cross(b, c) - np.cross(mesh.centre, c) - np.cross(b, mesh.centre),
            )
        )
        / 6.0
    )
    area = float(face_normals(mesh)[1].sum())
    # float32 positions are good to 1e-7 of the size; both sums keep a hundred times more.
    return not (abs(volume / hull.volume - 1.0) < 1e-5 and abs(area / hull.area - 1.0) < 1e-5)


def bake(
    mesh: Mesh,
    *,
    open_sheets: bool,
    settings: BakeSettings = BakeSettings(),
    progress: ProgressCallback | None = None,
) -> LightTransport | None:
    """The transport of a body; None where no surface of it sees another.

    Deterministic: the same mesh and settings give the same bits.
    """
    sides = 2 if open_sheets else 1
    if not sees_itself(mesh, sides):
        return None
    return traced(mesh, sides=sides, settings=settings, progress=progress)


def traced(
    mesh: Mesh,
    *,
    sides: int,
    settings: BakeSettings,
    progress: ProgressCallback | None = None,
) -> LightTransport:
    """The transport of any body."""
    report = silent if progress is None else progress
    fine = refined(mesh, sides, settings)
    # Places and patches follow from what single rays meet; all others only count together.
    watertight, tracer = RayTracer(fine), RayTracer(fine, watertight=False)
    points = gather_points_of(fine, sides, limit=GATHER_POINTS)
    if sides == 1:
        points = moved_into_open(fine, watertight, points)
    number = len(points.origins)
    total = 4 * number
    report(0, total)
    seen = cast(
        fine, watertight, points, sides, settings.gather_rays, lambda done: report(done, total)
    )
    patches = cluster(fine, sides, _exposure(fine, points, seen), settings.patches)
    chosen = largest(fine, points, seen, settings)
    index = cell_index(fine, patches.of_side, settings.cells)
    by_sun, _ = cells_seen(
        fine,
        tracer,
        points,
        chosen,
        sides,
        index,
        max(settings.sun_rays - settings.gather_rays, 0),
        False,
        lambda done: report(number + 2 * done, total),
    )
    used, of_vertex = _points_of_vertices(fine, points, seen.buried)
    transport = _assembled(
        fine,
        sides,
        (used, of_vertex),
        seen,
        patches,
        (chosen, by_sun.of_patches(index)),
        patch_form_factors(fine, tracer, sides, patches, settings.patch_rays),
        settings,
    )
    transport = _with_finer_sunlight(
        transport,
        tracer,
        index,
        by_sun.of_rows(used),
        seen.nearness[used],
        places_of(points, used, seen.open, sides),
        settings,
        lambda done, count: report(3 * number + number * done // count, total),
    )
    report(total, total)
    return transport


def _exposure(mesh: Mesh, points: GatherPoints, seen: GatherRays) -> Array:
    """(m * sides,) share of the directions above each triangle's side in which it sees the body."""
    of_points = np.where(seen.buried, 0.0, seen.hit_share)
    corners = mesh.triangles.astype(np.int64)
    sides = [of_points[of_vertex[corners]].mean(axis=1) for of_vertex in points.of_vertex]
    exposure = np.concatenate(sides)
    return exposure if exposure.any() else np.ones_like(exposure)


def _with_finer_sunlight(
    transport: LightTransport,
    tracer: RayTracer,
    index: CellIndex,
    at_points: SeenCells,
    nearness: Array32,
    at_vertices: Places,
    settings: BakeSettings,
    report: ProgressCallback,
) -> LightTransport:
    """The transport with cells and grids, and values between which light has its rays' means.

    at_points, nearness, at_vertices : of the gather points of vertices, what they see of cells, as
        of ``mean_nearness``, and where their rays start
    """
    grids, at_nodes, of_nodes = light_grids(
        transport, tracer, index, settings.grids, settings.grid_rays, report
    )
    cells = patch_cells(transport.mesh, index, at_points, at_nodes)
    starts = [at_vertices]
    if at_nodes is not None and of_nodes is not None:
        nearness = np.concatenate([nearness, at_nodes.nearness])
        starts.append(of_nodes)
    places = np.concatenate([each.where_open(transport.mesh) for each in starts])
    middle, radius = middle_and_radius(places)
    transport = replace(
        transport,
        cells=cells,
        grids=grids,
        start_places=middle.astype(np.float32),
        start_radii=radius.astype(np.float32),
        start_normals=np.concatenate([each.normals for each in starts]).astype(np.float32),
    )
    return replace(
        transport,
        means=near_means(transport, nearness),
        sharpened=sharpened(transport, at_vertices),
        sun_sharpened=sun_sharpened(transport, at_vertices, of_nodes),
    )


def refined(mesh: Mesh, sides: int, settings: BakeSettings) -> Mesh:
    """Smaller triangles where other surfaces are near.

    Irradiance from surfaces changes over their harmonic mean distance (Ward et al. 1988): edges are
    as long as a multiple of it, one for all triangles that makes about ``added_triangles``.
    """
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    shortest = settings.edge_share * mesh.radius
    faces, areas = face_normals(mesh)
    big = np.flatnonzero((longest > shortest) & (areas > 0.0))
    distance = 1.0 / np.maximum(_nearness(mesh, faces, big, sides, shortest), 1e-9)

    def added(multiple: float) -> float:
        edge = np.maximum(multiple * distance, shortest)
        # A halved triangle's edges are two thirds of the longest allowed, on average.
        return float(np.sum(areas[big] / (0.19 * edge**2) * (longest[big] > edge)))

    low, high = 0.05, 100.0
    for _ in range(30):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if added(middle) > settings.added_triangles else (low, middle)
    wanted = np.full(len(longest), np.inf)
    wanted[big] = np.maximum(high * distance, shortest)
    return subdivided(mesh, wanted)


def _nearness(mesh: Mesh, faces: Array, chosen: IndexArray, sides: int, shortest: float) -> Array:
    """(k,) mean of 1 / distance [m-1] over the directions above the chosen triangles."""
    tracer = RayTracer(mesh)
    corners = mesh.positions[mesh.triangles[chosen]].astype(np.float64)
    pattern = cosine_directions(_LOOKS)
    nearness = np.zeros(len(chosen))
    for weights in _SPREAD:
        for side in (1.0, -1.0)[:sides]:
            n = side * faces[chosen]
            origin = np.einsum("k,ikj->ij", weights, corners) + LIFT * mesh.radius * n
            rays = np.matmul(pattern[None], np.swapaxes(frames(n), 1, 2)).reshape(-1, 3)
            triangle, distance = tracer.hits(np.repeat(origin, _LOOKS, axis=0), rays)
            met = triangle >= 0
            behind = met & (np.einsum("ij,ij->i", faces[triangle], rays) > 0.0) & (sides == 1)
            outside = behind.reshape(-1, _LOOKS).mean(axis=1) <= BURIED
            # Across a narrow gap little light comes in, and little is seen of it.
            counts_for = distance / (distance + GAP * mesh.radius)
            near = np.where(met, counts_for / np.maximum(distance, shortest), 0.0)
            nearness += near.reshape(-1, _LOOKS).mean(axis=1) * outside
    return nearness / (len(_SPREAD) * sides)


# Rays of one look around.
_LOOKS = 32
# Barycentric places at which a big triangle looks around.
_SPREAD = np.array(
    [
        [1 / 3, 1 / 3, 1 / 3],
        [0.9, 0.05, 0.05],
        [0.05, 0.9, 0.05],
        [0.05, 0.05, 0.9],
        [0.48, 0.48, 0.04],
        [0.04, 0.48, 0.48],
        [0.48, 0.04, 0.48],
    ]
)


def patch_directions(normals: Array, rays: int) -> Array:
    """(p, SAMPLES, rays / SAMPLES, 3) unit directions of the rays from patches' sample points.

    normals : (p, SAMPLES, 3) there; rays : of each patch
    """
    count = len(normals)
    # Ray i starts at sample i modulo their number: each sample has its own part of the sunflower.
    pattern = cosine_directions(rays).reshape(-1, SAMPLES, 3).swapaxes(0, 1)
    turn = frames(normals.reshape(-1, 3)).reshape(count, SAMPLES, 3, 3)
    # Another turn about the normal for each patch: what few rays miss evens out over a wall.
    turn = turn @ spins(count)[:, None]
    return np.matmul(pattern, np.swapaxes(turn, 2, 3))


def patch_form_factors(
    mesh: Mesh,
    tracer: RayTracer,
    sides: int,
    patches: Patches,
    rays: int,
    cells_across: int = CELLS_ACROSS,
) -> tuple[sparse.csr_matrix, sparse.csr_matrix, Mask]:
    """Form factors of patches, their view of the sky, and which sample points are outside.

    rays : of each patch, a multiple of its sample points
    cells_across : of the sky's cells on each face of a cube
    returns : (p, p), (p, 6 cells_across^2) shares of cosine-weighted directions, (p, SAMPLES)
    """
    count = len(patches.areas)
    faces, _ = face_normals(mesh)
    directions = patch_directions(patches.normals, rays)
    each = directions.shape[2]
    origins = np.repeat(patches.points.reshape(-1, 3), each, axis=0)
    flat = directions.reshape(-1, 3)
    triangle, _ = tracer.hits(origins, flat)
    met = triangle >= 0
    target = np.maximum(triangle, 0).astype(np.int64)
    behind = met & (np.einsum("ij,ij->i", faces[target], flat) > 0.0)
    if sides == 1:
        inside = behind.reshape(count, SAMPLES, each).mean(axis=2) > BURIED
        valid = ~behind & ~np.repeat(inside.ravel(), each)
    else:
        inside = np.zeros((count, SAMPLES), dtype=np.bool_)
        valid = np.ones(len(flat), dtype=np.bool_)
        target = target + len(mesh.triangles) * behind
    patch = np.repeat(np.arange(count), SAMPLES * each)
    used = np.bincount(patch[valid], minlength=count)
    scale = sparse.diags_array(1.0 / np.maximum(used, 1), dtype=np.float64)
    to_body, to_sky = valid & met, valid & ~met
    factors = counts(patch[to_body], patches.of_side[target[to_body]], (count, count))
    cell = sky_cell(flat[to_sky], cells_across)
    sky = counts(patch[to_sky], cell, (count, 6 * cells_across**2))
    return (
        (scale @ factors).tocsr().astype(np.float32),
        (scale @ sky).tocsr().astype(np.float32),
        ~inside,
    )


def _points_of_vertices(
    mesh: Mesh, points: GatherPoints, buried: Mask
) -> tuple[IndexArray, IndexArray]:
    """The gather points that give vertices light, and which of them (sides, v) each vertex has."""
    instead = nearest_open(mesh, points, buried)
    used, of_vertex = np.unique(instead[points.of_vertex], return_inverse=True)
    return used, of_vertex.reshape(points.of_vertex.shape)


def _assembled(
    mesh: Mesh,
    sides: int,
    points: tuple[IndexArray, IndexArray],
    seen: GatherRays,
    patches: Patches,
    more: tuple[Mask, sparse.csr_matrix],
    patch_rays: tuple[sparse.csr_matrix, sparse.csr_matrix, Mask],
    settings: BakeSettings,
) -> LightTransport:
    factors, sky, point_open = patch_rays
    used, of_vertex = points
    to_patch = counts(
        np.arange(len(patches.of_side)), patches.of_side, (len(patches.of_side), len(patches.areas))
    )
    gather = (seen.hits @ to_patch).tocsr()
    gather.data /= settings.gather_rays
    sun_gather = _together(gather, *more, settings)
    gather = gather[used]
    rows, sky_rays_row = np.unique(seen.sky_rays_row[used], return_inverse=True)
    sky_part, sky_part_seen = lesser_part(
        seen.occluded[used].tocsr(), sparse.csr_matrix(seen.sky_rays)[seen.sky_rays_row[used]]
    )
    return LightTransport(
        mesh=mesh,
        sides=sides,
        areas=patches.areas.astype(np.float32),
        patch_of_side=patches.of_side,
        materials=patches.materials.astype(np.float32),
        points=patches.points.astype(np.float32),
        normals=patches.normals.astype(np.float32),
        point_open=point_open,
        form_factors=by_columns(factors),
        sky=by_columns(sky),
        gather=by_columns(gather.astype(np.float32)),
        sun_gather=by_columns(sun_gather[used]),
        sky_part=by_columns(sky_part),
        sky_part_seen=sky_part_seen,
        sky_rays=by_columns(seen.sky_rays[rows]),
        sky_rays_row=sky_rays_row.ravel(),
        gather_point_of_vertex=of_vertex,
    )


def _together(
    gather: sparse.csr_matrix, chosen: Mask, more: sparse.csr_matrix, settings: BakeSettings
) -> sparse.csr_matrix:
    """The form factors of gather points, some of which have more rays: all rays count alike."""
    share = settings.gather_rays / max(settings.sun_rays, settings.gather_rays)
    old = sparse.diags_array(np.where(chosen, share, 1.0).astype(np.float32))
    return (old @ gather + np.float32(1.0 - share) * more).tocsr().astype(np.float32)


# Of all light that gather points may get, what most of them by number get together.
_LITTLE = 0.02


def largest(mesh: Mesh, points: GatherPoints, seen: GatherRays, settings: BakeSettings) -> Mask:
    """(s,) the gather points that get all but a little of what light surfaces may send, by their
    area and by how much of the body they see; none where more rays are not asked for."""
    if settings.sun_rays <= settings.gather_rays:
        return np.zeros(len(points.origins), dtype=np.bool_)
    areas = np.repeat(face_normals(mesh)[1] / 3.0, 3)
    light = np.zeros(len(points.origins))
    for of_vertex in points.of_vertex:
        corners = of_vertex[mesh.triangles.astype(np.int64)].ravel()
        light += np.bincount(corners, areas, minlength=len(light))
    light *= np.where(seen.buried, 0.0, np.asarray(seen.hits.sum(axis=1)).ravel())
    order = np.argsort(light, kind="stable")
    much = np.cumsum(light[order]) > _LITTLE * light.sum()
    chosen = np.zeros(len(light), dtype=np.bool_)
    chosen[order] = much
    return chosen


def lesser_part(
    occluded: sparse.csr_matrix, rays: sparse.csr_matrix
) -> tuple[sparse.csr_matrix, Mask]:
    """Of each row what is occluded or what is left of all rays, and whether it is the latter."""
    left = (rays - occluded).tocsr()
    left.data[np.abs(left.data) < 1e-4] = 0.0  # what rounding leaves of whole rays
    left.eliminate_zeros()
    fewer = np.diff(left.indptr) < np.diff(occluded.indptr)
    pick, other = (sparse.diags_array(v.astype(np.float32)) for v in (fewer, ~fewer))
    part = (pick @ left + other @ occluded).tocsr().astype(np.float32)
    part.eliminate_zeros()
    return part, fewer
