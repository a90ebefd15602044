"""What gather points see by many rays, for light that is gathered once for many frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from simgl.arrays import Array32, IndexArray, Mask
from simgl.radiosity.gather_points import (
    GAP,
    PLACES,
    GatherPoints,
    counts,
    face_normals,
    mean_nearness,
    open_places,
    point_and_place,
)
from simgl.radiosity.hemisphere import cosine_directions, frames, spins
from simgl.radiosity.in_turn import in_turn
from simgl.radiosity.patch_cells import CellIndex, SeenCells
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh


class _Part(NamedTuple):
    """A row of shares for some gather points; the cells they see, a place on each, its side; how
    near what they see is."""

    shares: sparse.csr_matrix
    cells: IndexArray
    places: Array32
    side: IndexArray
    nearness: Array32


def cells_seen(
    mesh: Mesh,
    tracer: RayTracer,
    points: GatherPoints,
    chosen: Mask,
    sides: int,
    index: CellIndex,
    rays: int,
    spun: bool,
    tick: Callable[[int], None],
) -> tuple[SeenCells, Mask]:
    """The cells that gather points see, and (s, PLACES) which of their places are outside other
    parts.

    chosen : (s,) which points; the rows of the others stay empty
    rays : of each point, a multiple of ``PLACES``
    spun : whether they are turned about the normal from point to point, so that what few rays miss
        evens out between neighbours
    tick : gets how many points are done
    """
    pattern = cosine_directions(rays).astype(np.float32)
    faces = face_normals(mesh)[0].astype(np.float32)
    turns = frames(points.normals)
    turns = (turns @ spins(len(turns)) if spun else turns).astype(np.float32)
    open_ = np.ones((len(chosen), PLACES), dtype=np.bool_)
    gap = GAP * mesh.radius

    def counted(part: IndexArray) -> _Part:
        turn = turns[part]
        directions = np.matmul(pattern[None], np.swapaxes(turn, 1, 2)).reshape(-1, 3)
        origins = np.tile(points.origins[part].astype(np.float32), (1, rays // PLACES, 1))
        triangle, distance = tracer.hits(origins.reshape(-1, 3), directions)
        met = np.flatnonzero(triangle >= 0)
        side, distance = triangle.take(met).astype(np.int64), distance.take(met)
        directions = directions.take(met, axis=0)
        behind = np.einsum("ij,ij->i", faces.take(side, axis=0), directions) > 0.0
        point, place = point_and_place(met, rays)
        near = mean_nearness(point, distance + gap, len(part), rays)
        usable, weight = open_places(place[behind & (sides == 1)], len(part), rays)
        open_[part] = usable
        side += len(faces) * (behind & (sides == 2))
        of_use = np.flatnonzero(usable.ravel().take(place) & ~(behind & (sides == 1)))
        side, places = side[of_use], directions.take(of_use, axis=0)
        places *= distance[of_use, None]
        places += origins.reshape(-1, 3).take(met[of_use], axis=0)
        cell = index.of(side, places)
        shares = counts(point[of_use], cell, (len(part), index.count), weight / rays)
        first = _first_of_each(cell, index.count)
        return _Part(shares, cell[first], places[first], side[first], near)

    rows = np.flatnonzero(chosen)
    parts = in_turn(counted, rows, rays, tick)
    return _together(parts, rows, (len(chosen), index.count)), open_


def _together(parts: list[_Part], rows: IndexArray, shape: tuple[int, int]) -> SeenCells:
    """What some of the rows (points) of a matrix saw; of each cell the first place counts."""
    places, side = np.zeros((shape[1], 3), dtype=np.float32), np.full(shape[1], -1)
    nearness = np.zeros(shape[0], dtype=np.float32)
    if not parts:
        nothing = sparse.csr_matrix(shape, dtype=np.float32)
        return SeenCells(shares=nothing, places=places, side=side, nearness=nearness)
    shares = sparse.vstack([part.shares for part in parts], format="csr")
    lengths = np.zeros(shape[0] + 1, dtype=np.int64)
    lengths[1 + rows] = np.diff(shares.indptr)
    for part in reversed(parts):
        places[part.cells], side[part.cells] = part.places, part.side
    nearness[rows] = np.concatenate([part.nearness for part in parts])
    rows_of_all = shares.data, shares.indices, np.cumsum(lengths)
    all_shares = sparse.csr_matrix(rows_of_all, shape=shape)
    return SeenCells(shares=all_shares, places=places, side=side, nearness=nearness)


def _first_of_each(number: IndexArray, count: int) -> IndexArray:
    """Where each of some numbers below ``count`` stands first."""
    place = np.arange(len(number))
    first = np.empty(count, dtype=np.int64)
    # The last writer of a place wins.
    first[number[::-1]] = place[::-1]
    return np.flatnonzero(first[number] == place)
