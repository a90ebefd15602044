"""glTF 2.0 files as spacecraft models: triangles, named nodes, materials with their images.

The file is read strictly and its numbers stay in double precision:

gltf_schema  the objects of the format -> gltf_file  bytes and accessors
             -> gltf_images  pixels -> gltf_materials  surfaces -> gltf_model  the model
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simgl.arrays import AnyArray, Array, IndexArray
from simgl.config.path_sandbox import Base
from simgl.errors import AssetError, ConfigError
from simgl.model_files import gltf_schema as schema
from simgl.model_files.gltf_file import FLOAT, UNSIGNED, GltfFile
from simgl.model_files.gltf_materials import Palette, read_palette
from simgl.model_files.model_from_mesh import check_size, face_normals, unit_normals
from simgl.scene.materials import MAX_MATERIALS, Material
from simgl.scene.mesh import Mesh
from simgl.scene.solid import is_solid
from simgl.scene.spacecraft import Branch, SpacecraftModel

# A count beyond this is cut to it, so that sums stay within 64 bits.
_HUGE = 1 << 40
_DEFAULT = Material(name="default", reflectance=(1.0, 1.0, 1.0, 1.0), roughness=1.0)


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """One primitive in body axes, with the arrays of ``Mesh``."""

    positions: Array
    normals: Array
    triangles: IndexArray
    material: int
    uv: Array | None
    colour: Array | None

    def flat(self) -> _Piece:
        """With one vertex per triangle corner and the normals of the facets."""
        corners = self.triangles.ravel()
        return replace(
            self,
            positions=self.positions[corners],
            normals=np.repeat(face_normals(self.positions, self.triangles), 3, axis=0),
            triangles=np.arange(len(corners)).reshape(-1, 3),
            uv=None if self.uv is None else self.uv[corners],
            colour=None if self.colour is None else self.colour[corners],
        )


class _Part:
    """Reads the mesh of one node into body axes."""

    def __init__(self, file: GltfFile, palette: Palette, name: str, body_from_node: Array) -> None:
        self._file, self._palette, self.name = file, palette, name
        self._linear, self._offset = body_from_node[:3, :3], body_from_node[:3, 3]
        self.notes: list[str] = []
        self._volume = float(np.linalg.det(self._linear))
        if self._volume == 0.0:
            raise self._error("is scaled to nothing")

    def _error(self, problem: str) -> AssetError:
        return AssetError(f'{self._file.path}: part "{self.name}" {problem}')

    def pieces(self, mesh: int) -> list[_Piece]:
        """Its primitives, but for points and lines."""
        primitives = self._file.item("mesh", self._file.gltf.meshes, mesh).primitives
        surfaces = [one for one in primitives if one.mode >= schema.TRIANGLES]
        if len(surfaces) < len(primitives):
            self.notes.append(f'part "{self.name}": points and lines are not drawn')
        return [self._piece(primitive) for primitive in surfaces]

    def _piece(self, primitive: schema.Primitive) -> _Piece:
        given = primitive.attributes
        points = self._file.array(given.position, "VEC3", FLOAT) @ self._linear.T + self._offset
        chosen = primitive.material
        if chosen is None:
            chosen = len(self._palette.materials)
        else:
            self._file.item("material", self._palette.materials, chosen)
        piece = _Piece(
            positions=points,
            normals=np.zeros_like(points),
            triangles=self._triangles(primitive, len(points)),
            material=chosen,
            uv=self._uv(given, primitive.material, len(points)),
            colour=self._colour(given, len(points)),
        )
        if given.normal is None:
            return piece.flat()
        normals = self._file.array(given.normal, "VEC3", FLOAT)
        self._check_count(normals, len(points), "normal")
        # The inverse transpose, also of a mirror: what faced outwards still does.
        normals = normals @ np.linalg.inv(self._linear)
        normals, without = unit_normals(normals, points, piece.triangles)
        if without:
            self.notes.append(
                f'part "{self.name}": {without} normals have no direction; '
                "those of the facets stand in"
            )
        return replace(piece, normals=normals)

    def _check_count(self, values: AnyArray, count: int, what: str) -> None:
        if len(values) != count:
            raise self._error(f"has not one {what} a vertex")

    def _triangles(self, primitive: schema.Primitive, count: int) -> IndexArray:
        if primitive.indices is None:
            corners = np.arange(count)
        else:
            corners = self._file.array(primitive.indices, "SCALAR", UNSIGNED).ravel()
        joined = primitive.mode != schema.TRIANGLES
        if len(corners) < 3 if joined else len(corners) % 3:
            raise self._error("ends within a triangle")
        if corners.max() >= count:
            raise self._error("has an index past its vertices")
        index = _separate(corners.astype(np.int64), primitive.mode)
        return index[:, ::-1] if self._volume < 0.0 else index

    def _uv(self, given: schema.Attributes, material: int | None, count: int) -> Array | None:
        frame = None if material is None else self._palette.frames[material]
        if frame is None or material is None:
            return None
        accessor = (given.texcoord_0, given.texcoord_1)[frame.tex_coord]
        if accessor is None:
            name = self._palette.materials[material].name
            self.notes.append(
                f'part "{self.name}": has no texture coordinates {frame.tex_coord}; '
                f'one texel of each image of material "{name}" is drawn all over it'
            )
            return np.zeros((count, 2))
        uv = self._file.fractions(accessor, "VEC2")
        self._check_count(uv, count, "texture coordinate")
        return frame.place(uv)

    def _colour(self, given: schema.Attributes, count: int) -> Array | None:
        if given.color_0 is None:
            return None
        colour = self._file.fractions(given.color_0, ("VEC3", "VEC4"))
        self._check_count(colour, count, "colour")
        if np.any((colour < 0.0) | (colour > 1.0)):
            raise self._error("has a vertex colour outside 0..1")
        return np.concatenate([colour, np.ones((count, 4 - colour.shape[1]))], axis=1)


def _separate(corners: IndexArray, mode: int) -> IndexArray:
    """(m, 3) triangles of the corners (n,) of a primitive, by the glTF specification."""
    first = np.arange(len(corners) - 2)
    if mode == schema.TRIANGLE_STRIP:
        odd = first % 2
        return corners[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)]
    if mode == schema.TRIANGLE_FAN:
        return corners[np.stack([first + 1, first + 2, 0 * first], axis=1)]
    return corners.reshape(-1, 3)


def _size(file: GltfFile, mesh: int) -> IndexArray:
    """(2,) triangles and vertices of a mesh, as its accessors count them, before any is read."""
    sizes = np.zeros(2, dtype=np.int64)
    accessors = file.gltf.accessors
    for primitive in file.item("mesh", file.gltf.meshes, mesh).primitives:
        if primitive.mode < schema.TRIANGLES:
            continue
        vertices = file.item("accessor", accessors, primitive.attributes.position).count
        corners = vertices
        if primitive.indices is not None:
            corners = file.item("accessor", accessors, primitive.indices).count
        # Flat facets share no vertices.
        flat = primitive.attributes.normal is None
        # A strip has a triangle for each corner.
        joined = primitive.mode != schema.TRIANGLES
        triangles = min(corners, _HUGE) if joined else min(corners, _HUGE) // 3
        sizes += triangles, min(3 * triangles if flat else vertices, _HUGE)
    return sizes


def _filled(values: list[Array | None], counts: list[int], default: Array) -> Any:
    """All vertices' values in float32, ``default`` for pieces without; None if all are without."""
    if all(v is None for v in values):
        return None
    blocks = [
        np.tile(default, (n, 1)) if v is None else v for v, n in zip(values, counts, strict=True)
    ]
    return np.concatenate(blocks).astype(np.float32)


def _coloured(piece: _Piece) -> Array:
    return np.ones((len(piece.positions), 4)) if piece.colour is None else piece.colour


def _finite(path: Path, what: str, values: Any) -> Any:
    if values is not None and not np.all(np.isfinite(values)):
        raise AssetError(f"{path}: holds {what} that are not finite")
    return values


def _mesh(path: Path, palette: Palette, pieces: list[_Piece], part: list[int]) -> Mesh:
    if any(material.cutoff is not None for material in palette.materials):
        # Cut-outs are drawn by the coverage in the vertex colours.
        pieces = [replace(p, colour=_coloured(p)) for p in pieces]
    counts = [len(p.positions) for p in pieces]
    first = np.cumsum([0, *counts[:-1]])
    triangles = [p.triangles + start for p, start in zip(pieces, first, strict=True)]
    with np.errstate(over="ignore"):  # a coordinate beyond float32 becomes infinite, seen below
        places = np.concatenate([p.positions for p in pieces]).astype(np.float32)
        uv = _filled([p.uv for p in pieces], counts, np.zeros(2))
        colour = _filled([p.colour for p in pieces], counts, np.ones(4))
    return Mesh(
        positions=_finite(path, "vertices", places),
        normals=np.concatenate([p.normals for p in pieces]).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        part=np.repeat(part, counts).astype(np.uint32),
        material=np.repeat([p.material for p in pieces], counts).astype(np.uint32),
        uv=_finite(path, "texture coordinates", uv),
        colour=_finite(path, "vertex colours", colour),
    )


def read_gltf(
    path: Path, name: str, body_from_file: Array, folder: Base | None = None
) -> SpacecraftModel:
    """The model in a .glb or .gltf file.

    body_from_file : (3, 3) axes, unit included: body metres from the file's coordinates
    folder : of the buffers and images that it names; None is the file's folder

    Each node with a mesh is a part, named after the node; the nodes above parts are the model's
    branches. A primitive without normals gets flat facets, as the glTF specification requires.
    """
    file = GltfFile(path, folder)
    try:
        palette = read_palette(file)
    except ConfigError as error:
        raise AssetError(str(error)) from None
    if len(palette.materials) >= MAX_MATERIALS:
        problem = f"holds {len(palette.materials)} materials, at most {MAX_MATERIALS - 1} are drawn"
        raise AssetError(f"{path}: {problem}")
    body_from_root = np.eye(4)
    body_from_root[:3, :3] = body_from_file
    parts: list[str] = []
    pieces: list[_Piece] = []
    owners: list[int] = []
    names: dict[int, str] = {}
    carried: dict[int, list[int]] = {}
    notes = list(palette.notes)
    sizes = np.zeros(2, dtype=np.int64)
    for node, matrix, ancestry in file.nodes():
        names[ancestry[-1]] = node.name or ""
        if node.mesh is None:
            continue
        part = _Part(file, palette, node.name or f"part_{len(parts)}", body_from_root @ matrix)
        sizes = sizes + _size(file, node.mesh)
        check_size(str(path), int(sizes[0]), int(sizes[1]), len(parts) + 1)
        pieces_of_part = part.pieces(node.mesh)
        notes += part.notes
        if not pieces_of_part:
            continue
        names[ancestry[-1]] = part.name
        for number in ancestry:
            carried.setdefault(number, []).append(len(parts))
        pieces += pieces_of_part
        owners += [len(parts)] * len(pieces_of_part)
        parts.append(part.name)
    if not pieces:
        raise AssetError(f"{path}: holds no mesh of triangles")
    mesh = _mesh(path, palette, pieces, owners)
    # Many programs write all materials as double-sided.
    sheets = any(material.double_sided for material in file.gltf.materials)
    holes = any(material.alpha_mode != "OPAQUE" for material in file.gltf.materials)
    return SpacecraftModel(
        name=name,
        mesh=mesh,
        parts=tuple(parts),
        branches=tuple(
            Branch(name=name, parts=tuple(carried[number]))
            for number, name in names.items()
            if number in carried
        ),
        materials=(*palette.materials, _DEFAULT),
        textures=palette.textures,
        open_sheets=sheets and (holes or not is_solid(mesh)),
        notes=tuple(notes),
    )
