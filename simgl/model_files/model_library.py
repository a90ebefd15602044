"""Spacecraft models by name, shipped or from the user's files."""

from __future__ import annotations

import io
import logging
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field

from simgl import assets
from simgl.arrays import Array
from simgl.config.curve_files import read_fractions
from simgl.config.path_sandbox import Base, folder_of
from simgl.config.validation import convert, read_toml
from simgl.config.value_types import Positive, Table, Vector
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.file_cache import FileCache
from simgl.input_files import read_file
from simgl.lru_cache import MANY
from simgl.model_files.gltf_model import read_gltf
from simgl.model_files.heat_tables import ThermalLinkTable, read_thermal
from simgl.model_files.joint_tables import JointTable, read_joints
from simgl.model_files.model_from_mesh import PLAIN, check_size, mesh_of_triangles
from simgl.physics.spectrum import BANDS
from simgl.scene.materials import MAX_MATERIALS, Material
from simgl.scene.solid import is_solid
from simgl.scene.spacecraft import SpacecraftModel

# Metres in each unit.
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048, "km": 1e3}
Unit = Literal["m", "mm", "cm", "in", "ft", "km"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
AXES = ("x", "y", "z", "-x", "-y", "-z")

# Longest side of spacecraft, from a picosatellite to the space station [m].
_SMALLEST, _LARGEST = 0.03, 150.0
# Units that CAD programs export, the most likely first.
_LIKELY_UNITS = {"millimetres": "mm", "centimetres": "cm", "inches": "in", "kilometres": "km"}

# The forward axis where only the up axis is given: z where y is up, as in glTF.
_USUAL_FORWARD = {"x": "z", "y": "z", "z": "x"}
# The names of axes in a model card.
_CARD_AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
_MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".stl")
# The largest of text has twice the triangles that are drawn.
_MAX_MESH_BYTES = 512 << 20
_MATERIAL_LINE = re.compile(r"^[ \t]*(?:usemtl|mtllib)\b.*$", re.MULTILINE)


class AxesTable(Table, frozen=True, kw_only=True):
    """Body axes named by the file's axes: ``x = "+z"`` says that body x is the file's z."""

    x: str
    y: str
    z: str


class ModelTable(Table, frozen=True, kw_only=True):
    """A model card, such as ``models/NAME/model.toml``.

    file : from the card's folder
    thermal, thermal_node : by parts and by names of what is inside, ``read_thermal`` reads them
    reflectance : measured curves by materials, CSV files from the card's folder
    """

    name: str
    file: str
    description: str = ""
    source: str = ""
    unit_m: Positive
    axes: AxesTable
    joint: Annotated[tuple[JointTable, ...], Meta(max_length=255)] = ()
    keypoints: Annotated[dict[str, Vector], Meta(max_length=10_000)] = field(default_factory=dict)
    thermal: Annotated[dict[str, Any], Meta(max_length=10_000)] = field(default_factory=dict)
    thermal_node: Annotated[dict[str, Any], Meta(max_length=10_000)] = field(default_factory=dict)
    thermal_link: Annotated[tuple[ThermalLinkTable, ...], Meta(max_length=100_000)] = ()
    reflectance: Annotated[dict[str, str], Meta(max_length=MAX_MATERIALS)] = field(
        default_factory=dict
    )


def shipped_models() -> list[str]:
    """Names of the models that come with simgl, sorted; docs/models.md describes them.

    >>> "space_rider" in simgl.shipped_models()
    True
    """
    return sorted(p.parent.name for p in assets.models().glob("*/model.toml"))


def unit_guess(model: SpacecraftModel, unit_m: float | None) -> str | None:
    """The likely unit of a model's file, where its size is not that of a spacecraft; else None.

    unit_m : metres per unit with which the file was read
    """
    longest = float(np.ptp(model.mesh.positions, axis=0).max())
    if _SMALLEST <= longest <= _LARGEST:
        return None
    for name, unit in _LIKELY_UNITS.items():
        metres = longest / (unit_m or 1.0) * UNITS[unit]
        if _SMALLEST <= metres <= _LARGEST:
            fits = f"{metres:.3g} m if in {name}"
            return f'{longest:.6g} m is not a spacecraft\'s size; {fits}: unit = "{unit}"'
    return f"{longest:.6g} m is not a spacecraft's size, and no usual unit makes it one"


def body_from_file(unit_m: float, up: str | None, forward: str | None) -> Array:
    """(3, 3) matrix from a file's coordinates to body axes in metres.

    unit_m : metres per unit of the file
    up, forward : the file's axes, of ``AXES``, that become body -z and body x; without ``up`` the
        file's axes are the body's

    Raises ValueError if the two are not perpendicular.
    """
    if up is None:
        if forward is not None:
            raise ValueError("requires up_axis")
        return unit_m * np.eye(3)
    forward = forward or _USUAL_FORWARD[up[-1]]
    if forward[-1] == up[-1]:
        raise ValueError(f"must not lie along up_axis, got {forward} and {up}")
    x, z = _axis(forward), -_axis(up)
    return unit_m * np.stack([x, np.cross(z, x), z])


def _axis(name: str) -> Array:
    sign = -1.0 if name[0] == "-" else 1.0
    return sign * np.eye(3)["xyz".index(name[-1])]


def _body_from_card(axes: AxesTable, where: str) -> Array:
    for key in ("x", "y", "z"):
        if getattr(axes, key) not in _CARD_AXES:
            problem = f'must be one of {", ".join(_CARD_AXES)}, got "{getattr(axes, key)}"'
            raise ConfigError(where, f"axes.{key}", problem)
    matrix = np.stack([_axis(axes.x), _axis(axes.y), _axis(axes.z)])
    if not np.isclose(np.linalg.det(matrix), 1.0):
        raise ConfigError(where, "axes", "must be right-handed and use each axis once")
    return matrix


def _read_model_card(path: Path, folder: Base) -> SpacecraftModel:
    """The model that a card describes; its file is named from ``folder``."""
    where = str(path)
    table = convert(read_toml(path), ModelTable, where)
    file_to_body = table.unit_m * _body_from_card(table.axes, where)
    file = folder / table.file
    model = read_gltf(file, table.name, file_to_body, folder_of(file, folder))
    joints = read_joints(table.joint, model, table.keypoints, where)
    keypoints = {k: np.array(v) for k, v in table.keypoints.items()}
    materials = _measured(model.materials, table.reflectance, where, folder)
    model = replace(model, keypoints=keypoints, joints=joints, materials=materials)
    return read_thermal(model, table.thermal, table.thermal_node, table.thermal_link, where)


def _measured(
    materials: tuple[Material, ...], curves: dict[str, str], where: str, folder: Base
) -> tuple[Material, ...]:
    """Materials, some of which have a measured curve in place of their colour."""
    names = [material.name for material in materials]
    measured = {}
    for name, file in curves.items():
        key = f"reflectance.{name}"
        if name not in names:
            raise ConfigError(where, key, f"names no material; {did_you_mean(name, names)}")
        measured[name] = read_fractions(file, folder, where, key)
    return tuple(
        replace(one, reflectance=BANDS.photon_mean_of(curve), spectrum=curve, form=None)
        if (curve := measured.get(one.name)) is not None
        else one
        for one in materials
    )


def _is_binary_stl(content: bytes) -> bool:
    """Whether the count of triangles after the 80-byte title fits the length."""
    return len(content) >= 84 and len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")


def _read_plain_mesh(path: Path, body_from_file: Array) -> SpacecraftModel:
    kind = path.suffix[1:].lower()
    content = read_file(path, _MAX_MESH_BYTES)
    source: io.BytesIO | io.StringIO = io.BytesIO(content)
    if not (kind == "stl" and _is_binary_stl(content)):
        # Names and comments may be in any encoding; what matters is ASCII.
        text = content.decode("utf-8", errors="replace")
        # Materials are not read, and trimesh takes minutes for some thousands of them.
        source = io.StringIO(_MATERIAL_LINE.sub("", text) if kind == "obj" else text)
        kind = {"stl": "stl_ascii"}.get(kind, kind)
    # Here: its import takes longer than all others of simgl, and glTF files need none of it.
    import trimesh

    log = logging.getLogger("trimesh.util")  # of all its modules
    log.disabled, before = True, log.disabled  # what it warns of is in our error, or harmless
    try:
        loaded = trimesh.load(source, file_type=kind, force="mesh", process=False)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise AssetError(f"{path}: is not a readable {path.suffix[1:].upper()} file") from error
    finally:
        log.disabled = before
    points = np.asarray(getattr(loaded, "vertices", ()), dtype=np.float64)
    triangles = np.asarray(getattr(loaded, "faces", ()), dtype=np.int64)
    check_size(str(path), len(triangles), len(points))
    if triangles.size == 0:
        hint = f"is it a whole {path.suffix[1:].upper()} file?"
        raise AssetError(f"{path}: holds no triangles; {hint}")
    if points.shape[1] != 3:
        problem = f"has vertices of {points.shape[1]} coordinates; they must have x, y and z"
        raise AssetError(f"{path}: {problem}")
    with np.errstate(over="ignore", invalid="ignore"):  # seen in the mesh
        points = points @ body_from_file.T
    mesh = mesh_of_triangles(str(path), points, triangles)
    return SpacecraftModel(
        name=path.stem,
        mesh=mesh,
        parts=(path.stem,),
        materials=(PLAIN,),
        open_sheets=not is_solid(mesh),
    )


# More than a scene shows; the files of a model take some ms to read again.
_models = FileCache[tuple[object, ...], SpacecraftModel](
    MANY, max_bytes=1 << 30, size_of=lambda model: model.nbytes
)


def load_model(
    name: str,
    base: Base = Path(),
    unit_m: float | None = None,
    up_axis: str | None = None,
    forward_axis: str | None = None,
) -> SpacecraftModel:
    """A spacecraft model from a file, or a shipped one by its name.

    Equal files give the same object while it is in the cache.

    name : a shipped name, or a path to .glb, .gltf, .obj or .stl, or to a model card (.toml)
    base : folder that a relative path starts from
    unit_m : metres per unit of a mesh file; metres if omitted
    up_axis, forward_axis : the mesh file's axes ("y", "-z") that become body -z and x; the file's
        axes are the body's if omitted

    Raises AssetError for a file that cannot be read, ConfigError for a bad card, and ValueError
    for axes that are not perpendicular.

    >>> model = simgl.load_model("wedge")
    >>> model.name, len(model.mesh.triangles)
    ('wedge', 12)
    """
    key = name, base, unit_m, up_axis, forward_axis
    return _models.get(key, lambda: _read_model(name, base, unit_m, up_axis, forward_axis))


def _read_model(
    name: str, base: Base, unit_m: float | None, up_axis: str | None, forward_axis: str | None
) -> SpacecraftModel:
    if unit_m is not None and not 0.0 < unit_m < np.inf:
        raise AssetError(f'model "{name}": unit_m must be positive and finite, got {unit_m}')
    file_to_body = body_from_file(1.0 if unit_m is None else unit_m, up_axis, forward_axis)
    kind = Path(name).suffix.lower()
    shipped = not kind and "/" not in name
    if shipped and name not in shipped_models():
        raise AssetError(f'no model "{name}"; {did_you_mean(name, shipped_models())}')
    if shipped or kind == ".toml":
        if unit_m is not None:
            raise AssetError(
                f'model "{name}" knows its unit; unit_m is allowed only for a mesh file'
            )
        if up_axis is not None:
            raise AssetError(
                f'model "{name}" knows its axes; up_axis is allowed only for a mesh file'
            )
    if shipped:
        folder = assets.models() / name
        return _read_model_card(folder / "model.toml", folder)
    path = base / name
    if not os.path.exists(path):
        raise AssetError(f"{path}: no such model file")
    if kind == ".toml":
        return _read_model_card(path, folder_of(path, base))
    if kind not in _MESH_SUFFIXES:
        known = ", ".join(_MESH_SUFFIXES)
        problem = f"neither a mesh that simgl reads ({known}) nor a model card (.toml)"
        raise AssetError(f"{path}: {problem}")
    if kind in (".glb", ".gltf"):
        model = read_gltf(path, path.stem, file_to_body, folder_of(path, base))
    else:
        model = _read_plain_mesh(path, file_to_body)
    guess = unit_guess(model, unit_m)
    return model if guess is None else replace(model, notes=(*model.notes, guess))
