"""What glossy surfaces get of the sky: its radiance averaged over lobes of some roughnesses.

Cube and octahedral map keep their form under the eight symmetries that leave the z axis or mirror
planes through it in place. Weights of lobes are known for an eighth of an octahedral map, and taken
for all of it by turning the sky: a product with a sparse matrix costs little more for eight skies
than for one.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from scipy.sparse import csr_array, vstack

from simgl.arrays import Array, Array32, IndexArray
from simgl.disk_cache import Arrays, computed_once
from simgl.environment_map import (
    COARSE,
    FINE,
    PYRAMID,
    SkyRadiance,
    block_children,
    cube_cell,
    cube_directions,
    cube_solid_angles,
    float_matrix,
    octahedron,
)
from simgl.sparse_arrays import matrix_arrays, matrix_of

# The layers of prefiltered light belong to these perceptual roughnesses; 0 is the cube itself.
ROUGHNESS = (0.2, 0.4, 0.6, 0.8, 1.0)
# For each but the last: points along an edge of the map as it is summed, and how wide a block may
# be to serve a lobe, in units of the lobe's scale there.
_POINTS = (FINE, COARSE, COARSE, COARSE)
_BLOCK_TO_LOBE = (0.5, 0.35, 0.35, 0.35)
_BLOCKS = sum(6 * n * n for n in PYRAMID)


def prefiltered(sky: SkyRadiance, plane_irradiance: Array32) -> Array32:
    """(5, m, m, 4) mean radiance that glossy lobes of each ``ROUGHNESS`` see [W m-2 sr-1].

    Octahedral maps by the mirror direction r, for n = v = r (the split sum of Karis 2013): weights
    D(h) max(n.l, 0) with the GGX distribution D. At roughness 1 that is the irradiance over pi.
    """
    pyramid = np.concatenate([sky.pyramid[n].reshape(-1, 4) for n in PYRAMID])
    weights, blocks = prepare_lobes()
    eighths = weights @ np.take(pyramid, blocks, axis=0).reshape(len(blocks), -1)
    lobes = np.take(eighths.reshape(-1, 4), _symmetry()[1], axis=0)
    ends = np.cumsum([points**2 for points in _POINTS])
    maps = [
        _refined(one.reshape(points, points, 4))
        for points, one in zip(_POINTS, np.split(lobes, ends[:-1]), strict=True)
    ]
    maps.append(_refined(plane_irradiance / np.float32(np.pi)))
    return np.stack(maps)


def _refined(coarse: Array32) -> Array32:
    """An octahedral map on the fine grid, linear between the points of a coarse one."""
    if len(coarse) == FINE:
        return coarse
    fine = np.empty((FINE, FINE, 4), dtype=np.float32)
    fine[::2, ::2] = coarse
    fine[::2, 1::2] = 0.5 * (coarse[:, 1:] + coarse[:, :-1])
    fine[1::2] = 0.5 * (fine[2::2] + fine[:-2:2])
    return fine


@lru_cache(maxsize=1)
def _symmetry() -> tuple[IndexArray, IndexArray]:
    """(blocks, 8) where each block of the pyramid lies in the sky turned or mirrored; and, for all
    points of the maps one after the other, the row of ``prepare_lobes`` and that sky, as one."""
    turns = [
        np.diag([x, y, 1.0])[:, order]
        for x, y, order in product((1, -1), (1, -1), ([0, 1, 2], [1, 0, 2]))
    ]
    starts = np.cumsum([0, *(6 * n * n for n in PYRAMID)])
    blocks = np.stack(
        [
            np.concatenate(
                [
                    start + cube_cell(cube_directions(n) @ turn.T, n).ravel()
                    for start, n in zip(starts, PYRAMID, strict=False)
                ]
            )
            for turn in turns
        ],
        axis=1,
    )
    of_points, first = [], 0
    for points in _POINTS:
        middle = points // 2
        row, column = np.divmod(_eighth(points), points)
        of_map = np.empty(points**2, dtype=np.int64)
        for index, turn in enumerate(turns):
            x, y = turn[:2, :2] @ (column - middle, row - middle)
            at = (y + middle) * points + x + middle
            of_map[at.astype(np.int64)] = 8 * (first + np.arange(len(row))) + index
        of_points.append(of_map)
        first += len(row)
    return blocks, np.concatenate(of_points)


def _eighth(points: int) -> IndexArray:
    """The points of a map that the symmetries take to all others: those with 0 <= y <= x."""
    row, column = np.indices((points, points)) - points // 2
    return np.flatnonzero((row >= 0) & (column >= row))


@lru_cache(maxsize=1)
def prepare_lobes() -> tuple[csr_array, IndexArray]:
    """(points of an eighth of each map, k) weights of block fluxes [sr-1] in the lobes about a
    map's directions, and (k, 8) the blocks that have any, in the sky in each way that it is
    turned or mirrored; made once on a machine."""

    def fits(arrays: Arrays) -> bool:
        points = sum(len(_eighth(points)) for points in _POINTS)
        return bool(matrix_of("lobes", arrays).shape == (points, _BLOCKS))

    def made() -> Arrays:
        levels = [_made_lobe_operator(level) for level in range(len(_POINTS))]
        return matrix_arrays("lobes", csr_array(vstack(levels)))

    made_by = (__name__, "simgl.environment_map", "numpy")
    lobes = matrix_of("lobes", computed_once("tables", made_by, "lobes", made, fits))
    used = np.unique(lobes.indices)
    return csr_array(lobes[:, used]), _symmetry()[0][used]


def _made_lobe_operator(level: int) -> csr_array:
    """(points of an eighth, blocks) weights of block fluxes [sr-1] in the lobes of one map.

    Each lobe takes large blocks far from its axis and small ones near it.
    """
    alpha = ROUGHNESS[level] ** 2
    axes = octahedron(_POINTS[level]).reshape(-1, 3)[_eighth(_POINTS[level])]
    point = np.repeat(np.arange(len(axes)), 6 * PYRAMID[-1] ** 2)
    block = np.tile(np.arange(6 * PYRAMID[-1] ** 2), len(axes))
    terms: list[tuple[IndexArray, IndexArray, Array, Array]] = []
    start = _BLOCKS
    for n in PYRAMID[::-1]:
        start -= 6 * n * n
        middle = cube_directions(n).reshape(-1, 3)[block]
        width = np.sqrt(cube_solid_angles(n).ravel()[block % (n * n)])
        away = np.linalg.norm(middle - axes[point], axis=1)
        coarse = width > _BLOCK_TO_LOBE[level] * np.hypot(2.0 * alpha, away)
        # At the bottom of the pyramid the finest block serves.
        taken = ~coarse | (n == PYRAMID[0])
        share = _lobe_integral(axes[point[taken]], block[taken], n, alpha)
        solid_angle = cube_solid_angles(n).ravel()[block[taken] % (n * n)]
        terms.append((point[taken], start + block[taken], share / solid_angle, share))
        point, block = np.repeat(point[~taken], 4), block_children(block[~taken], n)
    rows, columns, weights, shares = (np.concatenate(part) for part in zip(*terms, strict=True))
    total = np.bincount(rows, weights=shares, minlength=len(axes))
    shape = (len(axes), _BLOCKS)
    lit = weights > 0.0
    return float_matrix(rows[lit], columns[lit], (weights / total[rows])[lit], shape)


def _lobe_integral(axes: Array, block: IndexArray, n: int, alpha: float) -> Array:
    """Of D(h) max(n.l, 0) over blocks of n along an edge, for n = v = the lobe's axis."""
    # 4 x 4 directions in each block: one of a lobe's own width sees its slope and curve.
    fine = cube_directions(4 * n).reshape(6, n, 4, n, 4, 3).transpose(2, 4, 0, 1, 3, 5)
    solid_angle = cube_solid_angles(4 * n).reshape(n, 4, n, 4).transpose(1, 3, 0, 2)
    total = np.zeros(len(block))
    for j, i in np.ndindex(4, 4):
        light = fine[j, i].reshape(-1, 3)[block]
        # 1 - (n.h)^2 = |l - n|^2 / 4, without the cancellation of a cosine near 1.
        sine2 = 0.25 * np.sum((light - axes) ** 2, axis=1)
        ggx = alpha**2 / (np.pi * (alpha**2 * (1.0 - sine2) + sine2) ** 2)
        cosine = np.maximum(1.0 - 2.0 * sine2, 0.0)
        total += ggx * cosine * solid_angle[j, i].ravel()[block % (n * n)]
    return total
