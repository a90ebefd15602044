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
# Where the noise of two faces of its cube is mixed, as in shaders/planet/chart.glsl; and how far
# off the place that is seen the clouds before it and before the Sun may lie, in their heights.
_CHART_SEAM, _CLOUD_REACH = 0.02, 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Tiles:
    """What is seen where in a picture: masks (rows, columns), no two on one place.

    even : tiles on the ground that see it change evenly
    sea : those of them that have no shore on them
    pixel : (rows, columns) edge of a pixel on the ground of the even tiles [m]
    ground : blocks with other ground on them
    air : blocks that miss the ground; what is in none of the masks misses the air, too
    """

    even: Mask
    sea: Mask
    pixel: Array
    ground: Mask
    air: Mask


def tiles_of(
    planet: PlanetView,
    intrinsics: NDArray[np.float32],
    size: tuple[int, int],
    open_sea: Mask | None = None,
) -> Tiles:
    """The tiles of a picture.

    intrinsics : (3, 3) [pixels]
    size : width and height [pixels]; the last tiles may reach past it
    open_sea : (rows, columns) cells of an equirectangular map that hold nothing but open sea
    """
    columns, rows = (-(-length // BLOCK) for length in size)
    corners = corners_on_ground(planet, intrinsics, (columns * BLOCK, rows * BLOCK))
    even = even_tiles(planet, corners)
    parts = BLOCK // TILE
    block_even = even.reshape(rows, parts, columns, parts).all(axis=(1, 3))
    nearest = _nadir_angles(planet, intrinsics, (columns, rows))
    distance = float(np.sqrt(1.0 + planet.outside))
    top = 1.0 if planet.earth.air is None else 1.0 + AIR_TOP / planet.earth.equatorial_radius
    ground = nearest < np.arcsin(min((1.0 + _cloud_height(planet)) / distance, 1.0))
    air = (nearest < np.arcsin(top / distance)) if distance > top else np.ones_like(ground)
    even &= block_even.repeat(parts, axis=0).repeat(parts, axis=1)
    pixel = np.mean(
        _corners_of(corners.distance / np.sqrt(np.maximum(corners.slant, 1e-3))), axis=0
    )
    return Tiles(
        even=even,
        sea=even & (False if open_sea is None else _all_within(corners, open_sea)),
        pixel=pixel / float(intrinsics[0, 0]) * planet.earth.equatorial_radius,
        ground=ground & ~block_even,
        air=air & ~ground,
    )


def _cloud_height(planet: PlanetView) -> float:
    """In Earth radii."""
    clouds = planet.earth.clouds
    return 0.0 if clouds is None else clouds.height / planet.earth.equatorial_radius


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Corners:
    """Of the tiles of a picture, (rows + 1, columns + 1): where they lie on the ground.

    Corners beside the Earth get some place or other.

    meets : whether the ground is there
    normal : of it, ITRF
    slant : cosine of the ray from the vertical
    distance : in Earth radii
    """

    meets: Mask
    normal: Array
    slant: Array
    distance: Array


def corners_on_ground(
    planet: PlanetView, intrinsics: NDArray[np.float32], size: tuple[int, int]
) -> Corners:
    """What the corners of tiles see of the ground.

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
    distance = planet.outside / np.where(meets, root - od, 1.0)
    ground = place + distance[..., None] * d
    return Corners(
        meets=meets,
        normal=_unit(ground / np.array(planet.earth.radii)),
        slant=root / np.sqrt(dd),
        distance=distance,
    )


def even_tiles(planet: PlanetView, corners: Corners) -> Mask:
    """(rows, columns) whether a tile lies on the ground and sees it change evenly."""
    normal, slant = corners.normal, corners.slant
    longitude = np.arctan2(normal[..., 1], normal[..., 0])
    sun = normal @ planet.sun_direction_itrf.astype(np.float64)
    even = _least(corners.meets) & (_range(slant) < _SLANT_CHANGE * _least(slant))
    even &= _range(longitude) < _LONGITUDE_CHANGE
    even &= _on_one_face(normal, _CHART_SEAM + _CLOUD_REACH * _cloud_height(planet))
    sun_height = np.maximum(_least(np.abs(sun)), _TWILIGHT)
    return np.asarray(even & (_range(sun) < _SUN_CHANGE * sun_height))


def _all_within(corners: Corners, cells: Mask) -> Mask:
    """Whether every cell of an equirectangular map that a tile may touch is set.

    Of a tile that spans the date line every longitude is asked for.
    """
    rows, columns = cells.shape
    x, y, z = np.moveaxis(corners.normal, -1, 0)
    row = (0.5 - np.arctan2(z, np.hypot(x, y)) / np.pi) * rows
    column = (np.arctan2(y, x) / (2.0 * np.pi) + 0.5) * columns
    top, left = (np.floor(_least(v) - 0.5).astype(int) for v in (row, column))
    bottom, right = (np.ceil(_most(v) + 0.5).astype(int) for v in (row, column))
    unset = np.zeros((rows + 1, columns + 1), dtype=np.int64)
    unset[1:, 1:] = np.cumsum(np.cumsum(~cells, axis=0), axis=1)
    top, bottom = np.clip(top, 0, rows), np.clip(bottom, 0, rows)
    left, right = np.clip(left, 0, columns), np.clip(right, 0, columns)
    found = unset[bottom, right] - unset[top, right] - unset[bottom, left] + unset[top, left]
    return np.asarray(found == 0)


def _on_one_face(normal: Array, margin: float) -> Mask:
    """Whether a tile lies on one face of a cube about the Earth, so far from its edges."""
    size = np.abs(normal)
    two, one = np.partition(size, 1, axis=-1)[..., 1:].transpose(2, 0, 1)
    faces = np.argmax(size, axis=-1) + 3 * (np.max(normal, axis=-1) == one)
    return np.asarray((_range(faces) == 0) & (_least(one * (1.0 - margin) - two) > 0.0))


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


def _most(values: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.max(_corners_of(values), axis=0))


def _range(values: Array) -> Array:
    return np.asarray(np.ptp(_corners_of(values), axis=0))
