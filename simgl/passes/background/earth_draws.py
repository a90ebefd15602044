"""Which programs draw the tiles of an image of the Earth."""

from __future__ import annotations

import numpy as np

from simgl.arrays import IndexArray, Mask
from simgl.passes.background.lit_earth import LitEarth
from simgl.passes.background.planet_blocks import MAP_TEXEL_M
from simgl.passes.background.tile_kinds import (
    TileDraws,
    halvings,
    kinds_at_corners,
    lights_and_seasons,
)
from simgl.scene.noise_projection import LEVELS, TEXEL_KM
from simgl.view.background_tiles import MERGED, TILE, BackgroundTiles, GroundTiles

# Variants that find light and place at the corners of tiles; the others are cheap or rare.
_EVEN = tuple(
    (*bands, "EARTH_MAPS", *far, "AIR") for bands in ((), ("BANDS",)) for far in ((), ("FAR",))
)
# Where a large tile spans less of an angle, it finds glint, 0.2 rad wide, at its corners.
_SPANNED_ANGLE = 0.03


def earth_draws(
    lit: LitEarth,
    tiles: BackgroundTiles,
    dark: Mask,
    variant: tuple[str, ...],
    *,
    magnified: bool,
    hardware: bool,
) -> TileDraws:
    """Every tile with the cheapest program that serves it.

    dark : tiles with lamps and the airglow's light
    magnified : the maps' texels are larger than pixels
    hardware : a GPU draws, which chooses for itself among the halvings of the maps
    """
    draws, ground = TileDraws(), tiles.ground
    if variant in _EVEN:
        # Whether large tiles span small angles.
        narrow = _SPANNED_ANGLE * float(lit.background.intrinsics[0, 0]) > MERGED * TILE
        at_corners = ("SEA_AT_CORNERS",) if narrow else ()
        kinds, which = kinds_at_corners(tiles, dark)
        steps = _steps(tiles.known, noise=not lit.far, maps=not magnified and not hardware)
        defines = [("EVEN", *kind, *at_corners, *variant) for kind in kinds]
        draws.add_even("planet/tiles", tiles, defines, which + len(kinds) * steps)
    else:
        ground = ground | tiles.even | tiles.finer
    for kind, mask in lights_and_seasons(ground, dark, tiles):
        draws.add("planet/planet", mask, (*kind, *variant))
    if "AIR" in variant:
        draws.add("planet/air", tiles.air, variant)
    return draws


def _steps(known: GroundTiles, *, noise: bool, maps: bool) -> IndexArray:
    """By how much the noise, and LEVELS times by how much the maps are halved for each even or
    finer tile."""
    steps = np.zeros(known.pixel.shape, dtype=np.int64)
    if noise:
        steps += halvings(known.noise_pixel, 1e3 * TEXEL_KM)
    if maps:
        steps += LEVELS * halvings(known.pixel, MAP_TEXEL_M)
    return steps
