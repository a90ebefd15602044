"""Closed triangle surfaces from parameters: boxes, lofts, lathes, pipes, shells.

Every builder returns a Shape whose triangles run counter-clockwise seen from outside, so normals
follow from the triangles alone. Solids of revolution lie along +x until they are turned.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, IndexArray, Mask

# Edges sharper than this stay hard. The coarsest round things have ten sides, which bend 36
# degrees; the flattest edge meant to be seen, on the service module's skirt, bends 45.
CREASE = np.radians(40.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """A closed surface of triangles, counter-clockwise seen from outside.

    vertices : (n, 3) positions in the frame of the part it belongs to [m]
    triangles : (m, 3) rows of `vertices`
    materials : (m,) the name of the material each triangle wears
    """

    vertices: Array
    triangles: IndexArray
    materials: NDArray[np.str_]

    def moved(self, offset: ArrayLike) -> Self:
        """The shape shifted by `offset` (3,) [m]."""
        return replace(self, vertices=self.vertices + np.asarray(offset))

    def turned(self, rotation: Rotation) -> Self:
        """The shape rotated about its frame's origin."""
        return replace(self, vertices=rotation.apply(self.vertices))

    def mirrored(self) -> Self:
        """The shape's mirror image in the plane y = 0."""
        return replace(
            self,
            vertices=self.vertices * [1.0, -1.0, 1.0],
            triangles=self.triangles[:, ::-1].copy(),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadedMesh:
    """A shape with its vertices split where an edge is hard.

    positions : (n, 3) [m]; normals : (n, 3) unit, outward; triangles : (m, 3)
    materials : (m,) material names
    """

    positions: Array
    normals: Array
    triangles: IndexArray
    materials: NDArray[np.str_]


def closed(vertices: Array, triangles: IndexArray, material: str | NDArray[np.str_]) -> Shape:
    """A shape from a consistently wound closed surface, turned to face outward."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:  # six times the signed volume
        triangles = triangles[:, ::-1].copy()
    names = np.broadcast_to(np.asarray(material, dtype=np.str_), len(triangles)).copy()
    return Shape(vertices=vertices, triangles=triangles, materials=names)


def grid_triangles(index: IndexArray) -> IndexArray:
    """Two triangles per cell of a grid of vertex numbers.

    index : (r, c) vertex numbers; a number repeated along a cell's side collapses that side
    returns : (m, 3), row-major in cells, collapsed triangles left out
    """
    a, b = index[:-1, :-1], index[:-1, 1:]
    c, d = index[1:, 1:], index[1:, :-1]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], -2).reshape(-1, 3)
    distinct: Mask = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    retained: IndexArray = triangles[distinct]
    return retained


def boundary_edges(triangles: IndexArray) -> IndexArray:
    """(k, 2) directed edges that no neighbouring triangle runs along the other way."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    stride = int(triangles.max()) + 1
    forward = edges[:, 0] * stride + edges[:, 1]
    backward = edges[:, 1] * stride + edges[:, 0]
    return edges[~np.isin(forward, backward)]


def wall_triangles(edges: IndexArray, counterpart: IndexArray) -> IndexArray:
    """Triangles between boundary edges and the same edges moved.

    edges : (k, 2) from `boundary_edges`; counterpart[v] is the moved copy of vertex v
    """
    a, b = edges.T
    a_moved, b_moved = counterpart[a], counterpart[b]
    return np.concatenate([np.stack([b, a, a_moved], -1), np.stack([b, a_moved, b_moved], -1)])


def box(material: str, size: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Shape:
    """A box with edges `size` (3,) [m] along the axes, about `centre` (3,) [m]."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return closed(corners * np.asarray(size) + np.asarray(centre), triangles, material)


def loft(material: str | Sequence[str], rings: Sequence[Array], *, torus: bool = False) -> Shape:
    """A surface through rings of points, closed by a single point at each end.

    material : one name, or one for each band between neighbouring rings
    rings : (k, 3) each, all with the same k, or (1, 3) for a point [m]
    torus : join the last ring to the first instead of ending in points
    """
    count = max(len(ring) for ring in rings)
    starts = np.cumsum([0] + [len(ring) for ring in rings[:-1]])
    rows = [
        start + (np.arange(count + 1) % count if len(ring) > 1 else np.zeros(count + 1, int))
        for start, ring in zip(starts, rings, strict=True)
    ]
    if torus:
        rows.append(rows[0])
    bands = [grid_triangles(np.stack(pair)) for pair in pairwise(rows)]
    names = [material] * len(bands) if isinstance(material, str) else material
    worn = np.concatenate(
        [np.full(len(band), name) for band, name in zip(bands, names, strict=True)]
    )
    return closed(np.concatenate(rings), np.concatenate(bands), worn)


def circle(x: float, radius: float, segments: int) -> Array:
    """(segments, 3) points about the x axis, or the one point (1, 3) where radius is 0 [m]."""
    if radius == 0.0:
        return np.array([[x, 0.0, 0.0]])
    angle = 2.0 * np.pi * np.arange(segments) / segments
    return np.stack([np.full(segments, x), radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def lathe(
    material: str | Sequence[str], profile: ArrayLike, segments: int, *, torus: bool = False
) -> Shape:
    """A solid of revolution about the x axis.

    profile : (k, 2) of x and radius [m]; starts and ends on the axis unless `torus`
    """
    rings = [circle(float(x), float(r), segments) for x, r in np.asarray(profile)]
    return loft(material, rings, torus=torus)


def sphere(material: str, radius: float, segments: int) -> Shape:
    """A sphere about the origin, `segments` around and half as many from pole to pole."""
    polar = np.linspace(0.0, np.pi, segments // 2 + 1)
    profile = np.stack([radius * np.cos(polar), radius * np.sin(polar)], axis=-1)
    profile[[0, -1], 1] = 0.0
    return lathe(material, profile, segments)


def pointing(direction: ArrayLike) -> Rotation:
    """The rotation that takes +x to `direction` (3,) by the shortest way, any length."""
    target = np.asarray(direction, dtype=float)
    target = target / np.linalg.norm(target)
    axis = np.cross([1.0, 0.0, 0.0], target)
    if np.linalg.norm(axis) < 1e-12:  # parallel: no turn, or half a turn about z
        return Rotation.from_rotvec([0.0, 0.0, 0.0 if target[0] > 0.0 else np.pi])
    angle = np.arctan2(np.linalg.norm(axis), target[0])
    return Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle)


def rod(material: str, start: ArrayLike, end: ArrayLike, radius: float, segments: int) -> Shape:
    """A round rod with flat ends from `start` to `end` (3,) [m]."""
    axis = np.asarray(end, dtype=float) - np.asarray(start, dtype=float)
    length = float(np.linalg.norm(axis))
    profile = [(0.0, 0.0), (0.0, radius), (length, radius), (length, 0.0)]
    return lathe(material, profile, segments).turned(pointing(axis)).moved(start)


def tube(material: str, x: tuple[float, float], radii: tuple[float, float], segments: int) -> Shape:
    """An open tube along the x axis between two x, with inner and outer radius [m]."""
    (x0, x1), (inner, outer) = x, radii
    profile = [(x0, inner), (x0, outer), (x1, outer), (x1, inner)]
    return lathe(material, profile, segments, torus=True)


def handrail(material: str, start: ArrayLike, end: ArrayLike, rise: ArrayLike) -> list[Shape]:
    """A grip on two posts: rods of 22 mm, standing `rise` (3,) [m] off its feet."""
    a, b, up = (np.asarray(v, dtype=float) for v in (start, end, rise))
    radius, overhang = 0.011, 0.011 * (b - a) / np.linalg.norm(b - a)
    return [
        rod(material, a, a + up, radius, 10),
        rod(material, b, b + up, radius, 10),
        rod(material, a + up - overhang, b + up + overhang, radius, 10),
    ]


def slab(
    materials: tuple[str, str, str],
    x: tuple[float, float],
    y: tuple[float, float],
    thickness: float,
) -> Shape:
    """A flat plate from z = 0 down to z = `thickness`; materials as for `shell` [m]."""
    front = np.array([[[a, b, 0.0] for b in y] for a in x])
    return shell(materials, front, front + np.array([0.0, 0.0, thickness]))


def prism(material: str, outline: ArrayLike, width: float) -> Shape:
    """A convex outline (k, 2) of x and z [m], drawn out along y to `width` about y = 0."""
    x, z = np.asarray(outline, dtype=float).T
    near = np.stack([x, np.full_like(x, -0.5 * width), z], axis=-1)
    far = near * np.array([1.0, -1.0, 1.0])
    ends = near.mean(axis=0, keepdims=True), far.mean(axis=0, keepdims=True)
    return loft(material, [ends[0], near, far, ends[1]])


def shell(materials: tuple[str, str, str], front: Array, back: Array) -> Shape:
    """A sheet with thickness between two grids of points.

    materials : names for the front, the back and the rim
    front, back : (r, c, 3) matching points on either side [m]
    """
    count = front.shape[0] * front.shape[1]
    faces = grid_triangles(np.arange(count).reshape(front.shape[:2]))
    rim = wall_triangles(boundary_edges(faces), np.arange(count, 2 * count))
    triangles = np.concatenate([faces, faces[:, ::-1] + count, rim])
    worn = np.repeat(np.asarray(materials), [len(faces), len(faces), len(rim)])
    vertices = np.concatenate([front.reshape(-1, 3), back.reshape(-1, 3)])
    return closed(vertices, triangles, worn)


def _corner_angles(corners: Array) -> Array:
    """(m, 3) interior angle at each corner of (m, 3, 3) triangles [rad]."""
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(ahead, behind), axis=-1)
    angles: Array = np.arctan2(sine, np.einsum("ijk,ijk->ij", ahead, behind))
    return angles


def _pairs_at_vertices(flat: IndexArray) -> tuple[IndexArray, IndexArray]:
    """All ordered pairs of triangle corners that share a vertex, a corner with itself included.

    flat : (3m,) vertex number of each corner
    """
    order = np.argsort(flat, kind="stable")
    counts = np.bincount(flat)
    starts = np.cumsum(counts) - counts
    per_corner = counts[flat[order]]
    left = np.repeat(order, per_corner)
    within = np.arange(len(left)) - np.repeat(np.cumsum(per_corner) - per_corner, per_corner)
    right = order[np.repeat(starts[flat[order]], per_corner) + within]
    return left, right


def shaded(shape: Shape) -> ShadedMesh:
    """The shape with normals: each corner averages its neighbours across soft edges only.

    Neighbours are weighted by their angle at the vertex, which makes the result independent of
    how a face was cut into triangles.
    """
    flat = shape.triangles.ravel()
    corners = shape.vertices[shape.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    angles = _corner_angles(corners).ravel()
    left, right = _pairs_at_vertices(flat)
    soft = np.einsum("ij,ij->i", faces[left // 3], faces[right // 3]) >= np.cos(CREASE)
    left, right = left[soft], right[soft]
    weighted = faces[right // 3] * angles[right, None]
    sums = [np.bincount(left, weights=w, minlength=len(flat)) for w in weighted.T]
    normals: Array = np.stack(sums, axis=-1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    keys = np.concatenate([flat[:, None], np.round(normals * 1e4).astype(np.int64)], axis=1)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return ShadedMesh(
        positions=shape.vertices[flat[first]],
        normals=normals[first],
        triangles=inverse.reshape(-1, 3),
        materials=shape.materials,
    )
