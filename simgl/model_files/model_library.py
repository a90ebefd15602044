"""Spacecraft models by name, shipped or from the user's files."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
import trimesh
from msgspec import Meta, field

from simgl import assets
from simgl.arrays import Array
from simgl.config.path_sandbox import Base, folder_of
from simgl.config.validation import convert, read_toml
from simgl.config.value_types import Positive, Table, Vector
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.model_files.file_axes import body_from_file
from simgl.model_files.gltf_model import face_normals, read_gltf
from simgl.model_files.joint_tables import JointTable, read_joints
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel

_AXES = {
    sign + axis: (1.0 if sign == "+" else -1.0) * np.eye(3)[i]
    for i, axis in enumerate("xyz")
    for sign in "+-"
}
_MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".stl")

# Bare aluminium-like grey for meshes that carry no material (OBJ and STL are read as shape only).
_PLAIN = Material(name="plain", reflectance=(0.5, 0.5, 0.5, 0.5), roughness=0.6)


class AxesTable(Table, frozen=True, kw_only=True):
    """Body axes named by the file's axes: ``x = "+z"`` says that body x is the file's z."""

    x: str
    y: str
    z: str


class ModelTable(Table, frozen=True, kw_only=True):
    """A model card, such as ``models/NAME/model.toml``; file : from the card's folder."""

    name: str
    file: str
    description: str = ""
    source: str = ""
    unit_m: Positive
    axes: AxesTable
    joint: Annotated[tuple[JointTable, ...], Meta(max_length=256)] = ()
    keypoints: dict[str, Vector] = field(default_factory=dict)


def shipped_models() -> list[str]:
    """Names of the models that come with simgl."""
    return sorted(p.parent.name for p in assets.models().glob("*/model.toml"))


def _body_from_file(axes: AxesTable, where: str) -> Array:
    for key in ("x", "y", "z"):
        if getattr(axes, key) not in _AXES:
            problem = f'must be one of {", ".join(_AXES)}, got "{getattr(axes, key)}"'
            raise ConfigError(where, f"axes.{key}", problem)
    matrix = np.stack([_AXES[axes.x], _AXES[axes.y], _AXES[axes.z]])
    if not np.isclose(np.linalg.det(matrix), 1.0):
        raise ConfigError(where, "axes", "must be right-handed and use each axis once")
    return matrix


def _read_model_card(path: Path, folder: Base) -> SpacecraftModel:
    """The model that a card describes; its file is named from ``folder``."""
    where = str(path)
    table = convert(read_toml(path), ModelTable, where)
    file_to_body = table.unit_m * _body_from_file(table.axes, where)
    file = folder / table.file
    model = read_gltf(file, table.name, file_to_body, folder_of(file, folder))
    joints = read_joints(table.joint, model, table.keypoints, where)
    keypoints = {k: np.array(v) for k, v in table.keypoints.items()}
    return replace(model, keypoints=keypoints, joints=joints)


def _is_binary_stl(content: bytes) -> bool:
    """Whether the count of triangles after the 80-byte title fits the length."""
    return len(content) >= 84 and len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")


def _read_plain_mesh(path: Path, body_from_file: Array) -> SpacecraftModel:
    kind = path.suffix[1:].lower()
    try:
        content = path.read_bytes()
    except OSError as error:
        raise AssetError(f"{path}: cannot be read ({error.strerror})") from None
    source: io.BytesIO | io.StringIO = io.BytesIO(content)
    if not (kind == "stl" and _is_binary_stl(content)):
        # Names and comments may be in any encoding; what matters is ASCII.
        source = io.StringIO(content.decode("utf-8", errors="replace"))
        kind = {"stl": "stl_ascii"}.get(kind, kind)
    try:
        loaded = trimesh.load(source, file_type=kind, force="mesh", process=False)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise AssetError(f"{path}: is not a readable {path.suffix[1:].upper()} file") from error
    points = np.asarray(getattr(loaded, "vertices", ()), dtype=np.float64)
    faces = np.asarray(getattr(loaded, "faces", ()), dtype=np.int64)
    if faces.size == 0:
        hint = f"is it a whole {path.suffix[1:].upper()} file?"
        raise AssetError(f"{path}: holds no triangles; {hint}")
    with np.errstate(over="ignore", invalid="ignore"):  # beyond float32 lies infinity
        points = points @ body_from_file.T
        corners = points[faces.ravel()].astype(np.float32)
    if not np.all(np.isfinite(corners)):
        raise AssetError(f"{path}: holds vertices that are not finite")
    label = np.zeros(len(corners), dtype=np.uint32)
    mesh = Mesh(
        positions=corners,
        normals=np.repeat(face_normals(points, faces), 3, axis=0).astype(np.float32),
        triangles=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        part=label,
        material=label,
    )
    return SpacecraftModel(
        name=path.stem, mesh=mesh, parts=(path.stem,), materials=(_PLAIN,), open_sheets=True
    )


@lru_cache(maxsize=32)
def load_model(
    name: str,
    base: Base = Path(),
    unit_m: float | None = None,
    up_axis: str | None = None,
    forward_axis: str | None = None,
) -> SpacecraftModel:
    """A shipped model by name, or by path a mesh file or a card that stands folder_of one.

    name : a shipped name, or a path to .glb, .gltf, .obj or .stl, or to a card's .toml
    base : folder that a relative path starts from
    unit_m : metres per unit of the file, for files that are not in metres
    up_axis, forward_axis : the file's axes ("y", "-z") that become body -z and x

    Raises AssetError; ConfigError for a bad card; ValueError for axes that are not square to each
    other.
    """
    file_to_body = body_from_file(unit_m or 1.0, up_axis, forward_axis)
    kind = Path(name).suffix.lower()
    shipped = "/" not in name and kind not in (*_MESH_SUFFIXES, ".toml")
    if shipped and name not in shipped_models():
        raise AssetError(f'no model "{name}"; {did_you_mean(name, shipped_models())}')
    if shipped or kind == ".toml":
        if unit_m is not None:
            raise AssetError(f'model "{name}" knows its unit; unit_m goes with a mesh file')
        if up_axis is not None:
            raise AssetError(f'model "{name}" knows its axes; up_axis goes with a mesh file')
    if shipped:
        folder = assets.models() / name
        return _read_model_card(folder / "model.toml", folder)
    path = base / name
    if not path.is_file():
        raise AssetError(f"{path}: no such model file")
    if kind == ".toml":
        return _read_model_card(path, folder_of(path, base))
    if kind in (".glb", ".gltf"):
        return read_gltf(path, path.stem, file_to_body, folder_of(path, base))
    if kind in _MESH_SUFFIXES:
        return _read_plain_mesh(path, file_to_body)
    known = ", ".join(_MESH_SUFFIXES)
    raise AssetError(f"{path}: neither a mesh that simgl reads ({known}) nor a model card (.toml)")
