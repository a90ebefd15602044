"""glTF 2.0 files as spacecraft models: triangles, named nodes, factor materials."""

from __future__ import annotations

import base64
import binascii
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar
from urllib.parse import unquote

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simgl.errors import AssetError, ConfigError
from simgl.scenario.strict import fitted
from simgl.scene.materials import SMOOTHEST, Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_UNSIGNED, _FLOAT = (5121, 5123, 5125), (5126,)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLES = 4
_MAGIC, _JSON_CHUNK, _BINARY_CHUNK = b"glTF", 0x4E4F534A, 0x004E4942

T = TypeVar("T")
Index = Annotated[int, Meta(ge=0)]
Count = Annotated[int, Meta(ge=1)]
_Triple = tuple[float, float, float]


class _Object(Struct, frozen=True, rename="camel", kw_only=True):
    """A glTF object: what simgl reads of it; everything else in the file is passed over."""


class _Accessor(_Object, frozen=True):
    component_type: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    count: Count
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    buffer_view: Index | None = None
    byte_offset: Index = 0
    sparse: dict[str, Any] | None = None


class _BufferView(_Object, frozen=True):
    buffer: Index
    byte_offset: Index = 0
    byte_stride: Count | None = None


class _Buffer(_Object, frozen=True):
    uri: str | None = None


class _Pbr(_Object, frozen=True):
    base_color_factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    metallic_factor: float = 1.0
    roughness_factor: float = 1.0
    base_color_texture: Any = None
    metallic_roughness_texture: Any = None


class _MaterialExtras(_Object, frozen=True, rename=None):
    nir_reflectance: float | None = None


class _Surface(_Object, frozen=True):
    name: str | None = None
    pbr_metallic_roughness: _Pbr = _Pbr()
    double_sided: bool = False
    normal_texture: Any = None
    occlusion_texture: Any = None
    emissive_texture: Any = None
    emissive_factor: _Triple = (0.0, 0.0, 0.0)
    extras: Any = None


class _Attributes(_Object, frozen=True, rename="upper"):
    position: Index
    normal: Index | None = None


class _Primitive(_Object, frozen=True):
    attributes: _Attributes
    indices: Index | None = None
    material: Index | None = None
    mode: int = _TRIANGLES


class _MeshObject(_Object, frozen=True):
    primitives: tuple[_Primitive, ...]


class _Node(_Object, frozen=True):
    name: str | None = None
    mesh: Index | None = None
    children: tuple[Index, ...] = ()
    matrix: Annotated[tuple[float, ...], Meta(min_length=16, max_length=16)] | None = None
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: _Triple = (1.0, 1.0, 1.0)
    translation: _Triple = (0.0, 0.0, 0.0)


class _Scene(_Object, frozen=True):
    nodes: tuple[Index, ...] = ()


class _Gltf(_Object, frozen=True):
    accessors: tuple[_Accessor, ...] = ()
    buffer_views: tuple[_BufferView, ...] = ()
    buffers: tuple[_Buffer, ...] = ()
    extensions_required: tuple[str, ...] = ()
    materials: tuple[_Surface, ...] = ()
    meshes: tuple[_MeshObject, ...] = ()
    nodes: tuple[_Node, ...] = ()
    scene: Index = 0
    scenes: tuple[_Scene, ...] = ()


def _chunks(path: Path, content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON text and the binary chunk of a .glb file."""
    if len(content) < 20 or content[:4] != _MAGIC:
        raise AssetError(f"{path}: is not a binary glTF file (no glTF header)")
    version, total = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise AssetError(f"{path}: is glTF version {version}; simgl reads version 2")
    if len(content) < total:
        raise AssetError(f"{path}: is cut short, {len(content)} of {total} bytes")
    found: dict[int, bytes] = {}
    start = 12
    while start + 8 <= total:
        length, kind = struct.unpack_from("<II", content, start)
        if start + 8 + length > total:
            raise AssetError(f"{path}: has a chunk that runs past the end of the file")
        found.setdefault(kind, content[start + 8 : start + 8 + length])
        start += 8 + length
    if _JSON_CHUNK not in found:
        raise AssetError(f"{path}: has no JSON chunk")
    return found[_JSON_CHUNK], found.get(_BINARY_CHUNK)


class _File:
    """One glTF file: its JSON and the bytes of its buffers."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            content = path.read_bytes()
        except OSError as error:
            raise AssetError(f"{path}: cannot be read ({error.strerror})") from None
        self._blob: bytes | None = None
        if path.suffix.lower() == ".glb":
            content, self._blob = _chunks(path, content)
        try:
            data = msgspec.json.decode(content)
        except ValueError as error:  # DecodeError and UnicodeDecodeError are of this kind
            raise AssetError(f"{path}: is not a glTF file ({error})") from None
        try:
            self.gltf = fitted(data, _Gltf, str(path))
        except ConfigError as error:
            raise AssetError(str(error)) from None
        if self.gltf.extensions_required:
            names = ", ".join(self.gltf.extensions_required)
            raise AssetError(f"{path}: needs the glTF extension {names}, which simgl does not read")
        self._buffers = [self._buffer(b.uri) for b in self.gltf.buffers]

    def _buffer(self, uri: str | None) -> bytes:
        if uri is None:
            if self._blob is None:
                raise AssetError(f"{self.path}: names no buffer file and carries no binary chunk")
            return self._blob
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except binascii.Error:
                raise AssetError(f"{self.path}: holds a buffer that is not base64") from None
        file = self.path.parent / unquote(uri)
        try:
            return file.read_bytes()
        except OSError as error:
            reason = error.strerror
            raise AssetError(f'{self.path}: buffer "{uri}" cannot be read ({reason})') from None

    def item(self, kind: str, items: Sequence[T], index: int) -> T:
        """One of the file's numbered objects."""
        if index >= len(items):
            raise AssetError(f"{self.path}: names {kind} {index}, but holds only {len(items)}")
        return items[index]

    def array(self, index: int, kind: str, components: tuple[int, ...]) -> NDArray[Any]:
        """(count, width) values of an accessor of the given type and component types."""
        accessor = self.item("accessor", self.gltf.accessors, index)
        if accessor.type != kind or accessor.component_type not in components:
            wanted = f"{kind} of {' or '.join(_COMPONENTS[c] for c in components)}"
            got = f"{accessor.type} of {_COMPONENTS[accessor.component_type]}"
            raise AssetError(f"{self.path}: accessor {index} must be {wanted}, got {got}")
        if accessor.buffer_view is None or accessor.sparse is not None:
            raise AssetError(f"{self.path}: accessor {index} is sparse or empty; that is not read")
        view = self.item("buffer view", self.gltf.buffer_views, accessor.buffer_view)
        data = self.item("buffer", self._buffers, view.buffer)
        dtype = np.dtype("<" + _COMPONENTS[accessor.component_type])
        width = _WIDTHS[accessor.type]
        start = view.byte_offset + accessor.byte_offset
        stride = view.byte_stride or dtype.itemsize * width
        if start + stride * (accessor.count - 1) + dtype.itemsize * width > len(data):
            raise AssetError(f"{self.path}: accessor {index} runs past the end of its buffer")
        return np.ndarray(
            (accessor.count, width), dtype, data, start, (stride, dtype.itemsize)
        ).copy()

    def nodes(self) -> Iterator[tuple[_Node, NDArray[np.float64]]]:
        """Every node of the scene with its (4, 4) file_from_node matrix."""

        def visit(
            index: int, parent: NDArray[np.float64], above: frozenset[int]
        ) -> Iterator[tuple[_Node, NDArray[np.float64]]]:
            if index in above:
                raise AssetError(f"{self.path}: node {index} is its own ancestor")
            node = self.item("node", self.gltf.nodes, index)
            matrix = parent @ self._local(index, node)
            yield node, matrix
            for child in node.children:
                yield from visit(child, matrix, above | {index})

        for root in self.item("scene", self.gltf.scenes, self.gltf.scene).nodes:
            yield from visit(root, np.eye(4), frozenset())

    def _local(self, index: int, node: _Node) -> NDArray[np.float64]:
        if node.matrix is not None:
            return np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
        if not np.any(node.rotation):
            raise AssetError(f"{self.path}: node {index} has a rotation of all zeros")
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_quat(node.rotation).as_matrix() * np.asarray(node.scale)
        matrix[:3, 3] = node.translation
        return matrix


def _material(path: Path, index: int, surface: _Surface) -> Material:
    pbr = surface.pbr_metallic_roughness
    name = surface.name or f"material_{index}"
    red, green, blue, _ = pbr.base_color_factor
    extras = surface.extras if isinstance(surface.extras, dict) else {}
    nir = fitted(extras, _MaterialExtras, f'{path} material "{name}" extras').nir_reflectance
    try:
        return Material(
            name=name,
            # A file that says nothing of the near infrared is taken to be as bright as in red.
            reflectance=(red, green, blue, red if nir is None else nir),
            metallic=pbr.metallic_factor,
            roughness=max(pbr.roughness_factor, SMOOTHEST),
        )
    except ValueError as error:
        raise AssetError(f"{path}: {error}") from None


def _notes(index: int, surface: _Surface) -> list[str]:
    """What a material asks for and does not get."""
    name = surface.name or f"material_{index}"
    pbr = surface.pbr_metallic_roughness
    asked = {
        "base colour texture": pbr.base_color_texture,
        "metallic-roughness texture": pbr.metallic_roughness_texture,
        "normal map": surface.normal_texture,
        "occlusion texture": surface.occlusion_texture,
        "emissive texture": surface.emissive_texture,
        "emission": any(surface.emissive_factor) or None,
        "transparency": pbr.base_color_factor[3] < 1.0 or None,
    }
    notes = [
        f'material "{name}": {what} is not drawn' for what, it in asked.items() if it is not None
    ]
    if pbr.roughness_factor < SMOOTHEST:
        notes.append(
            f'material "{name}": roughness {pbr.roughness_factor:g} is raised to {SMOOTHEST:g}'
        )
    return notes


def face_normals(positions: NDArray[Any], triangles: NDArray[Any]) -> NDArray[np.float64]:
    """(m, 3) unit normals of triangles; a degenerate one gets zero."""
    a, b, c = np.moveaxis(positions[triangles].astype(np.float64), 1, 0)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0))


def read_gltf(path: Path, name: str, body_from_file: NDArray[np.float64]) -> SpacecraftModel:
    """The model in a .glb or .gltf file.

    body_from_file : (3, 3) axes, unit included: body metres from the file's coordinates

    Each node that carries a mesh is a part, named after the node. A primitive without normals is
    drawn with flat facets, as the glTF specification asks.
    """
    file = _File(path)
    try:
        materials = [_material(path, i, m) for i, m in enumerate(file.gltf.materials)]
    except ConfigError as error:
        raise AssetError(str(error)) from None
    default = len(materials)
    materials.append(Material(name="default", reflectance=(1.0, 1.0, 1.0, 1.0), roughness=1.0))
    parts: list[str] = []
    positions, normals, triangles, part, material = [], [], [], [], []
    count = 0
    for node, matrix in file.nodes():
        if node.mesh is None:
            continue
        parts.append(node.name or f"part_{len(parts)}")
        linear = body_from_file @ matrix[:3, :3]
        offset = body_from_file @ matrix[:3, 3]
        volume = float(np.linalg.det(linear))
        if volume == 0.0:
            raise AssetError(f'{path}: part "{parts[-1]}" is scaled to nothing')
        cofactor = np.linalg.inv(linear).T * np.sign(volume)
        for primitive in file.item("mesh", file.gltf.meshes, node.mesh).primitives:
            if primitive.mode != _TRIANGLES:
                raise AssetError(f'{path}: part "{parts[-1]}" is not made of triangles')
            points = file.array(primitive.attributes.position, "VEC3", _FLOAT) @ linear.T + offset
            if primitive.indices is None:
                corners = np.arange(len(points))
            else:
                corners = file.array(primitive.indices, "SCALAR", _UNSIGNED).ravel()
            if len(corners) % 3:
                raise AssetError(f'{path}: part "{parts[-1]}" ends within a triangle')
            if corners.max() >= len(points):
                raise AssetError(f'{path}: part "{parts[-1]}" has an index past its vertices')
            index = corners.astype(np.int64).reshape(-1, 3)
            if volume < 0.0:
                index = index[:, ::-1]
            if primitive.attributes.normal is None:
                flat = face_normals(points, index)
                points = points[index.ravel()]
                normal = np.repeat(flat, 3, axis=0)
                index = np.arange(len(points)).reshape(-1, 3)
            else:
                normal = file.array(primitive.attributes.normal, "VEC3", _FLOAT) @ cofactor.T
                if len(normal) != len(points):
                    raise AssetError(f'{path}: part "{parts[-1]}" has not one normal a vertex')
                length = np.linalg.norm(normal, axis=1, keepdims=True)
                normal = normal / np.where(length > 0.0, length, 1.0)
            positions.append(points)
            normals.append(normal)
            triangles.append(index + count)
            part.append(np.full(len(points), len(parts) - 1))
            chosen = default
            if primitive.material is not None:
                file.item("material", file.gltf.materials, primitive.material)
                chosen = primitive.material
            material.append(np.full(len(points), chosen))
            count += len(points)
    if not count:
        raise AssetError(f"{path}: holds no mesh")
    with np.errstate(over="ignore"):  # a coordinate beyond float32 becomes infinite, seen below
        places = np.concatenate(positions).astype(np.float32)
    if not np.all(np.isfinite(places)):
        raise AssetError(f"{path}: holds vertices that are not finite")
    mesh = Mesh(
        positions=places,
        normals=np.concatenate(normals).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        part=np.concatenate(part).astype(np.uint32),
        material=np.concatenate(material).astype(np.uint32),
    )
    return SpacecraftModel(
        name=name,
        mesh=mesh,
        parts=tuple(parts),
        materials=tuple(materials),
        open_sheets=any(m.double_sided for m in file.gltf.materials),
        notes=tuple(n for i, m in enumerate(file.gltf.materials) for n in _notes(i, m)),
    )
