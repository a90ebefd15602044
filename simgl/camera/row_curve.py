"""The row on which a line of sight ends, where a lens does not image as a pinhole: a polynomial.

Its variables are the direction's x and y over its length plus z, tan(theta / 2) from the boresight:
they are smooth to 90 deg off it.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.lru_cache import MANY, LruCache

# Of the polynomial, as in shaders/common/moving.glsl; its number of coefficients.
DEGREE = 7
TERMS = (DEGREE + 1) * (DEGREE + 2) // 2
# Places along an edge of the image that it is fitted to.
_PLACES = 41

_curves = LruCache[tuple[Hashable, ...], Array](MANY)


def row_curve(camera: Camera) -> Array:
    """(TERMS,) coefficients: of y^j, in order of j, those of x^0, x^1, ... x^(DEGREE - j)."""
    return _curves.get(camera.geometry, lambda: _fitted(camera))


def rows_on(curve: Array, rays: Array) -> Array:
    """(n,) row coordinates of directions (n, 3), camera axes."""
    return np.asarray(_powers(rays) @ curve)


def _powers(rays: Array) -> Array:
    x, y = rays[:, :2].T / (np.linalg.norm(rays, axis=1) + rays[:, 2])
    return np.stack([x**i * y**j for j in range(DEGREE + 1) for i in range(DEGREE + 1 - j)], axis=1)


def _fitted(camera: Camera) -> Array:
    d = camera.detector
    nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _PLACES))
    pixels = np.stack(np.meshgrid(nodes * d.width, nodes * d.height), axis=-1).reshape(-1, 2)
    powers = _powers(camera.rays(pixels))
    seen = np.isfinite(powers).all(axis=1)
    # Columns of one size, or the highest powers of narrow fields would be lost.
    scale = np.abs(powers[seen]).max(axis=0)
    fitted, *_ = np.linalg.lstsq(powers[seen] / scale, pixels[seen, 1], rcond=None)
    return np.asarray(fitted / scale)
