"""Hapke's reflectance model of regolith.

Bidirectional reflectance r [sr-1], the radiance per irradiance of a plane that faces the Sun, at
cosines of incidence mu0 and emergence mu and phase angle g (Hapke 1993, Theory of Reflectance and
Emittance Spectroscopy, chapters 8 and 12):

    r = w / (4 pi)  mu0e / (mu0e + mue)  (p(g) (1 + B(g)) + H(mu0e) H(mue) - 1)  S

with p a double Henyey-Greenstein phase function, B the opposition surge, H Chandrasekhar's function
in Hapke's approximation, mu0e, mue and S the effective cosines and the shadowing function of a
rough surface. ``shaders/planet/regolith.glsl`` has the same formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array

# Quadrature nodes over the disc for the geometric albedo.
_RINGS = 64
# Below this sine the azimuth is undefined.
_NO_SINE = 1e-5


@dataclass(frozen=True, kw_only=True)
class Regolith:
    """Hapke's parameters.

    single_scattering : albedo w of a grain
    lobe, backward : asymmetry b of the lobes, and fraction c of the backward one
    surge, surge_width : amplitude B0 and width h of the opposition surge
    roughness : mean slope angle [rad]
    """

    single_scattering: float
    lobe: float
    backward: float
    surge: float
    surge_width: float
    roughness: float


# Planetary mean from orbit, corrected for the atmosphere (Vincendon 2013, Planetary and Space
# Science 76, 87, abstract: omega, b, c, B0, h, theta).
MARS = Regolith(
    single_scattering=0.85,
    lobe=0.12,
    backward=0.6,
    surge=1.0,
    surge_width=0.05,
    roughness=float(np.radians(17.0)),
)


def reflectance(ground: Regolith, mu0: ArrayLike, mu: ArrayLike, cos_phase: ArrayLike) -> Array:
    """r [sr-1] at cosines of incidence, emergence and phase angle; 0 below either horizon."""
    i, e, g = np.broadcast_arrays(*(np.asarray(a, dtype=np.float64) for a in (mu0, mu, cos_phase)))
    up = (i > 0.0) & (e > 0.0)
    i, e = np.where(up, i, 0.5), np.where(up, e, 0.5)
    sin_i, sin_e = np.sqrt(np.maximum(1.0 - i * i, 0.0)), np.sqrt(np.maximum(1.0 - e * e, 0.0))
    known = sin_i * sin_e > _NO_SINE
    cos_psi = np.where(known, (g - i * e) / np.where(known, sin_i * sin_e, 1.0), 1.0)
    cos_psi = np.clip(cos_psi, -1.0, 1.0)
    mu0e, mue, shade = _facets(ground, i, e, sin_i, sin_e, cos_psi)
    tangent = np.sqrt(np.maximum(1.0 - g, 0.0) / np.maximum(1.0 + g, 1e-12))
    surge = ground.surge / (1.0 + tangent / ground.surge_width)
    w = ground.single_scattering
    gamma = np.sqrt(1.0 - w)
    multiple = (1.0 + 2.0 * mu0e) / (1.0 + 2.0 * mu0e * gamma)
    multiple = multiple * (1.0 + 2.0 * mue) / (1.0 + 2.0 * mue * gamma) - 1.0
    light = _lobes(ground, g) * (1.0 + surge) + multiple
    r = w / (4.0 * np.pi) * mu0e / (mu0e + mue) * light * shade
    return np.where(up, r, 0.0)


@lru_cache(maxsize=16)
def geometric_albedo(ground: Regolith) -> float:
    """Light of a sphere at opposition relative to a white Lambertian disc of the same size."""
    nodes, weights = np.polynomial.legendre.leggauss(_RINGS)
    mu = 0.5 * (nodes + 1.0)
    # Fraction of the disc's area between mu and mu + dmu: 2 mu dmu.
    return float(np.sum(weights * mu * np.pi * reflectance(ground, mu, mu, 1.0)))


def face_on(ground: Regolith) -> float:
    """Reflectance factor at the centre of the full disc, the largest of all."""
    return float(np.pi * reflectance(ground, 1.0, 1.0, 1.0))


def _lobes(ground: Regolith, cos_phase: Array) -> Array:
    b, c = ground.lobe, ground.backward
    square = 1.0 + b * b
    back = (square - 2.0 * b * cos_phase) ** -1.5
    forward = (square + 2.0 * b * cos_phase) ** -1.5
    return (1.0 - b * b) * (c * back + (1.0 - c) * forward)


def _facets(
    ground: Regolith, i: Array, e: Array, sin_i: Array, sin_e: Array, cos_psi: Array
) -> tuple[Array, Array, Array]:
    """Effective cosines mu0e and mue, and the shadowing function S."""
    tan = np.tan(ground.roughness)
    chi = 1.0 / np.sqrt(1.0 + np.pi * tan**2)

    def falls(cos: Array, sin: Array) -> tuple[Array, Array]:
        cot = cos / np.maximum(sin, _NO_SINE) / tan
        return np.exp(-2.0 / np.pi * cot), np.exp(-(cot**2) / np.pi)

    def one_direction(cos: Array, sin: Array, e1: Array, e2: Array) -> Array:
        return chi * (cos + sin * tan * e2 / (2.0 - e1))

    i1, i2 = falls(i, sin_i)
    e1, e2 = falls(e, sin_e)
    half = 0.5 * (1.0 - cos_psi)
    psi = np.arctan2(np.sqrt(np.maximum(1.0 - cos_psi**2, 0.0)), cos_psi) / np.pi
    # The direction of larger zenith angle decides which facets shadow or hide others.
    slant_sun = i < e
    a1, a2 = np.where(slant_sun, i1, e1), np.where(slant_sun, i2, e2)
    b1, b2 = np.where(slant_sun, e1, i1), np.where(slant_sun, e2, i2)
    below = 2.0 - a1 - psi * b1
    larger_angle = tan * (a2 - half * b2) / below
    other = tan * (cos_psi * a2 + half * b2) / below
    mu0e = chi * (i + sin_i * np.where(slant_sun, larger_angle, other))
    mue = chi * (e + sin_e * np.where(slant_sun, other, larger_angle))
    eta_i, eta_e = one_direction(i, sin_i, i1, i2), one_direction(e, sin_e, e1, e2)
    hidden = np.exp(-2.0 * np.sqrt(half / np.maximum(1.0 - half, 1e-12)))
    steeper = np.where(slant_sun, e / eta_e, i / eta_i)
    shade = mue / eta_e * (i / eta_i) * chi / (1.0 - hidden + hidden * chi * steeper)
    return mu0e, mue, np.asarray(shade)
