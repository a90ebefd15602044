"""Which triangles of a mesh turn their front to a place, of a solid about half, and are in view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask, UIntArray
from simgl.motion.joints import Joint
from simgl.scene.mesh import Mesh, cached_with_mesh
from simgl.scene.posed_mesh import PosedMesh, rigid_groups

# How far behind a triangle's plane a place may lie and yet count as before it, as a part of their
# distance: where corners are rounded to 1/256 of a texel, a triangle seen on its edge may turn.
_GRAZING = 1e-3
# Triangles whose distances are one product: for more, BLAS may wake its threads, which keep a core
# busy for as long as a frame takes.
_AT_ONCE = 1 << 15
# Neighbours that are in view or out of it together.
_CLUSTER = 32
# As a part of distances: by so much rounding moves a cluster against a plane.
_ROUNDING = 1e-5
# Bits of each coordinate in a place on the curve.
_BITS = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class _Facets:
    """Triangles of one rigid group, neighbours close to each other.

    group : index of its motion
    numbers : (k,) of the triangles in the mesh
    planes : (4, k) unit normal, and the distance of the origin before the plane [m]; all 0 for a
        triangle without area
    spheres : (4, c) middle and radius [m], around ``_CLUSTER`` triangles each, one after the other
    """

    group: int
    numbers: UIntArray
    planes: Array32
    spheres: Array


def _along_a_curve(places: Array) -> IndexArray:
    """Order of places (k, 3) along Morton's curve."""
    low, extent = places.min(axis=0), max(float(np.ptp(places, axis=0).max()), 1e-30)
    steps = ((places - low) * ((1 << _BITS) - 1) / extent).astype(np.int64)
    along = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            along |= (steps[:, axis] >> bit & 1) << 3 * bit + axis
    return np.argsort(along, kind="stable")


def _planes(corners: Array) -> Array32:
    """(4, k) as ``_Facets`` has them, of corners (k, 3, 3)."""
    first, second, third = np.moveaxis(corners, 1, 0)
    across = np.cross(second - first, third - first)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    normals = across / np.where(length > 0.0, length, 1.0)
    before = -np.einsum("ij,ij->i", normals, first)
    return np.vstack([normals.T, before]).astype(np.float32)


def _spheres(corners: Array) -> Array:
    """(4, c) as ``_Facets`` has them, of corners (k, 3, 3)."""
    starts = np.arange(0, len(corners), _CLUSTER)
    low = np.minimum.reduceat(corners.min(axis=1), starts)
    high = np.maximum.reduceat(corners.max(axis=1), starts)
    return np.vstack([0.5 * (low + high).T, 0.5 * np.linalg.norm(high - low, axis=1)])


@cached_with_mesh
def _facets(mesh: Mesh, joints: tuple[Joint, ...]) -> tuple[_Facets, ...]:
    facets = []
    for group in rigid_groups(mesh, joints):
        corners = mesh.positions[mesh.triangles[group.triangles]].astype(np.float64)
        order = _along_a_curve(corners.mean(axis=1))
        for start in range(0, len(order), _AT_ONCE):
            some = order[start : start + _AT_ONCE]
            facets.append(
                _Facets(
                    group=group.index,
                    numbers=group.triangles[some].astype(np.uint32),
                    planes=_planes(corners[some]),
                    spheres=_spheres(corners[some]),
                )
            )
    return tuple(facets)


def facing_triangles(
    posed: PosedMesh, places: Array, between: float = 0.0, sides: Array | None = None
) -> UIntArray:
    """(k,) numbers of the triangles whose front any of several places sees, and of those that they
    see on their edge.

    places : (n, 3) body axes [m]
    between : how far from straight lines between them others are that count, too [m]
    sides : (m, 3) unit normals of planes through the first place, body axes: those that lie behind
        one of them are out of view, and left out but for some near it. None for all

    Neighbours are close to each other: vertices that they share are transformed once, and texels
    that they read are at hand.
    """
    facing = []
    for facets in _facets(posed.mesh, posed.joints if posed.motion is not None else ()):
        seen_from = places
        if posed.motion is not None:
            body_from_stored = posed.motion[facets.group]
            seen_from = (places - body_from_stored[:3, 3]) @ body_from_stored[:3, :3]
        away = np.linalg.norm(seen_from - posed.mesh.centre, axis=1)
        threshold = -_GRAZING * (float(away.max()) + posed.mesh.radius) - between
        chosen = _farthest_before(facets.planes, seen_from) > threshold
        if sides is not None:
            turned = sides if posed.motion is None else sides @ posed.motion[facets.group, :3, :3]
            chosen &= _in_view(facets, seen_from[0], turned)
        # A mask as an index takes numpy six times as long.
        facing.append(facets.numbers.compress(chosen))
    return np.concatenate(facing) if facing else np.zeros(0, dtype=np.uint32)


def _farthest_before(planes: Array32, places: Array) -> Array32:
    """(k,) how far the farthest of places (n, 3) lies before each of planes (4, k) [m]."""
    first, *others = np.column_stack([places, np.ones(len(places))]).astype(np.float32)
    before = first @ planes
    for other in others:
        np.maximum(before, other @ planes, out=before)
    return np.asarray(before)


def _in_view(facets: _Facets, place: Array, sides: Array) -> Mask:
    """(k,) of the triangles of clusters that reach before all planes through a place, as stored."""
    middles, radii = facets.spheres[:3] - place[:, None], facets.spheres[3]
    slack = _ROUNDING * np.sqrt((middles**2).sum(axis=0))
    reaching = (sides @ middles >= -(radii + slack)).all(axis=0)
    return np.repeat(reaching, _CLUSTER)[: len(facets.numbers)]
