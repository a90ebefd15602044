"""Rays from the patches of one rigid group that another one ends.

What one group ends of another's rays depends on the values of the joints between the two alone: a
joint on the move leaves the pairs that it carries together, and those that it does not carry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.motion.joints import Joint, chain
from simgl.rays import RayTracer
from simgl.scene.posed_mesh import RigidGroup

# Where a ray goes that does not count, since it starts inside another part.
NOWHERE = np.int32(np.iinfo(np.int32).min)
# How far a ray goes that meets nothing [m].
ENDLESS = np.float32(1e30)


@dataclass(frozen=True, kw_only=True, eq=False)
class PatchRays:
    """Rays from the sample points of one group's patches, in the axes as stored.

    point : (n,) index of the sample points among those of all groups
    origins, normals : (n, 3) the points [m] and the normals there
    directions : (n, k, 3) unit
    reach : (n, k) how far they go before the group itself ends them [m]; 0 where they do not count
    """

    point: IndexArray
    origins: Array32
    normals: Array32
    directions: Array32
    reach: Array32

    @cached_property
    def farthest(self) -> Array32:
        """(n,) the largest reach of each point."""
        return self.reach.max(axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ends:
    """Rays that another group ends.

    ray : (n,) index among all rays of all patches
    reach : (n,) where they end [m]
    target : (n,) patch that they meet there, or ``NOWHERE`` if they meet a solid from inside
    """

    ray: IndexArray
    reach: Array32
    target: IndexArray

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        return self.ray.nbytes + self.reach.nbytes + self.target.nbytes


@dataclass(frozen=True, kw_only=True, eq=False)
class Target:
    """A group that rays may meet.

    faces : (m, 3) unit normals of the mesh's triangles, as stored
    patch_of_side : (sides, m) patch of each triangle's front and, of open sheets, of its back
    """

    group: RigidGroup
    tracer: RayTracer
    faces: Array32
    patch_of_side: IndexArray

    @cached_property
    def box(self) -> tuple[Array32, Array32]:
        """(3,) its lowest and its highest corner, as stored, and a little more [m]."""
        low, high = self.group.hull.min(axis=0), self.group.hull.max(axis=0)
        more = 1e-3 * self.group.radius
        return (low - more).astype(np.float32), (high + more).astype(np.float32)


def ends(rays: PatchRays, target: Target, target_from_rays: Array) -> Ends:
    """The rays of one group that end at another.

    target_from_rays : (4, 4) from the axes as stored of the one to those of the other
    """
    group = target.group
    turn = target_from_rays[:3, :3].T.astype(np.float32)
    starts = rays.origins @ turn + target_from_rays[:3, 3].astype(np.float32)
    point = _points_near(rays, target, starts, rays.normals @ turn)
    # The bounding sphere, seen from there in the axes of the rays.
    offset = (group.centre.astype(np.float32) - np.take(starts, point, axis=0)) @ turn.T
    radius = np.float32(1.001 * group.radius)
    past = np.einsum("ij,ij->i", offset, offset) - radius * radius
    along = np.matmul(np.take(rays.directions, point, axis=0), offset[:, :, None])[:, :, 0]
    reach = np.take(rays.reach, point, axis=0)
    # The line passes it, ahead, before the ray ends; or starts in it.
    near = np.flatnonzero((along * np.abs(along) > past[:, None]) & (along - radius < reach))
    sides, each = len(target.patch_of_side), rays.reach.shape[1]
    ray = (point[:, None] * each + np.arange(each)).ravel()[near]
    ways = np.take(rays.directions.reshape(-1, 3), ray, axis=0) @ turn
    origins = np.take(starts, ray // each, axis=0)
    triangle, reach = target.tracer.hits(origins, ways, reach.ravel()[near])
    met = np.flatnonzero(triangle >= 0)
    number, which = np.divmod(ray[met], each)
    of_mesh = group.triangles[triangle[met]]
    behind = np.einsum("ij,ij->i", target.faces[of_mesh], ways[met]) > 0.0
    patch = target.patch_of_side[behind * (sides - 1), of_mesh]
    return Ends(
        ray=(rays.point[number] * each + which).astype(np.int32),
        reach=reach[met],
        target=np.where(behind & (sides == 1), NOWHERE, patch).astype(np.int32),
    )


def _points_near(rays: PatchRays, target: Target, starts: Array32, normals: Array32) -> IndexArray:
    """Sample points some of whose rays may reach the box around a group.

    starts, normals : (n, 3) of the points in the axes of the group
    """
    low, high = (corner[:, None] for corner in target.box)
    # Rows of thousands: numpy takes as long for three numbers as for hundreds.
    places, ways = np.ascontiguousarray(starts.T), np.ascontiguousarray(normals.T)
    gap = np.maximum(np.maximum(low - places, places - high), np.float32(0.0))
    middle, half = np.float32(0.5) * (low + high), np.float32(0.5) * (high - low)
    height = (ways * (middle - places) + np.abs(ways) * half).sum(axis=0)
    before_end = np.sqrt((gap * gap).sum(axis=0)) < rays.farthest
    return np.flatnonzero(before_end & (height > 0.0))


def joints_between(joints: Sequence[Joint], this: int, other: int) -> tuple[list[int], list[int]]:
    """Indices of the joints that carry one of two groups alone, from the body outwards.

    this, other : indices of the groups' motions, 0 for what no joint carries
    """
    chains = [[] if group == 0 else chain(joints, group - 1)[::-1] for group in (this, other)]
    first, second = ([j for j in c if j not in chains[1 - i]] for i, c in enumerate(chains))
    return first, second


def other_from_this(transforms: Sequence[Array], this: list[int], other: list[int]) -> Array:
    """(4, 4) motion from one group to another, from the transforms of ``joints_between``.

    Joints that carry both have no part in it: the same values give the same bits wherever those
    stand.
    """
    first, second = np.eye(4), np.eye(4)
    for index in this:
        first = first @ transforms[index]
    for index in other:
        second = second @ transforms[index]
    back = np.eye(4)
    back[:3, :3] = second[:3, :3].T
    back[:3, 3] = -second[:3, :3].T @ second[:3, 3]
    return back @ first
