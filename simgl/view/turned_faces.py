"""How many snapshots it takes until faces of a body that turn to the camera, or away, are right.

A snapshot shows the faces of its middle. One that comes into view during a snapshot is missing from
then on until its middle, or is swept from there to before it came, where it has no area to take
from. Its area in the image meanwhile grows evenly, by s in an exposure: of one of n snapshots
s h^2 / 2 are lost in the mean over the exposure, with half of a snapshot h = 1 / (2 n), if it comes
just in the middle; a third of that in the mean over all times at which it may come, and rms less by
the square root of 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import MAX_PARTS
from simgl.motion.joints import Joint
from simgl.rays import ray_tracer
from simgl.scene.mesh import Mesh, cached_with_mesh
from simgl.scene.posed_mesh import PosedMesh, groups_of_parts
from simgl.view.depth_slices import NEAREST

# Misplacement of the middles of rows that faces leave, rms [px]: half of what these may be off.
_MISPLACED = 0.01
# Share of its light that a body loses in the mean: half of what it may.
_LOST = 5e-4
# Normals within so much along each axis count as one.
_SAME = 0.05
# Cosines between which the normals of faces are that look alike: what one lacks, another shows.
_ALIKE, _ONE = float(np.cos(np.radians(15.0))), float(np.cos(np.radians(1.0)))
# Cells along a body's radius within which faces count as one.
_CELLS = 2.0
# Steps of an exposure in which faces are told that turn at all.
_COARSE = 4
# So far before a face, in radii of its body, a line of sight leaves it.
_BEFORE = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class _Faces:
    """Faces of a mesh, as stored.

    group : (k,) of the rigid groups
    normals : (k, 3)
    places : (k, 3) on each of them [m]
    areas : (k,) that look like nothing beside them [m2]
    """

    group: IndexArray
    normals: Array
    places: Array
    areas: Array


def snapshots_of_faces(posed: PosedMesh, camera: Camera, poses: Array, area_px: float) -> float:
    """Of one body, until its rows' middles and its light are right.

    What is too little on one side of a row moves its middle by half of that at most.

    poses : (t, 4, 4) camera_from_body at even times of what a row sees, from its start to its end
    area_px : of its outline in the image [px2]
    """
    normals, places, areas = _moved(posed)
    coarse = _towards(normals, places, camera, poses[:: max((len(poses) - 1) // _COARSE, 1)])
    turns = (coarse.min(axis=0) < 0.0) & (coarse.max(axis=0) > 0.0)
    normals, places = normals[turns], places[turns]
    seen = areas[turns] * _towards(normals, places, camera, poses)
    rows, faces = np.nonzero(seen[1:] * seen[:-1] < 0.0)
    # Whether the body hides a face is seen when that looks most towards the camera.
    widest = poses[seen.argmax(axis=0)[faces]]
    bare = ~_hidden(posed, places[faces], normals[faces], widest)
    rows, faces = rows[bare], faces[bare]
    before, after = np.abs(seen[rows, faces]), np.abs(seen[rows + 1, faces])
    steps = len(poses) - 1
    growth = steps * (before + after)
    times = (rows + before / (before + after)) / steps
    # Of one that comes near the start or the end, nothing is wrong for longer than from there.
    at_ends = 0.5 * np.minimum(times, 1.0 - times) ** 2
    for count in range(1, MAX_PARTS):
        worst = 0.125 / count**2
        wrong = growth * np.minimum(worst / np.sqrt(5.0), at_ends)
        lost = float(np.sum(growth * np.minimum(worst / 3.0, at_ends)))
        moved = float(np.sqrt(np.sum(wrong**2))) / (2.0 * np.sqrt(area_px))
        if moved <= _MISPLACED and lost <= _LOST * area_px:
            return float(count)
    return float(MAX_PARTS)


def _moved(posed: PosedMesh) -> tuple[Array, Array, Array]:
    """Normals (k, 3), places (k, 3) [m] and areas (k,) [m2] of faces, body axes."""
    faces = _faces(posed.mesh, posed.joints)
    if posed.motion is None:
        return faces.normals, faces.places, faces.areas
    motion = posed.motion[faces.group]
    places = np.einsum("kij,kj->ki", motion[:, :3, :3], faces.places) + motion[:, :3, 3]
    return np.einsum("kij,kj->ki", motion[:, :3, :3], faces.normals), places, faces.areas


def _towards(normals: Array, places: Array, camera: Camera, poses: Array) -> Array:
    """(t, k) how large faces are in the image for their area [px2 m-2], negative where they turn
    their back, 0 out of view."""
    R = poses[:, :3, :3]
    at = np.einsum("tij,kj->tki", R, places) + poses[:, None, :3, 3]
    towards = -np.einsum("tki,tki->tk", np.einsum("tij,kj->tki", R, normals), at)
    depth = np.maximum(at[..., 2], NEAREST)
    pixels = camera.project(at.reshape(-1, 3)).reshape(*at.shape[:2], 2)
    size = np.array([camera.detector.width, camera.detector.height])
    in_view = np.all((pixels > 0.0) & (pixels < size), axis=-1) & (at[..., 2] > NEAREST)
    scale = camera.focal_length_px**2 / (depth**2 * np.linalg.norm(at, axis=-1))
    return np.asarray(in_view * scale * towards)


def _hidden(posed: PosedMesh, places: Array, normals: Array, poses: Array) -> Mask:
    """(n,) whether a body hides places (n, 3) on it, by camera_from_body (n, 4, 4)."""
    starts = places + _BEFORE * posed.radius * normals
    eyes = -np.einsum("nji,nj->ni", poses[:, :3, :3], poses[:, :3, 3])
    reach = np.ones(len(starts), dtype=np.float32)
    return ray_tracer(posed).occluded(starts, eyes - starts, reach)


@cached_with_mesh
def _faces(mesh: Mesh, joints: tuple[Joint, ...]) -> _Faces:
    corners = mesh.positions.astype(np.float64)[mesh.triangles]
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # The largest of each face first, which stands for all of it.
    order = np.argsort(-np.linalg.norm(twice, axis=1), kind="stable")
    twice, corners = twice[order], corners[order]
    double = np.linalg.norm(twice, axis=1)
    flat = double > 0.0
    normals, areas = twice[flat] / double[flat, None], 0.5 * double[flat]
    middles = corners[flat].mean(axis=1)
    group = groups_of_parts(mesh, joints)[mesh.part[mesh.triangles[order][flat, 0]]]
    cells = np.round((middles - mesh.centre) * (_CELLS / mesh.radius)).astype(np.int64)
    of_normal = np.round(normals / _SAME).astype(np.int64)
    keys, first, index = np.unique(
        np.column_stack([group, cells, of_normal]), axis=0, return_index=True, return_inverse=True
    )
    total = np.asarray(np.bincount(index.ravel(), areas), dtype=np.float64)
    distinct = _distinct(keys[:, :4], normals[first], total)
    chosen = distinct > 0.0
    first = first[chosen]
    return _Faces(
        group=keys[chosen, 0],
        normals=normals[first],
        places=middles[first],
        areas=distinct[chosen],
    )


def _distinct(places: IndexArray, normals: Array, areas: Array) -> Array:
    """(k,) areas less those of faces in the same place that look alike, 0 at least.

    places : (k, n), the same for those in the same place, in order
    """
    starts = np.flatnonzero(np.any(np.diff(places, axis=0) != 0, axis=1)) + 1
    distinct = areas.copy()
    for one in np.split(np.arange(len(areas)), starts):
        cosines = normals[one] @ normals[one].T
        alike = (cosines > _ALIKE) & (cosines < _ONE)
        distinct[one] = np.maximum(areas[one] - alike @ areas[one], 0.0)
    return distinct
