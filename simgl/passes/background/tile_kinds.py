"""Which tiles of the Earth one program can draw, and what that program need not look up."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.passes.background.planet_blocks import MAP_TEXEL_M
from simgl.scene.noise_projection import LEVELS
from simgl.view.background import PlanetView
from simgl.view.background_tiles import MERGED, TILE, BackgroundTiles

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


def lights_and_seasons(
    ground: Mask, dark: Mask, frosted: Mask, glint: Mask
) -> Iterator[tuple[tuple[str, ...], Mask]]:
    """Tiles that are found by pixels in masks, with what their shader knows of them."""
    for night in (), ("NIGHT",):
        for frost in (), ("FROST",):
            for shining in (), ("GLINT",):
                mask = ground & (dark if night else ~dark) & (frosted if frost else ~frosted)
                mask &= glint if shining else ~glint
                if mask.any():
                    yield (*night, *frost, *shining), mask


def kinds_at_corners(tiles: BackgroundTiles, dark: Mask) -> Iterator[tuple[tuple[str, ...], Mask]]:
    """The even and the finer tiles in masks, with what their shader knows of them.

    The rare ones, at night or at the corners of the noise's cube, are left few programs.
    """
    seen = tiles.even | tiles.finer
    small = tiles.pixel < _WITHIN_MARGINS_M
    level = tiles.pixel * MERGED * TILE < _SPANNED_TEXELS * MAP_TEXEL_M
    yz, zx, xy = tiles.two_faces
    plain = (tiles.one_face | yz | zx | xy) & ~dark
    kinds = {
        "ONE_FACE": tiles.one_face,
        "TWO_FACES": yz | zx | xy,
        "FACES_YZ": yz,
        "FACES_ZX": zx & ~yz,
        "FACES_XY": xy & ~yz & ~zx,
        "NIGHT": dark,
        "FROST": tiles.frosted,
        "SEA": tiles.sea,
        "LAND": tiles.land & small & plain,
        "GLINT": tiles.glint & ~tiles.land,
        "NO_HIGH_CLOUD": ~tiles.high_clouds & small & plain,
    }
    kinds["RELIEF_AT_CORNERS"] = kinds["LAND"] & level
    which = np.zeros(seen.shape, dtype=np.int64)
    for bit, known_of in enumerate(kinds.values()):
        which += known_of.astype(np.int64) << bit
    for value in np.unique(which[seen]).tolist():
        known = tuple(kind for bit, kind in enumerate(kinds) if value >> bit & 1)
        yield known, seen & (which == value)


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
