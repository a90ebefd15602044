"""Bakes kept as files: a body is traced once on a machine."""

from __future__ import annotations

import hashlib
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from simgl.disk_cache import cache_folder, read_arrays, write_arrays
from simgl.progress import ProgressCallback
from simgl.radiosity.bake import BakeSettings, bake, sees_itself
from simgl.radiosity.light_transport import LightTransport
from simgl.scene.mesh import Mesh

# Part of every key: a change in how bakes are made or stored makes the old files strangers.
VERSION = 7

_MATRICES = ("form_factors", "sky", "gather", "sky_part", "whole")


def transport_of(
    mesh: Mesh,
    *,
    open_sheets: bool,
    settings: BakeSettings = BakeSettings(),
    progress: ProgressCallback | None = None,
) -> LightTransport | None:
    """The transport of a body, from the file of an earlier bake where there is one.

    None where no surface of it sees another. A folder that cannot be written only costs the next
    bake; a damaged file is made anew.
    """
    if not sees_itself(mesh, 2 if open_sheets else 1):
        return None
    path = cache_folder("transport") / f"{_key(mesh, open_sheets, settings)}.npz"
    found = _read(path)
    if found is None:
        found = bake(mesh, open_sheets=open_sheets, settings=settings, progress=progress)
        assert found is not None
        write_arrays(path, _packed(found), "light between surfaces is traced again next time")
    return found


def _key(mesh: Mesh, open_sheets: bool, settings: BakeSettings) -> str:
    what = f"{VERSION} {mesh.digest} {open_sheets} {astuple(settings)}"
    return hashlib.sha256(what.encode()).hexdigest()


def _read(path: Path) -> LightTransport | None:
    """The bake in a file; None where there is none, or no whole one."""
    data = read_arrays(path)
    try:
        return None if data is None else _unpacked(data)
    except (ValueError, KeyError):
        return None


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
