"""Spacecraft models from arrays in memory: vertices and triangles, or a ``trimesh.Trimesh``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import AnyArray, Array, IndexArray
from simgl.errors import AssetError
from simgl.model_files.surface_tables import load_finish
from simgl.scene.materials import MAX_MATERIALS, Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel

# Bare aluminium-like grey of meshes without a material.
PLAIN = Material(name="plain", reflectance=(0.5, 0.5, 0.5, 0.5), roughness=0.6)


# Of one model: 2 GB while it is read. Places in a file count once for each part that shows them.
MAX_TRIANGLES, MAX_VERTICES = 5_000_000, 15_000_000
# A part's number has 16 bits in the truth.
MAX_PARTS = 50_000


def check_size(where: str, triangles: int, vertices: int, parts: int = 1) -> None:
    """Raise AssetError, which starts with ``where``, for a model too large to be drawn."""
    for what, count, limit in (
        ("triangles", triangles, MAX_TRIANGLES),
        ("vertices", vertices, MAX_VERTICES),
        ("parts", parts, MAX_PARTS),
    ):
        if count > limit:
            raise AssetError(f"{where}: holds {count} {what}, at most {limit} are drawn")


class TriangleMesh(Protocol):
    """What is read of a mesh object; ``trimesh.Trimesh`` has it."""

    @property
    def vertices(self) -> Any:
        """(n, 3) real numbers."""

    @property
    def faces(self) -> Any:
        """(m, 3) indices of vertices."""


def face_normals(positions: AnyArray, triangles: AnyArray) -> Array:
    """(m, 3) unit normals of triangles; zero for a degenerate one."""
    a, b, c = np.moveaxis(positions[triangles].astype(np.float64), 1, 0)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0)


def unit_normals(given: AnyArray, positions: AnyArray, triangles: AnyArray) -> tuple[Array, int]:
    """(n, 3) unit normals of vertices, and how many have no direction: zero or not finite.

    given : (n, 3) of any length

    Those without get the mean of the triangles at the vertex, by area; zero if these have none.
    """
    length = np.linalg.norm(given, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > 0.0)
    unit = np.divide(given, length, out=np.zeros(given.shape), where=usable)
    without = ~usable[:, 0]
    if np.any(without):
        a, b, c = np.moveaxis(positions[triangles].astype(np.float64), 1, 0)
        sums = np.zeros(given.shape)
        np.add.at(sums, triangles.T, np.cross(b - a, c - a))
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        facets = np.divide(sums, length, out=np.zeros(given.shape), where=length > 0.0)
        unit[without] = facets[without]
    return unit, int(np.count_nonzero(without))


def model_from_mesh(
    mesh: TriangleMesh | tuple[ArrayLike, ArrayLike],
    *,
    name: str = "mesh",
    materials: Sequence[Material | str] = (PLAIN,),
    material_of_triangle: ArrayLike | None = None,
    parts: Sequence[str] | None = None,
    part_of_triangle: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    keypoints: Mapping[str, ArrayLike] | None = None,
    unit_m: float = 1.0,
    double_sided: bool = True,
) -> SpacecraftModel:
    """A spacecraft model of a mesh in memory, in body axes.

    mesh : a ``trimesh.Trimesh``, or (vertices, triangles): (n, 3) real numbers and (m, 3) indices,
        counter-clockwise seen from outside
    name : of the model
    materials : materials, or names of finishes
    material_of_triangle : (m,) index into ``materials``; the first one if omitted
    parts : names of the parts; one part of the model's name if omitted
    part_of_triangle : (m,) index into ``parts``; the first one if omitted
    normals : (n, 3) of the vertices, of any length; flat facets if omitted
    keypoints : name to (3,) position in body axes [m]
    unit_m : metres per unit of the vertices
    double_sided : both sides of each triangle are visible; a closed mesh may say False

    Raises AssetError for wrong shapes, indices out of range, and numbers that are not finite.

    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> model = simgl.model_from_mesh((corners, faces), name="tetra", materials=["white_paint"])
    >>> model.mesh.positions.shape  # each facet has its own three vertices
    (12, 3)
    """
    where = f'mesh "{name}"'
    if not 0.0 < unit_m < np.inf:
        raise AssetError(f"{where}: unit_m must be positive and finite, got {unit_m}")
    given = mesh if isinstance(mesh, tuple) else (mesh.vertices, mesh.faces)
    vertices = unit_m * _vectors(where, "vertices", given[0])
    triangles = _indices(where, "triangles", given[1], ("m", 3), "vertices", len(vertices))
    directions = None if normals is None else _vectors(where, "normals", normals)
    if directions is not None and len(directions) != len(vertices):
        raise AssetError(f"{where}: has {len(directions)} normals for {len(vertices)} vertices")
    check_size(where, len(triangles), len(vertices), 1 if parts is None else len(parts))
    surfaces = tuple(load_finish(m) if isinstance(m, str) else m for m in materials)
    if len(surfaces) > MAX_MATERIALS:
        raise AssetError(
            f"{where}: has {len(surfaces)} materials, at most {MAX_MATERIALS} are drawn"
        )
    names = (name,) if parts is None else tuple(parts)

    def labels(what: str, values: ArrayLike | None, labelled: str, count: int) -> IndexArray:
        values = np.zeros(len(triangles), dtype=int) if values is None else values
        return _indices(where, what, values, (len(triangles),), labelled, count)

    return SpacecraftModel(
        name=name,
        mesh=mesh_of_triangles(
            where,
            vertices,
            triangles,
            directions,
            part=labels("part_of_triangle", part_of_triangle, "parts", len(names)),
            material=labels(
                "material_of_triangle", material_of_triangle, "materials", len(surfaces)
            ),
        ),
        parts=names,
        materials=surfaces,
        keypoints={
            key: _vectors(where, f"keypoint {key}", np.atleast_2d(place))[0]
            for key, place in (keypoints or {}).items()
        },
        open_sheets=double_sided,
    )


def mesh_of_triangles(
    where: str,
    vertices: Array,
    triangles: IndexArray,
    normals: Array | None = None,
    part: IndexArray | int = 0,
    material: IndexArray | int = 0,
) -> Mesh:
    """A mesh of labelled triangles.

    vertices : (n, 3) in body axes [m]
    triangles : (m, 3)
    normals : (n, 3) of the vertices, of any length; None for flat facets, which share no vertices
    part, material : (m,) of the triangles

    Raises AssetError, which starts with ``where``, for vertices beyond float32.
    """
    corner = triangles.ravel()
    labels = np.stack(
        [np.repeat(np.broadcast_to(label, len(triangles)), 3) for label in (part, material)]
    )
    index = np.arange(len(corner))
    if normals is not None:
        # Triangles of one part and material share their vertices.
        _, first, index = np.unique(np.stack([corner, *labels]), True, True, axis=1)
        corner, labels = corner[first], labels[:, first]
    with np.errstate(over="ignore", invalid="ignore"):  # beyond float32 lies infinity
        positions = vertices[corner].astype(np.float32)
    if not np.all(np.isfinite(positions)):
        raise AssetError(f"{where}: holds vertices that are not finite")
    if normals is None:
        directions = np.repeat(face_normals(vertices, triangles), 3, axis=0)
    else:
        directions = unit_normals(normals, vertices, triangles)[0][corner]
    return Mesh(
        positions=positions,
        normals=directions.astype(np.float32),
        triangles=index.reshape(-1, 3).astype(np.uint32),
        part=labels[0].astype(np.uint32),
        material=labels[1].astype(np.uint32),
    )


def _vectors(where: str, what: str, values: ArrayLike) -> Array:
    """(n, 3) finite float64."""
    try:
        vectors = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise AssetError(f"{where}: {what} must be an array of numbers") from None
    if vectors.ndim != 2 or vectors.shape[1] != 3:
        raise AssetError(f"{where}: {what} must have the shape (n, 3), got {vectors.shape}")
    if not np.all(np.isfinite(vectors)):
        raise AssetError(f"{where}: {what} holds numbers that are not finite")
    return vectors


def _indices(
    where: str, what: str, values: ArrayLike, shape: tuple[int | str, ...], indexed: str, count: int
) -> IndexArray:
    """Whole numbers from 0 to below ``count``, the number of what is ``indexed``.

    shape : of the array; a letter stands for any length but 0
    """
    index = np.asarray(values)
    pairs = list(zip(shape, index.shape, strict=False))
    if index.ndim != len(shape) or index.size == 0 or any(n != m for n, m in pairs if n != "m"):
        wanted = f"({', '.join(map(str, shape))})"
        raise AssetError(f"{where}: {what} must have the shape {wanted}, got {index.shape}")
    if index.dtype.kind not in "iu":
        raise AssetError(f"{where}: {what} must be whole numbers, got {index.dtype}")
    wrong = index[(index < 0) | (index >= count)]
    if wrong.size:
        raise AssetError(f"{where}: {what} holds index {wrong[0]}, but there are {count} {indexed}")
    return index.astype(np.int64)
