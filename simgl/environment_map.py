"""What a spacecraft sees around it as a cube of radiance, and what its surfaces get of that.

A cube has six square faces of n x n texels in body axes, in the order +x -x +y -y +z -z. Seen from
the centre, texel (row j, column i) of face f lies in the direction

    FORWARD[f] + u RIGHT[f] + v DOWN[f]    with u = (2 i + 1) / n - 1, v = (2 j + 1) / n - 1,

which is a cube map of OpenGL, texel for texel (its faces are mirrored: right x down = -forward).

    cube of radiance (6, n, n, 4)
      -> irradiance()      an octahedral map, what diffuse surfaces need
      -> cell_radiance()   means over few large cells, for precomputed visibility

What glossy surfaces need is worked out by simgl/glossy_sky.py.

An octahedral map of m x m points holds a function of direction: the octahedron |x| + |y| + |z| = 1
seen along -z, its lower half folded outwards (Meyer et al. 2010). Points lie on the square's edges
too: with m odd the six axes are points of the map, and bilinear interpolation is continuous.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.sparse import csc_array, csr_array

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.disk_cache import Arrays, computed_once
from simgl.sparse_arrays import matrix_arrays, matrix_of

FORWARD = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
RIGHT = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0.0]])
DOWN = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0.0]])

# Irradiance is summed over so many blocks along a face's edge, glossy light over a pyramid of them.
_BLOCKS = 16
PYRAMID = (64, 32, 16, 8, 4, 2)
# Points along an edge of the octahedral maps, 7.5 and 3.75 degrees apart on the whole.
COARSE, FINE = 25, 49


@dataclass(frozen=True, kw_only=True, eq=False)
class SkyRadiance:
    """The sky around a spacecraft, the Sun's disc left out.

    radiance : (6, n, n, 4) float32 in body axes [W m-2 sr-1]; n is a multiple of 64
    """

    radiance: Array32

    def __post_init__(self) -> None:
        n = self.radiance.shape[1]
        if self.radiance.shape != (6, n, n, 4) or n % PYRAMID[0]:
            raise ValueError(
                f"a sky is (6, n, n, 4) with n a multiple of {PYRAMID[0]}, "
                f"got {self.radiance.shape}"
            )

    @cached_property
    def pyramid(self) -> Mapping[int, Array32]:
        """(6, n, n, 4) radiance times solid angle, summed over blocks of n along an edge [W m-2].

        For n = 64, 32, 16, 8, 4 and 2.
        """
        fine = self.radiance.shape[1]
        flux = (self.radiance.reshape(6, fine, -1) * _texel_weights(fine)).reshape(6, fine, fine, 4)
        levels = {}
        for n in PYRAMID:
            while flux.shape[1] > n:
                flux = _halved(flux)
            levels[n] = flux
        return levels


@lru_cache(maxsize=8)
def cube_directions(n: int) -> Array:
    """(6, n, n, 3) unit directions of the texels' centres: face, row, column."""
    t = (2.0 * np.arange(n) + 1.0) / n - 1.0
    d = FORWARD[:, None, None] + DOWN[:, None, None] * t[:, None, None]
    d = d + RIGHT[:, None, None] * t[:, None]
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


@lru_cache(maxsize=8)
def cube_solid_angles(n: int) -> Array:
    """(n, n) solid angles of a face's texels [sr], exact; a face has 2 pi / 3."""
    # The rectangle from the face's middle to (x, y) spans atan(x y / sqrt(x^2 + y^2 + 1)).
    edge = 2.0 * np.arange(n + 1) / n - 1.0
    x, y = np.meshgrid(edge, edge)
    corner = np.arctan2(x * y, np.sqrt(x * x + y * y + 1.0))
    return np.diff(np.diff(corner, axis=0), axis=1)


@lru_cache(maxsize=3)
def _texel_weights(n: int) -> Array32:
    """(n, 4 n) solid angles of a face's texels, once for each band."""
    return np.repeat(cube_solid_angles(n).astype(np.float32), 4, axis=1)


def cube_cell(directions: Array, n: int) -> IndexArray:
    """(...) which of n x n cells on each face directions (..., 3) point to: 0..6 n^2 - 1."""
    # Coordinate by coordinate: numpy takes as long for three numbers as for hundreds.
    x, y, z = np.moveaxis(directions.reshape(-1, 3), 1, 0).copy()
    along_x = (np.abs(x) >= np.abs(y)) & (np.abs(x) >= np.abs(z))
    along_y = ~along_x & (np.abs(y) >= np.abs(z))
    along = np.where(along_x, x, np.where(along_y, y, z))
    face = np.where(along_x, 0, np.where(along_y, 2, 4)) + (along < 0.0)
    cell = face
    # Of DOWN and RIGHT: a component, and whether its sign changes on the face behind.
    down = np.where(along_y, z * np.sign(y), -y)
    right = np.where(along_x, -z * np.sign(x), np.where(along_y, x, x * np.sign(z)))
    for component in (down, right):
        place = (0.5 * (component / np.abs(along) + 1.0) * n).astype(np.int64)
        cell = cell * n + np.clip(place, 0, n - 1)
    return cell.reshape(directions.shape[:-1])


def with_borders(radiance: Array32) -> Array32:
    """(6, n + 2, n + 2, 4) a cube's faces, each with the texels of its neighbours around it.

    radiance : (6, n, n, 4)

    In a corner, where three texels meet, their mean stands for the fourth. Interpolation within a
    face is then continuous from face to face.
    """
    n = radiance.shape[1]
    result = np.empty((6, n + 2, n + 2, 4), dtype=np.float32)
    result[:, 1:-1, 1:-1] = radiance
    border, neighbours = _neighbours(n)
    result.reshape(-1, 4)[border] = radiance.reshape(-1, 4)[neighbours]
    for end, inner in ((0, 1), (-1, -2)):
        for side, within in ((0, 1), (-1, -2)):
            meeting = result[:, inner, within] + result[:, end, within] + result[:, inner, side]
            result[:, end, side] = meeting / np.float32(3.0)
    return result


@lru_cache(maxsize=3)
def _neighbours(n: int) -> tuple[IndexArray, IndexArray]:
    """Where a cube with borders has texels of neighbouring faces, without corners, and which."""
    t = (2.0 * np.arange(n) + 1.0) / n - 1.0
    beyond, places, directions = 1.0 + 1.0 / n, [], []
    steps = 1 + np.arange(n)
    for face in range(6):
        first = face * (n + 2) ** 2
        for end, at in ((-beyond, 0), (beyond, n + 1)):
            # A row, and a column.
            for u, v, place in (
                (t, end, first + at * (n + 2) + steps),
                (end, t, first + steps * (n + 2) + at),
            ):
                along = np.multiply.outer(np.broadcast_to(u, n), RIGHT[face])
                directions.append(FORWARD[face] + along + np.multiply.outer(v, DOWN[face]))
                places.append(place)
    return np.concatenate(places), cube_cell(np.concatenate(directions), n)


def fill_between(radiance: Array32, tiles: Mask, coarse: Array32) -> None:
    """Make whole, in place, radiance (6, n, n, 4) of which some tiles are known.

    tiles : (6, t, t) those that are, t along an edge of a face
    coarse : (6, k, k, 4) radiance for the others, n a multiple of k
    """
    n, edge, across = radiance.shape[1], coarse.shape[1], tiles.shape[1]
    tiled = radiance.reshape(6, across, n // across, across, n // across, 4)
    face, row, column = np.nonzero(tiles)
    known = tiled[face, row, :, column]
    spread = radiance.reshape(6, edge, n // edge, edge, n // edge, 4)
    spread[...] = coarse[:, :, None, :, None]
    tiled[face, row, :, column] = known


def add_small_light(radiance: Array32, direction: Array32, irradiance: Array32) -> None:
    """Add a light smaller than a texel to radiance (6, n, n, 4) [W m-2 sr-1], in place.

    It is spread over the four texels around it, at a face's edge over those of that face.

    direction : (3,) unit, body axes; irradiance : (4,) facing it [W m-2]
    """
    n = radiance.shape[1]
    components = direction.tolist()
    # As of ``cube_cell``; numpy takes longer for one direction.
    axis = max(range(3), key=lambda i: abs(components[i]))
    face = 2 * axis + (components[axis] < 0.0)
    along = FORWARD[face] @ direction
    across, down = float(RIGHT[face] @ direction / along), float(DOWN[face] @ direction / along)
    for j, of_row in _two_texels(down, n):
        for i, of_column in _two_texels(across, n):
            share = of_row * of_column / cube_solid_angles(n)[j, i]
            radiance[face, j, i] += np.float32(share) * irradiance


def _two_texels(place: float, n: int) -> list[tuple[int, float]]:
    """The two of n texels along an edge whose centres are about a place in -1..1, and shares."""
    at = min(max(0.5 * (place + 1.0) * n - 0.5, 0.0), n - 1.0)
    first = min(int(at), n - 2)
    return [(first, first + 1.0 - at), (first + 1, at - first)]


def turned(sky: SkyRadiance, R_sky_from_body: Array) -> SkyRadiance:
    """A sky on a cube of other axes, 64 texels along an edge; the light moves by half of one.

    R_sky_from_body : (3, 3) to the axes of the sky
    """
    return _TurnedSky(sky, R_sky_from_body)


class _TurnedSky(SkyRadiance):
    """Turned by whichever thread first asks for its radiance: the one that draws never does."""

    _sky: SkyRadiance
    _R_sky_from_body: Array

    def __init__(self, sky: SkyRadiance, R_sky_from_body: Array) -> None:
        object.__setattr__(self, "_sky", sky)
        object.__setattr__(self, "_R_sky_from_body", R_sky_from_body)

    @cached_property
    def radiance(self) -> Array32:
        # Attitudes that differ by rounding errors are one.
        cells = _turned_cells((np.round(self._R_sky_from_body, 9) + 0.0).tobytes())
        return np.take(cell_radiance(self._sky, PYRAMID[0]), cells, axis=0)


@lru_cache(maxsize=8)
def _turned_cells(R_sky_from_body: bytes) -> IndexArray:
    """(6, n, n) cells of a sky that the texels of one turned against it look at, n = 64.

    R_sky_from_body : (3, 3) as bytes
    """
    R = np.frombuffer(R_sky_from_body).reshape(3, 3)
    return cube_cell(cube_directions(PYRAMID[0]) @ R.T, PYRAMID[0])


def cell_radiance(sky: SkyRadiance, cells: int = 4) -> Array32:
    """(6 cells^2, 4) means over ``cells`` x ``cells`` blocks of each face [W m-2 sr-1].

    In the order face, row, column; each mean is weighted by solid angle. ``cells`` is 2, 4 ... 64.
    """
    solid_angle = cube_solid_angles(cells).astype(np.float32)[:, :, None]
    return (sky.pyramid[cells] / solid_angle).reshape(-1, 4)


def octahedron(m: int) -> Array:
    """(m, m, 3) unit directions of an octahedral map's points: row along y, column along x."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, m), np.linspace(-1.0, 1.0, m))
    z = 1.0 - np.abs(x) - np.abs(y)
    folded = np.maximum(-z, 0.0)
    d = np.stack([x - np.copysign(folded, x), y - np.copysign(folded, y), z], axis=-1)
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def irradiance(sky: SkyRadiance) -> Array32:
    """(m, m, 4) irradiance of a plane by its normal, an octahedral map [W m-2].

    The sum over texels of L max(n.d, 0) and the solid angle. A block of texels wholly above the
    plane gives n.V, its flux vector V being the sum of L d and the solid angle, which is exact; one
    that the plane cuts gives the part of V that a uniform block would. For normals along the body
    axes no block is cut.
    """
    operator = _irradiance_operator(sky.radiance.shape[1])
    vectors = operator.vectors @ sky.radiance.reshape(-1, 4)
    levels = [vectors.reshape(6, _BLOCKS, _BLOCKS, 12)]
    while levels[-1].shape[1] > PYRAMID[-1]:
        levels.append(_halved(levels[-1]))
    above = operator.above @ np.concatenate([level.reshape(-1, 12) for level in levels])
    total = np.einsum("pc,pcb->pb", operator.normals, above.reshape(-1, 3, 4))
    total += operator.cut @ np.einsum("kc,kcb->kb", operator.block_flux, vectors.reshape(-1, 3, 4))
    return total.reshape(COARSE, COARSE, 4)


def prepare_irradiance(texels: Iterable[int]) -> None:
    """Make what ``irradiance`` needs for skies of so many texels along an edge, unless an earlier
    run has made it."""
    for n in texels:
        _irradiance_operator(n)


def _halved(values: Array32) -> Array32:
    """(6, n / 2, n / 2, k) sums over blocks of 2 x 2."""
    _, n, _, k = values.shape
    rows = (values[:, ::2] + values[:, 1::2]).ravel()
    # Of all neighbours, half of them in vain: numpy takes as long for k numbers as for hundreds.
    sums = (rows[:-k] + rows[k:]).reshape(-1, k)
    every_other = np.arange(0, 3 * n * n, 2)
    return np.take(sums, every_other, axis=0).reshape(6, n // 2, n // 2, k)


@dataclass(frozen=True, kw_only=True, eq=False)
class _IrradianceOperator:
    """Matrices from texels to irradiance, by columns: by rows, with four bands, each entry would
    wait for the sum before it.

    normals : (points, 3)
    vectors : (3 blocks, texels), flux vectors of the blocks
    above : (points, blocks and their merged levels), 1 where one lies wholly above the plane
    block_flux : (blocks, 3), flux vectors of blocks of unit radiance
    cut : (points, blocks), of a cut block's n.V / V.V for unit radiance the part above the plane
    """

    normals: Array32
    vectors: csc_array
    above: csc_array
    block_flux: Array32
    cut: csc_array


_MATRICES = ("vectors", "above", "cut")


@lru_cache(maxsize=3)
def _irradiance_operator(n: int) -> _IrradianceOperator:
    """For a sky of n texels along an edge; made once on a machine."""

    def packed() -> Arrays:
        made = _made_irradiance_operator(n)
        matrices = (matrix_arrays(name, getattr(made, name).tocsr()) for name in _MATRICES)
        dense: Arrays = {"normals": made.normals, "block_flux": made.block_flux}
        return dense | {key: value for matrix in matrices for key, value in matrix.items()}

    def unpacked(arrays: Arrays) -> _IrradianceOperator:
        vectors, above, cut = (matrix_of(name, arrays).tocsc() for name in _MATRICES)
        normals, block_flux = arrays["normals"], arrays["block_flux"]
        return _IrradianceOperator(
            normals=normals, vectors=vectors, above=above, block_flux=block_flux, cut=cut
        )

    def fits(arrays: Arrays) -> bool:
        operator = unpacked(arrays)
        blocks, points = len(operator.block_flux), len(operator.normals)
        return (
            (points, blocks) == (COARSE**2, 6 * _BLOCKS**2)
            and operator.vectors.shape == (3 * blocks, 6 * n * n)
            and operator.above.shape[0] == operator.cut.shape[0] == points
        )

    return unpacked(computed_once("tables", (__name__, "numpy"), ("irradiance", n), packed, fits))


def _made_irradiance_operator(n: int) -> _IrradianceOperator:
    size = n // _BLOCKS
    normals = octahedron(COARSE).reshape(-1, 3)
    weighted = (cube_directions(n) * cube_solid_angles(n)[:, :, None]).reshape(-1, 3)
    face, row, column = np.indices((6, n, n)).reshape(3, -1)
    block = (face * _BLOCKS + row // size) * _BLOCKS + column // size
    vectors = float_matrix(
        3 * block[:, None] + np.arange(3),
        np.repeat(np.arange(len(block)), 3),
        weighted,
        (3 * 6 * _BLOCKS**2, len(block)),
    )
    (point, above), (cut_point, cut_block), width = _halves(normals)
    texels = weighted[np.argsort(block, kind="stable")].reshape(6 * _BLOCKS**2, -1, 3)
    block_flux = texels.sum(axis=1)
    share = np.empty(len(cut_point))
    # In parts: what lies between fits a core's cache.
    for start in range(0, len(share), _CUTS_AT_ONCE):
        part = slice(start, start + _CUTS_AT_ONCE)
        heights = np.einsum("kc,ktc->kt", normals[cut_point[part]], texels[cut_block[part]])
        np.maximum(heights, 0.0).sum(axis=1, out=share[part])
    share /= np.sum(block_flux[cut_block] ** 2, axis=1)
    return _IrradianceOperator(
        normals=normals.astype(np.float32),
        vectors=vectors.tocsc(),
        above=float_matrix(point, above, np.ones(len(point)), (len(normals), width)).tocsc(),
        block_flux=block_flux.astype(np.float32),
        cut=float_matrix(cut_point, cut_block, share, (len(normals), len(block_flux))).tocsc(),
    )


# Blocks that a plane cuts, of 256 texels at most.
_CUTS_AT_ONCE = 64

Pairs = tuple[IndexArray, IndexArray]


def _halves(normals: Array) -> tuple[Pairs, Pairs, int]:
    """The upper half space of each plane as blocks, the largest that fit.

    returns : (plane, block) of those wholly above, counted over 16 x 16 to 2 x 2 blocks a face; of
        the finest that are cut; number of blocks in all
    """
    n, start = PYRAMID[-1], sum(6 * k * k for k in PYRAMID if k <= _BLOCKS)
    width = start
    point = np.repeat(np.arange(len(normals)), 6 * n * n)
    block = np.tile(np.arange(6 * n * n), len(normals))
    covered = []
    while True:
        start -= 6 * n * n
        side = np.einsum("pc,pkc->pk", normals[point], _corners(n)[block])
        # Corners on the plane itself cut nothing.
        above, below = np.all(side > -1e-9, axis=1), np.all(side < 1e-9, axis=1)
        covered.append((point[above], start + block[above]))
        point, block = point[~above & ~below], block[~above & ~below]
        if n == _BLOCKS:
            rows, columns = (np.concatenate(part) for part in zip(*covered, strict=True))
            return (rows, columns), (point, block), width
        point, block, n = np.repeat(point, 4), block_children(block, n), 2 * n


def _corners(n: int) -> Array:
    """(6 n^2, 4, 3) directions of the corners of n x n blocks a face, unnormalised."""
    edge = np.linspace(-1.0, 1.0, n + 1)
    corners = []
    for u in (edge[:-1], edge[1:]):
        for v in (edge[:-1], edge[1:]):
            d = FORWARD[:, None, None] + DOWN[:, None, None] * v[:, None, None]
            corners.append((d + RIGHT[:, None, None] * u[:, None]).reshape(-1, 3))
    return np.stack(corners, axis=1)


def float_matrix(
    rows: IndexArray, columns: IndexArray, values: Array, shape: tuple[int, int]
) -> csr_array:
    """A float32 matrix of entries, those at the same place summed."""
    entries = values.ravel().astype(np.float32), (rows.ravel(), columns.ravel())
    return csr_array(entries, shape=shape)


def block_children(block: IndexArray, n: int) -> IndexArray:
    """The four blocks of the next finer level, 2 n blocks along an edge, for each block."""
    face, rest = np.divmod(block, n * n)
    row, column = np.divmod(rest, n)
    first = (face * 2 * n + 2 * row) * 2 * n + 2 * column
    return (first[:, None] + np.array([0, 1, 2 * n, 2 * n + 1])).ravel()
