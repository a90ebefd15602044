"""Multiple scattering in the atmosphere: the radiance field, and the source of the next order.

At each height and solar zenith angle the radiance is sampled on rings of constant elevation, as its
first three harmonics in azimuth from the Sun. Rayleigh scattering needs the field's mean and second
moments. The aerosol's forward peak needs more: light about the Sun, which has the shape of the
phase function, is split off as an aureole; the smooth rest is tabulated by elevation. Radiances
[sr-1] are for sunlight of 1 W m-2, arrays (heights, ..., suns, 4) with the bands last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP

# The axes of the tables, as in shaders/air/diffuse_place.glsl.
HEIGHTS, SUNS, LOOKS = 32, 96, 24
_CROWDING, _MIDDLE = 16.0, 0.04

# Legendre terms of the aerosol's phase function: 0.8^24 is 5e-3.
_TERMS = 24


def table_heights() -> Array:
    """(HEIGHTS,) heights of the rows [m], dense at the ground."""
    return AIR_TOP * np.linspace(0.0, 1.0, HEIGHTS) ** 2


def table_suns() -> Array:
    """(SUNS,) cosine of the solar zenith angle, dense about the terminator."""
    low, high = (np.arcsinh(_CROWDING * (_MIDDLE + end)) for end in (-1.0, 1.0))
    return np.sinh(np.linspace(low, high, SUNS)) / _CROWDING - _MIDDLE


def table_looks() -> Array:
    """(LOOKS,) cosine of the view's zenith angle."""
    return np.linspace(-1.0, 1.0, LOOKS)


@dataclass(frozen=True)
class Rings:
    """Sampling of a field: Gauss nodes above and below the horizon of each height, dense at it,
    where the sky changes fastest; azimuths on half a circle, as the field is even."""

    above: int
    below: int
    around: int
    steps: int

    @property
    def nodes(self) -> Array:
        """(above + below, 2) square roots of the distance from the horizon, 0..1, and weights."""
        parts = []
        for count in (self.above, self.below):
            x, weight = np.polynomial.legendre.leggauss(count)
            parts.append(0.5 * np.stack([x + 1.0, weight], axis=1))
        return np.concatenate(parts)

    def elevations(self, radius: float) -> tuple[Array, Array]:
        """(heights, rings) cosines of the zenith angle, and their weights, which sum to 2."""
        height = table_heights()[:, None]
        horizon = -np.sqrt(height * (2.0 * radius + height)) / (radius + height)
        place, weight = self.nodes.T
        span = np.where(np.arange(len(place)) < self.above, 1.0, -1.0) - horizon
        return horizon + span * place**2, np.abs(span) * 2.0 * place * weight


@dataclass(frozen=True, kw_only=True, eq=False)
class Skylight:
    """Moments of a field that the next scattering order and the ground need.

    mean, mxx, mzz, mxz : (heights, suns, 4) int L dw and int L w w^T dw in axes x (the Sun's
        horizontal direction) and z (up), w the direction that light comes from
    down : (heights, suns, 4) irradiance of a horizontal plane from above
    aureole : (heights, suns, 4) strength of the part that the aerosol scatters about the Sun
    by_look, by_look_x : (heights, looks, suns, 4) radiance that the aerosol scatters of the rest,
        per unit of scattering; the second is multiplied by the view direction's x
    """

    mean: Array
    mxx: Array
    mzz: Array
    mxz: Array
    down: Array
    aureole: Array
    by_look: Array
    by_look_x: Array

    @property
    def tables(self) -> tuple[Array, ...]:
        """All tables, in the order of the attributes."""
        flat = (self.mean, self.mxx, self.mzz, self.mxz, self.down, self.aureole)
        return (*flat, self.by_look, self.by_look_x)


def skylight(
    rings: Rings, radius: float, asymmetry: Array, field: tuple[Array, Array, Array], aureole: Array
) -> Skylight:
    """Moments of a field.

    radius : of the ground [m]
    asymmetry : (4,) of the aerosol's phase function
    field : int L cos(m a) da over azimuth, m = 0, 1, 2, each (rings, heights, suns, 4)
    aureole : (heights, suns, 4)
    """
    mu, weight = rings.elevations(radius)
    sine = np.sqrt(np.maximum(1.0 - mu**2, 0.0))

    def summed(values: Array, factor: Array) -> Array:
        return np.einsum("ihsb,hi->hsb", values, weight * factor)

    zero, one, two = field
    return Skylight(
        mean=summed(zero, np.ones_like(mu)),
        mxx=summed(0.5 * (zero + two), sine**2),
        mzz=summed(zero, mu**2),
        mxz=summed(one, sine * mu),
        down=summed(zero, np.maximum(mu, 0.0)),
        aureole=aureole,
        by_look=_by_look(0, zero, mu, weight, asymmetry, aureole),
        by_look_x=_by_look(1, one, mu, weight, asymmetry, aureole),
    )


def aureole_strength(rings: Rings, radius: float, asymmetry: Array, peak: Array) -> Array:
    """(heights, suns, 4) strength of the Henyey-Greenstein field about the Sun.

    peak : (rings, heights, suns, 4) int L (P - P2) da over azimuth, L of the sunlight that the
        aerosol scattered once, P2 the first three Legendre terms of its phase function P, about
        the angle from the Sun

    A field of the shape P scatters into one with the square of its asymmetry. The strength is such
    that the higher terms scatter the right amount of light straight away from the Sun.
    """
    _, weight = rings.elevations(radius)
    order = np.arange(3, _TERMS)[:, None]
    of_unit_field = np.sum((2 * order + 1) * asymmetry ** (2 * order), axis=0) / (4.0 * np.pi)
    return np.einsum("ihsb,hi->hsb", peak, weight) / of_unit_field


def _by_look(
    m: int, harmonic: Array, mu: Array, weight: Array, asymmetry: Array, aureole: Array
) -> Array:
    """One azimuthal harmonic of the aerosol's scattering over sin^m, without the aureole's."""
    looks, suns = table_looks(), table_suns()
    order = np.arange(m, _TERMS)
    # (l - m)! / (l + m)! for m = 0, 1; twice for the two signs of m.
    scale = (2 * order + 1) * (1.0 if m == 0 else 2.0 / np.maximum(order * (order + 1.0), 1.0))
    looking = _legendre(m, looks)
    incoming = _legendre(m, mu) * np.sqrt(np.maximum(1.0 - mu**2, 0.0)) ** m
    sunward = _legendre(m, suns) * np.sqrt(np.maximum(1.0 - suns**2, 0.0)) ** m
    # Height by height: products so small that BLAS keeps them to one thread. Woken ones keep the
    # cores busy while they wait for the next product.
    moments = np.moveaxis(incoming, 1, 0) * weight[:, None]
    field = np.moveaxis(harmonic, 1, 0)
    per_order = (moments @ field.reshape(*field.shape[:2], -1)).reshape(
        len(mu), len(order), *harmonic.shape[2:]
    )
    g = asymmetry ** order[:, None]
    per_order -= g[:, None] * sunward[:, :, None] * aureole[:, None]
    scattering = np.einsum("l,lb,lo->bol", scale, g, looking)
    made = scattering @ np.ascontiguousarray(np.moveaxis(per_order, 3, 1))
    return np.moveaxis(made, 1, 3) / (4.0 * np.pi)


def _legendre(m: int, x: Array) -> Array:
    """(terms from m, ...) Legendre polynomials, or for m = 1 their derivatives."""
    values = [np.ones_like(x), x]
    for n in range(1, _TERMS):
        values.append(((2 * n + 1) * x * values[n] - n * values[n - 1]) / (n + 1))
    if m == 0:
        return np.stack(values[:_TERMS])
    slopes = [np.zeros_like(x), np.ones_like(x)]
    for n in range(1, _TERMS):
        slopes.append(slopes[n - 1] + (2 * n + 1) * values[n])
    return np.stack(slopes[1:_TERMS])
