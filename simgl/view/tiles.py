"""What of the Earth lies where in a picture, by tiles: each is drawn as simply as it can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgl.physics.air import AIR_TOP
from simgl.view.background import PlanetView

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Edges of tiles and of blocks of them [pixels]. Software renderers draw by 64.
TILE, BLOCK = 16, 64
# What may change along a tile's edge. Between its corners a place lies off by an eighth of the
# slant's change, in edges: 0.25 pixel; light that falls by e while the Sun's cosine changes by c is
# off by 1 / 8 of the squared change over c, 0.1 %.
_SLANT_CHANGE = 0.0625
_LONGITUDE_CHANGE = 0.05
_SUN_CHANGE = 0.09
# Cosine that light takes to fall by e at the terminator.
_TWILIGHT = 0.026


@dataclass(frozen=True, kw_only=True, eq=False)
class Tiles:
    """What is seen where in a picture: masks (rows, columns), no two on one place.

    even : tiles on the ground that see it change evenly
    ground : blocks with other ground on them
    air : blocks that miss the ground; what is in none of the masks misses the air, too
    """

    even: Mask
    ground: Mask
    air: Mask


def tiles_of(planet: PlanetView, intrinsics: NDArray[np.float32], size: tuple[int, int]) -> Tiles:
    """The tiles of a picture.

    intrinsics : (3, 3) [pixels]
    size : width and height [pixels]; the last tiles may reach past it
    """
    columns, rows = (-(-length // BLOCK) for length in size)
    even = even_tiles(planet, intrinsics, (columns * BLOCK, rows * BLOCK))
    parts = BLOCK // TILE
    block_even = even.reshape(rows, parts, columns, parts).all(axis=(1, 3))
    nearest = _nadir_angles(planet, intrinsics, (columns, rows))
    distance = float(np.sqrt(1.0 + planet.outside))
    top = 1.0 if planet.earth.air is None else 1.0 + AIR_TOP / planet.earth.equatorial_radius
    ground = nearest < np.arcsin(1.0 / distance)
    air = (nearest < np.arcsin(top / distance)) if distance > top else np.ones_like(ground)
    return Tiles(
        even=even & block_even.repeat(parts, axis=0).repeat(parts, axis=1),
        ground=ground & ~block_even,
        air=air & ~ground,
    )


def _nadir_angles(
    planet: PlanetView, intrinsics: NDArray[np.float32], blocks: tuple[int, int]
) -> Array:
    """(rows, columns) least angle from nadir within each block and a pixel about it [rad]."""
    columns, rows = blocks
    corners = _unit(_rays(planet, intrinsics, (columns + 1, rows + 1), BLOCK))
    middles = _unit(np.sum(_corners_of(corners), axis=0))
    nadir = _unit(-planet.camera_in_sphere.astype(np.float64))
    angle = np.arccos(np.clip(middles @ nadir, -1.0, 1.0))
    reach = np.max([_angle(middles, corner) for corner in _corners_of(corners)], axis=0)
    return np.asarray(angle - (1.0 + 4.0 / BLOCK) * reach)


def even_tiles(planet: PlanetView, intrinsics: NDArray[np.float32], size: tuple[int, int]) -> Mask:
    """(rows, columns) whether a tile lies on the ground and sees it change evenly.

    intrinsics : (3, 3) [pixels]
    size : of the picture, width and height [pixels]; the last tiles may reach past it
    """
    columns, rows = (-(-length // TILE) + 1 for length in size)
    d = _rays(planet, intrinsics, (columns, rows), TILE)
    place = planet.camera_in_sphere.astype(np.float64)
    dd, od = np.einsum("...i,...i", d, d), d @ place
    discriminant = od * od - dd * planet.outside
    meets = (discriminant > 0.0) & (od < 0.0)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    # Corners beside the Earth get some place or other.
    ground = place + (planet.outside / np.where(meets, root - od, 1.0))[..., None] * d
    normal = _unit(ground / np.array(planet.earth.radii))
    slant = root / np.sqrt(dd)
    longitude = np.arctan2(normal[..., 1], normal[..., 0])
    sun = normal @ planet.sun_direction_itrf.astype(np.float64)
    even = _least(meets) & (_range(slant) < _SLANT_CHANGE * _least(slant))
    even &= _range(longitude) < _LONGITUDE_CHANGE
    sun_height = np.maximum(_least(np.abs(sun)), _TWILIGHT)
    return np.asarray(even & (_range(sun) < _SUN_CHANGE * sun_height))


def _rays(
    planet: PlanetView, intrinsics: NDArray[np.float32], corners: tuple[int, int], edge: int
) -> Array:
    """(rows, columns, 3) directions of corners so many pixels apart, in sphere space."""
    k = intrinsics.astype(np.float64)
    x = (edge * np.arange(corners[0]) - k[0, 2]) / k[0, 0]
    y = (edge * np.arange(corners[1]) - k[1, 2]) / k[1, 1]
    x, y = np.broadcast_arrays(x, y[:, None])
    rays = _unit(np.stack([x, y, np.ones_like(x)], axis=-1))
    return np.asarray(rays @ planet.sphere_from_camera.astype(np.float64).T)


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _angle(a: Array, b: Array) -> Array:
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(a - b, axis=-1), 1.0)))


def _corners_of(values: NDArray[Any]) -> list[NDArray[Any]]:
    """The four corners of every tile."""
    return [values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]]


def _least(values: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.min(_corners_of(values), axis=0))


def _range(values: Array) -> Array:
    return np.asarray(np.ptp(_corners_of(values), axis=0))
