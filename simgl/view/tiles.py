"""Tiles of a picture on which the Earth is even enough to be found at their corners alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgl.view.background import PlanetView

Array = NDArray[np.float64]

# Of a tile's edge [pixels].
TILE = 16
# What may change along a tile's edge. Between its corners a place lies off by an eighth of the
# slant's change, in edges: 0.25 pixel; light that falls by e while the Sun's cosine changes by c is
# off by 1 / 8 of the squared change over c, 0.1 %.
_SLANT_CHANGE = 0.0625
_LONGITUDE_CHANGE = 0.05
_SUN_CHANGE = 0.09
# Cosine that light takes to fall by e at the terminator.
_TWILIGHT = 0.026


def even_tiles(
    planet: PlanetView, intrinsics: NDArray[np.float32], size: tuple[int, int]
) -> NDArray[np.bool_]:
    """(rows, columns) whether a tile lies on the ground and sees it change evenly.

    intrinsics : (3, 3) [pixels]
    size : of the picture, width and height [pixels]; the last tiles may reach past it
    """
    columns, rows = (-(-length // TILE) + 1 for length in size)
    k = intrinsics.astype(np.float64)
    x = (TILE * np.arange(columns) - k[0, 2]) / k[0, 0]
    y = (TILE * np.arange(rows) - k[1, 2]) / k[1, 1]
    x, y = np.broadcast_arrays(x, y[:, None])
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) / np.sqrt(1.0 + x * x + y * y)[..., None]
    d = rays @ planet.sphere_from_camera.astype(np.float64).T
    place = planet.camera_in_sphere.astype(np.float64)
    dd, od = np.einsum("...i,...i", d, d), d @ place
    discriminant = od * od - dd * planet.outside
    met = _least((discriminant > 0.0) & (od < 0.0))
    root = np.sqrt(np.maximum(discriminant, 0.0))
    ground = place + (planet.outside / (root - od))[..., None] * d
    normal = ground / np.array(planet.earth.radii)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    slant = root / np.sqrt(dd)
    longitude = np.arctan2(normal[..., 1], normal[..., 0])
    sun = normal @ planet.sun_direction_itrf.astype(np.float64)
    even = met & (_range(slant) < _SLANT_CHANGE * _least(slant))
    even &= _range(longitude) < _LONGITUDE_CHANGE
    sun_height = np.maximum(_least(np.abs(sun)), _TWILIGHT)
    return np.asarray(even & (_range(sun) < _SUN_CHANGE * sun_height))


def _corners(values: NDArray[Any]) -> NDArray[Any]:
    """(4, rows, columns) of every tile."""
    return np.stack([values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]])


def _least(values: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(_corners(values).min(axis=0))


def _range(values: Array) -> Array:
    corners = _corners(values)
    return np.asarray(corners.max(axis=0) - corners.min(axis=0))
