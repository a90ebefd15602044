"""Which tiles of the Earth one program can draw, and what that program need not look up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np

from simgl.arrays import AnyArray, Array, IndexArray, Mask
from simgl.gpu.tile_quads import LARGEST_TILE, Faces, tile_faces
from simgl.passes.background.planet_blocks import MAP_TEXEL_M
from simgl.scene.noise_projection import LEVELS
from simgl.view.background import PlanetView
from simgl.view.background_tiles import MERGED, PARTS, TILE, BackgroundTiles, split

# By how often a tile of this kind halves the largest edge.
_SIZES = {
    name: (LARGEST_TILE // edge).bit_length() - 1
    for name, edge in (("large", MERGED * TILE), ("tile", TILE), ("part", TILE // PARTS))
}
# Of pixels for which the margins of the maps' cells are enough [m].
_WITHIN_MARGINS_M = 9800.0
# Where a large tile spans less of a map's texel, it reads the map's slopes at its corners: 0.1 % of
# the light.
_SPANNED_TEXELS = 0.4
# Sines of the Sun's height: below the first the lamps of cities shine, by the second the air is
# dark but for its own glow (shaders/planet/night.glsl).
DUSK, DARK = 0.5 / 12.0, -0.1
# There a full Moon, 2.5e-6 of the Sun, gives 1e-4 of the light on the ground, which falls by e
# while the sine falls by so much: 2,000 lx at 2.4 deg, 3.4 at -6 (Bond and Henderson 1963).
_FULL_MOON, _FADES = 2.5e-6, 0.023


@dataclass(frozen=True)
class TileDraw:
    """Faces that one program draws, of one image.

    defines : of the program
    step : halvings of what it reads; None where it finds them
    """

    program: str
    defines: tuple[str, ...]
    step: int | None
    image: int
    first: int
    count: int


class TileDraws:
    """Draws over tiles, and their faces."""

    def __init__(self) -> None:
        self._draws: list[TileDraw] = []
        self._faces: list[Faces] = []
        self._count = 0

    def __iter__(self) -> Iterator[TileDraw]:
        return iter(self._draws)

    @property
    def faces(self) -> Faces:
        """(n, 6) of all draws."""
        return np.concatenate([np.empty((0, 6), np.uint32), *self._faces])

    def without(self, known: set[tuple[object, ...]], of_view: tuple[object, ...]) -> TileDraws:
        """One face each of the programs and steps that are not among those known for such views;
        they are from now on."""
        draws = TileDraws()
        draws._faces, draws._count = self._faces, self._count
        for draw in self:
            key = *of_view, draw.program, draw.defines, draw.step
            if key not in known:
                known.add(key)
                draws._draws.append(replace(draw, image=0, count=1))
        return draws

    def add(self, program: str, tiles: Mask, defines: tuple[str, ...]) -> None:
        """Some of the tiles (images, rows, columns)."""
        if tiles.all():
            # One large face costs less than its parts.
            image = np.arange(len(tiles))
            origin, (rows, columns) = np.zeros_like(image), tiles.shape[1:]
            faces = tile_faces(origin, origin, _SIZES["tile"], columns, rows)
        else:
            image, y, x = _places(tiles)
            faces = tile_faces(x, y, _SIZES["tile"])
        self._add_sorted(program, (defines,), image, faces, len(tiles), steps=False)

    def add_even(
        self,
        program: str,
        tiles: BackgroundTiles,
        defines: Sequence[tuple[str, ...]],
        which: IndexArray,
    ) -> None:
        """The even and the finer tiles.

        defines : of the program for each kind of tile
        which : (images, rows, columns) number of a tile's kind, and their count times its step
        """
        images = len(which)
        merged = tiles.calm & tiles.even
        large = _merged(merged, which)
        even = tiles.even.copy()
        rows, columns = (MERGED * length for length in large.shape[1:])
        even[:, :rows, :columns] &= ~split(large, MERGED)
        keys, faces = [], []
        for mask, size, of_mask in (
            (large, "large", which[:, :rows:MERGED, :columns:MERGED]),
            (even, "tile", which),
            (tiles.finer, "part", which),
        ):
            image, y, x = _places(mask)
            key = of_mask[mask] * images + image
            if size == "part":
                row, column = (part.ravel() for part in np.indices((PARTS, PARTS)))
                y, x = (PARTS * y[:, None] + row).ravel(), (PARTS * x[:, None] + column).ravel()
                key = key.repeat(PARTS**2)
            keys.append(key)
            faces.append(tile_faces(x, y, _SIZES[size]))
        key = np.concatenate(keys)
        # Few bits sort fastest.
        key = key.astype(np.min_scalar_type(key.max(initial=0)))
        order = np.argsort(key, kind="stable")
        sorted_faces = np.concatenate(faces).take(order, axis=0)
        self._add_sorted(program, defines, key[order], sorted_faces, images, steps=True)

    def _add_sorted(
        self,
        program: str,
        defines: Sequence[tuple[str, ...]],
        key: IndexArray,
        faces: Faces,
        images: int,
        *,
        steps: bool,
    ) -> None:
        """Faces in the order of their keys: image, plus the count of images times kind and step."""
        ends = [*(np.flatnonzero(key[1:] != key[:-1]) + 1).tolist(), len(key)]
        for start, end in pairwise([0, *ends]) if len(key) else ():
            kind_and_step, image = divmod(int(key[start]), images)
            step, kind = divmod(kind_and_step, len(defines))
            place = self._count + start, end - start
            self._draws.append(
                TileDraw(program, defines[kind], step if steps else None, image, *place)
            )
        self._faces.append(faces)
        self._count += len(faces)


def _places(tiles: Mask) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Image, row and column of those in a mask; of large ones numpy's own ``nonzero`` takes six
    times as long."""
    rows, columns = tiles.shape[1:]
    image, place = np.divmod(np.flatnonzero(tiles), rows * columns)
    return (image, *np.divmod(place, columns))


def _merged(tiles: Mask, which: IndexArray) -> Mask:
    """Larger tiles: those all of whose parts are in a mask, and of one kind."""
    rows, columns = (length // MERGED * MERGED for length in tiles.shape[1:])

    def part(values: AnyArray, row: int, column: int) -> AnyArray:
        return values[:, row:rows:MERGED, column:columns:MERGED]

    merged = part(tiles, 0, 0).copy()
    for row, column in np.ndindex(MERGED, MERGED):
        merged &= part(tiles, row, column)
        merged &= part(which, row, column) == part(which, 0, 0)
    return merged


def lights_and_seasons(
    ground: Mask, dark: Mask, tiles: BackgroundTiles
) -> Iterator[tuple[tuple[str, ...], Mask]]:
    """Tiles that are found by pixels in masks, with what their shader knows of them."""
    bits = _bits([tiles.glint, tiles.known.frosted, dark])
    for value in np.flatnonzero(np.bincount(bits[ground])).tolist():
        names = ("NIGHT",) * (value >> 2), ("FROST",) * (value >> 1 & 1), ("GLINT",) * (value & 1)
        yield tuple(chain(*names)), ground & (bits == value)


def _bits(masks: Sequence[Mask]) -> IndexArray:
    """Of up to 24 masks a bit each, the lowest of the first."""
    # As a product with powers of two: numpy shifts and packs bits five times as slowly.
    powers = np.ldexp(np.float32(1.0), np.arange(len(masks)))
    return np.tensordot(powers, np.stack(masks, dtype=np.float32), 1).astype(np.int64)


def kinds_at_corners(
    tiles: BackgroundTiles, dark: Mask
) -> tuple[list[tuple[str, ...]], IndexArray]:
    """What a shader knows of the even and the finer tiles: each kind, and (images, rows, columns)
    the number of each tile's kind.

    The rare ones, at night or at the corners of the noise's cube, are left few programs.
    """
    known = tiles.known
    small = known.pixel < _WITHIN_MARGINS_M
    level = known.pixel * MERGED * TILE < _SPANNED_TEXELS * MAP_TEXEL_M
    yz, zx, xy = known.two_faces
    two_faces = yz | zx | xy
    plain = (known.one_face | two_faces) & ~dark
    land = known.land & small & plain
    clear = tiles.clear & small & plain
    kinds = {
        "ONE_FACE": known.one_face,
        "TWO_FACES": two_faces,
        "FACES_YZ": yz,
        "FACES_ZX": zx & ~yz,
        "FACES_XY": xy & ~yz & ~zx,
        "NIGHT": dark,
        "FROST": known.frosted,
        "SEA": known.sea,
        "LAND": land,
        "GLINT": tiles.glint & ~known.land,
        "NO_HIGH_CLOUD": ~known.high_clouds & ~clear & small & plain,
        "CLEAR": clear,
        "RELIEF_AT_CORNERS": land & level,
    }
    seen = tiles.even | tiles.finer
    bits = _bits(list(kinds.values()))
    present = np.bincount(bits[seen], minlength=1 << len(kinds)) > 0
    names = [
        tuple(kind for bit, kind in enumerate(kinds) if value >> bit & 1)
        for value in np.flatnonzero(present).tolist()
    ]
    return names, (present.cumsum() - 1)[bits]


def halvings(pixel: Array, texel: float) -> IndexArray:
    """Of an image whose texels are so long, for pixels of such edges [m]; 0 beside the planet."""
    steps = np.rint(np.log2(np.maximum(pixel / texel, 1.0)))
    return np.minimum(steps, LEVELS - 1).astype(np.int64)


def moonlit_below(planet: PlanetView) -> float:
    """Sine of the Sun's height below which the Moon is 1e-4 of the light and more."""
    if planet.moonlight is None:
        return -1.0
    share = float(planet.moonlight.irradiance.sum() / max(planet.sun_irradiance.sum(), 1e-30))
    return DUSK + _FADES * float(np.log(max(share, 1e-30) / _FULL_MOON))
