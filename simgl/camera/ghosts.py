"""Ghosts: images of the Sun by light that was reflected twice inside a lens.

Each pair of surfaces sends a part of the light back and forward again. To first order in the angles
(Gaussian optics) it arrives as an evenly lit disc, an image of the pupil, about a place on the line
through the principal point and the Sun's own image.
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
    """One twice reflected image of a distant source.

    lever : place of its centre over the tangent of the source's angle off the axis [m]
    spread : radius of its disc over the radius of the pupil
    share : of the light that reaches the picture straight
    """

    lever: float
    spread: float
    share: float


def _move(gap: float) -> Array:
    return np.array([[1.0, gap], [0.0, 1.0]])


def _refract(before: float, after: float, radius: float) -> Array:
    return np.array([[1.0, 0.0], [-(after - before) / (after * radius), before / after]])


def _reflect(radius: float) -> Array:
    # Along the light's own way; a mirror whose centre of curvature lies behind it spreads light.
    return np.array([[1.0, 0.0], [2.0 / radius, 1.0]])


def _forward(surfaces: tuple[LensSurface, ...], first: int, last: int) -> Array:
    """From before surface ``first`` to before surface ``last``, heights and slopes."""
    matrix = np.eye(2)
    for k in range(first, last):
        before = 1.0 if k == 0 else surfaces[k - 1].index
        matrix = _refract(before, surfaces[k].index, surfaces[k].radius) @ matrix
        if k + 1 < len(surfaces):
            matrix = _move(surfaces[k].gap) @ matrix
    return matrix


def _ghost_matrix(surfaces: tuple[LensSurface, ...], front: int, back: int) -> Array:
    """From before the lens to behind its last surface, reflected at ``back``, then at ``front``."""
    matrix = _reflect(surfaces[back].radius) @ _forward(surfaces, 0, back)
    for k in range(back - 1, front, -1):
        matrix = _move(surfaces[k].gap) @ matrix
        # Seen from behind, a surface curves the other way.
        matrix = _refract(surfaces[k].index, surfaces[k - 1].index, -surfaces[k].radius) @ matrix
    matrix = _reflect(-surfaces[front].radius) @ _move(surfaces[front].gap) @ matrix
    matrix = _move(surfaces[front].gap) @ matrix
    return _forward(surfaces, front + 1, len(surfaces)) @ matrix


def ghosts(surfaces: tuple[LensSurface, ...], focal_length: float) -> tuple[Ghost, ...]:
    """Every ghost of a lens that is scaled to a focal length [m], the detector in its focus.

    Raises ConfigError where the surfaces do not make a lens that collects light.
    """
    if not surfaces:
        return ()
    whole = _forward(surfaces, 0, len(surfaces))
    power = -whole[1, 0]
    if not power > 0.0 or not whole[0, 0] / power > 0.0:
        problem = "must form a real image behind the last one"
        raise ConfigError("lens", "optics.surfaces", problem)
    scale = focal_length * power
    to_focus = _move(whole[0, 0] / power)
    found = []
    for front, back in combinations(range(len(surfaces)), 2):
        matrix = to_focus @ _ghost_matrix(surfaces, front, back)
        passed = [(1.0 - surfaces[k].reflectance) ** 2 for k in range(front + 1, back)]
        share = surfaces[front].reflectance * surfaces[back].reflectance * float(np.prod(passed))
        found.append(
            Ghost(lever=float(matrix[0, 1] * scale), spread=abs(float(matrix[0, 0])), share=share)
        )
    return tuple(found)


def common_area(a: float, b: float, distance: Array) -> Array:
    """Area that two circles of radius a and b share, their centres ``distance`` apart."""
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
    """A ghost in a picture [pixels]: two discs folded, the pupil's and the Sun's.

    x, y : of its centre
    power : (n,) in each plane: the sum over all its pixels
    """

    x: float
    y: float
    pupil: float
    sun: float
    power: Array

    @property
    def radius(self) -> float:
        """Of all that it lights [pixels]."""
        return self.pupil + self.sun

    @property
    def edge(self) -> float:
        """Width of its fall from full light to none [pixels]."""
        return 2.0 * min(self.pupil, self.sun)


def add_discs(planes: Sequence[Array | Array32], discs: Iterable[GhostDisc], block: int) -> None:
    """Add ghosts to planes (rows, columns) of means over blocks of so many pixels along an edge."""
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
