"""Refraction in the atmosphere: how far rays are bent, and what they lose on their bent ways.

In air whose refractive index n depends on the radius r alone, n r sin(z) stays the same along a
ray, z its angle from the vertical: its impact parameter a, which outside the air is the distance of
the straight ray from the Earth's centre. With x = n r, the bending from a place outwards is

    a int -(d ln n / dx) dx / sqrt(x^2 - a^2)

and a ray that passes through the air bends by twice that from its lowest point (Born and Wolf,
Principles of Optics, section 3.2). Between the places of the profiles' table ln n and extinction
are linear in x, and the integrals inverse hyperbolic cosines and roots. Lengths in m, angles in
rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP, PROFILE_PLACES
from simgl.physics.atmosphere import Air, band_depths, extinction, profiles

# Rays of a table, and how far apart the radii are that have tables of their own [m]. Between them
# bending and depth go with the root of the radius: 1e-5 in a step.
_RAYS, _RADIUS_STEP = 512, 25e3


@dataclass(frozen=True, kw_only=True, eq=False)
class BentRays:
    """Rays seen from one place, from that which grazes the ground upwards.

    apparent : (k, 4) angles from nadir at which they are seen, in each band
    bending : (k, 4) by so much lower lies what is seen in them
    depth : (k, 4) optical depth to space
    """

    apparent: Array
    bending: Array
    depth: Array

    @property
    def true(self) -> Array:
        """(k, 4) angles from nadir of what is seen in them.

        They need not rise with the apparent angles: below the tropopause, where rays bend more
        with height, places may be seen twice.
        """
        return self.apparent - self.bending

    def seen_at(self, true: Array, band: int) -> Array:
        """(k,) apparent angles from nadir of what lies at true angles (k,); the highest of several.

        What the ground hides is lifted like what is seen along the ground.
        """
        ends = np.maximum.accumulate(self.true[:, band])
        lifts = np.interp(true, ends, self.bending[:, band])
        # Of the rays, not of their ends, which may coincide.
        seen = np.interp(true, ends, self.apparent[:, band])
        return np.where((true < ends[0]) | (true > ends[-1]), true + lifts, seen)


def rays_from_space(air: Air, radius: float, distance: float) -> BentRays:
    """Of the limb from a place outside the air.

    radius, distance : of the ground, and of the place from the Earth's centre [m]
    """
    reference = max(round(radius / _RADIUS_STEP), 1) * _RADIUS_STEP
    height, bending, depth = _through(air, reference)
    scale = np.sqrt(radius / reference)
    apparent = np.arcsin(np.minimum((radius + height) / distance, 1.0))
    return BentRays(apparent=apparent, bending=scale * bending, depth=scale * depth)


def rays_from_inside(air: Air, radius: float, height: float, low: float, high: float) -> BentRays:
    """From a place inside the air at a height above the ground [m].

    low, high : true angles from nadir that are looked at; those below the horizon are left out

    Rays of all bands take the green one's way, and bend by their refractivity's share of its.
    """
    layers = _Layers.of(air, radius, 1)
    x = float(np.interp(radius + height, layers.r, layers.x))
    start = max(float(np.arcsin(min(layers.x[0] / x, 1.0))), low)
    # Nothing bends by more than 0.02.
    seen = start + (max(high - start, 0.0) + 0.02) * np.linspace(0.0, 1.0, _RAYS // 4) ** 2
    below = seen < 0.5 * np.pi
    sums = layers.outwards(x * np.sin(seen), x)
    passing = layers.outwards(x * np.sin(seen[below]), layers.x[0])
    sums[below] = 2.0 * passing - sums[below]
    green = air.refractivity[1]
    of_green = np.array(air.refractivity) / green if green else np.zeros(4)
    return BentRays(
        apparent=np.repeat(seen[:, None], 4, axis=1),
        bending=np.outer(sums[:, 0], of_green),
        depth=band_depths(air, sums[:, 1:]),
    )


@lru_cache(maxsize=8)
def _through(air: Air, radius: float) -> tuple[Array, Array, Array]:
    """Of rays from space to space: impact parameter less radius, bending, depth; (_RAYS, 4)."""
    columns = []
    for band in range(4):
        layers = _Layers.of(air, radius, band)
        places = np.linspace(0.0, 1.0, _RAYS) ** 2
        impact = layers.x[0] + (layers.x[-1] - layers.x[0]) * places
        sums = 2.0 * layers.outwards(impact, layers.x[0])
        depth = band_depths(air, sums[:, 1:])[:, band]
        columns.append((impact - radius, sums[:, 0], depth))
    height, bending, depth = np.stack(columns, axis=-1)
    return height, bending, depth


@dataclass(frozen=True, eq=False)
class _Layers:
    """The air at the places of the profiles' table, with one band's refractive index.

    r, x : (n,) radius, and the same times the refractive index
    log_index : (n,) logarithm of the refractive index
    extinction : (n, terms) [m-1]
    """

    r: Array
    x: Array
    log_index: Array
    extinction: Array

    @classmethod
    def of(cls, air: Air, radius: float, band: int) -> _Layers:
        height = AIR_TOP * np.linspace(0.0, 1.0, PROFILE_PLACES) ** 2
        density = profiles(air)[:, 0]
        # As dense as at the top beyond it, or the last layer would end with a step.
        refractivity = air.refractivity[band] * (density - density[-1]) / density[0]
        r = radius + height
        bent = r * (1.0 + refractivity), np.log1p(refractivity)
        return cls(r, *bent, extinction(air, height))

    def outwards(self, impact: Array, start: float) -> Array:
        """(k, 1 + terms) of rays with impact parameters (k,): bending from x = ``start``, depths.

        From where they are lowest, for those that never come down to it.
        """
        a = impact[:, None]
        x = np.maximum(self.x, np.maximum(a, start))
        steps = np.diff(self.x)
        angle = np.arccosh(np.maximum(x / a, 1.0))
        bending = np.diff(angle, axis=1) @ (-np.diff(self.log_index) / steps)
        # Along the way ds, which is dr / dx times x dx / sqrt(x^2 - a^2), the extinction is linear
        # in x: the part of its rise that comes with x - x0 follows from the same integrals.
        root = np.sqrt((x - a) * (x + a))
        ways = np.diff(root, axis=1)
        moments = 0.5 * np.diff(x * root + a * a * angle, axis=1) - ways * self.x[:-1]
        slope = np.diff(self.r) / steps
        rises = np.diff(self.extinction, axis=0) / steps[:, None]
        depth = (ways * slope) @ self.extinction[:-1] + (moments * slope) @ rises
        return np.column_stack([impact * bending, depth])
