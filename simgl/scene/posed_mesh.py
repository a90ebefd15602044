"""A mesh whose joints stand at some values: the stored mesh, and how each rigid group of it moved.

A rigid group is what one joint carries and no joint on it does; group 0 is what no joint carries.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.motion.joints import Joint, relative_motion
from simgl.scene.mesh import Mesh, cached_with_mesh, hull_corners, hull_edges


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidGroup:
    """What moves as one.

    index : of its motion
    triangles : (k,) indices into the mesh's
    hull : (c, 3) corners of its convex hull, as stored [m]
    centre, radius : of a sphere around it, as stored [m]
    """

    index: int
    triangles: IndexArray
    hull: Array
    centre: Array
    radius: float


@cached_with_mesh
def rigid_groups(mesh: Mesh, joints: tuple[Joint, ...]) -> tuple[RigidGroup, ...]:
    """The groups of a mesh that have triangles; the same object for the same mesh and joints."""
    group_of_part = groups_of_parts(mesh, joints)
    of_vertex = group_of_part[mesh.part]
    of_triangle = of_vertex[mesh.triangles[:, 0]]
    groups = []
    for index in np.unique(of_triangle).tolist():
        triangles = np.flatnonzero(of_triangle == index)
        hull = hull_corners(mesh.positions[of_vertex == index].astype(np.float64))
        centre = 0.5 * (hull.min(axis=0) + hull.max(axis=0))
        radius = float(np.linalg.norm(hull - centre, axis=1).max())
        group = RigidGroup(
            index=index, triangles=triangles, hull=hull, centre=centre, radius=radius
        )
        groups.append(group)
    return tuple(groups)


@cached_with_mesh
def groups_of_parts(mesh: Mesh, joints: tuple[Joint, ...]) -> IndexArray:
    """(parts,) index of the group of each part: one more than that of its joint, or 0."""
    groups = np.zeros(int(mesh.part.max(initial=0)) + 1, dtype=np.int64)
    for index, joint in enumerate(joints):
        parts = [part for part in joint.parts if part < len(groups)]
        groups[parts] = index + 1
    return groups


@cached_with_mesh
def are_closed(mesh: Mesh, joints: tuple[Joint, ...]) -> bool:
    """Whether the groups of a mesh are closed surfaces."""
    return all(mesh.is_closed(group.triangles) for group in rigid_groups(mesh, joints))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Known:
    """Whether a point (3,) is inside a surface, and all others nearer to it than ``reach`` [m]."""

    point: Array
    inside: bool
    reach: float


# Of the points asked for last: those of a few cameras.
_MAX_KNOWN = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class PosedMesh:
    """A mesh with its joints at some values.

    mesh : as stored, the same object in all poses
    motion : (joints + 1, 4, 4) body_from_stored of each group; None where all are as stored
    """

    mesh: Mesh
    joints: tuple[Joint, ...] = ()
    motion: Array | None = None

    @cached_property
    def digest(self) -> str:
        """Hash of the content, the key of anything worked out from it."""
        if self.motion is None:
            return self.mesh.digest
        h = hashlib.sha256(self.mesh.digest.encode())
        h.update(groups_of_parts(self.mesh, self.joints).tobytes())
        h.update(self.motion.tobytes())
        return h.hexdigest()

    @property
    def groups(self) -> tuple[RigidGroup, ...]:
        """The rigid groups that have triangles."""
        return rigid_groups(self.mesh, self.joints)

    @cached_property
    def hull(self) -> Array:
        """(k, 3) points whose convex hull is that of the mesh, body axes [m]."""
        motion = self.motion
        if motion is None:
            return self.mesh.hull
        moved = [g.hull @ motion[g.index, :3, :3].T + motion[g.index, :3, 3] for g in self.groups]
        return np.concatenate(moved)

    @cached_property
    def hull_edges(self) -> IndexArray:
        """(n, 2) which points of ``hull`` edges of their convex hull join, or more pairs."""
        return self.mesh.hull_edges if self.motion is None else hull_edges(self.hull)

    @cached_property
    def centre(self) -> Array:
        """(3,) middle of the bounding box [m]."""
        if self.motion is None:
            return self.mesh.centre
        return 0.5 * (self.hull.min(axis=0) + self.hull.max(axis=0))

    @cached_property
    def radius(self) -> float:
        """Radius of the bounding sphere about ``centre`` [m]."""
        if self.motion is None:
            return self.mesh.radius
        return float(np.linalg.norm(self.hull - self.centre, axis=1).max())

    def winding_number(self, point: Array) -> float:
        """How often the surface encloses a point (3,) in body axes: 0 outside, 1 inside one part.

        The sum over the groups: each sees the point where it was before the joints moved.
        """
        motion = self.motion
        if motion is None:
            return self.mesh.winding_number(point)
        total = 0.0
        for group in self.groups:
            body_from_stored = motion[group.index]
            stored = body_from_stored[:3, :3].T @ (point - body_from_stored[:3, 3])
            total += self.mesh.winding_number(stored, group.triangles)
        return total

    def distance(self, point: Array) -> float:
        """From a point (3,) in body axes to the nearest triangle [m]."""
        motion = self.motion
        if motion is None:
            return self.mesh.distance(point)
        nearest = np.inf
        for group in self.groups:
            body_from_stored = motion[group.index]
            stored = body_from_stored[:3, :3].T @ (point - body_from_stored[:3, 3])
            nearest = min(nearest, self.mesh.distance(stored, group.triangles))
        return nearest

    @cached_property
    def _known(self) -> list[_Known]:
        return []

    def encloses(self, point: Array) -> bool:
        """Whether a point (3,) in body axes lies inside the surface.

        The sum over all triangles takes 10 ms. Of a closed surface, what it says of a point holds
        as far around as no triangle is: a second point asks for that distance, and those near it
        need no sum.
        """
        if not are_closed(self.mesh, self.joints if self.motion is not None else ()):
            return self.winding_number(point) > 0.5
        for known in self._known:
            if np.linalg.norm(point - known.point) < known.reach:
                return known.inside
        inside = self.winding_number(point) > 0.5
        # A little less, for the sum and the distance are rounded.
        reach = 0.999 * self.distance(point) if self._known else 0.0
        self._known[_MAX_KNOWN - 1 :] = []
        self._known.insert(0, _Known(point=point.copy(), inside=inside, reach=reach))
        return inside

    def of_triangles(self, vectors: Array32) -> Array32:
        """(m, 3) directions of the mesh's triangles, as stored, turned as these are."""
        if self.motion is None:
            return vectors
        turned = vectors.copy()
        for group in self.groups:
            turned[group.triangles] = vectors[group.triangles] @ self.motion[group.index, :3, :3].T
        return turned

    def moved_from(self, earlier: PosedMesh, mesh: Mesh) -> PosedMesh:
        """Another mesh of the same parts that was made at an earlier pose, moved to this one.

        earlier : of the same joints
        """
        rest = np.tile(np.eye(4), (len(self.joints) + 1, 1, 1))
        first, second = (rest if p.motion is None else p.motion for p in (earlier, self))
        motion = relative_motion(first, second)
        moved = not np.array_equal(motion, rest)
        return PosedMesh(mesh=mesh, joints=self.joints, motion=motion if moved else None)

    def baked(self) -> Mesh:
        """The pose as a mesh of its own; what has not moved stays to the bit."""
        if self.motion is None:
            return self.mesh
        positions, normals = self.mesh.positions.copy(), self.mesh.normals.copy()
        group_of_vertex = groups_of_parts(self.mesh, self.joints)[self.mesh.part]
        for index, matrix in enumerate(self.motion):
            chosen = group_of_vertex == index
            if np.array_equal(matrix, np.eye(4)) or not np.any(chosen):
                continue
            positions[chosen] = self.mesh.positions[chosen] @ matrix[:3, :3].T + matrix[:3, 3]
            normals[chosen] = self.mesh.normals[chosen] @ matrix[:3, :3].T
        return replace(self.mesh, positions=positions, normals=normals)
