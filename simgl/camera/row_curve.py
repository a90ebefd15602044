"""The row on which a line of sight ends, where a lens does not image as a pinhole: a polynomial.

Its variables are the direction's x and y over its length plus z, tan(theta / 2) from the boresight:
they are smooth to 90 deg off it.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.pinhole_fields import PinholeField
from simgl.lru_cache import MANY, LruCache

# Of the polynomial, as in shaders/common/moving.glsl; its number of coefficients.
DEGREE = 7
TERMS = (DEGREE + 1) * (DEGREE + 2) // 2
# Places along an edge of the image that it is fitted to.
_PLACES = 41

_curves = LruCache[tuple[Hashable, ...], Array](MANY)


def row_curve(camera: Camera, field: PinholeField) -> Array:
    """(TERMS,) coefficients: of y^j, in order of j, those of x^0, x^1, ... x^(DEGREE - j).

    field : in the axes of whose pinhole
    """
    return _curves.get(field.key, lambda: _fitted(camera, field))


def rows_on(curve: Array, rays: Array) -> Array:
    """(n,) row coordinates of directions (n, 3), the pinhole's axes."""
    return np.asarray(_powers(rays) @ curve)


def _powers(rays: Array) -> Array:
    x, y = rays[:, :2].T / (np.linalg.norm(rays, axis=1) + rays[:, 2])
    return np.stack([x**i * y**j for j in range(DEGREE + 1) for i in range(DEGREE + 1 - j)], axis=1)


def _fitted(camera: Camera, field: PinholeField) -> Array:
    nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _PLACES))
    edges = [np.flatnonzero(field.drawn.any(axis=axis))[[0, -1]] + [0, 1] for axis in (0, 1)]
    across, down = (low + nodes * (high - low) for low, high in edges)
    pixels = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)
    rays = camera.rays(pixels) @ field.R_pinhole_from_camera.T
    image = field.pinhole.detector
    inside = field.pinhole.project(rays) / np.array([image.width, image.height])
    seen = np.all((inside > 0.0) & (inside < 1.0), axis=1)
    powers, pixels = _powers(rays[seen]), pixels[seen]
    # Columns of one size, or the highest powers of narrow fields would be lost.
    scale = np.abs(powers).max(axis=0)
    fitted, *_ = np.linalg.lstsq(powers / scale, pixels[:, 1], rcond=None)
    return np.asarray(fitted / scale)
