"""Meshes of plane sheets, made by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgl.arrays import Array
from simgl.scene.mesh import Mesh

Point = tuple[float, float, float]
Quad = tuple[Point, Point, Point, Point]

# The open box of C6: its inside, 2 x 1 x 1 m, faces turned inwards. Floor, x = 0, x = 2, y = 0, 1.
FLOOR: Quad = ((0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0))
OPEN_BOX: tuple[Quad, ...] = (
    FLOOR,
    ((0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)),
    ((2, 0, 0), (2, 0, 1), (2, 1, 1), (2, 1, 0)),
    ((0, 0, 0), (0, 0, 1), (2, 0, 1), (2, 0, 0)),
    ((0, 1, 0), (2, 1, 0), (2, 1, 1), (0, 1, 1)),
)
LID: Quad = ((0, 0, 1), (0, 1, 1), (2, 1, 1), (2, 0, 1))


def quads(corners: Sequence[Quad]) -> Mesh:
    """Two triangles a quad, counter-clockwise; its material is its place in the list."""
    positions = np.asarray(corners, dtype=np.float64).reshape(-1, 4, 3)
    normals = np.cross(positions[:, 1] - positions[:, 0], positions[:, 3] - positions[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    first = 4 * np.arange(len(positions))[:, None, None]
    triangles = first + np.array([[0, 1, 2], [0, 2, 3]])
    label = np.repeat(np.arange(len(positions)), 4).astype(np.uint32)
    return Mesh(
        positions=positions.reshape(-1, 3).astype(np.float32),
        normals=np.repeat(normals, 4, axis=0).astype(np.float32),
        triangles=triangles.reshape(-1, 3).astype(np.uint32),
        part=np.zeros_like(label),
        material=label,
    )


def joined(*meshes: Mesh) -> Mesh:
    """One mesh of several bodies."""
    starts = np.cumsum([0, *(len(m.positions) for m in meshes)])
    return Mesh(
        positions=np.concatenate([m.positions for m in meshes]),
        normals=np.concatenate([m.normals for m in meshes]),
        triangles=np.concatenate(
            [m.triangles + np.uint32(start) for m, start in zip(meshes, starts, strict=False)]
        ),
        part=np.concatenate([m.part for m in meshes]),
        material=np.concatenate([m.material for m in meshes]),
    )


def moved(mesh: Mesh, offset: Point) -> Mesh:
    """The same body elsewhere [m]."""
    return Mesh(
        positions=mesh.positions + np.asarray(offset, dtype=np.float32),
        normals=mesh.normals,
        triangles=mesh.triangles,
        part=mesh.part,
        material=mesh.material,
    )


def doubled_areas(mesh: Mesh) -> Array:
    """(m, 3) twice the area of each triangle times its normal."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    return np.cross(b - a, c - a)


def view_at_right_angles(distance: Array, along: Array, width: float, depth: float) -> Array:
    """Form factor to a rectangle from points in a plane at right angles to it, through its edge.

    The integral of cos cos / (pi r2) over the rectangle.

    distance : (n,) of the points from the edge [m]
    along : (n,) their places along the edge [m]
    width, depth : of the rectangle, along the edge and away from it [m]
    """
    total = np.zeros_like(distance)
    far = np.hypot(distance, depth)
    for half in (along, width - along):
        total += np.arctan2(half, distance) - distance / far * np.arctan2(half, far)
    return total / (2.0 * np.pi)
