"""The committed models, read without the code that draws them."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, IndexArray
from tools.spacecraft_models.__main__ import GENERATORS
from tools.spacecraft_models.glb import R_FILE_FROM_BODY

MODELS = Path(__file__).parents[2] / "models"
ATV_WINGS = ("upper_right", "lower_right", "lower_left", "upper_left")
NAMES = tuple(GENERATORS)


@dataclass(frozen=True)
class Piece:
    """One node of a committed file in the body frame, its primitives joined.

    corners, normals : (m, 3, 3) of each triangle's corners [m], [-]
    vertices : (m, 3) numbers of the corners, equal where positions are equal
    """

    corners: Array
    normals: Array
    vertices: IndexArray


@cache
def document_of(name: str) -> Any:
    """The glTF document of a model."""
    return pygltflib.GLTF2.load_from_bytes((MODELS / name / f"{name}.glb").read_bytes())


def rows_of(document: Any, accessor: int, dtype: str) -> Any:
    """(n, 3) rows: the vectors of an accessor, or its indices three by three."""
    entry = document.accessors[accessor]
    view = document.bufferViews[entry.bufferView]
    content = document.binary_blob()[view.byteOffset or 0 :][: view.byteLength]
    rows = np.frombuffer(content, dtype).reshape(-1, 3)
    assert entry.count == (rows.size if entry.type == "SCALAR" else len(rows))
    return rows


def corners_of(document: Any, primitive: Any, attribute: str = "POSITION") -> Any:
    """(m, 3, 3) of the corners of each triangle of a primitive, in the node's axes."""
    rows = rows_of(document, primitive.indices, "<u4")
    return rows_of(document, getattr(primitive.attributes, attribute), "<f4")[rows]


def placed(document: Any) -> dict[str, tuple[Any, Rotation, Array]]:
    """Node name to the node, its turn and its place in the file's axes, through all above it."""
    found: dict[str, tuple[Any, Rotation, Array]] = {}

    def visit(number: int, turn: Rotation, place: Array) -> None:
        node = document.nodes[number]
        place = place + turn.apply(node.translation or [0.0, 0.0, 0.0])
        found[node.name] = node, turn * Rotation.from_quat(node.rotation or [0, 0, 0, 1]), place
        for child in node.children or []:
            visit(child, *found[node.name][1:])

    for root in document.scenes[0].nodes:
        visit(root, Rotation.identity(), np.zeros(3))
    assert len(found) == len(document.nodes)
    return found


@cache
def pieces(name: str) -> dict[str, Piece]:
    """Part name to geometry, read from the committed file."""
    document = document_of(name)
    found = {}
    for node, R_file_from_node, place in placed(document).values():
        positions, normals = [], []
        for primitive in document.meshes[node.mesh].primitives:
            positions.append(corners_of(document, primitive))
            normals.append(corners_of(document, primitive, "NORMAL"))
        local = np.concatenate(positions)
        _, vertices = np.unique(local.reshape(-1, 3), axis=0, return_inverse=True)
        R_body_from_node = R_FILE_FROM_BODY.T @ R_file_from_node.as_matrix()
        offset = R_FILE_FROM_BODY.T @ place
        found[node.name] = Piece(
            corners=local.astype(np.float64) @ R_body_from_node.T + offset,
            normals=np.concatenate(normals).astype(np.float64) @ R_body_from_node.T,
            vertices=vertices.reshape(-1, 3),
        )
    return found


def record_of(name: str) -> dict[str, Any]:
    """What stands in a model's ``model.toml``."""
    return tomllib.loads((MODELS / name / "model.toml").read_text())


def all_corners(name: str, *parts: str) -> Array:
    """(m, 3, 3) of all triangles of some parts, or of the whole model, body axes [m]."""
    chosen = parts or tuple(pieces(name))
    return np.concatenate([pieces(name)[part].corners for part in chosen])


def ray_hits(origin: Array, direction: Array, corners: Array) -> Array:
    """Sorted distances at which a ray meets the triangles (Moller and Trumbore 1997) [m]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    across = np.cross(direction, c - a)
    determinant = np.einsum("ij,ij->i", b - a, across)
    facing = np.abs(determinant) > 1e-15
    a, b, c, across, determinant = (v[facing] for v in (a, b, c, across, determinant))
    u = np.einsum("ij,ij->i", origin - a, across) / determinant
    lifted = np.cross(origin - a, b - a)
    v = lifted @ direction / determinant
    distance = np.einsum("ij,ij->i", c - a, lifted) / determinant
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance > 0.0)
    return np.sort(distance[inside])
