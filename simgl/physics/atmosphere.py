"""Extinction of the clear atmosphere per band: vertical optical depths, and profiles by height.

Each constituent has a vertical optical depth and a profile; both give the optical depth of any
path. Lengths in m, bands R, G, B, N. Air in other bands (``BandAir``) is a sum of such airs: what
passes a band of many lines falls by no one exponential.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.air_profile import (
    AIR_TOP,
    MIDLATITUDE_OZONE,
    PROFILE_PLACES,
    STRATOSPHERIC_AEROSOL,
    Exponential,
    Profile,
    Sum,
    UsStandard1976,
    profile_place,
    shape,
)
from simgl.physics.spectrum import PerBand

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(160)


@dataclass(frozen=True)
class Absorber:
    """Vertical optical depths of a gas from sea level, and its profile."""

    depth: PerBand
    profile: Profile


@dataclass(frozen=True, kw_only=True)
class Atmosphere:
    """Vertical optical depths from sea level, and profiles by height.

    rayleigh : molecular scattering
    depolarisation : of natural light scattered by molecules at 90 deg, the ratio of its two
        polarised parts; 0 for isotropic molecules
    aerosol : aerosol extinction (scattering and absorption)
    aerosol_albedo : single-scattering albedo of the aerosol
    aerosol_asymmetry : mean cosine of its scattering angle
    ozone : absorption
    refractivity : refractive index of the air on the ground less 1; it falls with the molecules'
        profile. Zeros leave rays straight
    rayleigh_profile, aerosol_profile, ozone_profile : of each, up to ``AIR_TOP``
    absorbers : gases besides ozone
    """

    name: str
    rayleigh: PerBand
    depolarisation: float
    aerosol: PerBand
    aerosol_albedo: PerBand
    aerosol_asymmetry: PerBand
    ozone: PerBand
    refractivity: PerBand
    rayleigh_profile: Profile
    aerosol_profile: Profile
    ozone_profile: Profile
    absorbers: tuple[Absorber, ...] = ()

    def __hash__(self) -> int:
        # Caches ask often: some of its numbers tell it from others.
        return hash((self.rayleigh, self.aerosol, self.ozone))


@dataclass(frozen=True, kw_only=True)
class BandAir:
    """Air in bands of a scenario: in each a sum of terms, in which light falls exponentially.

    parts : four terms each, with the same profiles
    shares : of each part, (4, 4): how much of a band's light (rows) a term has (columns)
    refractivity : per band, as in ``Atmosphere``
    """

    name: str
    parts: tuple[Atmosphere, ...]
    shares: tuple[tuple[PerBand, PerBand, PerBand, PerBand], ...]
    refractivity: PerBand

    def __hash__(self) -> int:
        return hash((self.name, self.refractivity))

    @property
    def all_shares(self) -> Array:
        """(4, terms) how much of each band's light its terms have."""
        return np.concatenate([np.array(one) for one in self.shares], axis=1)


Air = Atmosphere | BandAir


def parts_of(air: Air) -> tuple[Atmosphere, ...]:
    """Those that it is a sum of."""
    return air.parts if isinstance(air, BandAir) else (air,)


def band_transmittance(air: Air, depth: Array) -> Array:
    """(..., 4) transmittance in each band of optical depths in all terms (..., terms)."""
    passed = np.exp(-depth)
    return passed @ air.all_shares.T if isinstance(air, BandAir) else passed


def band_depths(air: Air, depth: Array) -> Array:
    """(..., 4) effective optical depth in each band of those in all terms (..., terms)."""
    if isinstance(air, BandAir):
        return -np.log(np.maximum(band_transmittance(air, depth), 1e-300))
    return depth


# Part of the aerosol that is in the stratosphere: 0.005 of 0.08 at 550 nm, the years without
# volcanic aerosol after 1997 (Kovilakam et al. 2020, Earth Syst. Sci. Data 12, 2607).
_STRATOSPHERIC = 0.005 / 0.08

# Rayleigh: Hansen & Travis (1974), 0.008569 l^-4 (1 + 0.0113 l^-2 + 0.00013 l^-4) with l in um, at
# the centre of the visible bands and at 840 nm, near the photon mean of N. Aerosol: 0.08 at 550 nm,
# a mean of clean continental and maritime air, Angstrom exponent 1. Ozone: 300 Dobson units in the
# Chappuis band, at the centres of the bands. Depolarisation: 0.0279 (Young 1981, Appl. Opt. 20,
# 533), King's factor 1.048. Refractivity: dry air of 15 deg C and 101325 Pa after Ciddor (1996,
# Appl. Opt. 35, 1566), at the same wavelengths as Rayleigh scattering.
STANDARD = Atmosphere(
    name="standard",
    rayleigh=(0.0493, 0.0973, 0.2213, 0.0175),
    depolarisation=0.0279,
    aerosol=(0.0677, 0.08, 0.0978, 0.0524),
    aerosol_albedo=(0.95, 0.95, 0.95, 0.95),
    aerosol_asymmetry=(0.7, 0.7, 0.7, 0.7),
    ozone=(0.0200, 0.0282, 0.0030, 0.0003),
    refractivity=(2.7632e-4, 2.7784e-4, 2.8053e-4, 2.7482e-4),
    rayleigh_profile=UsStandard1976(),
    aerosol_profile=Sum(
        ((1.0 - _STRATOSPHERIC, Exponential(1.2e3)), (_STRATOSPHERIC, STRATOSPHERIC_AEROSOL))
    ),
    ozone_profile=MIDLATITUDE_OZONE,
)

# Values of the lighting study: 680, 550, 440 nm in R, G, B; its aerosol depth is taken as
# extinction. It has no near infrared: Rayleigh is extrapolated to 840 nm by the fourth power.
SOURCE = Atmosphere(
    name="source",
    rayleigh=(0.0464, 0.1080, 0.2648, 0.0464 * (680.0 / 840.0) ** 4),
    depolarisation=0.0,
    aerosol=(0.024, 0.024, 0.024, 0.024),
    aerosol_albedo=(0.9, 0.9, 0.9, 0.9),
    aerosol_asymmetry=(0.76, 0.76, 0.76, 0.76),
    ozone=(0.0, 0.0, 0.0, 0.0),
    refractivity=(0.0, 0.0, 0.0, 0.0),
    rayleigh_profile=Exponential(8e3),
    aerosol_profile=Exponential(1.2e3),
    ozone_profile=MIDLATITUDE_OZONE,
)

ATMOSPHERES = {a.name: a for a in (STANDARD, SOURCE)}


def albedo_from_below(air: Air) -> Array:
    """(4,) share of the light from all sides of the ground that the clear air sends back down.

    Two-stream method in Eddington's form without absorption (Meador and Weaver 1980, eq. 24); for
    molecules within 8 % of the exact value up to an optical depth of 0.25. Other gases dim it by
    one diffuse passage (1.66 of the vertical).
    """
    if isinstance(air, BandAir):
        of_terms = np.concatenate([_from_below(part) for part in air.parts])
        return np.asarray(air.all_shares @ of_terms)
    return _from_below(air)


def _from_below(air: Atmosphere) -> Array:
    onward = (1.0 - np.array(air.aerosol_asymmetry)) * np.array(air.aerosol_albedo)
    scattering = np.array(air.rayleigh) + onward * np.array(air.aerosol)
    sent_back = np.asarray(0.75 * scattering / (1.0 + 0.75 * scattering))
    if not air.absorbers:
        return sent_back
    return sent_back * np.exp(-1.66 * np.sum([gas.depth for gas in air.absorbers], axis=0))


@lru_cache(maxsize=16)
def profiles(air: Air) -> Array:
    """(PROFILE_PLACES, constituents) share of the columns of molecules, aerosol, ozone and other
    gases [m-1].

    By ``profile_place`` of the height. The shaders interpolate the same table.
    """
    one = parts_of(air)[0]
    shapes = (one.rayleigh_profile, one.aerosol_profile, one.ozone_profile)
    gases = (gas.profile for gas in one.absorbers)
    return np.stack([shape(profile) for profile in (*shapes, *gases)], axis=-1)


def absorption(air: Atmosphere) -> Array:
    """(PROFILE_PLACES, 4) absorption of the gases besides ozone [m-1], as ``profiles``."""
    gases = np.array([gas.depth for gas in air.absorbers]).reshape(-1, 4)
    return np.asarray(profiles(air)[:, 3:] @ gases)


def densities(air: Air, height: Array) -> Array:
    """(..., constituents) share of the columns of ``profiles`` at heights (...) [m-1]."""
    table = profiles(air)
    at = profile_place(height) * (PROFILE_PLACES - 1)
    below = np.minimum(at.astype(np.intp), PROFILE_PLACES - 2)
    share = (at - below)[..., None]
    between = (1.0 - share) * table[below] + share * table[below + 1]
    return between * (height < AIR_TOP)[..., None]


def extinction(air: Air, height: Array) -> Array:
    """(..., terms) extinction coefficient at heights (...) [m-1]; terms are bands in one part."""
    return densities(air, height) @ _depths(air)


def _depths(air: Air) -> Array:
    """(constituents, terms) vertical optical depths."""
    return np.concatenate(
        [
            [one.rayleigh, one.aerosol, one.ozone, *(gas.depth for gas in one.absorbers)]
            for one in parts_of(air)
        ],
        axis=1,
    )


def grazing_optical_depth(air: Air, radius: float, height: Array) -> Array:
    """(k, terms) optical depth of straight rays from space to space with given tangent heights.

    radius : of the ground [m]
    height : (k,) tangent heights above it [m]
    """
    lowest = radius + height[:, None]
    half_chord = np.sqrt(np.maximum((radius + AIR_TOP) ** 2 - lowest**2, 0.0))
    x = 0.5 * (_NODES + 1.0)
    along = half_chord * x**2
    # sqrt(lowest^2 + along^2) - lowest, without the cancellation.
    at = height[:, None] + along**2 / (np.sqrt(lowest**2 + along**2) + lowest)
    columns = np.einsum("kn,knc->kc", 2.0 * half_chord * x * _WEIGHTS, densities(air, at))
    return columns @ _depths(air)


def optical_depth_to_space(air: Air, radius: float, height: float, cosines: Array) -> Array:
    """(k, terms) optical depth from a point inside the air to space, for rays above the ground.

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


def _rising_depth(air: Air, radius: float, height: float, cosines: Array) -> Array:
    """(k, terms) optical depth of rising rays to space; nodes are dense at their start."""
    start = radius + height
    above = (radius + AIR_TOP) ** 2 - start**2
    length = above / (start * cosines + np.sqrt((start * cosines) ** 2 + above))
    x = 0.5 * (_NODES + 1.0)
    along = length[:, None] * x**2
    rise = along * (2.0 * start * cosines[:, None] + along)
    at = height + rise / (np.sqrt(start**2 + rise) + start)
    step = length[:, None] * x * _WEIGHTS
    return np.einsum("kn,knc->kc", step, densities(air, at)) @ _depths(air)
