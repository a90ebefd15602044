"""Ghosts: images of the Sun by light that is reflected twice inside a lens.

Each pair of surfaces gives one ghost. In Gaussian optics it is a uniform disc, an image of the
pupil, centred on the line through the principal point and the Sun's image.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.lens import LensSurface
from simgl.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Ghost:
    """Ghost of a distant source.

    lever : position of its centre per tangent of the source's off-axis angle [m]; over the focal
        length, per distance of the direct image
    spread : radius of its disc over the radius of the pupil
    share : its light relative to that of the direct image
    """

    lever: float
    spread: float
    share: float


def _move(gap: float) -> Array:
    return np.array([[1.0, gap], [0.0, 1.0]])


def _refract(before: float, after: float, radius: float) -> Array:
    return np.array([[1.0, 0.0], [-(after - before) / (after * radius), before / after]])


def _reflect(radius: float) -> Array:
    # In coordinates along the light's path, a positive radius is that of a diverging mirror.
    return np.array([[1.0, 0.0], [2.0 / radius, 1.0]])


def _forward(surfaces: tuple[LensSurface, ...], first: int, last: int) -> Array:
    """Ray transfer matrix of height and slope from before surface ``first`` to before ``last``."""
    matrix = np.eye(2)
    for k in range(first, last):
        before = 1.0 if k == 0 else surfaces[k - 1].index
        matrix = _refract(before, surfaces[k].index, surfaces[k].radius) @ matrix
        if k + 1 < len(surfaces):
            matrix = _move(surfaces[k].gap) @ matrix
    return matrix


def _ghost_matrix(surfaces: tuple[LensSurface, ...], front: int, back: int) -> Array:
    """Ray transfer matrix through the lens with reflections at ``back``, then at ``front``."""
    matrix = _reflect(surfaces[back].radius) @ _forward(surfaces, 0, back)
    for k in range(back - 1, front, -1):
        matrix = _move(surfaces[k].gap) @ matrix
        # For light that travels backwards the sign of the radius changes.
        matrix = _refract(surfaces[k].index, surfaces[k - 1].index, -surfaces[k].radius) @ matrix
    matrix = _reflect(-surfaces[front].radius) @ _move(surfaces[front].gap) @ matrix
    matrix = _move(surfaces[front].gap) @ matrix
    return _forward(surfaces, front + 1, len(surfaces)) @ matrix


def ghosts(surfaces: tuple[LensSurface, ...], focal_length: float) -> tuple[Ghost, ...]:
    """All ghosts of a lens that is scaled to a focal length [m], focused at infinity.

    Raises ConfigError if the surfaces form no real image behind the lens.
    """
    if not surfaces:
        return ()
    lens = _forward(surfaces, 0, len(surfaces))
    power = -lens[1, 0]
    if not power > 0.0 or not lens[0, 0] / power > 0.0:
        problem = "must form a real image behind the last one"
        raise ConfigError("lens", "optics.surfaces", problem)
    scale = focal_length * power
    to_focus = _move(lens[0, 0] / power)
    result = []
    for front, back in combinations(range(len(surfaces)), 2):
        matrix = to_focus @ _ghost_matrix(surfaces, front, back)
        passed = [(1.0 - surfaces[k].reflectance) ** 2 for k in range(front + 1, back)]
        share = surfaces[front].reflectance * surfaces[back].reflectance * float(np.prod(passed))
        result.append(
            Ghost(lever=float(matrix[0, 1] * scale), spread=abs(float(matrix[0, 0])), share=share)
        )
    return tuple(result)


def common_area(a: float, b: float, distance: Array) -> Array:
    """Common area of two circles of radii a and b with centres ``distance`` apart."""
    small, large = min(a, b), max(a, b)
    d = np.clip(distance, large - small + 1e-12 * large, large + small)
    at_small = np.clip((d * d + small**2 - large**2) / (2.0 * d * small), -1.0, 1.0)
    at_large = np.clip((d * d + large**2 - small**2) / (2.0 * d * large), -1.0, 1.0)
    product = (small + large - d) * (d + small - large) * (d - small + large) * (d + small + large)
    kite = 0.5 * np.sqrt(np.maximum(product, 0.0))
    area = small**2 * np.arccos(at_small) + large**2 * np.arccos(at_large) - kite
    return np.where(distance <= large - small, np.pi * small**2, area)


@dataclass(frozen=True, kw_only=True, eq=False)
class GhostDisc:
    """A ghost in an image: the pupil's disc convolved with the Sun's.

    x, y : centre [px]
    pupil, sun : radii of the two discs [px]
    power : (n,) sum over all pixels in each plane
    """

    x: float
    y: float
    pupil: float
    sun: float
    power: Array

    @property
    def radius(self) -> float:
        """Outer radius [px]."""
        return self.pupil + self.sun

    @property
    def edge(self) -> float:
        """Width of the edge from full light to none [px]."""
        return 2.0 * min(self.pupil, self.sun)


def add_discs(planes: Sequence[Array | Array32], discs: Iterable[GhostDisc], block: int) -> None:
    """Add ghosts to planes in place.

    planes : (rows, columns) each, means over blocks of pixels
    block : pixels along the edge of a block
    """
    for disc in discs:
        places = []
        for middle, size in zip((disc.y, disc.x), planes[0].shape, strict=True):
            low = int(np.floor((middle - disc.radius) / block))
            high = int(np.ceil((middle + disc.radius) / block))
            places.append(np.arange(max(low, 0), min(high, size)))
        rows, columns = places
        if not rows.size or not columns.size:
            continue
        y = (rows + 0.5)[:, None] * block - disc.y
        x = (columns + 0.5) * block - disc.x
        distance = np.hypot(y, x)
        shared = np.where(distance < disc.radius, np.pi * min(disc.pupil, disc.sun) ** 2, 0.0)
        falls = (distance > abs(disc.pupil - disc.sun)) & (distance < disc.radius)
        shared[falls] = common_area(disc.pupil, disc.sun, distance[falls])
        profile = shared / (np.pi * disc.pupil * disc.sun) ** 2
        for plane, power in zip(planes, disc.power, strict=True):
            part = plane[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            part += (power * profile).astype(plane.dtype)
