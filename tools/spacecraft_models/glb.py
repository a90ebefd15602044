"""Writes a craft as a binary glTF 2.0 file, one node and one mesh per part.

A part that another one carries hangs under that one's node.

glTF wants +Y up and +Z forward, which leaves -X for the right: body x, y, z are file +z, -x, -y.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pygltflib as gltf
from scipy.spatial.transform import Rotation

from simgl.arrays import AnyArray, Array, IndexArray
from tools.spacecraft_models.generated_model import GeneratedModel, Part
from tools.spacecraft_models.materials import MATERIALS, Material
from tools.spacecraft_models.shapes import ShadedMesh, shaded

R_FILE_FROM_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])

# A micrometre. Rounding before the conversion to float32 hides the last bits in which
# mathematical libraries differ, so that every machine writes the same file.
DECIMALS = 6


@dataclass
class _Buffer:
    """The binary chunk while it grows, with the views and accessors that describe it."""

    data: bytearray = field(default_factory=bytearray)
    views: list[Any] = field(default_factory=list)
    accessors: list[Any] = field(default_factory=list)

    def vectors(self, values: Array, *, bounds: bool) -> int:
        """Appends (n, 3) float32 and returns the accessor's number."""
        array = (np.round(values, DECIMALS) + 0.0).astype("<f4")  # + 0.0 turns -0 into 0
        accessor = self._append(array, gltf.FLOAT, gltf.VEC3, gltf.ARRAY_BUFFER, len(array))
        if bounds:
            self.accessors[accessor].min = array.min(axis=0).tolist()
            self.accessors[accessor].max = array.max(axis=0).tolist()
        return accessor

    def indices(self, triangles: IndexArray) -> int:
        """Appends (m, 3) uint32 and returns the accessor's number."""
        array = triangles.astype("<u4")
        return self._append(
            array, gltf.UNSIGNED_INT, gltf.SCALAR, gltf.ELEMENT_ARRAY_BUFFER, array.size
        )

    def _append(self, array: AnyArray, component: int, kind: str, target: int, count: int) -> int:
        content = array.tobytes()
        self.views.append(
            gltf.BufferView(
                buffer=0, byteOffset=len(self.data), byteLength=len(content), target=target
            )
        )
        self.data += content
        self.accessors.append(
            gltf.Accessor(
                bufferView=len(self.views) - 1, componentType=component, count=count, type=kind
            )
        )
        return len(self.accessors) - 1


def _gltf_material(name: str, material: Material) -> Any:
    extras: dict[str, Any] = {"nir_reflectance": material.nir}
    if material.finish is not None:
        extras["simgl_finish"] = material.finish
    return gltf.Material(
        name=name,
        pbrMetallicRoughness=gltf.PbrMetallicRoughness(
            baseColorFactor=[*material.rgb, 1.0],
            metallicFactor=material.metallic,
            roughnessFactor=material.roughness,
        ),
        alphaMode=None,
        alphaCutoff=None,
        doubleSided=None,
        emissiveFactor=None,
        extras=extras,
    )


def _worn_together(meshes: list[ShadedMesh], material: str) -> tuple[Array, Array, Any]:
    """Positions (n, 3), normals (n, 3) and triangles (m, 3) of all that wears one material."""
    positions, normals, triangles, base = [], [], [], 0
    for mesh in meshes:
        chosen = mesh.triangles[mesh.materials == material]
        used, renumbered = np.unique(chosen, return_inverse=True)
        positions.append(mesh.positions[used])
        normals.append(mesh.normals[used])
        triangles.append(renumbered.reshape(-1, 3) + base)
        base += len(used)
    return np.concatenate(positions), np.concatenate(normals), np.concatenate(triangles)


def _gltf_mesh(part: Part, palette: list[str], buffer: _Buffer) -> Any:
    meshes = [shaded(shape) for shape in part.shapes]
    worn = sorted({str(name) for mesh in meshes for name in np.unique(mesh.materials)})
    primitives = []
    for name in worn:
        positions, normals, triangles = _worn_together(meshes, name)
        attributes = gltf.Attributes(
            POSITION=buffer.vectors(positions @ R_FILE_FROM_BODY.T, bounds=True),
            NORMAL=buffer.vectors(normals @ R_FILE_FROM_BODY.T, bounds=False),
        )
        primitives.append(
            gltf.Primitive(
                attributes=attributes,
                indices=buffer.indices(triangles),
                material=palette.index(name),
                mode=gltf.TRIANGLES,
            )
        )
    return gltf.Mesh(name=part.name, primitives=primitives)


def _gltf_node(part: Part, mesh: int, parts: Sequence[Part]) -> Any:
    """The part's node; a transform is written only where it does something."""
    carrier = next(
        (other for other in parts if other.name == part.parent), Part(name="", shapes=())
    )
    R_carrier_from_body = carrier.R_body_from_part.as_matrix().T
    R_carrier_from_part = R_carrier_from_body @ part.R_body_from_part.as_matrix()
    offset = R_carrier_from_body @ np.subtract(part.origin_body, carrier.origin_body)
    R_file = Rotation.from_matrix(R_FILE_FROM_BODY @ R_carrier_from_part @ R_FILE_FROM_BODY.T)
    rotation = (np.round(R_file.as_quat(canonical=True), 9) + 0.0).tolist()
    translation = (np.round(R_FILE_FROM_BODY @ offset, DECIMALS) + 0.0).tolist()
    children = [number for number, other in enumerate(parts) if other.parent == part.name]
    return gltf.Node(
        name=part.name,
        mesh=mesh,
        children=children,
        translation=translation if any(translation) else None,
        rotation=rotation if any(rotation[:3]) else None,
    )


def glb_bytes(model: GeneratedModel) -> bytes:
    """The whole file for a craft."""
    shapes = [shape for part in model.parts for shape in part.shapes]
    palette = sorted({str(name) for shape in shapes for name in np.unique(shape.materials)})
    buffer = _Buffer()
    meshes = [_gltf_mesh(part, palette, buffer) for part in model.parts]
    roots = [i for i, part in enumerate(model.parts) if part.parent is None]
    document = gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator="simgl"),
        scene=0,
        scenes=[gltf.Scene(name=model.name, nodes=roots)],
        nodes=[_gltf_node(part, i, model.parts) for i, part in enumerate(model.parts)],
        meshes=meshes,
        materials=[_gltf_material(name, MATERIALS[name]) for name in palette],
        accessors=buffer.accessors,
        bufferViews=buffer.views,
        buffers=[gltf.Buffer(byteLength=len(buffer.data))],
    )
    document.set_binary_blob(bytes(buffer.data))
    return b"".join(document.save_to_bytes())
