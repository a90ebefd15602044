"""Light transports of spacecraft models, in memory and as files: a body is traced once."""

from __future__ import annotations

import hashlib
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from simgl.disk_cache import cache_folder, read_arrays, write_arrays
from simgl.lru_cache import MANY, LruCache
from simgl.progress import ProgressCallback
from simgl.radiosity.bake import BakeSettings, bake, sees_itself
from simgl.radiosity.light_transport import LightTransport
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.spacecraft import SpacecraftModel

# Light between surfaces changes little over a few degrees of a joint, and tracing it takes seconds.
JOINT_STEP = np.radians(5.0)
# Of the transports in memory: an arm on the move takes a new one, up to 50 MB, with every step.
MAX_BYTES = 512 << 20
# Part of every key: with a change in how bakes are made or stored, old files are not read any more.
VERSION = 8

_MATRICES = ("form_factors", "sky", "gather", "sky_part", "sky_rays")


class TransportStore:
    """The transports of models by their content, the last ``MAX_BYTES`` of them in memory."""

    def __init__(self) -> None:
        self._transports = LruCache[tuple[str, bool], LightTransport | None](
            MANY, max_bytes=MAX_BYTES
        )

    def of(
        self, model: SpacecraftModel, progress: ProgressCallback | None = None
    ) -> LightTransport | None:
        """How a model's surfaces see each other; None where none sees another.

        Traced at the first call, unless a file has it. Joints stand at the nearest multiple of
        ``JOINT_STEP``.
        """
        posed, open_sheets = model.coarsely_posed(JOINT_STEP).posed_mesh, model.open_sheets
        return self._transports.get(
            (posed.digest, open_sheets),
            lambda: transport_of(posed.baked(), open_sheets=open_sheets, progress=progress),
            lambda transport: 0 if transport is None else transport.nbytes,
        )


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
    path = cache_folder("transport") / f"{_key(mesh, open_sheets, settings)}.npz"
    transport = _read(path)
    if transport is None:
        transport = bake(mesh, open_sheets=open_sheets, settings=settings, progress=progress)
        assert transport is not None
        write_arrays(path, _packed(transport), "light between surfaces is traced again next time")
    return transport


def _key(mesh: Mesh, open_sheets: bool, settings: BakeSettings) -> str:
    content = f"{VERSION} {mesh.digest} {open_sheets} {astuple(settings)}"
    return hashlib.sha256(content.encode()).hexdigest()


def _read(path: Path) -> LightTransport | None:
    """The bake in a file; None without a file, or where it is damaged or holds something else."""
    data = read_arrays(path)
    if data is None:
        return None
    try:
        transport = _unpacked(data)
        _check(transport)
    except (ValueError, KeyError, TypeError, IndexError):
        return None
    return transport


def _packed(transport: LightTransport) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for field in fields(transport):
        value = getattr(transport, field.name)
        if field.name in _MATRICES:
            data |= {
                f"{field.name}.data": value.data,
                f"{field.name}.indices": value.indices,
                f"{field.name}.indptr": value.indptr,
                f"{field.name}.shape": np.array(value.shape),
            }
        elif field.name == "mesh":
            arrays = {f.name: getattr(value, f.name) for f in fields(value)}
            data |= {f"mesh.{name}": array for name, array in arrays.items() if array is not None}
        else:
            data[field.name] = np.asarray(value)
    return data


def _unpacked(data: dict[str, Any]) -> LightTransport:
    mesh = {name[5:]: array for name, array in data.items() if name.startswith("mesh.")}
    matrices = {
        name: sparse.csr_matrix(
            (data[f"{name}.data"], data[f"{name}.indices"], data[f"{name}.indptr"]),
            shape=tuple(data[f"{name}.shape"]),
        )
        for name in _MATRICES
    }
    plain = {name: array for name, array in data.items() if "." not in name}
    plain["sides"] = int(plain["sides"])
    return LightTransport(mesh=Mesh(**mesh), **matrices, **plain)


def _check(transport: LightTransport) -> None:
    """Raise ValueError where an index points nowhere: compiled code would read past its arrays."""
    for name in _MATRICES:
        getattr(transport, name).check_format(full_check=True)
    patches, points = len(transport.areas), transport.gather.shape[0]
    shapes = {
        "form_factors": (patches, patches),
        "sky": (patches, transport.sky.shape[1]),
        "gather": (points, patches),
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
    if not right:
        raise ValueError("an index of a light transport points nowhere")


def lit_mesh(model: SpacecraftModel, transport: LightTransport) -> PosedMesh:
    """The transport's mesh with the joints where they are."""
    coarse = model.coarsely_posed(JOINT_STEP)
    return model.posed_mesh.moved_from(coarse.posed_mesh, transport.mesh)
