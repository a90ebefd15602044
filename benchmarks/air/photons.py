"""Backward Monte Carlo of the clear air over a grey sphere: slow, float64, and nothing shared.

Photons leave the camera, fly by delta tracking, and look at the Sun from every scattering and
reflection. Straight rays, a point Sun, no polarisation; lengths [m].
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, Mask
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import Atmosphere, densities, extinction

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
# Weights below this are played for.
_FAINT = 1e-3


def radiance_factor(
    air: Atmosphere,
    radius: float,
    albedo: float,
    place: Array,
    view: Array,
    sun: Array,
    *,
    band: int,
    photons: int,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """pi L / E in one direction, and its standard error."""
    world = _World(air, radius, albedo, sun, band)
    position = np.tile(_entry(place, view, radius + AIR_TOP), (photons, 1))
    direction = np.tile(view, (photons, 1))
    owner, weight = np.arange(photons), np.ones(photons)
    seen = np.zeros(photons)
    while len(owner):
        position, alive, on_ground = world.fly(position, direction, rng)
        keep = alive
        position, direction = position[keep], direction[keep]
        owner, weight, on_ground = owner[keep], weight[keep], on_ground[keep]
        if not len(owner):
            break
        light, direction, share = world.turn(position, direction, on_ground, rng)
        np.add.at(seen, owner, weight * light)
        weight = weight * share
        faint = weight < _FAINT
        survives = ~faint | (rng.random(len(weight)) < 0.1)
        weight = np.where(faint, 10.0 * weight, weight)[survives]
        position, direction, owner = position[survives], direction[survives], owner[survives]
    seen *= np.pi
    return float(seen.mean()), float(seen.std() / np.sqrt(photons))


def _entry(place: Array, view: Array, top: float) -> Array:
    """Where a ray that will meet the air enters it, or its start inside."""
    b = float(np.dot(place, view))
    c = float(np.dot(place, place)) - top**2
    return place if c <= 0.0 else place + (-b - np.sqrt(b * b - c)) * view


class _World:
    def __init__(
        self, air: Atmosphere, radius: float, albedo: float, sun: Array, band: int
    ) -> None:
        self.air, self.radius, self.albedo, self.sun, self.band = air, radius, albedo, sun, band
        self.majorant = float(extinction(air, np.linspace(0.0, 4e4, 400))[:, band].max())

    def take(self, height: Array) -> Array:
        return extinction(self.air, np.maximum(height, 0.0))[..., self.band]

    def fly(
        self, position: Array, direction: Array, rng: np.random.Generator
    ) -> tuple[Array, Mask, Mask]:
        """Where each photon scatters or meets the ground; those that leave are not alive."""
        b = np.einsum("ij,ij->i", position, direction)
        squared = np.einsum("ij,ij->i", position, position)
        to_ground = b**2 - squared + self.radius**2
        hits = (b < 0.0) & (to_ground > 0.0)
        to_top = -b + np.sqrt(np.maximum(b**2 - squared + (self.radius + AIR_TOP) ** 2, 0.0))
        end = np.where(hits, -b - np.sqrt(np.maximum(to_ground, 0.0)), to_top)
        way = np.zeros(len(b))
        flying = np.ones(len(b), dtype=bool)
        scattered = np.zeros(len(b), dtype=bool)
        while flying.any():
            i = np.flatnonzero(flying)
            way[i] += rng.exponential(1.0 / self.majorant, len(i))
            inside = way[i] < end[i]
            flying[i[~inside]] = False
            i = i[inside]
            r = np.sqrt(squared[i] + way[i] * (2.0 * b[i] + way[i]))
            real = rng.random(len(i)) * self.majorant < self.take(r - self.radius)
            scattered[i[real]] = True
            flying[i[real]] = False
        on_ground = hits & ~scattered
        at = position + np.where(scattered, way, end)[:, None] * direction
        return at, scattered | on_ground, on_ground

    def sunlight(self, position: Array) -> Array:
        """Transmittance towards the Sun; 0 where the Earth stands before it."""
        b = position @ self.sun
        squared = np.einsum("ij,ij->i", position, position)
        dark = (b < 0.0) & (b**2 - squared + self.radius**2 > 0.0)
        reach = np.sqrt(np.maximum(b**2 - squared + (self.radius + AIR_TOP) ** 2, 0.0))
        depth = np.zeros(len(b))
        # From the point nearest to the Earth's centre, where the ray passes it, outwards.
        turn = np.clip(0.0, b, None)
        for start, stop in ((b, turn), (turn, reach)):
            from_turn = stop is reach
            x = 0.5 * (_NODES + 1.0)
            length = stop - start
            s = (start[:, None] if from_turn else stop[:, None]) + (
                1.0 if from_turn else -1.0
            ) * length[:, None] * x**2
            r = np.sqrt(np.maximum(squared - b**2, 0.0)[:, None] + s**2)
            depth += (self.take(r - self.radius) * _WEIGHTS * x).sum(axis=1) * length
        return np.where(dark, 0.0, np.exp(-depth))

    def turn(
        self,
        position: Array,
        direction: Array,
        on_ground: Mask,
        rng: np.random.Generator,
    ) -> tuple[Array, Array, Array]:
        """Light of the Sun towards the camera [sr-1], the next direction, and its share."""
        n, band, air = len(position), self.band, self.air
        height = np.linalg.norm(position, axis=1) - self.radius
        density = densities(air, np.maximum(height, 0.0))
        rayleigh = air.rayleigh[band] * density[:, 0]
        aerosol = air.aerosol[band] * air.aerosol_albedo[band] * density[:, 1]
        scattered_share = (rayleigh + aerosol) / self.take(height)
        share_rayleigh = rayleigh / (rayleigh + aerosol)
        g = air.aerosol_asymmetry[band]
        nu = direction @ self.sun
        phase = share_rayleigh * 3.0 / (16.0 * np.pi) * (1.0 + nu**2) + (1.0 - share_rayleigh) * (
            1.0 - g * g
        ) / (4.0 * np.pi * (1.0 + g * g - 2.0 * g * nu) ** 1.5)
        up = position / np.linalg.norm(position, axis=1)[:, None]
        lambert = self.albedo / np.pi * np.maximum(up @ self.sun, 0.0)
        light = self.sunlight(position) * np.where(on_ground, lambert, scattered_share * phase)
        share = np.where(on_ground, self.albedo, scattered_share)
        u = rng.random(n)
        # Rayleigh's cosine by Cardano, Henyey and Greenstein's by its inverse.
        q = 4.0 * u - 2.0
        root = np.cbrt(q + np.sqrt(q * q + 1.0))
        by_rayleigh = root - 1.0 / root
        by_aerosol = (1.0 + g * g - ((1.0 - g * g) / (1.0 - g + 2.0 * g * u)) ** 2) / (2.0 * g)
        cosine = np.where(rng.random(n) < share_rayleigh, by_rayleigh, by_aerosol)
        cosine = np.where(on_ground, np.sqrt(u), np.clip(cosine, -1.0, 1.0))
        axis = np.where(on_ground[:, None], up, direction)
        return light, _around(axis, cosine, 2.0 * np.pi * rng.random(n)), share


def _around(axis: Array, cosine: Array, azimuth: Array) -> Array:
    hint = np.where(np.abs(axis[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = np.cross(axis, hint)
    u /= np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(axis, u)
    sine = np.sqrt(1.0 - cosine**2)
    turned = cosine[:, None] * axis
    turned += sine[:, None] * (np.cos(azimuth)[:, None] * u + np.sin(azimuth)[:, None] * v)
    return turned / np.linalg.norm(turned, axis=1)[:, None]
