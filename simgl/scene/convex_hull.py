"""Convex hulls of points, each worked out once in a process."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import scipy

from simgl.arrays import Array, IndexArray
from simgl.lru_cache import MANY, LruCache


@dataclass(frozen=True, kw_only=True, eq=False)
class Hull:
    """The convex hull of points that do not lie in a plane.

    corners : (k,) which points are corners
    """

    corners: IndexArray
    volume: float
    area: float


# What opens a scene asks for a body's hull more than once, and the next scene often has the same
# bodies: the hull of a finely divided one takes as long as all the rest of opening it.
_hulls = LruCache[tuple[int, bytes], Hull | None](MANY, max_bytes=4 << 20)


def convex_hull(points: Array) -> Hull | None:
    """Of points (n, 3); None where they lie in a plane."""
    content = hashlib.sha256(points.tobytes()).digest()
    return _hulls.get((len(points), content), lambda: _worked_out(points), _size)


def _worked_out(points: Array) -> Hull | None:
    try:
        hull = scipy.spatial.ConvexHull(points)
    except scipy.spatial.QhullError:
        return None
    return Hull(corners=hull.vertices, volume=float(hull.volume), area=float(hull.area))


def _size(hull: Hull | None) -> int:
    return 0 if hull is None else hull.corners.nbytes
