"""Rays from the patches of one rigid group that another one ends.

What one group ends of another's rays depends on the values of the joints between the two alone: a
joint on the move leaves the pairs that it carries together, and those that it does not carry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
    """Rays from the patches of one group, in the axes as stored.

    row : (p,) the patches, among all
    origins, normals : (p, n, 3) sample points [m] and normals there
    directions : (p, n, k, 3) unit
    reach : (p, n, k) how far they go before the group itself ends them [m]; 0 where they do not
        count
    """

    row: IndexArray
    origins: Array32
    normals: Array32
    directions: Array32
    reach: Array32


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


def ends(rays: PatchRays, target: Target, target_from_rays: Array) -> Ends:
    """The rays of one group that end at another.

    target_from_rays : (4, 4) from the axes as stored of the one to those of the other
    """
    group = target.group
    turn = target_from_rays[:3, :3].astype(np.float32)
    shift = target_from_rays[:3, 3].astype(np.float32)
    centre = target_from_rays[:3, :3].T @ (group.centre - target_from_rays[:3, 3])
    radius = np.float32(1.001 * group.radius)
    each = rays.reach.shape[2]
    point = _points_near(rays, centre.astype(np.float32), radius)
    offset = centre.astype(np.float32) - rays.origins.reshape(-1, 3)[point]
    directions = rays.directions.reshape(-1, each, 3)[point]
    reach = rays.reach.reshape(-1, each)[point]
    along = np.matmul(directions, offset[:, :, None])[..., 0]
    past = np.einsum("ij,ij->i", offset, offset) - radius * radius
    inside = past <= 0.0
    # The line passes the bounding sphere, ahead, before the ray ends.
    near = (along * along > past[:, None]) & (along > 0.0) & (along - radius < reach)
    near |= inside[:, None] & (reach > 0.0)
    chosen, which = np.nonzero(near)
    ways = directions[chosen, which] @ turn.T
    starts = (rays.origins.reshape(-1, 3)[point] @ turn.T + shift)[chosen]
    triangle, distance = target.tracer.hits(starts, ways, reach[chosen, which])
    met = np.flatnonzero(triangle >= 0)
    of_mesh = group.triangles[triangle[met]]
    behind = np.einsum("ij,ij->i", target.faces[of_mesh], ways[met]) > 0.0
    sides = len(target.patch_of_side)
    patch = target.patch_of_side[behind * (sides - 1), of_mesh]
    number = point[chosen[met]]
    samples = rays.reach.shape[1]
    row = rays.row[number // samples]
    return Ends(
        ray=((row * samples + number % samples) * each + which[met]).astype(np.int32),
        reach=distance[met],
        target=np.where(behind & (sides == 1), NOWHERE, patch).astype(np.int32),
    )


def _points_near(rays: PatchRays, centre: Array32, radius: np.float32) -> IndexArray:
    """Sample points of which a ray may reach a sphere, by its centre in their axes."""
    offset = centre - rays.origins.reshape(-1, 3)
    farthest = rays.reach.reshape(len(offset), -1).max(axis=1)
    distance = np.linalg.norm(offset, axis=1)
    # Part of the sphere is above the surface, and no ray ends before it.
    height = np.einsum("ij,ij->i", offset, rays.normals.reshape(-1, 3))
    return np.flatnonzero((height > -radius) & (farthest > np.maximum(distance - radius, 0.0)))


def other_from_this(
    joints: Sequence[Joint], values: Sequence[float], this: int, other: int
) -> tuple[tuple[float, ...], Array]:
    """The values on which the motion between two groups depends, and that motion (4, 4).

    this, other : indices of the groups' motions, 0 for what no joint carries

    Joints that carry both have no part in it: the same values give the same bits wherever those
    stand.
    """
    chains = [[] if group == 0 else chain(joints, group - 1) for group in (this, other)]
    between = set(chains[0]) ^ set(chains[1])
    moved = []
    for of_group in chains:
        motion = np.eye(4)
        for index in reversed(of_group):
            if index in between and values[index]:
                motion = motion @ joints[index].transform(values[index])
        moved.append(motion)
    first, second = moved
    back = np.eye(4)
    back[:3, :3] = second[:3, :3].T
    back[:3, 3] = -second[:3, :3].T @ second[:3, 3]
    return tuple(values[index] for index in sorted(between)), back @ first
