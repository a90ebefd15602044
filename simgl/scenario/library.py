"""Models and camera presets by name, shipped or from the user's files."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import trimesh
from msgspec import Meta, field
from numpy.typing import NDArray

from simgl import assets
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.scenario.fields import direction
from simgl.scenario.file_axes import body_from_file
from simgl.scenario.folder import Base, beside
from simgl.scenario.gltf import face_normals, read_gltf
from simgl.scenario.schema import CameraPresetTable
from simgl.scenario.strict import convert, read_toml
from simgl.scenario.values import Positive, Table, Vector
from simgl.scene.joints import Joint
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


class JointTable(Table, frozen=True, kw_only=True):
    """How a part can move; 0 is the position stored in the file.

    keypoints : those that move with the part
    sunward_body : the side that a drive turns to the Sun, as stored
    """

    name: str
    part: str
    kind: Literal["revolute"]
    axis_body: Vector
    origin_body_m: Vector
    range_deg: tuple[float, float]
    keypoints: tuple[str, ...] = ()
    sunward_body: Vector | None = None


class ModelTable(Table, frozen=True, kw_only=True):
    """``models/NAME/model.toml``."""

    name: str
    file: str
    description: str
    source: str
    unit_m: Positive
    axes: AxesTable
    joint: Annotated[tuple[JointTable, ...], Meta(max_length=256)] = ()
    keypoints: dict[str, Vector] = field(default_factory=dict)


def shipped_models() -> list[str]:
    """Names of the models that come with simgl."""
    return sorted(p.parent.name for p in assets.models().glob("*/model.toml"))


def shipped_presets() -> list[str]:
    """Names of the camera presets that come with simgl."""
    return sorted(p.stem for p in (assets.data() / "cameras").glob("*.toml"))


def _body_from_file(axes: AxesTable, where: str) -> NDArray[np.float64]:
    for key in ("x", "y", "z"):
        if getattr(axes, key) not in _AXES:
            problem = f'must be one of {", ".join(_AXES)}, got "{getattr(axes, key)}"'
            raise ConfigError(where, f"axes.{key}", problem)
    matrix = np.stack([_AXES[axes.x], _AXES[axes.y], _AXES[axes.z]])
    if not np.isclose(np.linalg.det(matrix), 1.0):
        raise ConfigError(where, "axes", "must be right-handed and use each axis once")
    return matrix


def _read_model_folder(folder: Path) -> SpacecraftModel:
    where = str(folder / "model.toml")
    table = convert(read_toml(folder / "model.toml"), ModelTable, where)
    file_to_body = table.unit_m * _body_from_file(table.axes, where)
    model = read_gltf(folder / table.file, table.name, file_to_body)
    joints = tuple(_joint(j, model, table.keypoints, where) for j in table.joint)
    keypoints = {k: np.array(v) for k, v in table.keypoints.items()}
    return replace(model, keypoints=keypoints, joints=joints)


def _joint(
    table: JointTable, model: SpacecraftModel, keypoints: dict[str, Vector], where: str
) -> Joint:
    key = f"joint {table.name}"
    if table.part not in model.parts:
        problem = f"names no part: {did_you_mean(table.part, model.parts)}"
        raise ConfigError(where, key, problem)
    for name in table.keypoints:
        if name not in keypoints:
            raise ConfigError(where, key, f"names no keypoint: {did_you_mean(name, keypoints)}")
    low, high = np.radians(table.range_deg)
    if not low <= 0.0 <= high:
        raise ConfigError(where, key, "must have 0, the stored position, in its range_deg")
    sunward = table.sunward_body
    return Joint(
        name=table.name,
        part=model.parts.index(table.part),
        axis_body=direction(table.axis_body, where, f"{key} axis_body"),
        origin_body=np.array(table.origin_body_m),
        limits=(float(low), float(high)),
        keypoints=table.keypoints,
        sunward_body=(
            None if sunward is None else direction(sunward, where, f"{key} sunward_body")
        ),
    )


def _is_binary_stl(content: bytes) -> bool:
    """Whether the count of triangles after the 80-byte title fits the length."""
    return len(content) >= 84 and len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")


def _read_plain_mesh(path: Path, body_from_file: NDArray[np.float64]) -> SpacecraftModel:
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
    """A shipped model by name, or a mesh file by path.

    name : a shipped name, or a path to .glb, .gltf, .obj or .stl
    base : folder that a relative path starts from
    unit_m : metres per unit of the file, for files that are not in metres
    up_axis, forward_axis : the file's axes ("y", "-z") that become body -z and x

    Raises AssetError; ValueError for axes that are not square to each other.
    """
    file_to_body = body_from_file(unit_m or 1.0, up_axis, forward_axis)
    if "/" not in name and Path(name).suffix.lower() not in _MESH_SUFFIXES:
        if name not in shipped_models():
            raise AssetError(f'no model "{name}"; {did_you_mean(name, shipped_models())}')
        if unit_m is not None:
            raise AssetError(f'model "{name}" knows its unit; unit_m goes with a mesh file')
        if up_axis is not None:
            raise AssetError(f'model "{name}" knows its axes; up_axis goes with a mesh file')
        return _read_model_folder(assets.models() / name)
    path = base / name
    if not path.is_file():
        raise AssetError(f"{path}: no such model file")
    if path.suffix.lower() in (".glb", ".gltf"):
        return read_gltf(path, path.stem, file_to_body, beside(base, path))
    if path.suffix.lower() in _MESH_SUFFIXES:
        return _read_plain_mesh(path, file_to_body)
    raise AssetError(f"{path}: not a mesh that simgl reads ({', '.join(_MESH_SUFFIXES)})")


def preset_path(name: str, base: Base = Path()) -> Path:
    """The file of a camera preset, named as shipped or by the path of a .toml file."""
    if name.endswith(".toml"):
        return base / name
    if name not in shipped_presets():
        raise AssetError(f'no camera preset "{name}"; {did_you_mean(name, shipped_presets())}')
    return assets.data() / "cameras" / f"{name}.toml"


@lru_cache(maxsize=32)
def load_preset(path: Path) -> CameraPresetTable:
    """The camera preset in a file."""
    return convert(read_toml(path), CameraPresetTable, str(path))
