"""Validation of a model file: its parts, and what will not be drawn."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import msgspec
import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.errors import AssetError
from simgl.input_files import read_file
from simgl.model_files.model_library import load_model, unit_guess
from simgl.motion.joints import Joint
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel

# Vertices nearer than this share of the model's size are one: float32 keeps 6e-8 of a coordinate.
_SAME_PLACE = 1e-6


@dataclass(frozen=True, kw_only=True)
class PartReport:
    """One part of a model.

    size : extent along the body axes [m]
    open_edges : directed edges without an opposite edge of a neighbour; 0 for a closed surface
    flat_triangles : without area
    contrary_normals : triangles whose corners' normals point, on average, to the side that their
        winding says is the back; light and camera are then taken to be on opposite sides
    volume : enclosed, negative where the triangles face inward [m3]; meaningless if open
    """

    name: str
    triangles: int
    size: tuple[float, float, float]
    open_edges: int
    flat_triangles: int
    contrary_normals: int
    volume: float

    @property
    def verdict(self) -> str:
        """Whether the surface is fit to cast shadows and hide what is inside."""
        if self.open_edges:
            return f"open, {self.open_edges} edges without a neighbour"
        return "watertight" if self.volume > 0.0 else "inside out"


@dataclass(frozen=True, kw_only=True)
class JointReport:
    """One joint of a model.

    way : its range, in words
    carrier : what it is mounted on, in words
    parts : mounted on it directly
    """

    name: str
    way: str
    carrier: str
    parts: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ModelReport:
    """Results of `check_model`.

    size, middle : of the bounding box, body axes [m]
    unit_guess : text on the unit; None where the size is that of a spacecraft
    images : number of texture images
    """

    name: str
    size: tuple[float, float, float]
    middle: tuple[float, float, float]
    unit_guess: str | None
    parts: tuple[PartReport, ...]
    materials: tuple[Material, ...]
    images: int
    joints: tuple[JointReport, ...]
    keypoints: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def triangles(self) -> int:
        """Number in all parts."""
        return sum(part.triangles for part in self.parts)

    @property
    def watertight(self) -> bool:
        """Whether every part is closed and faces outward."""
        return all(part.verdict == "watertight" for part in self.parts)


def check_model(
    name: str,
    unit_m: float | None = None,
    up_axis: str | None = None,
    forward_axis: str | None = None,
) -> ModelReport:
    """The report on a shipped model, or on a file by its path.

    unit_m : metres per unit of the file, where it is not in metres
    up_axis, forward_axis : as `load_model` takes them

    Raises AssetError, in one line, for a file that cannot be drawn.
    """
    _check_files(Path(name))
    model = load_model(name, unit_m=unit_m, up_axis=up_axis, forward_axis=forward_axis)
    mesh = model.mesh
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    size = np.subtract(high, low, dtype=np.float64)
    places = _places(mesh, float(size.max()))
    worn = np.unique(mesh.material)
    guess = unit_guess(model, unit_m)
    return ModelReport(
        name=name,
        size=_triple(size),
        middle=_triple(mesh.centre),
        unit_guess=guess,
        parts=tuple(_part(model, index, places) for index in range(len(model.parts))),
        materials=tuple(model.materials[index] for index in worn),
        images=sum(len(getattr(model.textures, kind)) for kind in _KINDS),
        joints=tuple(_joint(model, joint) for joint in model.joints),
        keypoints=tuple(model.keypoints),
        notes=(*(n for n in model.notes if n != guess), *_left_out(Path(name))),
    )


_KINDS = ("base_colour", "law", "normal", "emission")


class _NamedFile(msgspec.Struct):
    """A buffer or an image of a .gltf file."""

    uri: str | None = None


class _NamedFiles(msgspec.Struct):
    """The parts of a .gltf file that name other files."""

    buffers: tuple[_NamedFile, ...] = ()
    images: tuple[_NamedFile, ...] = ()


def _check_files(path: Path) -> None:
    """Raise one AssetError for all missing files that a .gltf refers to."""
    if path.suffix.lower() != ".gltf":
        return
    try:
        data = msgspec.json.decode(read_file(path), type=_NamedFiles)
    except (ValueError, RecursionError, AssetError):
        return  # the reader reports it better
    uris = {file.uri for file in (*data.buffers, *data.images) if file.uri is not None}
    named = sorted(uri for uri in uris if not uri.startswith("data:"))
    missing = [uri for uri in named if not os.path.exists(path.parent / unquote(uri))]
    if missing:
        names = ", ".join(f'"{uri}"' for uri in missing)
        raise AssetError(f"{path}: needs files that are missing beside it: {names}")


def _left_out(path: Path) -> tuple[str, ...]:
    """A note for formats of which only the shape is read."""
    if path.suffix.lower() in (".obj", ".stl"):
        kind = path.suffix[1:].upper()
        return (f"{kind} is read as shape only: grey, flat facets, one part, no images",)
    return ()


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _places(mesh: Mesh, longest: float) -> IndexArray:
    """(n,) a number for each vertex, equal for vertices at the same position."""
    grid = np.round(mesh.positions.astype(np.float64) / (_SAME_PLACE * max(longest, 1e-30)))
    _, numbers = np.unique(grid.astype(np.int64), axis=0, return_inverse=True)
    return numbers.reshape(-1)


def _part(model: SpacecraftModel, index: int, places: IndexArray) -> PartReport:
    mesh = model.mesh
    triangles = mesh.triangles[mesh.part[mesh.triangles[:, 0]] == index]
    corners = mesh.positions[triangles].astype(np.float64)
    if not len(triangles):
        return PartReport(
            name=model.parts[index],
            triangles=0,
            size=(0.0, 0.0, 0.0),
            open_edges=0,
            flat_triangles=0,
            contrary_normals=0,
            volume=0.0,
        )
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    facets = np.cross(b - a, c - a)
    normals = mesh.normals[triangles].astype(np.float64).sum(axis=1)
    return PartReport(
        name=model.parts[index],
        triangles=len(triangles),
        size=_triple(np.ptp(corners, axis=(0, 1))),
        open_edges=_open_edges(places[triangles]),
        flat_triangles=int(np.sum(~np.any(facets, axis=1))),
        contrary_normals=int(np.sum(np.einsum("ij,ij->i", facets, normals) < 0.0)),
        volume=float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0),
    )


def _joint(model: SpacecraftModel, joint: Joint) -> JointReport:
    low, high = joint.limits if joint.slides else np.degrees(joint.limits)
    way = f"{'slides' if joint.slides else 'turns'} {low:.4g}..{high:.4g}"
    return JointReport(
        name=joint.name,
        way=f"{way} {'m' if joint.slides else 'deg'}",
        carrier="on the body" if joint.parent is None else f"on {model.joints[joint.parent].name}",
        parts=tuple(model.parts[part] for part in joint.parts),
    )


def _open_edges(triangles: IndexArray) -> int:
    """Number of directed edges of (m, 3) triangles without as many opposite ones."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    ways = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, edge = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return int(np.abs(np.bincount(edge.reshape(-1), weights=ways)).sum())


def _percents(material: Material) -> str:
    return " ".join(f"{100.0 * value:.3g}" for value in material.reflectance)


def _law(material: Material) -> str:
    if material.roughness is None:
        law = "diffuse"
    else:
        kind = "metal" if material.metallic == 1.0 else "glossy" if not material.metallic else "mix"
        law = f"{kind}, roughness {material.roughness:g}"
    layers = {
        "coat": material.coat, "cells": material.cells, "crinkle": material.crinkle
    }  # fmt: skip
    return ", ".join([law, *(name for name, layer in layers.items() if layer is not None)])


def _judged(part: PartReport) -> str:
    """The verdict on a part, and its bad triangles."""
    bad = {
        "without area": part.flat_triangles,
        "with normals to the wrong side": part.contrary_normals,
    }
    counts = [f"{count} triangles {what}" for what, count in bad.items() if count]
    return "; ".join([part.verdict, *counts])


def _columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows as lines, each column as wide as its widest entry."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  " + "  ".join(v.ljust(w) for v, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def model_document(report: ModelReport) -> dict[str, object]:
    """The report as ``simgl model check --json`` prints it."""
    return {
        "model": report.name,
        "size_m": report.size,
        "centre_m": report.middle,
        "unit_guess": report.unit_guess,
        "triangles": report.triangles,
        "watertight": report.watertight,
        "images": report.images,
        "parts": [
            {
                "name": part.name,
                "triangles": part.triangles,
                "size_m": part.size,
                "open_edges": part.open_edges,
                "triangles_without_area": part.flat_triangles,
                "volume_m3": part.volume,
                "verdict": part.verdict,
            }
            for part in report.parts
        ],
        "joints": [
            {"name": j.name, "motion": j.way, "carrier": j.carrier, "parts": j.parts}
            for j in report.joints
        ],
        "materials": [
            {
                "name": material.name,
                "reflectance_rgbn": [float(value) for value in material.reflectance],
                "roughness": material.roughness,
                "metallic": material.metallic,
            }
            for material in report.materials
        ],
        "keypoints": report.keypoints,
        "notes": report.notes,
    }


def report_text(report: ModelReport) -> str:
    """The report as lines of plain text."""
    size = " x ".join(f"{v:.4g}" for v in report.size)
    middle = ", ".join(f"{v:.4g}" for v in (round(m, 6) + 0.0 for m in report.middle))
    closed = sum(part.verdict == "watertight" for part in report.parts)
    lines = [
        report.name,
        f"size       {size} m along x, y, z; middle at ({middle}) m",
        f"unit       {report.unit_guess or 'metres, which fits a spacecraft'}",
        f"triangles  {report.triangles}",
        f"watertight {closed} of {len(report.parts)} parts",
        f"images     {report.images}",
        f"joints     {len(report.joints) or 'none'}",
        f"keypoints  {', '.join(report.keypoints) or 'none'}",
        "",
        "parts",
    ]
    rows = [
        (
            part.name,
            f"{part.triangles} triangles",
            " x ".join(f"{v:.3g}" for v in part.size) + " m",
            _judged(part),
        )
        for part in report.parts
    ]
    lines += _columns(rows)
    if report.joints:
        lines += ["", "joints"]
        lines += _columns(
            [(j.name, j.way, j.carrier, ", ".join(j.parts) or "none") for j in report.joints]
        )
    lines += ["", "materials, reflectance in R G B N [%]"]
    lines += _columns([(m.name, _percents(m), _law(m)) for m in report.materials])
    lines += ["", "not drawn as the file asks" if report.notes else "all is drawn as the file asks"]
    lines += [f"  {note}" for note in report.notes]
    return "\n".join(lines)
