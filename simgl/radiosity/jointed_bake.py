"""Bake of a body whose joints move: each rigid group is traced by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.motion.joints import Joint
from simgl.progress import ProgressCallback, silent
from simgl.radiosity.bake import BakeSettings, lesser_part, patch_directions, refined
from simgl.radiosity.gather_points import (
    BURIED,
    GatherPoints,
    GatherRays,
    cast,
    counts,
    face_normals,
    gather_points_of,
    nearest_open,
)
from simgl.radiosity.hemisphere import SKY_CELLS, sky_cell
from simgl.radiosity.jointed_transport import JointedTransport, shares
from simgl.radiosity.light_transport import LightTransport, by_columns
from simgl.radiosity.occlusion import moved_into_open
from simgl.radiosity.patches import SAMPLES, Patches, cluster
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.rigid_pairs import ENDLESS, NOWHERE
from simgl.radiosity.shared_points import GATHER_POINTS
from simgl.rays import RayTracer, group_tracers
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import RigidGroup, rigid_groups

# Of the body's radius: what is far from all others as stored may come near to them.
_LONGEST_EDGE = 1.0 / 8.0
# Share of its directions that any surface may turn to others in another pose than the stored one.
_EXPOSURE = 0.02
# Rays of a vertex that tell how much of its group and of all others it sees.
_LOOKS = 32


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """A rigid group as a body of its own, its axes moved to its middle.

    vertices : (v,) of the whole mesh
    """

    rigid: RigidGroup
    mesh: Mesh
    vertices: IndexArray
    points: GatherPoints
    seen: GatherRays


def bake_jointed(
    mesh: Mesh,
    joints: tuple[Joint, ...],
    *,
    open_sheets: bool,
    settings: BakeSettings = BakeSettings(),
    progress: ProgressCallback | None = None,
) -> JointedTransport:
    """The transport of a body with joints, whatever their values.

    mesh : as stored

    Deterministic: the same mesh, joints and settings give the same bits. Triangles and patches are
    as fine as the stored pose needs them.
    """
    report = silent if progress is None else progress
    sides = 2 if open_sheets else 1
    fine = subdivided(refined(mesh, sides, settings), _LONGEST_EDGE * mesh.radius)
    total = len(fine.positions) * sides
    groups: list[_Group] = []
    for rigid in rigid_groups(fine, joints):
        done = sum(len(group.points.origins) for group in groups)

        def tick(of_group: int, done: int = done) -> None:
            report(min(done + of_group, total), total)

        groups.append(_traced(fine, rigid, sides, settings, tick))
    patches = cluster(fine, sides, _exposure(fine, sides, groups), settings.patches)
    reach, target, point_open = _patch_rays(fine, joints, sides, patches, settings.patch_rays)
    report(total, total)
    factors, sky, _ = shares(target, len(patches.areas), len(groups) * SKY_CELLS)
    return JointedTransport(
        separate=_separate(fine, sides, groups, patches, (factors, sky, point_open), settings),
        joints=joints,
        group_of_patch=_group_of_patch(fine, joints, sides, patches),
        reach=reach,
        target=target,
        spread=_spread(fine, sides, groups, patches),
    )


def _traced(
    fine: Mesh, rigid: RigidGroup, sides: int, settings: BakeSettings, tick: Callable[[int], None]
) -> _Group:
    mesh, vertices = _by_itself(fine, rigid)
    tracer = RayTracer(mesh)
    limit = GATHER_POINTS * len(mesh.triangles) // len(fine.triangles)
    points = gather_points_of(mesh, sides, limit=limit)
    if sides == 1:
        points = moved_into_open(mesh, tracer, points)
    seen = cast(mesh, tracer, points, sides, settings.gather_rays, tick)
    return _Group(rigid=rigid, mesh=mesh, vertices=vertices, points=points, seen=seen)


def _by_itself(fine: Mesh, rigid: RigidGroup) -> tuple[Mesh, IndexArray]:
    """A group as a mesh about its own middle, and its vertices in the whole."""
    triangles = fine.triangles[rigid.triangles].astype(np.int64)
    vertices, corners = np.unique(triangles, return_inverse=True)
    mesh = Mesh(
        positions=(fine.positions[vertices] - rigid.centre).astype(np.float32),
        normals=fine.normals[vertices],
        triangles=corners.reshape(-1, 3).astype(np.uint32),
        part=fine.part[vertices],
        material=fine.material[vertices],
    )
    return mesh, vertices


def _exposure(fine: Mesh, sides: int, groups: list[_Group]) -> Array:
    """(m * sides,) share of the directions above each triangle's side that see the body as stored,
    and a little more: see ``cluster``.
    """
    origins = [group.points.origins + group.rigid.centre for group in groups]
    points = GatherPoints(
        origins=np.concatenate(origins),
        triangles=np.concatenate([group.points.triangles for group in groups]),
        weights=np.concatenate([group.points.weights for group in groups]),
        normals=np.concatenate([group.points.normals for group in groups]),
        of_vertex=np.zeros((sides, 0), dtype=np.int64),
    )
    seen = cast(fine, RayTracer(fine), points, sides, _LOOKS, lambda _: None)
    share = np.where(seen.buried, 0.0, seen.hit_share)
    start, exposure = 0, np.zeros((sides, len(fine.triangles)))
    for group, places in zip(groups, origins, strict=True):
        row = group.points.of_vertex[:, group.mesh.triangles.astype(np.int64)]
        exposure[:, group.rigid.triangles] = share[start + row].mean(axis=2)
        start += len(places)
    return exposure.ravel() + _EXPOSURE


def _patch_rays(
    fine: Mesh, joints: tuple[Joint, ...], sides: int, patches: Patches, rays: int
) -> tuple[Array32, IndexArray, Mask]:
    """Where the rays of the patches end, what they meet, and which sample points are outside."""
    count = len(patches.areas)
    faces, _ = face_normals(fine)
    group_of_patch = _group_of_patch(fine, joints, sides, patches)
    directions = patch_directions(patches.normals, rays)
    each = directions.shape[2]
    reach = np.zeros((count, SAMPLES, each), dtype=np.float32)
    target: IndexArray = np.zeros(reach.shape, dtype=np.int32)
    point_open = np.zeros((count, SAMPLES), dtype=np.bool_)
    for index, (group, tracer) in enumerate(group_tracers(fine, joints)):
        row = np.flatnonzero(group_of_patch == index)
        ways = directions[row].reshape(-1, 3)
        starts = np.repeat(patches.points[row].reshape(-1, 3), each, axis=0)
        hit, distance = tracer.hits(starts, ways)
        met = hit >= 0
        triangle = group.triangles[np.maximum(hit, 0)]
        behind = met & (np.einsum("ij,ij->i", faces[triangle], ways) > 0.0)
        side = triangle + len(faces) * (behind & (sides == 2))
        sky = -1 - (index * SKY_CELLS + sky_cell(ways))
        ends = np.where(met, patches.of_side[side], sky).astype(np.int32)
        nowhere = behind & (sides == 1)
        inside = nowhere.reshape(-1, each).mean(axis=1) > BURIED
        nowhere |= np.repeat(inside, each)
        ends[nowhere] = NOWHERE
        shape = (len(row), SAMPLES, each)
        target[row] = ends.reshape(shape)
        length = np.where(met, distance, ENDLESS)
        reach[row] = np.where(nowhere, 0.0, length).reshape(shape)
        point_open[row] = ~inside.reshape(len(row), SAMPLES)
    return reach, target, point_open


def _group_of_patch(
    fine: Mesh, joints: tuple[Joint, ...], sides: int, patches: Patches
) -> IndexArray:
    """(p,) a patch holds triangles of one part, so of one group."""
    of_triangle = np.empty(len(fine.triangles), dtype=np.int64)
    for index, group in enumerate(rigid_groups(fine, joints)):
        of_triangle[group.triangles] = index
    of_patch = np.empty(len(patches.areas), dtype=np.int64)
    of_patch[patches.of_side] = np.tile(of_triangle, sides)
    return of_patch


def _spread(fine: Mesh, sides: int, groups: list[_Group], patches: Patches) -> sparse.csc_matrix:
    """(v * sides, p) csc, mean of the patches about each vertex by area, for each of its sides."""
    _, areas = face_normals(fine)
    rows, columns, weights = [], [], []
    of_side = patches.of_side.reshape(sides, -1)
    of_vertex = np.zeros((sides, len(fine.positions)), dtype=np.int64)
    start = 0
    for group in groups:
        for side in range(sides):
            of_vertex[side, group.vertices] = start + group.points.of_vertex[side]
            corner = start + group.points.of_vertex[side][group.mesh.triangles.astype(np.int64)]
            rows.append(corner.ravel())
            columns.append(np.repeat(of_side[side, group.rigid.triangles], 3))
            weights.append(np.repeat(areas[group.rigid.triangles], 3))
        start += len(group.points.origins)
    shape = (start, len(patches.areas))
    weight = np.maximum(np.concatenate(weights), 1e-30)
    sums = sparse.coo_matrix((weight, (np.concatenate(rows), np.concatenate(columns))), shape)
    total = np.asarray(sums.sum(axis=1)).ravel()
    mean = sparse.diags_array(1.0 / np.where(total > 0.0, total, 1.0)) @ sums.tocsr()
    return by_columns(mean.tocsr().astype(np.float32)[of_vertex.T.ravel()])


def _separate(
    fine: Mesh,
    sides: int,
    groups: list[_Group],
    patches: Patches,
    patch_rays: tuple[sparse.csr_matrix, sparse.csr_matrix, Mask],
    settings: BakeSettings,
) -> LightTransport:
    """How light goes with each group by itself."""
    factors, sky, point_open = patch_rays
    of_side = patches.of_side.reshape(sides, -1)
    cells = len(groups) * SKY_CELLS
    gather, part, part_seen, free, free_row = [], [], [], [], []
    of_vertex = np.zeros((sides, len(fine.positions)), dtype=np.int64)
    points = bins = 0
    for index, group in enumerate(groups):
        seen = group.seen
        instead = nearest_open(group.mesh, group.points, seen.buried)
        patch = of_side[:, group.rigid.triangles].ravel()
        to_patch = counts(np.arange(len(patch)), patch, (len(patch), len(patches.areas)))
        gather.append((seen.hits @ to_patch) / settings.gather_rays)
        lesser, is_seen = lesser_part(
            seen.occluded, sparse.csr_matrix(seen.sky_rays)[seen.sky_rays_row]
        )
        part.append(_among_cells(lesser, index, cells))
        part_seen.append(is_seen)
        free.append(_among_cells(sparse.csr_matrix(seen.sky_rays), index, cells))
        free_row.append(bins + seen.sky_rays_row)
        of_vertex[:, group.vertices] = points + instead[group.points.of_vertex]
        points += len(group.points.origins)
        bins += len(seen.sky_rays)
    return LightTransport(
        mesh=fine,
        sides=sides,
        areas=patches.areas.astype(np.float32),
        patch_of_side=patches.of_side,
        materials=patches.materials.astype(np.float32),
        points=patches.points.astype(np.float32),
        normals=patches.normals.astype(np.float32),
        point_open=point_open,
        form_factors=by_columns(factors),
        sky=by_columns(sky),
        gather=by_columns(sparse.vstack(gather).astype(np.float32)),
        # Its light is solved in the frame, pose by pose.
        sun_gather=sparse.csc_matrix(
            (sum(len(rows) for rows in free_row), len(patches.areas)), dtype=np.float32
        ),
        sky_part=by_columns(sparse.vstack(part).astype(np.float32)),
        sky_part_seen=np.concatenate(part_seen),
        sky_rays=by_columns(sparse.vstack(free).astype(np.float32)),
        sky_rays_row=np.concatenate(free_row),
        gather_point_of_vertex=of_vertex,
    )


def _among_cells(of_group: sparse.csr_matrix, index: int, cells: int) -> sparse.csr_matrix:
    """Columns of the cells of a group's sky, placed among those of all groups."""
    return sparse.csr_matrix(
        (of_group.data, of_group.indices + index * SKY_CELLS, of_group.indptr),
        shape=(of_group.shape[0], cells),
    )
