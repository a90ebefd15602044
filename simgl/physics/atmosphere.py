"""The clear atmosphere as layers of exponential and tent-shaped density, per band.

Each constituent has a vertical optical depth and a profile; what light loses along a path follows
from both. Lengths [m], optical depths without unit, bands R, G, B, N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import k1e

from simgl.arrays import Array

BandValues = tuple[float, float, float, float]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)


@dataclass(frozen=True, kw_only=True)
class Atmosphere:
    """Vertical optical depths from sea level, and profiles.

    rayleigh : scattering by air, density falls with ``rayleigh_scale_height``
    aerosol : extinction by aerosol (scattering and absorption), with ``aerosol_scale_height``
    aerosol_albedo : share of the aerosol's extinction that is scattering
    aerosol_asymmetry : mean cosine of its scattering angle
    ozone : absorption, a tent from 10 km over 25 km to 40 km
    """

    name: str
    rayleigh: BandValues
    rayleigh_scale_height: float
    aerosol: BandValues
    aerosol_albedo: BandValues
    aerosol_asymmetry: BandValues
    aerosol_scale_height: float
    ozone: BandValues


OZONE_FOOT, OZONE_PEAK, OZONE_TOP = 10e3, 25e3, 40e3  # [m]

# Where the scattering air ends [m]: a vertical ray loses 1e-6 above it.
AIR_TOP = 100e3

# Rayleigh: Hansen & Travis (1974), 0.008569 l^-4 (1 + 0.0113 l^-2 + 0.00013 l^-4), at the middle of
# the visible bands and at 840 nm, about the photon mean of the fourth. Aerosol: 0.08 at 550 nm, a
# clean continental to maritime mean, Angstrom exponent 1. Ozone: 300 Dobson units on the Chappuis
# band, as used with the same tent by Bruneton (2017), moved to the bands' middles.
STANDARD = Atmosphere(
    name="standard",
    rayleigh=(0.0493, 0.0973, 0.2213, 0.0175),
    rayleigh_scale_height=8.0e3,
    aerosol=(0.0677, 0.08, 0.0978, 0.0524),
    aerosol_albedo=(0.95, 0.95, 0.95, 0.95),
    aerosol_asymmetry=(0.7, 0.7, 0.7, 0.7),
    aerosol_scale_height=1.2e3,
    ozone=(0.0200, 0.0282, 0.0030, 0.0003),
)

# The lighting study's own set: 680, 550, 440 nm in red, green, blue, its aerosol depth taken as
# extinction. It has no near infrared: Rayleigh is carried on by the fourth power to 840 nm.
SOURCE = Atmosphere(
    name="source",
    rayleigh=(0.0464, 0.1080, 0.2648, 0.0464 * (680.0 / 840.0) ** 4),
    rayleigh_scale_height=8.0e3,
    aerosol=(0.024, 0.024, 0.024, 0.024),
    aerosol_albedo=(0.9, 0.9, 0.9, 0.9),
    aerosol_asymmetry=(0.76, 0.76, 0.76, 0.76),
    aerosol_scale_height=1.2e3,
    ozone=(0.0, 0.0, 0.0, 0.0),
)

ATMOSPHERES = {a.name: a for a in (STANDARD, SOURCE)}


def _exponential_chord(radius: float, height: Array, scale_height: float) -> Array:
    """Length of sea-level air along a whole grazing ray [m].

    The integral of exp(-(r - radius) / H) over a straight line of lowest radius r0 is
    2 r0 exp(radius / H) K1(r0 / H), K1 the modified Bessel function.
    """
    lowest = radius + height
    return 2.0 * lowest * np.exp(-height / scale_height) * k1e(lowest / scale_height)


def _tent_chord(radius: float, height: Array) -> Array:
    """Length of peak-density ozone along a whole grazing ray [m], by quadrature between kinks."""
    lowest = radius + height
    total = np.zeros_like(height)
    for low, high in ((OZONE_FOOT, OZONE_PEAK), (OZONE_PEAK, OZONE_TOP)):
        near, far = (
            np.sqrt(np.maximum((radius + edge) ** 2 - lowest**2, 0.0)) for edge in (low, high)
        )
        half = 0.5 * (far - near)
        along = near[..., None] + half[..., None] * (_NODES + 1.0)
        at = np.sqrt(lowest[..., None] ** 2 + along**2) - radius
        rising, falling = at - OZONE_FOOT, OZONE_TOP - at
        density = np.where(at < OZONE_PEAK, rising, falling) / (OZONE_PEAK - OZONE_FOOT)
        total += 2.0 * half * np.sum(_WEIGHTS * np.maximum(density, 0.0), axis=-1)
    return total


def grazing_optical_depth(air: Atmosphere, radius: float, height: Array) -> Array:
    """Optical depth of a ray from space to space by its lowest height above the ground.

    radius : of the sphere [m]
    height : (k,) tangent heights [m]
    returns : (k, 4)

    Straight rays: refraction, which would bend the lowest ones by up to 1.2 deg, is left out.
    """
    # A tent of unit peak over 15 km up and 15 km down holds 15 km of peak density.
    chords = (
        (air.rayleigh, _exponential_chord(radius, height, air.rayleigh_scale_height)
         / air.rayleigh_scale_height),
        (air.aerosol, _exponential_chord(radius, height, air.aerosol_scale_height)
         / air.aerosol_scale_height),
        (air.ozone, _tent_chord(radius, height) / (OZONE_PEAK - OZONE_FOOT)),
    )  # fmt: skip
    return np.sum([np.outer(ratio, np.array(depth)) for depth, ratio in chords], axis=0)


def optical_depth_to_space(air: Atmosphere, radius: float, height: float, cosines: Array) -> Array:
    """Optical depth from a place inside the air to space, along rays that miss the ground.

    radius : of the sphere [m]
    height : of the place above it [m]
    cosines : (k,) of the rays from the zenith
    returns : (k, 4)

    A ray that starts downwards has the whole grazing ray but for what lies behind its start.
    """
    upward = _rising_depth(air, radius, height, np.abs(cosines))
    if np.all(cosines >= 0.0):
        return upward
    lowest = (radius + height) * np.sqrt(np.maximum(1.0 - cosines**2, 0.0)) - radius
    grazing = grazing_optical_depth(air, radius, np.maximum(lowest, 0.0))
    return np.where(cosines[:, None] < 0.0, grazing - upward, upward)


def _rising_depth(air: Atmosphere, radius: float, height: float, cosines: Array) -> Array:
    """(k, 4) along rays that rise from a height, by quadrature crowded at their start."""
    start = radius + height
    above = (radius + AIR_TOP) ** 2 - start**2
    whole = above / (start * cosines + np.sqrt((start * cosines) ** 2 + above))
    x = 0.5 * (_NODES + 1.0)
    along = whole[:, None] * x**2
    rise = along * (2.0 * start * cosines[:, None] + along)
    at = height + rise / (np.sqrt(start**2 + rise) + start)
    step = whole[:, None] * x * _WEIGHTS
    return np.einsum("kn,knb->kb", step, extinction(air, at))


def extinction(air: Atmosphere, height: Array) -> Array:
    """(..., 4) extinction coefficient at heights (...) [m-1]."""
    tent = np.minimum(height - OZONE_FOOT, OZONE_TOP - height) / (OZONE_PEAK - OZONE_FOOT)
    layers = (
        (air.rayleigh, np.exp(-height / air.rayleigh_scale_height) / air.rayleigh_scale_height),
        (air.aerosol, np.exp(-height / air.aerosol_scale_height) / air.aerosol_scale_height),
        (air.ozone, np.maximum(tent, 0.0) / (OZONE_PEAK - OZONE_FOOT)),
    )
    return sum(d[..., None] * np.array(depth) for depth, d in layers)
