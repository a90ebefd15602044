"""Rays against meshes on the CPU, by Embree: one structure for each rigid group, built once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import ArrayLike, NDArray

from simgl.arrays import Array32, IndexArray, Mask, UIntArray
from simgl.motion.joints import Joint
from simgl.scene.mesh import Mesh, cached_with_mesh
from simgl.scene.posed_mesh import PosedMesh, RigidGroup, rigid_groups

# Fewer rays than this, some 10 ms, are not worth a thread.
_MIN_PART = 20_000


class RayTracer:
    """Traces rays against triangles that do not move.

    triangles : (m, 3) of the mesh's vertices; None for all of its triangles
    watertight : whether no ray passes between two triangles where they meet; else all are a fifth
        faster, for rays in many directions that only count together

    Directions need not be unit; distances are multiples of them.
    """

    def __init__(
        self, mesh: Mesh, triangles: UIntArray | None = None, *, watertight: bool = True
    ) -> None:
        self._scene = EmbreeScene(robust=watertight)
        used = mesh.triangles if triangles is None else triangles
        TriangleMesh(self._scene, mesh.positions, used.astype(np.int32))
        # The first ray builds the structure: before any two threads trace.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def hits(
        self, origins: ArrayLike, directions: ArrayLike, reach: Array32 | None = None
    ) -> tuple[NDArray[np.int32], Array32]:
        """(n,) first triangle that each ray meets, -1 for none, and (n,) distance along it.

        origins, directions : (n, 3), in the mesh's axes
        reach : (n,) distances at which the rays end; None where they go on for ever
        """
        starts, ways = _rows(origins), _rows(directions)
        triangle = np.empty(len(starts), dtype=np.int32)
        distance = np.empty(len(starts), dtype=np.float32)

        def trace(part: slice) -> None:
            ends = None if reach is None else reach[part]
            hits = self._scene.run(starts[part], ways[part], dists=ends, output=True)
            triangle[part], distance[part] = hits["primID"], hits["tfar"]

        _on_all_cores(trace, len(starts))
        return triangle, distance

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, reach: Array32 | None = None
    ) -> Mask:
        """(n,) whether a ray meets anything.

        origins, directions, reach : as of ``hits``
        """
        starts, ways = _rows(origins), _rows(directions)
        met = np.empty(len(starts), dtype=np.int32)

        def trace(part: slice) -> None:
            ends = None if reach is None else reach[part]
            met[part] = self._scene.run(starts[part], ways[part], dists=ends, query="OCCLUDED")

        _on_all_cores(trace, len(starts))
        return met >= 0


def _on_all_cores(trace: Callable[[slice], None], count: int) -> None:
    """Trace so many rays in parts, one for each core; Embree releases Python's lock."""
    parts = min(len(os.sched_getaffinity(0)), count // _MIN_PART)
    if parts <= 1:
        trace(slice(0, count))
        return
    edges = [count * i // parts for i in range(parts + 1)]
    with ThreadPoolExecutor(max_workers=parts) as threads:
        list(threads.map(trace, (slice(a, b) for a, b in pairwise(edges))))


class PosedRayTracer:
    """Traces rays against a mesh whose joints have moved some of it, as ``RayTracer`` does.

    Each rigid group is traced as stored: rays go to where they were before its joints moved it.
    """

    def __init__(self, posed: PosedMesh) -> None:
        assert posed.motion is not None
        self._motion = posed.motion
        self._groups = group_tracers(posed.mesh, posed.joints)

    def hits(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.int32], Array32]:
        """(n,) first triangle that each ray meets, -1 for none, and (n,) distance along it.

        origins, directions : (n, 3), body axes
        """
        starts, ways = _rows(origins), _rows(directions)
        triangle = np.full(len(starts), -1, dtype=np.int32)
        distance = np.full(len(starts), np.inf, dtype=np.float32)
        for group, tracer, near in self._near(starts, ways):
            hit, reach = tracer.hits(*self._as_stored(group, starts[near], ways[near]))
            first = np.flatnonzero((hit >= 0) & (reach < distance[near]))
            triangle[near[first]] = group.triangles[hit[first]]
            distance[near[first]] = reach[first]
        return triangle, distance

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, reach: Array32 | None = None
    ) -> Mask:
        """(n,) whether a ray meets anything.

        origins, directions : (n, 3), body axes
        reach : (n,) distances at which the rays end; None where they go on for ever
        """
        starts, ways = _rows(origins), _rows(directions)
        occluded = np.zeros(len(starts), dtype=np.bool_)
        for group, tracer, near in self._near(starts, ways):
            ends = None if reach is None else reach[near]
            rays = self._as_stored(group, starts[near], ways[near])
            occluded[near] |= tracer.occluded(*rays, ends)
        return occluded

    def _near(
        self, origins: Array32, directions: Array32
    ) -> Iterator[tuple[RigidGroup, RayTracer, IndexArray]]:
        """The groups that some rays may meet, and which these are."""
        # Rows of thousands: numpy takes as long for three numbers as for hundreds.
        starts, ways = (np.ascontiguousarray(vectors.T) for vectors in (origins, directions))
        ways /= np.sqrt((ways * ways).sum(axis=0))
        for group, tracer in self._groups:
            matrix = self._motion[group.index].astype(np.float32)
            middle = matrix[:3, :3] @ group.centre.astype(np.float32) + matrix[:3, 3]
            offset = middle[:, None] - starts
            along = (offset * ways).sum(axis=0)
            past = offset - along * ways
            # Of the bounding sphere, and what float32 leaves unsure of the farthest origin. One
            # bound for all rays: a maximum for each takes longer than tracing the few more that it
            # admits.
            farthest = np.fmax.reduce(np.abs(offset), axis=None, initial=0.0)
            reach = np.float32(1.001 * group.radius) + np.float32(1e-6) * farthest
            near = np.flatnonzero(((past * past).sum(axis=0) < reach * reach) & (along > -reach))
            if len(near):
                yield group, tracer, near

    def _as_stored(
        self, group: RigidGroup, origins: Array32, directions: Array32
    ) -> tuple[Array32, Array32]:
        """Rays as they are to a group where it is stored."""
        matrix = self._motion[group.index].astype(np.float32)
        return (origins - matrix[:3, 3]) @ matrix[:3, :3], directions @ matrix[:3, :3]


def _rows(vectors: ArrayLike) -> Array32:
    return np.ascontiguousarray(vectors, dtype=np.float32)


AnyRayTracer = RayTracer | PosedRayTracer


def ray_tracer(posed: PosedMesh) -> AnyRayTracer:
    """The tracer of a mesh at a pose; its structures are built once for all poses."""
    return _mesh_tracer(posed.mesh, None) if posed.motion is None else PosedRayTracer(posed)


# 53 k triangles take 50 ms and 10 MB.
@cached_with_mesh
def _mesh_tracer(mesh: Mesh, _: None) -> RayTracer:
    return RayTracer(mesh)


@cached_with_mesh
def group_tracers(
    mesh: Mesh, joints: tuple[Joint, ...]
) -> tuple[tuple[RigidGroup, RayTracer], ...]:
    """The rigid groups of a mesh, each with a tracer of itself as stored."""
    groups = rigid_groups(mesh, joints)
    return tuple((group, RayTracer(mesh, mesh.triangles[group.triangles])) for group in groups)
