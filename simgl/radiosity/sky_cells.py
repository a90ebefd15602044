"""The few cells of a body's sky, with radiances by which every plane gets the light that it should.

The Earth's limb runs through cells. With the mean radiance of such a cell, what is bright in it
shines from the cell's middle: a wall along the limb, which sees the bright part alone, gets 2 % too
little. Cells that share out their light so that planes get the right irradiance make up for it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array32, IndexArray
from simgl.environment_map import (
    SkyRadiance,
    cell_radiance,
    cube_directions,
    cube_solid_angles,
    octahedron,
)
from simgl.radiosity.hemisphere import CELLS_ACROSS, SKY_CELLS

# Parts of a cell along its edge, and of the whole sky along the edge of a face.
PARTS_ACROSS = 4
FINE_ACROSS = CELLS_ACROSS * PARTS_ACROSS
# Points along the edge of the octahedral map of the planes, some 18 deg apart.
_PLANES = 11
# What is left of the error of planes then is a third; of ten rounds, a half.
_ROUNDS = 32


def sky_cells(sky: SkyRadiance) -> Array32:
    """(96, 4) radiance of the cells of the sky [W m-2 sr-1]."""
    return balanced(cell_radiance(sky, FINE_ACROSS)[parts_of_cells()])


@lru_cache(maxsize=1)
def parts_of_cells() -> IndexArray:
    """(96, l) what of the 6 n^2 cells of the fine sky lies in each cell."""
    a, b = CELLS_ACROSS, PARTS_ACROSS
    number = np.arange(SKY_CELLS * b * b).reshape(6, a, b, a, b)
    return number.transpose(0, 1, 3, 2, 4).reshape(SKY_CELLS, b * b)


def balanced(parts: Array32) -> Array32:
    """(..., 96, 4) radiance of the cells of skies by that of their parts (..., 96, l, 4).

    The least squares of the irradiance of planes over all radiances that are not negative, from the
    means on (Daube-Witherspoon & Muehllehner 1986): what is dark stays dark.
    """
    shares, squares, products = _operators()
    cells: Array32 = np.einsum("cl,...clb->...cb", shares, parts)
    # Face by face: products so small that BLAS keeps them to one thread.
    faces = parts.reshape(*parts.shape[:-3], 6, -1, parts.shape[-1])
    wanted = np.matmul(products, faces).sum(axis=-3)
    for _ in range(_ROUNDS):
        cells = cells * (wanted / (squares @ cells + np.float32(1e-30)))
    return cells


@lru_cache(maxsize=1)
def _operators() -> tuple[Array32, Array32, Array32]:
    """(96, l) of a cell's solid angle that each of its parts has; (96, 96) and (6, 96, 16 l) sums
    over planes of the irradiance by each cell times that by each cell, and by each part of each
    face."""
    normals = octahedron(_PLANES).reshape(-1, 3)
    parts = parts_of_cells()
    directions = cube_directions(FINE_ACROSS).reshape(-1, 3)[parts]
    area = np.tile(cube_solid_angles(FINE_ACROSS).ravel(), 6)[parts]
    of_parts = np.maximum(np.einsum("pi,cli->pcl", normals, directions), 0.0) * area
    of_cells = of_parts.sum(axis=2)
    products = of_cells.T @ of_parts.reshape(len(normals), -1)
    return (
        (area / area.sum(axis=1, keepdims=True)).astype(np.float32),
        (of_cells.T @ of_cells).astype(np.float32),
        np.ascontiguousarray(np.moveaxis(products.reshape(SKY_CELLS, 6, -1), 1, 0), np.float32),
    )
