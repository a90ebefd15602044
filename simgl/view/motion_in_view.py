"""How far spacecraft move across an image between two states, by what of them is in view."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.camera.camera import Camera
from simgl.rays import ray_tracer
from simgl.scene.mesh import Mesh, cached_with_mesh
from simgl.scene.posed_mesh import PosedMesh, groups_of_parts
from simgl.scene.state import BodyState, CameraState, SceneState
from simgl.view.hulls_in_view import in_view
from simgl.view.row_clock import camera_from_body

# Lines of sight along the rim of a camera's view, for surfaces without an edge in it.
_RIM = np.arange(8) * (np.pi / 4.0)
# Of a cosine that widens the image off the axis.
_MIN_COSINE = 0.05


def parts_in_view(first: SceneState, second: SceneState, name: str, step: float) -> float:
    """In how many parts the time between two states has to be divided until spacecraft go no
    farther than a step across the image in each [px].

    What is out of view counts as far as it may come into it: it may go as far as it is away. The
    view is the cone through the corners of the image.

    name : of the camera
    """
    a, b = first.cameras[name], second.cameras[name]
    parts = (_parts_of(a, b, first.bodies[n], second.bodies[n], step) for n in first.bodies)
    return max(parts, default=0.0)


def _parts_of(
    a: CameraState, b: CameraState, before: BodyState, after: BodyState, step: float
) -> float:
    """The same of one body."""
    camera = a.camera
    poses = camera_from_body(a, before), camera_from_body(b, after)
    meshes = before.model.posed_mesh, after.model.posed_mesh
    old, new = (_hull(mesh, pose) for mesh, pose in zip(meshes, poses, strict=True))
    if np.all(_cosines(old) > np.cos(camera.half_diagonal_angle)):
        # All of it is in view: what is within the hull goes no farther than its corners do.
        return _largest(camera, old, new, step)
    if camera.is_pinhole:
        # An arc leaves its chord by less than a quarter of it.
        margin = 0.25 * step * _largest(camera, old, new, step)
        if not in_view(np.concatenate([old, new]), camera, margin):
            return 0.0
    old, new = (_corners(mesh, pose) for mesh, pose in zip(meshes, poses, strict=True))
    return _largest(camera, *_along_edges(a, before, old, new), step)


def _along_edges(
    placed: CameraState, body: BodyState, old: Array, new: Array
) -> tuple[Array, Array]:
    """Places (n, 3) of a body before and after, camera axes [m].

    Between the corners of triangles, edges have places where they are nearest to the axis of the
    view, and where they come into it and leave it.

    old, new : of the vertices
    """
    cosine = float(np.cos(placed.camera.half_diagonal_angle))
    ends = _edges(body.model.posed_mesh.mesh, None)
    inside = _cosines(old) > cosine
    first, second = ends[~(inside[ends[:, 0]] & inside[ends[:, 1]])].T
    starts, ways = old[first], old[second] - old[first]
    places, moved = [old], [new]
    for share in _shares(starts, ways, cosine):
        places.append(starts + share[:, None] * ways)
        moved.append(new[first] + share[:, None] * (new[second] - new[first]))
    for one, other in _on_surfaces(placed, body, old, new):
        places.append(one[None])
        moved.append(other[None])
    return np.concatenate(places), np.concatenate(moved)


def _largest(camera: Camera, old: Array, new: Array, step: float) -> float:
    """Of places (n, 3) before and after, camera axes [m], how often any goes as far as it may."""
    cone = camera.half_diagonal_angle
    u, v = (p / np.maximum(np.sqrt(_dot(p, p)), 1e-12)[:, None] for p in (old, new))
    turned = 2.0 * np.arctan2(np.sqrt(_dot(u - v, u - v)), np.sqrt(_dot(u + v, u + v)))
    off_axis = np.arccos(np.clip(u[:, 2], -1.0, 1.0))
    px = np.full(len(old), camera.focal_length_px)
    if camera.is_pinhole:
        # A radian off the axis takes more pixels.
        px /= np.maximum(np.cos(np.minimum(off_axis, cone)), _MIN_COSINE) ** 2
    may = np.maximum(px * (off_axis - cone), step)
    return float((px * turned / may).max(initial=0.0))


def _hull(posed: PosedMesh, matrix: Array) -> Array:
    """(n, 3) points that enclose a mesh, by camera_from_body (4, 4); the same in all poses."""
    groups, motion = posed.groups, posed.motion
    matrices = [matrix if motion is None else matrix @ motion[one.index] for one in groups]
    return np.concatenate(
        [one.hull @ m[:3, :3].T + m[:3, 3] for one, m in zip(groups, matrices, strict=True)]
    )


def _corners(posed: PosedMesh, matrix: Array) -> Array:
    """(n, 3) of a mesh's vertices, by camera_from_body (4, 4)."""
    mesh = posed.mesh
    positions = mesh.positions.astype(np.float64)
    if posed.motion is None:
        return np.asarray(positions @ matrix[:3, :3].T + matrix[:3, 3])
    matrices = matrix @ posed.motion
    moved = np.empty_like(positions)
    of_vertex = groups_of_parts(mesh, posed.joints)[mesh.part]
    for group in np.unique(of_vertex).tolist():
        chosen, one = of_vertex == group, matrices[group]
        moved[chosen] = positions[chosen] @ one[:3, :3].T + one[:3, 3]
    return moved


@cached_with_mesh
def _edges(mesh: Mesh, _: None) -> IndexArray:
    """(n, 2) vertices that the edges of triangles join."""
    pairs = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64))
    return np.asarray(np.unique(pairs, axis=0))


def _cosines(places: Array) -> Array:
    """(n,) of the angles between the axis of the view and places (n, 3)."""
    return np.asarray(places[:, 2] / np.maximum(np.sqrt(_dot(places, places)), 1e-12))


def _dot(a: Array, b: Array) -> Array:
    """(n,) scalar products of vectors (n, 3)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _shares(starts: Array, ways: Array, cosine: float) -> tuple[Array, Array, Array]:
    """(n,) shares of the ways from starts (n, 3) where lines are nearest to the axis of a cone, and
    where they cross it.

    cosine : of its half angle
    """
    aa, ab, bb = _dot(starts, starts), _dot(starts, ways), _dot(ways, ways)
    az, bz = starts[:, 2], ways[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        nearest = (az * ab - bz * aa) / (bz * ab - az * bb)
        # (az + s bz)^2 = cosine^2 |a + s b|^2
        square, half = bz**2 - cosine**2 * bb, az * bz - cosine**2 * ab
        root = np.sqrt(half**2 - square * (az**2 - cosine**2 * aa))
        crossings = (-half - root) / square, (-half + root) / square
    first, second, third = (
        np.clip(np.nan_to_num(share, nan=0.0), 0.0, 1.0) for share in (nearest, *crossings)
    )
    return first, second, third


def _on_surfaces(
    placed: CameraState, body: BodyState, old: Array, new: Array
) -> list[tuple[Array, Array]]:
    """Places (3,) before and after of what lines of sight meet in the middle and along the rim.

    old, new : of the vertices, camera axes [m]
    """
    cone, posed = placed.camera.half_diagonal_angle, body.model.posed_mesh
    around = np.sin(cone) * np.cos(_RIM), np.sin(cone) * np.sin(_RIM), np.full(8, np.cos(cone))
    sights = np.concatenate([[[0.0, 0.0, 1.0]], np.stack(around, axis=1)])
    back = np.linalg.inv(camera_from_body(placed, body))
    origins = np.broadcast_to(back[:3, 3], sights.shape)
    triangles, distances = ray_tracer(posed).hits(origins, sights @ back[:3, :3].T)
    met = []
    for triangle, distance, sight in zip(triangles, distances, sights, strict=True):
        if triangle >= 0:
            corners = posed.mesh.triangles[triangle]
            place = float(distance) * sight
            weights, *_ = np.linalg.lstsq(old[corners].T, place, rcond=None)
            met.append((place, weights @ new[corners]))
    return met
