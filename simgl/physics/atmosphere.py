"""Extinction of the clear atmosphere: exponential and tent-shaped density profiles, per band.

Each constituent has a vertical optical depth and a density profile; both give the optical depth of
any path. Lengths in m, bands R, G, B, N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from simgl.arrays import Array
from simgl.physics.spectrum import PerBand

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)


@dataclass(frozen=True, kw_only=True)
class Atmosphere:
    """Vertical optical depths from sea level, and density profiles.

    rayleigh : molecular scattering, exponential with ``rayleigh_scale_height`` [m]
    aerosol : aerosol extinction (scattering and absorption), with ``aerosol_scale_height`` [m]
    aerosol_albedo : single-scattering albedo of the aerosol
    aerosol_asymmetry : mean cosine of its scattering angle
    ozone : absorption; density rises linearly from 10 km to 25 km and falls to 0 at 40 km
    """

    name: str
    rayleigh: PerBand
    rayleigh_scale_height: float
    aerosol: PerBand
    aerosol_albedo: PerBand
    aerosol_asymmetry: PerBand
    aerosol_scale_height: float
    ozone: PerBand


OZONE_FOOT, OZONE_PEAK, OZONE_TOP = 10e3, 25e3, 40e3  # [m]

# Top of the scattering atmosphere [m]: a vertical ray loses 1e-6 above it.
AIR_TOP = 100e3

# Rayleigh: Hansen & Travis (1974), 0.008569 l^-4 (1 + 0.0113 l^-2 + 0.00013 l^-4) with l in um, at
# the centre of the visible bands and at 840 nm, near the photon mean of N. Aerosol: 0.08 at 550 nm,
# a mean of clean continental and maritime air, Angstrom exponent 1. Ozone: 300 Dobson units in the
# Chappuis band with the profile of Bruneton (2017), at the centres of the bands.
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

# Values of the lighting study: 680, 550, 440 nm in R, G, B; its aerosol depth is taken as
# extinction. It has no near infrared: Rayleigh is extrapolated to 840 nm by the fourth power.
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


def albedo_from_below(air: Atmosphere) -> Array:
    """(4,) share of the light from all sides of the ground that the clear air sends back down.

    Two-stream method in Eddington's form without absorption (Meador and Weaver 1980, eq. 24); for
    molecules within 8 % of the exact value up to an optical depth of 0.25.
    """
    forward = np.array(air.aerosol_asymmetry)
    scattering = np.array(air.rayleigh) + (1.0 - forward) * air.aerosol_albedo * np.array(
        air.aerosol
    )
    return np.asarray(0.75 * scattering / (1.0 + 0.75 * scattering))


def _exponential_chord(radius: float, height: Array, scale_height: float) -> Array:
    """Equivalent path length at sea-level density of a grazing ray from space to space [m].

    The integral of exp(-(r - radius) / H) along a straight line with the lowest radius r0 is
    2 r0 exp(radius / H) K1(r0 / H), K1 being the modified Bessel function.
    """
    lowest = radius + height
    return 2.0 * lowest * np.exp(-height / scale_height) * scipy.special.k1e(lowest / scale_height)


def _tent_chord(radius: float, height: Array) -> Array:
    """Equivalent path length at peak ozone density of a grazing ray from space to space [m].

    By quadrature on either side of the peak.
    """
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
    """(k, 4) optical depth of rays from space to space with given tangent heights.

    radius : of the ground [m]
    height : (k,) tangent heights above it [m]

    Rays are straight: refraction, up to 1.2 deg for the lowest rays, is neglected.
    """
    # The column of a tent profile of 15 km on either side is its peak density times 15 km.
    chords = (
        (air.rayleigh, _exponential_chord(radius, height, air.rayleigh_scale_height)
         / air.rayleigh_scale_height),
        (air.aerosol, _exponential_chord(radius, height, air.aerosol_scale_height)
         / air.aerosol_scale_height),
        (air.ozone, _tent_chord(radius, height) / (OZONE_PEAK - OZONE_FOOT)),
    )  # fmt: skip
    return np.sum([np.outer(ratio, np.array(depth)) for depth, ratio in chords], axis=0)


def optical_depth_to_space(air: Atmosphere, radius: float, height: float, cosines: Array) -> Array:
    """(k, 4) optical depth from a point inside the atmosphere to space, for rays above the ground.

    radius : of the ground [m]
    height : of the point above it [m]
    cosines : (k,) of the rays' zenith angles

    The optical depth of a descending ray is that of the grazing ray less the part behind the point.
    """
    upward = _rising_depth(air, radius, height, np.abs(cosines))
    if np.all(cosines >= 0.0):
        return upward
    lowest = (radius + height) * np.sqrt(np.maximum(1.0 - cosines**2, 0.0)) - radius
    grazing = grazing_optical_depth(air, radius, np.maximum(lowest, 0.0))
    return np.where(cosines[:, None] < 0.0, grazing - upward, upward)


def _rising_depth(air: Atmosphere, radius: float, height: float, cosines: Array) -> Array:
    """(k, 4) optical depth of rising rays to space; quadrature nodes are dense at their start."""
    start = radius + height
    above = (radius + AIR_TOP) ** 2 - start**2
    length = above / (start * cosines + np.sqrt((start * cosines) ** 2 + above))
    x = 0.5 * (_NODES + 1.0)
    along = length[:, None] * x**2
    rise = along * (2.0 * start * cosines[:, None] + along)
    at = height + rise / (np.sqrt(start**2 + rise) + start)
    step = length[:, None] * x * _WEIGHTS
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
