"""How what a snapshot shows moves across it while the shutter is open.

A snapshot of a moment stands for the exposure around it: what a pixel sees at a time stood then at
another place of the snapshot. The ways there are known at the nodes of a grid, and linear between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simgl.arrays import Array, Array32, Mask
from simgl.motion.joints import relative_motion
from simgl.rays import ray_tracer
from simgl.scene.posed_mesh import PosedMesh, groups_of_parts
from simgl.scene.state import CameraState, EarthState
from simgl.view.exposure_parts import BackgroundPart, ExposurePart
from simgl.view.row_clock import camera_from_body
from simgl.view.snapshot_count import BENDS, MIN_BEND

# Nodes along the longer edge of a grid, and the least distance between them [px].
_NODES, _NEAREST_NODES = 20, 4.0
# Power of the squared distance by which nodes within an outline tell of those around it.
_NEAR = 2.0
# Air up to this height moves with the ground below it; what is above stands still as stars [m].
_HIGHEST_AIR = 1e5

Box = tuple[int, int, int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class ImagePaths:
    """Ways across a snapshot, at the nodes of a grid.

    origin : of the first node, column and row [px]
    step : from a node to the next [px]
    nodes : (rows, columns, 4) float32, v and a, along x and y [px]: what is seen at a place t
        exposure times after the snapshot's moment is t v - t^2 a before it in the snapshot
    """

    origin: tuple[float, float]
    step: float
    nodes: Array32

    @property
    def reach(self) -> tuple[float, float]:
        """Twice the longest ways along x and y from the middle of an exposure time to its ends
        [px]."""
        ways = np.abs(self.nodes[..., :2]) + 0.5 * np.abs(self.nodes[..., 2:])
        longest = ways.max(axis=(0, 1))
        return float(longest[0]), float(longest[1])

    @property
    def uneven(self) -> bool:
        """Whether anything is far off an even motion through its middle."""
        way = np.hypot(*np.moveaxis(self.nodes[..., :2], -1, 0))
        bend = 0.5 * np.hypot(*np.moveaxis(self.nodes[..., 2:], -1, 0))
        return bool(((bend > MIN_BEND) & (BENDS * bend > way)).any())

    @property
    def still(self) -> ImagePaths:
        """Nothing moves."""
        return replace(self, nodes=np.zeros_like(self.nodes))

    def within(self, first: float, last: float) -> ImagePaths:
        """The same from the middle of a part of the exposure on, which is then all of it.

        first, last : exposure times from the snapshot's moment
        """
        v, a = np.split(self.nodes, 2, axis=-1)
        span = last - first
        nodes = np.concatenate([span * (v - (first + last) * a), span**2 * a], axis=-1)
        return replace(self, nodes=nodes.astype(np.float32))

    def box_of(self, first: float, last: float) -> tuple[Array, Array]:
        """(2,) least and (2,) largest ways along x and y at times of a part of the exposure [px].

        first, last : exposure times from the snapshot's moment
        """
        v, a = self.nodes.reshape(-1, 4).T.astype(np.float64).reshape(2, 2, -1)
        ways = np.hstack([t * v - t**2 * a for t in (first, 0.5 * (first + last), last)])
        # A parabola leaves its chords by a quarter of its bend at most.
        bend = 0.0625 * (last - first) ** 2 * np.abs(a).max(axis=1)
        return ways.min(axis=1) - bend, ways.max(axis=1) + bend

    def shortened(self, square: float) -> ImagePaths:
        """Ways whose squares are less by so much [px^2], 0 at least."""
        v = self.nodes[..., :2]
        squares = np.maximum((v**2).sum(axis=-1, keepdims=True), 1e-12)
        shorter = np.sqrt(np.maximum(1.0 - square / squares, 0.0)).astype(np.float32)
        nodes = np.concatenate([shorter * v, shorter**2 * self.nodes[..., 2:]], axis=-1)
        return replace(self, nodes=nodes)

    def differ(self, other: ImagePaths) -> float:
        """Largest difference of a motion from that of other paths, at these nodes [px]."""
        rows, columns = self.nodes.shape[:2]
        x, y = (self.origin[k] + self.step * np.arange(n) for k, n in enumerate((columns, rows)))
        theirs = other.nodes[..., :2].astype(np.float64)
        for axis, (places, start) in enumerate(((y, other.origin[1]), (x, other.origin[0]))):
            at = np.clip((places - start) / other.step, 0.0, theirs.shape[axis] - 1.0)
            low = np.minimum(at.astype(int), max(theirs.shape[axis] - 2, 0))
            high = np.minimum(low + 1, theirs.shape[axis] - 1)
            share = np.expand_dims(at - low, tuple(range(1, 3)))
            share = np.moveaxis(share, 0, axis)
            before, after = np.take(theirs, low, axis), np.take(theirs, high, axis)
            theirs = before + share * (after - before)
        return float(np.abs(self.nodes[..., :2] - theirs).max())


@dataclass(frozen=True, kw_only=True, eq=False)
class _Seen:
    """What some nodes see: how it moves about there.

    hit : (n,) whether the node sees any of it
    motion : (n, 4) velocity over the exposure time, and bend of both ends from the middle, summed
        [px]
    around : (n, 4) the same of a plane through the middle of the body, that goes along with it
    distance : (n,) along the line of sight, for whether it is hidden
    """

    hit: Mask
    motion: Array
    around: Array
    distance: Array


def _grid(box: Box) -> tuple[tuple[float, float], float, Array]:
    """Origin, step and (rows, columns, 2) nodes over x, y, width and height [px]."""
    x, y, width, height = box
    step = max(max(width, height) / _NODES, _NEAREST_NODES)
    columns, rows = (int(np.ceil(extent / step)) + 1 for extent in (width, height))
    across, down = x + step * np.arange(columns), y + step * np.arange(rows)
    return (float(x), float(y)), step, np.stack(np.meshgrid(across, down), axis=-1)


def spacecraft_paths(parts: Sequence[ExposurePart], names: Sequence[str], box: Box) -> ImagePaths:
    """Of spacecraft as the parts of an exposure draw them.

    parts : each draws other rows
    names : of those that are drawn
    box : x, y, width, height that they cover [px]
    """
    origin, step, grid = _grid(box)
    nodes = grid.reshape(-1, 2)
    hit = np.zeros(len(nodes), dtype=bool)
    motion, around = np.zeros((2, len(nodes), 4))
    for part in parts:
        in_part = np.ones(len(nodes), dtype=bool)
        if part.rows is not None and len(parts) > 1:
            in_part = (nodes[:, 1] >= part.rows.first) & (nodes[:, 1] < part.rows.end)
        if in_part.any():
            seen = _nearest([_of_body(part, name, nodes[in_part]) for name in names])
            hit[in_part], motion[in_part], around[in_part] = seen.hit, seen.motion, seen.around
    if not hit.any():
        # Too small or too thin for the nodes: as its middle.
        part = parts[len(parts) // 2]
        motion[:] = np.concatenate(_of_middle(part, names[0]))
        hit[:] = True
    nodes_moved = _extended(nodes, hit, motion, around, grid.shape[:2])
    return ImagePaths(origin=origin, step=step, nodes=nodes_moved)


def _nearest(seen: Sequence[_Seen]) -> _Seen:
    first = seen[0]
    for one in seen[1:]:
        nearer = one.distance < first.distance
        first = _Seen(
            hit=first.hit | one.hit,
            motion=np.where(nearer[:, None], one.motion, first.motion),
            around=first.around,
            distance=np.minimum(first.distance, one.distance),
        )
    return first


def _extended(
    nodes: Array, hit: Mask, motion: Array, around: Array, shape: tuple[int, ...]
) -> Array32:
    """(rows, columns, 4) ways at all nodes, beyond an outline as at those nearest within it.

    An even turn or zoom goes on beyond it, and bends the ways: it is told by the linear change of
    velocities and bends over the snapshot.

    motion : (n, 4) velocity and bend of what nodes see
    around : (n, 4) the same of what goes on beyond the outline; the linear change of what the
        outline differs from that goes on, too
    """
    middle = nodes[hit].mean(axis=0)
    scale = max(float(np.ptp(nodes)), 1.0)
    terms = np.column_stack([np.ones(len(nodes)), (nodes - middle) / scale])
    change = np.linalg.lstsq(terms[hit], motion[hit, :2], rcond=None)[0][1:].T / scale
    fit, *_ = np.linalg.lstsq(terms[hit], (motion - around)[hit], rcond=None)
    even = around + terms @ fit
    uneven = motion - even
    lost = np.flatnonzero(~hit)
    if lost.size:
        inside = np.flatnonzero(hit)
        near = ((nodes[lost, None] - nodes[inside]) ** 2).sum(axis=-1) ** -_NEAR
        uneven[lost] = near / near.sum(axis=1, keepdims=True) @ uneven[inside]
    ways, bends = np.split(even + uneven, 2, axis=-1)
    # From a place back to where it came from: the change of velocity on the way, less the bend.
    curves = ways @ change.T - 2.0 * bends
    return np.concatenate([ways, curves], axis=-1).astype(np.float32).reshape(*shape, 4)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pose:
    """A body's pose before the camera: by a time from -1 to 1 for what a part of an exposure sees.

    half : of the exposure time, in the same unit
    """

    middle: Array
    rate: Array
    change: Array
    half: float

    def at(self, times: Array) -> Array:
        """(n, 4, 4) camera_from_body."""
        t = times[:, None, None]
        return np.asarray(self.middle + t * (self.rate + t * self.change))


def _pose(part: ExposurePart, name: str) -> _Pose:
    before, middle, after = (
        camera_from_body(part.camera_of(state), state.bodies[name])
        for state in (part.first, part.state, part.last)
    )
    return _Pose(
        middle=middle,
        rate=0.5 * (after - before),
        change=0.5 * (after + before) - middle,
        half=0.5 * part.exposure_time / part.half_span,
    )


def _of_body(part: ExposurePart, name: str, nodes: Array) -> _Seen:
    """What nodes (n, 2) [px] see of a body."""
    camera, pose = part.camera_of(part.state).camera, _pose(part, name)
    mesh = part.state.bodies[name].model.posed_mesh
    times = part.row_times(nodes[:, 1])
    rays = np.nan_to_num(camera.rays(nodes))
    back = np.linalg.inv(pose.at(times))
    origins, ways = back[:, :3, 3], np.einsum("nij,nj->ni", back[:, :3, :3], rays)
    triangles, distance = ray_tracer(mesh).hits(origins, ways)
    hit = (triangles >= 0) & np.any(rays != 0.0, axis=-1)
    places = np.where(hit[:, None], origins + np.where(hit, distance, 0.0)[:, None] * ways, 0.0)
    shifts = _joint_shifts(part, name, places, triangles) * pose.half
    motion = _moved(part, pose, nodes, places, shifts)
    hit &= np.isfinite(motion).all(axis=-1)
    # Along lines of sight to the depth of its middle.
    depth = _depth(pose, mesh)
    plane = origins + (depth / np.maximum(rays[:, 2:], 1e-3)) * ways
    around = _moved(part, pose, nodes, plane, np.zeros_like(plane))
    if not np.isfinite(around).all():
        around = np.zeros_like(around)
    return _Seen(
        hit=hit,
        motion=np.where(hit[:, None], motion, 0.0),
        around=around,
        distance=np.where(hit, distance, np.inf),
    )


def _depth(pose: _Pose, mesh: PosedMesh) -> float:
    """Of a body's middle before the camera; a tenth of its radius where it is not before it [m]."""
    return max(float(pose.middle[2] @ np.append(mesh.centre, 1.0)), 0.1 * mesh.radius)


def _moved(part: ExposurePart, pose: _Pose, nodes: Array, places: Array, shifts: Array) -> Array:
    """(n, 4) velocity and bend of places (n, 3) of a body that nodes see [px].

    shifts : (n, 3) how far joints move them to the end of the exposure [m]
    """
    camera, times = part.camera_of(part.state).camera, part.row_times(nodes[:, 1])
    ends = []
    for side in (-1.0, 1.0):
        matrices = pose.at(times + side * pose.half)
        moved = places + side * shifts
        seen = np.einsum("nij,nj->ni", matrices[:, :3, :3], moved) + matrices[:, :3, 3]
        ends.append(camera.project(seen))
    return np.concatenate(_motion(ends[0], nodes, ends[1], part), axis=-1)


def _motion(before: Array, middle: Array, after: Array, part: ExposurePart) -> tuple[Array, Array]:
    """Velocity and bend of places [px], as rows see them that are exposed one after the other."""
    velocity, bend = after - before, after + before - 2.0 * middle
    # In a snapshot whose rows have their own times, what comes along with these is seen longer.
    runs = 1.0 - part.row_time / part.exposure_time * velocity[..., 1:]
    return velocity / np.maximum(runs, _SLOWEST), bend


# Least rate at which a row's time runs ahead of what moves along with the rows.
_SLOWEST = 0.25


def _of_middle(part: ExposurePart, name: str) -> tuple[Array, Array]:
    """Velocity and bend (2,) of the middle of a body [px]."""
    camera, pose = part.camera_of(part.state).camera, _pose(part, name)
    centre = np.append(part.state.bodies[name].model.posed_mesh.centre, 1.0)
    times = pose.half * np.array([-1.0, 0.0, 1.0])
    before, middle, after = camera.project((pose.at(times) @ centre)[:, :3])
    if not np.isfinite([before, middle, after]).all():
        return np.zeros(2), np.zeros(2)
    return _motion(before, middle, after, part)


def _joint_shifts(
    part: ExposurePart, name: str, places: Array, triangles: NDArray[np.int32]
) -> Array:
    """(n, 3) how far joints move places from the middle of the part to its end [m]."""
    meshes = [state.bodies[name].model.posed_mesh for state in (part.first, part.state, part.last)]
    middle = meshes[1]
    if all(one.motion is None for one in meshes):
        return np.zeros_like(places)
    first, rest, last = (_motions(one) for one in meshes)
    rates = 0.5 * (relative_motion(rest, last) - relative_motion(rest, first))
    if not rates.any():
        return np.zeros_like(places)
    part_of = middle.mesh.part[middle.mesh.triangles[np.maximum(triangles, 0), 0]]
    moved = rates[groups_of_parts(middle.mesh, middle.joints)[part_of]]
    return np.einsum("nij,nj->ni", moved[:, :3, :3], places) + moved[:, :3, 3]


def _motions(mesh: PosedMesh) -> Array:
    still = np.tile(np.eye(4), (len(mesh.joints) + 1, 1, 1))
    return still if mesh.motion is None else mesh.motion


def background_paths(part: BackgroundPart, name: str) -> ImagePaths:
    """Of the Earth and the sky behind spacecraft, over the exposure time."""
    state, placed = part.state, part.state.cameras[name]
    camera, d = placed.camera, placed.camera.detector
    origin, step, grid = _grid((0, 0, d.width, d.height))
    nodes = grid.reshape(-1, 2)
    rays = camera.rays(nodes)
    hit: Mask = np.asarray(np.isfinite(rays).all(axis=-1))
    sights = np.where(hit[:, None], rays, [0.0, 0.0, 1.0]) @ placed.R_camera_from_icrf
    sights /= np.linalg.norm(sights, axis=-1, keepdims=True)
    on_ground, places = _on_ground(state.earth, placed, sights)
    ends = []
    for end in (part.first, part.last):
        other = end.cameras[name]
        seen = sights @ other.R_camera_from_icrf.T
        if end.earth is not None:
            ground = places @ end.earth.R_itrf_from_icrf + end.earth.position - other.position
            ground = ground @ other.R_camera_from_icrf.T
            seen = np.where(on_ground[:, None], ground, seen)
        ends.append(camera.project(seen))
    hit &= np.isfinite(ends[0]).all(axis=-1) & np.isfinite(ends[1]).all(axis=-1)
    if not hit.any():
        return ImagePaths(
            origin=origin, step=step, nodes=np.zeros((*grid.shape[:2], 4), np.float32)
        )
    share = part.exposure_time / (2.0 * part.half_span)
    velocity, bend = share * (ends[1] - ends[0]), share**2 * (ends[1] + ends[0] - 2.0 * nodes)
    motion = np.where(hit[:, None], np.concatenate([velocity, bend], axis=-1), 0.0)
    nodes_moved = _extended(nodes, hit, motion, np.zeros_like(motion), grid.shape[:2])
    return ImagePaths(origin=origin, step=step, nodes=nodes_moved)


def _on_ground(earth: EarthState | None, placed: CameraState, sights: Array) -> tuple[Mask, Array]:
    """Whether lines of sight (n, 3), ICRF axes, end on the Earth or pass through its air, and the
    places there (n, 3), axes of the Earth [m]."""
    if earth is None:
        return np.zeros(len(sights), dtype=bool), np.zeros_like(sights)
    radii = np.array(earth.radii)
    # Where the ellipsoid is the unit sphere.
    start = earth.R_itrf_from_icrf @ (placed.position - earth.position) / radii
    ways = sights @ earth.R_itrf_from_icrf.T / radii
    a, b = (ways**2).sum(axis=-1), ways @ start
    nearest = -b / a
    lowest = start @ start - b**2 / a
    reach = np.sqrt(np.maximum(1.0 - lowest, 0.0) / a)
    air = (1.0 + _HIGHEST_AIR / float(radii.min())) ** 2
    seen = (lowest < air) & (nearest > 0.0)
    return seen, (start + (nearest - reach)[:, None] * ways) * radii
