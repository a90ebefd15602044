"""glTF 2.0 files as spacecraft models: triangles, named nodes, factor materials."""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simgl.errors import AssetError
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES = 4


class _File:
    """One open glTF file: its JSON and the bytes of its buffers."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.gltf: Any = pygltflib.GLTF2().load(str(path))
        except (OSError, ValueError, KeyError, TypeError, AttributeError, struct.error) as error:
            raise AssetError(f"{path}: not a readable glTF file ({error})") from None
        if self.gltf is None:
            raise AssetError(f"{path}: not a readable glTF file")
        self._buffers = [self._buffer(b.uri) for b in self.gltf.buffers]

    def _buffer(self, uri: str | None) -> bytes:
        if uri is None:
            blob: bytes | None = self.gltf.binary_blob()
            if blob is None:
                raise AssetError(f"{self.path}: names no buffer file and carries no binary chunk")
            return blob
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        file = self.path.parent / uri
        try:
            return file.read_bytes()
        except OSError as error:
            raise AssetError(f'{self.path}: buffer "{uri}" cannot be read ({error.strerror})') from None

    def array(self, index: int) -> NDArray[Any]:
        """(count, width) values of an accessor."""
        accessor = self.gltf.accessors[index]
        if accessor.bufferView is None or accessor.sparse is not None:
            raise AssetError(f"{self.path}: accessor {index} is sparse or empty; neither is supported")
        view = self.gltf.bufferViews[accessor.bufferView]
        dtype = np.dtype("<" + _COMPONENTS[accessor.componentType])
        width = _WIDTHS[accessor.type]
        start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
        stride = view.byteStride or dtype.itemsize * width
        data = self._buffers[view.buffer]
        if start + stride * (accessor.count - 1) + dtype.itemsize * width > len(data):
            raise AssetError(f"{self.path}: accessor {index} runs past the end of its buffer")
        return np.ndarray(
            (accessor.count, width), dtype, data, start, (stride, dtype.itemsize)
        ).copy()

    def nodes(self) -> Iterator[tuple[Any, NDArray[np.float64]]]:
        """Every node of the scene with its (4, 4) file_from_node matrix."""

        def visit(index: int, parent: NDArray[np.float64]) -> Iterator[tuple[Any, Any]]:
            node = self.gltf.nodes[index]
            matrix = parent @ _local(node)
            yield node, matrix
            for child in node.children or []:
                yield from visit(child, matrix)

        roots = self.gltf.scenes[self.gltf.scene or 0].nodes
        for root in roots:
            yield from visit(root, np.eye(4))


def _local(node: Any) -> NDArray[np.float64]:
    if node.matrix:
        return np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    if node.rotation:
        matrix[:3, :3] = Rotation.from_quat(node.rotation).as_matrix()
    if node.scale:
        matrix[:3, :3] *= np.asarray(node.scale)
    if node.translation:
        matrix[:3, 3] = node.translation
    return matrix


def _material(path: Path, index: int, material: Any) -> Material:
    pbr = material.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
    base = pbr.baseColorFactor or [1.0, 1.0, 1.0, 1.0]
    extras = material.extras or {}
    metallic = 1.0 if pbr.metallicFactor is None else pbr.metallicFactor
    roughness = 1.0 if pbr.roughnessFactor is None else pbr.roughnessFactor
    try:
        return Material(
            name=material.name or f"material_{index}",
            # A file that says nothing of the near infrared is taken to be as bright as in red.
            reflectance=(*base[:3], extras.get("nir_reflectance", base[0])),
            metallic=metallic,
            roughness=max(roughness, 0.01),
        )
    except ValueError as error:
        raise AssetError(f"{path}: {error}") from None


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
    materials = [_material(path, i, m) for i, m in enumerate(file.gltf.materials)]
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
        cofactor = np.linalg.inv(linear).T * np.sign(np.linalg.det(linear))
        for primitive in file.gltf.meshes[node.mesh].primitives:
            if primitive.mode not in (None, _TRIANGLES):
                raise AssetError(f'{path}: part "{parts[-1]}" is not made of triangles')
            points = file.array(primitive.attributes.POSITION) @ linear.T + offset
            if primitive.indices is None:
                index = np.arange(len(points)).reshape(-1, 3)
            else:
                index = file.array(primitive.indices).reshape(-1, 3)
            if index.size and index.max() >= len(points):
                raise AssetError(f'{path}: part "{parts[-1]}" has an index past its vertices')
            if np.linalg.det(linear) < 0.0:
                index = index[:, ::-1]
            if primitive.attributes.NORMAL is None:
                flat = face_normals(points, index)
                points = points[index.ravel()]
                normal = np.repeat(flat, 3, axis=0)
                index = np.arange(len(points)).reshape(-1, 3)
            else:
                normal = file.array(primitive.attributes.NORMAL) @ cofactor.T
                length = np.linalg.norm(normal, axis=1, keepdims=True)
                normal = normal / np.where(length > 0.0, length, 1.0)
            positions.append(points)
            normals.append(normal)
            triangles.append(index + count)
            part.append(np.full(len(points), len(parts) - 1))
            chosen = default if primitive.material is None else primitive.material
            material.append(np.full(len(points), chosen))
            count += len(points)
    if not count:
        raise AssetError(f"{path}: holds no mesh")
    mesh = Mesh(
        positions=np.concatenate(positions).astype(np.float32),
        normals=np.concatenate(normals).astype(np.float32),
        triangles=np.concatenate(triangles).astype(np.uint32),
        part=np.concatenate(part).astype(np.uint32),
        material=np.concatenate(material).astype(np.uint32),
    )
    if not np.all(np.isfinite(mesh.positions)):
        raise AssetError(f"{path}: holds vertices that are not finite")
    return SpacecraftModel(
        name=name,
        mesh=mesh,
        parts=tuple(parts),
        materials=tuple(materials),
        open_sheets=any(m.doubleSided for m in file.gltf.materials),
    )
