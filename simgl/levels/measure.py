"""How far a simplified surface is from the original: by sampled points both ways, and by area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from simgl.arrays import Array, IndexArray
from simgl.levels.triangles import doubled_areas, first_least, nearest_place
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Places on a triangle that are looked at, near its edges and its middle. None lies on an edge of a
# triangle that has been cut in halves, where rays may slip through.
_PLACES = np.array(
    [
        [0.335, 0.311, 0.354],
        [0.511, 0.472, 0.017],
        [0.013, 0.523, 0.464],
        [0.458, 0.019, 0.523],
        [0.713, 0.156, 0.131],
        [0.149, 0.712, 0.139],
        [0.128, 0.163, 0.709],
    ]
)
# Rays along normals, and tilted against them where those meet nothing near.
_TILTS = np.array([[0.0, 0.0, 0.0], [0.031, -0.017, 0.023], [-0.019, 0.037, -0.029]])
# Of triangles that have changed, so many are looked at, the largest among them.
_MOST = 4000
# Triangles of the other surface that are compared with a place.
_NEIGHBOURS = 10
# Directions from which projected areas are compared.
DIRECTIONS = 32


@dataclass(frozen=True, kw_only=True, eq=False)
class Pieces:
    """A surface in connected pieces: triangles (m, 3) of vertices at positions (n, 3), the piece of
    each triangle (m,)."""

    positions: Array
    triangles: IndexArray
    piece: IndexArray


def deviations(
    original: Pieces, simple: Pieces, count: int, expected: float
) -> tuple[Array, IndexArray]:
    """Largest distance found between two surfaces, for each connected piece [m].

    Every distance is one to some place on the same piece of the other surface, so that none is
    understated at the places looked at.

    original, simple : triangles over the same vertices
    count : of pieces
    expected : about how large distances are [m]; larger ones take longer to find
    returns : (count,), and the vertices of triangles that are farther off than expected
    """
    changed, made = _difference(original.triangles, simple.triangles)
    found, beyond = np.zeros(count), [np.zeros(0, dtype=np.int64)]
    for one, other, chosen in ((original, simple, changed), (simple, original, made)):
        if len(chosen) == 0:
            continue
        tri = _largest(one, chosen)
        corners = one.positions[one.triangles[tri]]
        points = np.einsum("pj,tjk->tpk", _PLACES, corners).reshape(-1, 3)
        doubled = doubled_areas(corners)
        normals = doubled / np.maximum(np.linalg.norm(doubled, axis=1), 1e-30)[:, None]
        piece = np.repeat(one.piece[tri], len(_PLACES))
        normals = np.repeat(normals, len(_PLACES), axis=0)
        far = np.full(len(points), np.inf)
        rest, tracer = np.arange(len(points)), _tracer(other)
        for tilt in _TILTS:
            ways = normals[rest] + tilt
            ways /= np.linalg.norm(ways, axis=1)[:, None]
            found_there = _along(tracer, points[rest], ways, piece[rest], other, expected)
            far[rest] = np.minimum(far[rest], found_there)
            rest = np.flatnonzero(far > 0.5 * expected)
        if len(rest):
            far[rest] = np.minimum(far[rest], _near(points[rest], piece[rest], other))
        np.maximum.at(found, piece, far)
        off = np.repeat(tri, len(_PLACES))[far > expected]
        beyond.append(one.triangles[off].ravel())
    return found, np.concatenate(beyond)


def _tracer(surface: Pieces) -> RayTracer:
    label = np.zeros(len(surface.positions), dtype=np.uint32)
    return RayTracer(
        Mesh(
            positions=surface.positions.astype(np.float32),
            normals=np.zeros((len(label), 3), dtype=np.float32),
            triangles=surface.triangles.astype(np.uint32),
            part=label,
            material=label,
        )
    )


def _along(
    tracer: RayTracer, points: Array, ways: Array, piece: IndexArray, other: Pieces, reach: float
) -> Array:
    """Distance to the same piece of another surface along lines, inf where nothing is met."""
    found = np.full(len(points), np.inf)
    for side in (1.0, -1.0):
        triangle, distance = tracer.hits(points + 2.0 * reach * side * ways, -side * ways)
        same = (triangle >= 0) & (other.piece[np.maximum(triangle, 0)] == piece)
        off = np.abs(distance.astype(np.float64) - 2.0 * reach)
        found = np.minimum(found, np.where(same, off, np.inf))
    return found


def _near(points: Array, piece: IndexArray, other: Pieces) -> Array:
    """Distance to the same piece of another surface, its triangles found by places on them."""
    found = np.full(len(points), np.inf)
    order = np.argsort(piece, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(piece[order])) + 1):
        triangles = other.triangles[other.piece == piece[mine[0]]]
        if len(triangles) == 0:
            continue
        corners = other.positions[triangles]
        places = np.einsum("pj,tjk->ptk", np.concatenate([np.eye(3), _PLACES]), corners)
        neighbours = min(_NEIGHBOURS, len(triangles))
        _, near = cKDTree(places.reshape(-1, 3)).query(points[mine], [*range(1, neighbours + 1)])
        place = np.repeat(np.arange(len(mine)), neighbours)
        target = (near % len(triangles)).ravel()
        _, distance = nearest_place(points[mine][place], corners[target])
        found[mine] = distance[first_least(distance, place)]
    return found


def _difference(original: IndexArray, simple: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Triangles that only the one, and only the other surface has."""
    n = int(original.max()) + 1

    def key(triangles: IndexArray) -> IndexArray:
        turned = np.argmin(triangles, axis=1)
        a, b, c = (triangles[np.arange(len(triangles)), (turned + k) % 3] for k in range(3))
        return (a * n + b) % (1 << 62) * 31 + c

    first, second = key(original), key(simple)
    return np.flatnonzero(~np.isin(first, second)), np.flatnonzero(~np.isin(second, first))


def _largest(surface: Pieces, chosen: IndexArray) -> IndexArray:
    """At most ``_MOST`` of the chosen triangles: half the largest, half evenly spread."""
    if len(chosen) <= _MOST:
        return chosen
    corners = surface.positions[surface.triangles[chosen]]
    area = np.linalg.norm(doubled_areas(corners), axis=1)
    order = chosen[np.argsort(-area, kind="stable")]
    rest = order[_MOST // 2 :]
    return np.sort(np.concatenate([order[: _MOST // 2], rest[:: 2 * len(rest) // _MOST + 1]]))


def projected_areas(
    positions: Array, triangles: IndexArray, shell: IndexArray, count: int
) -> Array:
    """(count, DIRECTIONS) area that each connected piece turns to a direction [m2].

    Of a piece that hides nothing of itself that is the area of its picture.
    """
    normals = 0.5 * doubled_areas(positions[triangles])
    i = np.arange(DIRECTIONS) + 0.5
    z, turn = 1.0 - 2.0 * i / DIRECTIONS, np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z * z)
    towards = np.stack([r * np.cos(turn), r * np.sin(turn), z])
    turned = np.maximum(normals @ towards, 0.0)
    return np.stack([np.bincount(shell, t, minlength=count) for t in turned.T], axis=1)
