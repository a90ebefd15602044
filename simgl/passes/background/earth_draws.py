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
from simgl.physics.air_profile import AIR_TOP
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
    """Every tile of an image with the cheapest program that serves it, all of a sky with one.

    dark : tiles with lamps and the airglow's light
    magnified : the maps' texels are larger than pixels
    hardware : a GPU draws, which chooses for itself among the halvings of the maps
    """
    if lit.of_sky:
        return sky_draws(lit, tiles.ground | tiles.even | tiles.finer, tiles.air, variant)
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
    _add_air(draws, tiles.air, variant)
    return draws


def sky_draws(lit: LitEarth, ground: Mask, air: Mask, variant: tuple[str, ...]) -> TileDraws:
    """Of a sky, whatever it shows: no place on an orbit needs a program more, for which an image
    would wait. Skies have so few pixels that those for some of their tiles save nothing.

    ground, air : tiles (images, rows, columns) with anything of the ground, and with air alone
    """
    draws = TileDraws()
    kind = ("NIGHT", *("FROST",) * lit.planet.earth.frost, "GLINT") if lit.mapped else ()
    draws.add("planet/planet", ground, (*kind, *variant))
    _add_air(draws, air, variant)
    return draws


def glow_draws(lit: LitEarth, inner: Mask, rim: Mask) -> TileDraws:
    """The airglow over tiles on the ground, and over those with air on them."""
    return _over_all(lit, "planet/glow", inner, rim)


def aurora_draws(lit: LitEarth, inner: Mask, rim: Mask) -> TileDraws:
    """The aurora over tiles without air on them, and with it."""
    return _over_all(lit, "planet/aurora", inner, rim)


def _over_all(lit: LitEarth, program: str, inner: Mask, rim: Mask) -> TileDraws:
    # Maps move the air's tables to other texture units.
    maps = ("EARTH_MAPS",) if lit.mapped else ()
    inside = ("AIR_INSIDE",) if lit.planet.height < AIR_TOP else ()
    draws = TileDraws()
    draws.add(program, inner, maps)
    draws.add(program, rim, (*maps, "AIR", *inside))
    return draws


def _add_air(draws: TileDraws, air: Mask, variant: tuple[str, ...]) -> None:
    if "AIR" in variant:
        # It has nothing of the chart, near or far.
        draws.add("planet/air", air, tuple(d for d in variant if d != "FAR"))


def _steps(known: GroundTiles, *, noise: bool, maps: bool) -> IndexArray:
    """By how much the noise, and LEVELS times by how much the maps are halved for each even or
    finer tile."""
    steps = np.zeros(known.pixel.shape, dtype=np.int64)
    if noise:
        steps += halvings(known.noise_pixel, 1e3 * TEXEL_KM)
    if maps:
        steps += LEVELS * halvings(known.pixel, MAP_TEXEL_M)
    return steps
