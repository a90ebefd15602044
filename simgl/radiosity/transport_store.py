"""Light transports of spacecraft models, in memory and as files: a body is traced once."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import astuple, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse

from simgl.disk_cache import cache_folder, made_once, read_arrays, write_arrays
from simgl.lru_cache import MANY, LruCache
from simgl.motion.joints import Joint
from simgl.progress import ProgressCallback, begin_stage
from simgl.radiosity.bake import BakeSettings, bake, sees_itself
from simgl.radiosity.hemisphere import SKY_CELLS
from simgl.radiosity.jointed_bake import bake_jointed
from simgl.radiosity.jointed_transport import JointedTransport
from simgl.radiosity.light_grids import NODES
from simgl.radiosity.light_transport import LightGrids, LightTransport, PatchCells
from simgl.radiosity.posed_transport import PosedTransport
from simgl.radiosity.rigid_pairs import NOWHERE
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import PosedMesh, groups_of_parts
from simgl.scene.spacecraft import SpacecraftModel
from simgl.sparse_arrays import matrix_arrays

# How light between parts that joints have moved is found: pair by pair of rigid groups
# (simgl/radiosity/jointed_transport.py), or by a bake of each pose.
JointLight = Literal["quick", "exact"]

# Light between surfaces changes little over half of these: over half a degree a part at the end of
# 2 m moves by 17 mm. A bake of the whole body takes seconds, and takes larger steps.
STEPS: dict[JointLight, float] = {"quick": np.radians(1.0), "exact": np.radians(5.0)}
# Of the transports in memory: an arm on the move takes a new one with every step, 12 MB if it is a
# quick one, up to 50 MB if exact.
MAX_BYTES = 512 << 20
# Part of every key: with a change in how bakes are made or stored, old files are not read any more.
VERSION = 23

_Bake = TypeVar("_Bake")
_Part = TypeVar("_Part", PatchCells, LightGrids)
_Layout = TypeVar("_Layout", sparse.csr_matrix, sparse.csc_matrix)
_NOT_WRITTEN = "light between surfaces is traced again next time"
_JOINTED_ARRAYS = ("group_of_patch", "reach", "target")
_MATRICES = ("form_factors", "sky", "gather", "sun_gather", "sky_part", "sky_rays")
# Of the gather points of vertices and grids, of vertices alone, and of both.
_OPTIONAL = ("means", "sharpened", "sun_sharpened")


class TransportStore:
    """The transports of models by their content, the last ``MAX_BYTES`` of them in memory."""

    def __init__(self) -> None:
        self._transports = LruCache[tuple[str, bool], LightTransport | None](
            MANY, max_bytes=MAX_BYTES
        )
        self._jointed = LruCache[tuple[str, bytes, bool], JointedTransport](
            MANY, max_bytes=MAX_BYTES
        )
        self._posed = LruCache[tuple[str, bool], PosedTransport](MANY, max_bytes=MAX_BYTES)

    def reserve(self, bodies: int) -> None:
        """The transports of so many, the last ones, stay in memory whatever their size."""
        for transports in (self._transports, self._jointed, self._posed):
            transports.reserve(bodies)

    def of(
        self,
        model: SpacecraftModel,
        joint_light: JointLight = "exact",
        progress: ProgressCallback | None = None,
    ) -> LightTransport | None:
        """How a model's surfaces see each other; None where none sees another.

        Traced at the first call, unless a file has it. Joints stand at the nearest of their
        ``STEPS``. Where any has moved, ``joint_light`` says how.
        """
        coarse = _coarse(model, joint_light)
        posed, open_sheets = coarse.posed_mesh, model.open_sheets
        if _by_pairs(coarse, joint_light):
            jointed = self._jointed_of(model, progress)
            return self._posed.get(
                (posed.digest, open_sheets),
                lambda: jointed.at(posed, coarse.angles),
                lambda transport: transport.nbytes,
            )
        return self._transports.get(
            (posed.digest, open_sheets),
            lambda: transport_of(
                posed.baked(), open_sheets=open_sheets, settings=BakeSettings(), progress=progress
            ),
            lambda transport: 0 if transport is None else transport.nbytes,
        )

    def prepare(
        self,
        models: Iterable[SpacecraftModel],
        joint_light: JointLight = "exact",
        progress: ProgressCallback | None = None,
    ) -> None:
        """Trace what ``of`` will need: for the pose of each model and, with "quick", for all others
        but for the pairs of groups that joints then move."""
        for model in models:
            begin_stage(progress, f"light between surfaces of {model.name}")
            self.of(model, joint_light, progress)
            if joint_light == "quick" and model.joints:
                self._jointed_of(model, progress).trace(_coarse_values(model))

    def to_trace(self, models: Iterable[SpacecraftModel], joint_light: JointLight) -> bool:
        """Whether ``prepare`` has to trace rays for any of these: no file has what it needs."""
        return any(_to_trace(model, joint_light) for model in models)

    def exchanges(self, model: SpacecraftModel) -> bool:
        """Whether any of a model's surfaces may see another, as far as can be told before it is
        traced."""
        return sees_itself(model.mesh, 2 if model.open_sheets else 1)

    def is_posed(self, model: SpacecraftModel, joint_light: JointLight) -> bool:
        """Whether ``of`` puts the transport of the model's pose together from pairs of groups."""
        return _by_pairs(_coarse(model, joint_light), joint_light)

    def untraced_pairs(self, model: SpacecraftModel) -> int:
        """How many pairs of groups ``of`` would trace for quick light at the model's pose."""
        return self._jointed_of(model, None).untraced(_coarse_values(model))

    def trace_pairs(self, model: SpacecraftModel, count: int) -> None:
        """Trace so many of them."""
        self._jointed_of(model, None).trace(_coarse_values(model), count)

    def has_pose(self, model: SpacecraftModel) -> bool:
        """Whether ``of`` finds quick light at the model's pose."""
        return (_coarse(model, "quick").posed_mesh.digest, model.open_sheets) in self._posed

    def _jointed_of(
        self, model: SpacecraftModel, progress: ProgressCallback | None
    ) -> JointedTransport:
        mesh, joints, open_sheets = model.mesh, model.joints, model.open_sheets
        key = mesh.digest, groups_of_parts(mesh, joints).tobytes(), open_sheets
        return self._jointed.get(
            key,
            lambda: jointed_transport_of(mesh, joints, open_sheets=open_sheets, progress=progress),
            lambda transport: transport.nbytes,
        )


def _coarse(model: SpacecraftModel, joint_light: JointLight) -> SpacecraftModel:
    """At the pose whose light is taken.

    A joint that passes a multiple of a step stays at one quick pose; a bake is the light of a pose
    that a scenario gives in whole steps, to the bit.
    """
    return model.coarsely_posed(STEPS[joint_light], near_stay=joint_light == "exact")


def _by_pairs(coarse: SpacecraftModel, joint_light: JointLight) -> bool:
    return joint_light == "quick" and coarse.posed_mesh.motion is not None


def _to_trace(model: SpacecraftModel, joint_light: JointLight) -> bool:
    if joint_light == "quick" and model.joints:
        return not _jointed_path(model.mesh, model.joints, model.open_sheets).is_file()
    mesh = _coarse(model, joint_light).posed_mesh.baked()
    if _path(mesh, model.open_sheets).is_file():
        return False
    return sees_itself(mesh, 2 if model.open_sheets else 1)


def _coarse_values(model: SpacecraftModel) -> tuple[float, ...]:
    """Of its joints, with quick light [rad] or [m]."""
    return _coarse(model, "quick").angles or (0.0,) * len(model.joints)


def jointed_transport_of(
    mesh: Mesh,
    joints: tuple[Joint, ...],
    *,
    open_sheets: bool,
    settings: BakeSettings = BakeSettings(),
    progress: ProgressCallback | None = None,
) -> JointedTransport:
    """The transport of a body with joints, from the file of an earlier bake if there is one.

    mesh : as stored
    """
    path = _jointed_path(mesh, joints, open_sheets, settings)

    def make() -> JointedTransport:
        transport = bake_jointed(
            mesh, joints, open_sheets=open_sheets, settings=settings, progress=progress
        )
        write_arrays(path, _packed_jointed(transport), _NOT_WRITTEN)
        return transport

    return made_once(path, lambda: _read(path, lambda data: _unpacked_jointed(data, joints)), make)


def transport_of(
    mesh: Mesh,
    *,
    open_sheets: bool,
    settings: BakeSettings = BakeSettings(),
    progress: ProgressCallback | None = None,
) -> LightTransport | None:
    """The transport of a body, from the file of an earlier bake if there is one.

    None where no surface of it sees another. If the folder cannot be written, the next process
    bakes again; a damaged file is replaced.
    """
    if not sees_itself(mesh, 2 if open_sheets else 1):
        return None
    path = _path(mesh, open_sheets, settings)

    def make() -> LightTransport:
        transport = bake(mesh, open_sheets=open_sheets, settings=settings, progress=progress)
        assert transport is not None
        write_arrays(path, _packed(transport), _NOT_WRITTEN)
        return transport

    return made_once(path, lambda: _read(path, _unpacked), make)


def _jointed_path(
    mesh: Mesh,
    joints: tuple[Joint, ...],
    open_sheets: bool,
    settings: BakeSettings = BakeSettings(),
) -> Path:
    groups = hashlib.sha256(groups_of_parts(mesh, joints).tobytes()).hexdigest()
    return _path(mesh, open_sheets, settings, groups)


def _path(
    mesh: Mesh, open_sheets: bool, settings: BakeSettings = BakeSettings(), groups: str = ""
) -> Path:
    content = f"{VERSION} {mesh.digest} {open_sheets} {astuple(settings)}{groups}"
    return cache_folder("transport") / f"{hashlib.sha256(content.encode()).hexdigest()}.npz"


def _read(path: Path, unpack: Callable[[dict[str, Any]], _Bake]) -> _Bake | None:
    """The bake in a file; None without a file, or where it is damaged or holds something else."""
    data = read_arrays(path)
    if data is None:
        return None
    try:
        return unpack(data)
    except (ValueError, KeyError, TypeError, IndexError):
        return None


def _packed_jointed(transport: JointedTransport) -> dict[str, Any]:
    data = _packed(transport.separate)
    for name in _JOINTED_ARRAYS:
        data[f"jointed.{name}"] = getattr(transport, name)
    return data | matrix_arrays("jointed.spread", transport.spread)


def _unpacked_jointed(data: dict[str, Any], joints: tuple[Joint, ...]) -> JointedTransport:
    """Raises ValueError where an index points nowhere."""
    separate = _unpacked(data)
    transport = JointedTransport(
        separate=separate,
        joints=joints,
        spread=_matrix(data, "jointed.spread", sparse.csc_matrix),
        **{name: data[f"jointed.{name}"] for name in _JOINTED_ARRAYS},
    )
    transport.spread.check_format(full_check=True)
    patches, cells, rays = len(separate.areas), separate.sky.shape[1], transport.reach.shape
    target = transport.target[transport.target != NOWHERE]
    right = transport.spread.shape == (separate.gather_point_of_vertex.size, patches)
    right &= transport.target.shape == rays and rays[:2] == separate.points.shape[:2]
    right &= bool(np.all((target >= -cells) & (target < patches)))
    groups = transport.group_of_patch
    right &= groups.shape == (patches,) and groups.min() >= 0 and groups.max() < cells // SKY_CELLS
    if not right:
        raise ValueError("an index of a light transport points nowhere")
    return transport


def _packed(transport: LightTransport) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for field in fields(transport):
        value = getattr(transport, field.name)
        if field.name in ("cells", "grids"):
            data |= _packed_part(field.name, value)
        elif field.name in (*_MATRICES, *_OPTIONAL):
            data |= {} if value is None else matrix_arrays(field.name, value)
        elif field.name == "mesh":
            arrays = {f.name: getattr(value, f.name) for f in fields(value)}
            data |= {f"mesh.{name}": array for name, array in arrays.items() if array is not None}
        else:
            data[field.name] = np.asarray(value)
    return data


def _packed_part(name: str, part: PatchCells | LightGrids | None) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for field in fields(part) if part is not None else ():
        key, value = f"{name}.{field.name}", getattr(part, field.name)
        data |= matrix_arrays(key, value) if field.name == "gather" else {key: value}
    return data


def _unpacked_part(
    name: str, kind: type[_Part], layout: type[_Layout], data: dict[str, Any]
) -> _Part | None:
    gather = f"{name}.gather"
    if f"{gather}.data" not in data:
        return None
    plain = {f.name: data[f"{name}.{f.name}"] for f in fields(kind) if f.name != "gather"}
    return kind(gather=_matrix(data, gather, layout), **plain)


def _matrix(data: dict[str, Any], name: str, layout: type[_Layout]) -> _Layout:
    arrays = data[f"{name}.data"], data[f"{name}.indices"], data[f"{name}.indptr"]
    return layout(arrays, shape=tuple(data[f"{name}.shape"]))


def _unpacked(data: dict[str, Any]) -> LightTransport:
    """Raises ValueError where an index points nowhere."""
    mesh = {name[5:]: array for name, array in data.items() if name.startswith("mesh.")}
    matrices = {name: _matrix(data, name, sparse.csc_matrix) for name in _MATRICES}
    plain = {name: array for name, array in data.items() if "." not in name}
    plain["sides"] = int(plain["sides"])
    transport = LightTransport(
        mesh=Mesh(**mesh),
        **matrices,
        **plain,
        cells=_unpacked_part("cells", PatchCells, sparse.csr_matrix, data),
        grids=_unpacked_part("grids", LightGrids, sparse.csc_matrix, data),
        **{
            name: _matrix(data, name, sparse.csc_matrix)
            for name in _OPTIONAL
            if f"{name}.data" in data
        },
    )
    _check(transport)
    return transport


def _check(transport: LightTransport) -> None:
    """Raise ValueError where an index points nowhere: compiled code would read past its arrays."""
    for name in _MATRICES:
        getattr(transport, name).check_format(full_check=True)
    patches, points = len(transport.areas), transport.gather.shape[0]
    shapes = {
        "form_factors": (patches, patches),
        "sky": (patches, transport.sky.shape[1]),
        "gather": (points, patches),
        "sun_gather": (points, patches),
        "sky_part": (points, transport.sky.shape[1]),
        "sky_rays": (transport.sky_rays.shape[0], transport.sky.shape[1]),
    }
    vertices, triangles = len(transport.mesh.positions), transport.mesh.triangles
    indices = (
        (triangles, (len(triangles), 3), vertices),
        (transport.patch_of_side, (len(triangles) * transport.sides,), patches),
        (transport.sky_rays_row, (points,), transport.sky_rays.shape[0]),
        (transport.gather_point_of_vertex, (transport.sides, vertices), points),
    )
    right = all(getattr(transport, name).shape == shape for name, shape in shapes.items())
    for index, shape, count in indices:
        right &= index.shape == shape and index.min() >= 0 and index.max() < count
    if transport.grids is not None:
        right &= _points_somewhere(transport.grids, transport)
    every = _all_points(transport)
    for name, count in zip(_OPTIONAL, (every, points, every), strict=True):
        matrix = getattr(transport, name)
        if matrix is not None:
            matrix.check_format(full_check=True)
            right &= matrix.shape == (count, count)
    right &= len(transport.start_places) in (0, every)
    right &= transport.start_places.shape == transport.start_normals.shape
    right &= transport.start_radii.shape == transport.start_places.shape[:1]
    if transport.cells is not None:
        right &= _cells_somewhere(transport.cells, transport)
    if not right:
        raise ValueError("an index of a light transport points nowhere")


def _points_somewhere(grids: LightGrids, transport: LightTransport) -> bool:
    grids.gather.check_format(full_check=True)
    points, patches = grids.gather.shape
    node, count = grids.point_of_node, len(grids.triangles)
    right = patches == len(transport.areas) and node.shape == (count, NODES, transport.sides)
    right &= bool(node.min() >= -1 and node.max() < points and grids.triangles.min() >= 0)
    right &= grids.row_of_node.shape == node.shape and bool(grids.row_of_node.min() >= 0)
    right &= grids.rows <= 1 + node.size and bool(np.all((grids.row_of_node > 0) <= (node >= 0)))
    return right and bool(grids.triangles.max() < len(transport.mesh.triangles))


def _all_points(transport: LightTransport) -> int:
    """Gather points of vertices and of grids."""
    of_grids = 0 if transport.grids is None else transport.grids.gather.shape[0]
    return int(transport.gather.shape[0]) + int(of_grids)


def _cells_somewhere(cells: PatchCells, transport: LightTransport) -> bool:
    cells.gather.check_format(full_check=True)
    count = len(cells.patch)
    right = cells.gather.shape == (count, _all_points(transport))
    right &= cells.points.shape == (count, 3) and cells.normals.shape == (count, 3)
    right &= cells.patch.shape == (count,)
    return right and bool(np.all((cells.patch >= 0) & (cells.patch < len(transport.areas))))


# Of each transport in use, for the pose that asked last: most poses stay from frame to frame.
_lit_meshes = WeakKeyDictionary[LightTransport, tuple[PosedMesh, PosedMesh]]()


def lit_mesh(model: SpacecraftModel, transport: LightTransport) -> PosedMesh:
    """The transport's mesh with the joints where they are."""
    posed, last = model.posed_mesh, _lit_meshes.get(transport)
    if last is None or last[0] is not posed:
        last = _lit_meshes[transport] = posed, _lit_mesh(model, transport)
    return last[1]


def _lit_mesh(model: SpacecraftModel, transport: LightTransport) -> PosedMesh:
    if isinstance(transport, PosedTransport):
        return replace(model.posed_mesh, mesh=transport.mesh)
    coarse = model.coarsely_posed(STEPS["exact"])
    return model.posed_mesh.moved_from(coarse.posed_mesh, transport.mesh)
