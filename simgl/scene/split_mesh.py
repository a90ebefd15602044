"""Meshes cut so finely that what moves the ends of an edge apart leaves it straight."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import IndexArray, UIntArray
from simgl.scene.mesh import Mesh, cached_with_mesh

# Edges of finer meshes stay longer.
_MAX_TRIANGLES = 1_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class SplitMesh:
    """A mesh whose long edges are cut.

    triangle : (m,) uint32, of the whole mesh, of which each triangle is a part
    """

    mesh: Mesh
    triangle: UIntArray


def longest_edge(mesh: Mesh) -> float:
    """Of a mesh [m]."""
    return _longest_edge(mesh, None)


@cached_with_mesh
def _longest_edge(mesh: Mesh, _: None) -> float:
    return float(np.sqrt(_longest_edges(mesh, mesh.triangles)[0].max(initial=0.0)))


def _longest_edges(mesh: Mesh, triangles: UIntArray) -> tuple[np.ndarray, IndexArray]:
    """(m,) squared length of each triangle's longest edge [m2], and the corner it starts from."""
    corners = mesh.positions[triangles]
    squared = np.sum((np.roll(corners, -1, axis=1) - corners) ** 2, axis=2)
    longest = np.argmax(squared, axis=1)
    return np.take_along_axis(squared, longest[:, None], axis=1)[:, 0], longest


def split_mesh(mesh: Mesh, longest: float) -> SplitMesh:
    """The mesh with edges cut in halves until none is longer [m].

    Whether an edge is cut depends on its ends alone, so that neighbours still meet.
    """
    done: list[tuple[UIntArray, UIntArray]] = []
    triangles, source = mesh.triangles, np.arange(len(mesh.triangles), dtype=np.uint32)
    count = 0
    while len(triangles):
        squared, start = _longest_edges(mesh, triangles)
        long = squared > longest * longest
        done.append((triangles[~long], source[~long]))
        count += int(np.sum(~long))
        triangles, source, start = triangles[long], source[long], start[long]
        if not len(triangles) or count + 2 * len(triangles) > _MAX_TRIANGLES:
            done.append((triangles, source))
            break
        row = np.arange(len(triangles))
        a, b, c = (triangles[row, (start + k) % 3] for k in range(3))
        middle = np.arange(len(row), dtype=np.uint32) + np.uint32(len(mesh.positions))
        mesh = _with_middles(mesh, a, b)
        halves = np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)
        triangles, source = np.concatenate(halves), np.concatenate([source, source])
    parts = [np.concatenate(part) for part in zip(*done, strict=True)]
    return SplitMesh(mesh=replace(mesh, triangles=parts[0]), triangle=parts[1])


def _with_middles(mesh: Mesh, a: UIntArray, b: UIntArray) -> Mesh:
    """The mesh with a vertex more in the middle of each edge from a to b."""

    def more(values: np.ndarray, middles: np.ndarray) -> np.ndarray:
        return np.concatenate([values, middles.astype(values.dtype)])

    def middles(values: np.ndarray) -> np.ndarray:
        return more(values, 0.5 * (values[a] + values[b]))

    return replace(
        mesh,
        positions=middles(mesh.positions),
        normals=middles(mesh.normals),
        part=more(mesh.part, mesh.part[a]),
        material=more(mesh.material, mesh.material[a]),
        uv=None if mesh.uv is None else middles(mesh.uv),
        colour=None if mesh.colour is None else middles(mesh.colour),
    )
