"""Triangle meshes in body axes, and the primitives of calibration scenes."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Hashable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np
import scipy
from numpy.typing import ArrayLike

from simgl.arrays import Array, Array32, IndexArray, UIntArray
from simgl.scene.convex_hull import convex_hull

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")


def cached_with_mesh(make: Callable[[Mesh, Key], Result]) -> Callable[[Mesh, Key], Result]:
    """Decorates a function of a mesh: its results live as long as the mesh, which none may hold."""
    results: WeakKeyDictionary[Mesh, dict[Key, Result]] = WeakKeyDictionary()

    @functools.wraps(make)
    def cached(mesh: Mesh, key: Key) -> Result:
        of_mesh = results.setdefault(mesh, {})
        if key not in of_mesh:
            of_mesh[key] = make(mesh, key)
        return of_mesh[key]

    return cached


def position_ids(positions: Array32) -> IndexArray:
    """(n,) one number for each place (n, 3): vertices that coincide have the same."""
    # Adding zero makes -0 and 0 the same bits. Two keys of integers sort faster than rows.
    bits = np.ascontiguousarray(positions + np.float32(0.0)).view(">u4")
    first = bits[:, 0].astype(np.uint64) << np.uint64(32) | bits[:, 1]
    last = bits[:, 2].astype(np.uint32)
    order = np.lexsort((last, first))
    first, last = first[order], last[order]
    new = (first[1:] != first[:-1]) | (last[1:] != last[:-1])
    ids = np.zeros(len(order), dtype=np.int64)
    ids[order[1:]] = np.cumsum(new)
    return ids


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh:
    """Triangles with outward normals.

    positions : (n, 3) float32 [m]
    normals : (n, 3) float32, unit
    triangles : (m, 3) uint32 vertex indices, counter-clockwise seen from outside
    part : (n,) uint32 index of the part that a vertex belongs to
    material : (n,) uint32 index of its material
    uv : (n, 2) float32 place in its material's images, v down from the top row; None without images
    colour : (n, 4) float32 factors of red, green, blue reflectance and of coverage; None for all 1
    """

    positions: Array32
    normals: Array32
    triangles: UIntArray
    part: UIntArray
    material: UIntArray
    uv: Array32 | None = None
    colour: Array32 | None = None

    @cached_property
    def nbytes(self) -> int:
        """Size of its arrays."""
        arrays = (getattr(self, field.name) for field in fields(self))
        return sum(array.nbytes for array in arrays if array is not None)

    @cached_property
    def digest(self) -> str:
        """Hash of the content, the key of anything precomputed from it."""
        h = hashlib.sha256()
        for array in (self.positions, self.normals, self.triangles, self.part, self.material):
            h.update(np.ascontiguousarray(array).tobytes())
        for name, optional in (("uv", self.uv), ("colour", self.colour)):
            if optional is not None:
                h.update(name.encode())
                h.update(np.ascontiguousarray(optional).tobytes())
        return h.hexdigest()

    @cached_property
    def centre(self) -> Array:
        """(3,) middle of the bounding box [m]."""
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        return 0.5 * (low.astype(np.float64) + high.astype(np.float64))

    @cached_property
    def radius(self) -> float:
        """Radius of the bounding sphere about ``centre`` [m]."""
        offsets = self.positions.astype(np.float64) - self.centre
        return float(np.sqrt(np.max(np.sum(offsets * offsets, axis=1))))

    @cached_property
    def hull(self) -> Array:
        """(k, 3) corners of the convex hull, which bound every projection of the mesh [m]."""
        return hull_corners(self.positions.astype(np.float64))

    @cached_property
    def hull_edges(self) -> IndexArray:
        """(n, 2) corners of ``hull`` that edges join, as ``hull_edges`` gives them."""
        return hull_edges(self.hull)

    @cached_property
    def part_spheres(self) -> Array:
        """(parts, 4) middle and radius of a sphere around each part [m]; -inf without vertices."""
        count = int(self.part.max(initial=0)) + 1
        spheres = np.zeros((count, 4))
        spheres[:, 3] = -np.inf
        for part in range(count):
            points = self.positions[self.part == part].astype(np.float64)
            if len(points):
                middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
                spheres[part, :3] = middle
                spheres[part, 3] = np.sqrt(np.max(np.sum((points - middle) ** 2, axis=1)))
        return spheres

    def winding_number(self, point: Array, chosen: IndexArray | None = None) -> float:
        """How often the surface encloses a point: 0 outside, 1 inside one closed part.

        chosen : (k,) the triangles that count; None for all

        Sum of their signed solid angles over 4 pi (Van Oosterom & Strackee 1983).
        """
        triangles = self.triangles if chosen is None else self.triangles[chosen]
        a, b, c = np.moveaxis(self.positions[triangles].astype(np.float64) - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
        denominator = (
            la * lb * lc
            + np.einsum("ij,ij->i", a, b) * lc
            + np.einsum("ij,ij->i", b, c) * la
            + np.einsum("ij,ij->i", c, a) * lb
        )
        return float(np.sum(np.arctan2(numerator, denominator)) / (2.0 * np.pi))

    def is_closed(self, chosen: IndexArray | None = None) -> bool:
        """Whether the triangles leave no edge free: each has a neighbour wound the other way.

        chosen : (k,) the triangles that count; None for all
        """
        triangles = self.triangles if chosen is None else self.triangles[chosen]
        corners = position_ids(self.positions)[triangles]
        edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
        one_way, other_way = (
            np.sort(edges[:, a] * len(self.positions) + edges[:, 1 - a]) for a in (0, 1)
        )
        return bool(np.array_equal(one_way, other_way))

    def distance(self, point: Array, chosen: IndexArray | None = None) -> float:
        """From a point (3,) to the nearest of the triangles [m].

        chosen : (k,) the triangles that count; None for all
        """
        triangles = self.triangles if chosen is None else self.triangles[chosen]
        corners = np.moveaxis(self.positions[triangles].astype(np.float64) - point, 1, 0)
        nearest2 = np.full(len(triangles), np.inf)
        over = np.ones(len(triangles), dtype=bool)
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        for start, end in zip(corners, (b, c, a), strict=True):
            edge = end - start
            length2 = np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-300)
            along = np.clip(-np.einsum("ij,ij->i", start, edge) / length2, 0.0, 1.0)
            foot = start + along[:, None] * edge
            nearest2 = np.minimum(nearest2, np.einsum("ij,ij->i", foot, foot))
            # Above the triangle the point lies on the inner side of each edge.
            over &= np.einsum("ij,ij->i", np.cross(normal, edge), start) <= 0.0
        area2 = np.einsum("ij,ij->i", normal, normal)
        height2 = np.einsum("ij,ij->i", normal, a) ** 2 / np.maximum(area2, 1e-300)
        return float(np.sqrt(np.min(np.where(over & (area2 > 0.0), height2, nearest2))))


def hull_corners(points: Array) -> Array:
    """(k, 3) corners of the convex hull of points (n, 3).

    Points in a plane have none; the corners of their bounding box serve.
    """
    hull = convex_hull(points)
    if hull is not None:
        return points[hull.corners]
    low, high = points.min(axis=0), points.max(axis=0)
    choice = np.indices((2, 2, 2)).reshape(3, -1).T
    return np.where(choice, high, low)


def hull_edges(points: Array) -> IndexArray:
    """(n, 2) which of the points (k, 3) edges of their convex hull join, or more pairs of them."""
    try:
        triangles = scipy.spatial.ConvexHull(points).simplices
    except scipy.spatial.QhullError:  # flat
        return np.stack(np.triu_indices(len(points), 1), axis=-1)
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _single(positions: ArrayLike, normals: ArrayLike, triangles: ArrayLike) -> Mesh:
    points = np.asarray(positions, dtype=np.float32)
    label = np.zeros(len(points), dtype=np.uint32)
    return Mesh(
        positions=points,
        normals=np.asarray(normals, dtype=np.float32),
        triangles=np.asarray(triangles, dtype=np.uint32),
        part=label,
        material=label,
    )


def box(size: tuple[float, float, float]) -> Mesh:
    """A box about the origin; size along x, y, z [m]."""
    positions: list[Array] = []
    normals: list[Array] = []
    triangles: list[tuple[int, int, int]] = []
    half = 0.5 * np.asarray(size)
    for axis in range(3):
        for sign in (-1.0, 1.0):
            n = np.zeros(3)
            n[axis] = sign
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3] * sign
            first = len(positions)
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                positions.append((n + s * u + t * v) * half)
                normals.append(n)
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return _single(positions, normals, triangles)


def plate(width: float, height: float) -> Mesh:
    """A thin rectangle, width along x and height along y [m], facing +z; 1/1000 of its size thick.

    A box whose +z face lies in the plane z = 0, so that the plate has a back and casts shadows.
    """
    thickness = 1e-3 * min(width, height)
    slab = box((width, height, thickness))
    shift = np.array([0.0, 0.0, -0.5 * thickness], dtype=np.float32)
    return _single(slab.positions + shift, slab.normals, slab.triangles)


def sphere(radius: float, segments: int = 192) -> Mesh:
    """A sphere about the origin [m] with exact vertex normals.

    Its facets lie as much outside the sphere as inside it: it has the sphere's volume. With 192
    segments they stay within 1.5e-4 of the radius, where corners on the sphere would put all of
    them inside it, by up to 2.7e-4.
    """
    rings = segments // 2
    theta = np.linspace(0.0, np.pi, rings + 1)
    phi = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    normals = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    normals = normals.reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij")
    a = (i * (segments + 1) + j).ravel()
    b, c, d = a + 1, a + segments + 1, a + segments + 2
    upper = np.stack([a, c, d], axis=1)[i.ravel() < rings - 1]
    lower = np.stack([a, d, b], axis=1)[i.ravel() > 0]
    triangles = np.concatenate([upper, lower])
    # Of the parts between the centre and each triangle; corners at distance 1.
    volume = float(np.linalg.det(normals[triangles]).sum()) / 6.0
    beyond = (4.0 / 3.0 * np.pi / volume) ** (1.0 / 3.0)
    return _single(beyond * radius * normals, normals, triangles)


def cylinder(radius: float, length: float, segments: int = 192) -> Mesh:
    """A closed cylinder about the z axis, centred on the origin [m]."""
    phi = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    ring = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=1)
    half = np.array([0.0, 0.0, 0.5 * length])
    positions = [radius * ring - half, radius * ring + half]
    normals = [ring, ring]
    n = segments + 1
    j = np.arange(segments)
    triangles = [
        np.stack([j, j + 1, j + 1 + n], axis=1),
        np.stack([j, j + 1 + n, j + n], axis=1),
    ]
    for sign in (-1.0, 1.0):
        first = sum(len(p) for p in positions)
        positions += [radius * ring + sign * half, (sign * half)[None, :]]
        normals += [np.tile([0.0, 0.0, sign], (n, 1)), np.array([[0.0, 0.0, sign]])]
        fan = np.stack([np.full(segments, first + n), first + j, first + j + 1], axis=1)
        triangles.append(fan if sign > 0 else fan[:, ::-1])
    return _single(np.concatenate(positions), np.concatenate(normals), np.concatenate(triangles))
