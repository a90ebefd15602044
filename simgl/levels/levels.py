"""Levels of detail of a mesh: what they hold, how they are made, and the files that keep them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, UIntArray
from simgl.disk_cache import cache_folder, read_arrays, write_arrays
from simgl.levels.collapse import Collapser, Surface
from simgl.levels.measure import Pieces, deviations, projected_areas
from simgl.levels.triangles import doubled_areas
from simgl.progress import ProgressCallback, silent
from simgl.scene.detail_steps import RUNGS
from simgl.scene.mesh import Mesh

# Part of every key: a change in how levels are made makes the old files strangers.
VERSION = 1

# Meshes of fewer triangles are drawn as they are.
FEWEST = 500
# What a connected piece may gain or lose of the area that it turns to any direction, as a share of
# its mean over all directions: thin tubes keep their width, and with it their light.
AREA_SHARE = 0.03
# Collapses aim below the allowed error: between the places that they look at it may be larger;
# connected pieces that come out too far off, or too narrow, are tried again.
_AIMS = (0.75, 0.3)
# Vertex colours may change so much.
_COLOUR_STEP = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Levels:
    """Triangles of a mesh from the finest level to the coarsest, one level after the other.

    triangles : (n, 3) uint32 vertices of the mesh; in each level sorted by part
    starts : (levels, parts + 1) where each part's triangles start, and the last one's end
    errors : (levels, parts) largest distance from the original by sampled points [m]; 0 in the
        first level, which is the original
    """

    triangles: UIntArray
    starts: IndexArray
    errors: Array

    @property
    def counts(self) -> IndexArray:
        """(levels, parts) triangles."""
        return np.diff(self.starts, axis=1)

    def chosen(self, allowed: Sequence[float]) -> tuple[int, ...]:
        """For each part the coarsest level within an allowed error [m]."""
        fits = self.errors <= np.asarray(allowed)[None, : self.errors.shape[1]]
        levels = np.arange(len(self.errors))[:, None]
        return tuple(np.max(np.where(fits, levels, 0), axis=0).tolist())

    def ranges(self, chosen: Sequence[int]) -> list[tuple[int, int]]:
        """First triangle and number of what is drawn where each part stands at a level."""
        found: list[tuple[int, int]] = []
        for part, level in enumerate(chosen):
            first, end = self.starts[level, part : part + 2].tolist()
            if found and sum(found[-1]) == first:
                found[-1] = found[-1][0], end - found[-1][0]
            elif end > first:
                found.append((first, end - first))
        return found

    def error(self, chosen: Sequence[int]) -> float:
        """The largest error of parts that stand at these levels [m]."""
        return float(max((self.errors[level, p] for p, level in enumerate(chosen)), default=0.0))


def levels_of(
    mesh: Mesh, progress: ProgressCallback | None = None, values: Array32 | None = None
) -> Levels:
    """The levels of a mesh, from the file of an earlier run where there is one.

    values : (n, k) of the vertices, what must stay the same to within 1, root mean square

    progress : told the steps done and their number

    A folder that cannot be written only costs the next run; a damaged file is made anew.
    """
    key = hashlib.sha256(f"{VERSION} {mesh.digest}".encode())
    if values is not None:
        key.update(np.ascontiguousarray(values).tobytes())
    path = cache_folder("levels") / f"{key.hexdigest()}.npz"
    data = read_arrays(path)
    if data is not None and set(data) == {"triangles", "starts", "errors"}:
        found = Levels(**data)
        if _fits(found, mesh):
            return found
    found = make_levels(mesh, progress, values)
    arrays = {"triangles": found.triangles, "starts": found.starts, "errors": found.errors}
    write_arrays(path, arrays, "levels of detail are made again next time")
    return found


def _fits(levels: Levels, mesh: Mesh) -> bool:
    """Whether a file's content can be drawn with a mesh."""
    triangles, starts, errors = levels.triangles, levels.starts, levels.errors
    return (
        triangles.dtype == np.uint32
        and triangles.ndim == 2
        and triangles.shape[1] == 3
        and starts.ndim == errors.ndim == 2
        and starts.shape == (errors.shape[0], errors.shape[1] + 1)
        and starts.shape[0] >= 1
        and int(starts[0, -1]) == len(mesh.triangles)
        and int(starts[-1, -1]) == len(triangles)
        and bool(np.all(np.diff(starts, axis=1) >= 0))
        and int(triangles.max(initial=0)) < len(mesh.positions)
    )


def make_levels(
    mesh: Mesh, progress: ProgressCallback | None = None, values: Array32 | None = None
) -> Levels:
    """The levels, computed; values : see ``levels_of``. The same mesh gives the same ones."""
    report = silent if progress is None else progress
    part = mesh.part.astype(np.int64)
    parts = int(part.max(initial=0)) + 1
    order = np.argsort(part[mesh.triangles[:, 0]], kind="stable")
    all_triangles = [mesh.triangles[order].astype(np.int64)]
    errors = [np.zeros(parts)]
    rungs = [e for e in RUNGS if e <= mesh.radius / 16.0] if len(order) >= FEWEST else []
    work = _Work(mesh, values) if rungs else None
    for step, rung in enumerate(rungs):
        report(step, len(rungs))
        assert work is not None
        triangles, shell_error = work.reduced(rung)
        shell_part = work.shell_part
        error = np.zeros(parts)
        np.maximum.at(error, shell_part, shell_error)
        # A level that spares little is not worth its place.
        if len(triangles) <= 0.95 * len(all_triangles[-1]):
            by_part = np.argsort(part[triangles[:, 0]], kind="stable")
            all_triangles.append(triangles[by_part])
            errors.append(error)
    if rungs:
        report(len(rungs), len(rungs))
    starts = []
    before = 0
    for triangles in all_triangles:
        starts.append(before + np.searchsorted(part[triangles[:, 0]], np.arange(parts + 1)))
        before += len(triangles)
    return Levels(
        triangles=np.concatenate(all_triangles).astype(np.uint32),
        starts=np.stack(starts).astype(np.int64),
        errors=np.stack(errors),
    )


class _Work:
    """A mesh on its way from level to level."""

    def __init__(self, mesh: Mesh, values: Array32 | None) -> None:
        self._positions = mesh.positions.astype(np.float64)
        part = mesh.part.astype(np.int64)
        columns = [np.zeros((len(part), 0))]
        if values is not None:
            columns.append(values.astype(np.float64))
        if mesh.colour is not None:
            columns.append(mesh.colour.astype(np.float64) / _COLOUR_STEP)
        self._collapser = Collapser(
            Surface(
                positions=self._positions,
                normals=mesh.normals.astype(np.float64),
                triangles=mesh.triangles.astype(np.int64),
                labels=mesh.material.astype(np.int64),
                groups=part,
                values=np.concatenate(columns, axis=1),
                places=_places_in_images(mesh),
            )
        )
        c = self._collapser
        self._count = len(c.frozen)
        self._original_shell = c.shell_of(c.original)
        self.shell_part = np.zeros(self._count, dtype=np.int64)
        self.shell_part[self._original_shell] = part[c.original[:, 0]]
        self._areas = self._projected(c.original)
        self._error = np.zeros(self._count)

    def _projected(self, triangles: IndexArray) -> Array:
        shell = self._collapser.shell_of(triangles)
        return projected_areas(self._positions, triangles, shell, self._count)

    def _pieces(self, triangles: IndexArray) -> Pieces:
        return Pieces(
            positions=self._positions,
            triangles=triangles,
            piece=self._collapser.shell_of(triangles),
        )

    def reduced(self, rung: float) -> tuple[IndexArray, Array]:
        """The triangles within an error [m], and the measured error of each connected piece."""
        c = self._collapser
        before = c.state()
        back, done = np.zeros(0, dtype=np.int64), c.frozen.copy()
        for aim in _AIMS:
            if len(back):
                c.restore(before, back)
                c.frozen[:] = True
                c.frozen[back] = done[back]
            c.reduce(aim * rung)
            c.frozen[:] = done
            change = np.abs(self._projected(c.triangles) - self._areas).max(axis=1)
            narrow = change > AREA_SHARE * self._areas.mean(axis=1)
            now = self._pieces(c.triangles)
            error, beyond = deviations(self._pieces(c.original), now, self._count, rung)
            back = np.flatnonzero(narrow | (error > rung))
            if len(back) == 0:
                break
            # What is too far off somewhere is tried again with the places around that held.
            c.held[c.point[beyond]] = True
            c.held[c.point[c.home[beyond]]] = True
        if len(back):
            c.restore(before, back)
            c.frozen |= narrow
            error[back] = self._error[back]
        c.held[:] = False
        self._error = error
        return c.triangles, error


def _places_in_images(mesh: Mesh) -> Array:
    """(n, 2) place in the images, in metres along the surface; (n, 0) without images."""
    if mesh.uv is None:
        return np.zeros((len(mesh.positions), 0))
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    uv = mesh.uv[mesh.triangles].astype(np.float64)
    u, v = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    in_images = float(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum())
    on_surface = float(np.linalg.norm(doubled_areas(corners), axis=1).sum())
    # One scale for the whole mesh: that of its mean.
    return mesh.uv * np.sqrt(on_surface / max(in_images, 1e-30))
