"""Spectra of the Earth's surfaces and clouds, as means over the bands of a scenario.

Maps and constants give reflectance in R, G, B and N. In other bands the surface's own spectrum is
scaled, in each of R, G, B and N, to that number; what lies below 400 nm goes with B, what lies
beyond 1000 nm with N. So bands that are R, G, B and N give the numbers back.

``simgl/data/earth/spectra.csv``: dry sand (Staetter and Schroeder 1978, as tabulated in 6S;
estimates below 400 and beyond 2200 nm), a canopy of green leaves (PROSAIL with PROSPECT-D:
chlorophyll 40, carotenoids 8 ug cm-2, water 0.01, dry matter 0.009 g cm-2, leaf area 3, Sun at
30 deg, over a mean of its dry and wet soil; an estimate below 400 nm), refractive index and
absorption of water (Hale and Querry 1973; Segelstein 1981) and absorption of ice (Warren and
Brandt 2008).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl import assets
from simgl.arrays import Array, Array32
from simgl.physics.spectral_form import parts_of_form, photon_shares
from simgl.physics.spectrum import CHANNELS, Bands

# Effective radii of grains [m]: of dry snow, of wet and melting snow and ice, of cloud droplets,
# and of the crystals of high clouds. Estimates by kind.
SNOW_GRAIN, MELTING_GRAIN, DROPLET, CRYSTAL = 100e-6, 600e-6, 10e-6, 30e-6
# Mean cosines of scattering by snow's grains, and by droplets (shaders/planet/cloud.glsl).
_SNOW_G, _DROPLET_G = 0.89, 0.85
# Of a thick grain all light that enters is lost, about 0.94 of what it meets; a grain's shadow is
# half of what it scatters.
_MAX_LOST = 0.47
# Foam over that of 500 nm (Frouin et al. 1996, J. Geophys. Res. 101, 14361: 40, 50 and 85 % less
# at 850, 1020 and 1650 nm).
_FOAM = (300.0, 600.0, 850.0, 1020.0, 1650.0, 2200.0), (1.0, 1.0, 0.6, 0.5, 0.15, 0.05)

# Table of clouds: by code of the thickness and the root of the Sun's cosine.
CLOUD_PLACES = 16
_LOG_THICKEST = np.log(100.0)


@lru_cache(maxsize=1)
def _table() -> Array:
    """(n, 6) rows of the file."""
    return np.loadtxt(assets.data() / "earth" / "spectra.csv", delimiter=",", skiprows=1)


def _column(name: str, nm: Array) -> Array:
    names = ("sand", "leaves", "water_index", "water_absorption", "ice_absorption")
    return np.interp(nm, _table()[:, 0], _table()[:, 1 + names.index(name)])


def _lost_by_a_grain(absorption: Array, index: Array, nm: Array, radius: float) -> Array:
    """Share of the light that a sphere takes of what it takes and scatters, large beside waves.

    absorption : imaginary part of the refractive index

    In the limit of weak absorption n^2 (1 - (1 - n^-2)^1.5) times its mean chord (Bohren and
    Huffman 1983, section 7.1).
    """
    per_metre = 4.0 * np.pi * absorption / (nm * 1e-9)
    weak = 2.0 / 3.0 * radius * per_metre * index**2 * (1.0 - (1.0 - index**-2) ** 1.5)
    return np.asarray(_MAX_LOST * (1.0 - np.exp(-weak / _MAX_LOST)))


def snow_reflectance(nm: Array, radius: float) -> Array:
    """(n,) of deep snow of grains of a radius [m], for light from all sides; wavelengths in nm.

    By van de Hulst's similarity (1980, Multiple Light Scattering, table 40).
    """
    lost = _lost_by_a_grain(_column("ice_absorption", nm), np.full(nm.shape, 1.3), nm, radius)
    s = np.sqrt(lost / (1.0 - (1.0 - lost) * _SNOW_G))
    return np.asarray((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))


def sand_reflectance(nm: Array) -> Array:
    """(n,) of dry sand; wavelengths in nm."""
    return _column("sand", nm)


def leaf_reflectance(nm: Array) -> Array:
    """(n,) of a canopy of green leaves; wavelengths in nm."""
    return _column("leaves", nm)


def foam_reflectance(nm: Array) -> Array:
    """(n,) of foam over that in green light; wavelengths in nm."""
    return np.interp(nm, *_FOAM)


def even_reflectance(nm: Array) -> Array:
    """(n,) of a surface that is alike all over R, G, B and N."""
    return np.ones(np.shape(nm))


@lru_cache(maxsize=16)
def _parts(bands: Bands) -> tuple[Array, Array]:
    """(3, 4) sand, leaves and snow in R, G, B, N; (3, 4, 4) the parts of their means over the bands
    (second axis) that lie in each of R, G, B, N."""
    curves = (sand_reflectance, leaf_reflectance, lambda nm: snow_reflectance(nm, SNOW_GRAIN))
    wide, parts = np.zeros((3, CHANNELS)), np.zeros((3, CHANNELS, CHANNELS))
    for kind, curve in enumerate(curves):
        wide[kind], parts[kind] = parts_of_form(curve, bands)
    return wide, parts


def land_in_bands(land: Array32, bands: Bands) -> Array32:
    """(..., 4) reflectance of land in the bands, of that in R, G, B, N.

    By its colours land is sand, leaves and snow, of which it has the spectra's mean.
    """
    wide, parts = (one.astype(np.float32) for one in _parts(bands))
    kinds = land_kinds(land)
    shares = np.stack([1.0 - kinds[..., 0] - kinds[..., 1], kinds[..., 0], kinds[..., 1]], axis=-1)
    ratio = land / (shares @ wide)
    result = np.zeros_like(land)
    for kind in range(3):
        result += shares[..., kind, None] * (ratio @ parts[kind].T)
    return np.clip(result, 0.0, 1.0)


def land_kinds(land: Array32) -> Array32:
    """(..., 2) shares of leaves and snow of land, by its reflectance in R, G, B, N."""
    red, _, blue, near = np.moveaxis(land, -1, 0)
    snow = np.clip((blue - 0.3) / 0.3, 0.0, 1.0)
    # Some shade falls on all leaves, and no land is nothing but leaves.
    leaves = np.clip(4.0 * (near - 1.35 * red), 0.0, 0.9) * (1.0 - snow)
    return np.stack([leaves, snow], axis=-1).astype(np.float32)


@lru_cache(maxsize=16)
def water_mirror(bands: Bands) -> Array:
    """(4,) reflectance of flat water over that of an index of 1.34, per band."""
    result = np.zeros(CHANNELS)
    for index in range(len(bands.edges)):
        nm, share = photon_shares(bands, index)
        n = _column("water_index", nm)
        result[index] = np.sum(((n - 1.0) / (n + 1.0)) ** 2 * share) / (0.34 / 2.34) ** 2
    return result


def two_streams(lost: Array, asymmetry: float, tau: Array, mu: Array) -> tuple[Array, Array]:
    """Reflectance and transmittance of a layer in direct light, by Eddington's two streams.

    lost : of the light that its drops take and scatter, the share that they take
    tau, mu : optical thickness, cosine of the light from the vertical

    Meador and Weaver (1980, J. Atmos. Sci. 37, 630), eq. 14 and 15, after the scaling of Joseph,
    Wiscombe and Weinman (1976).
    """
    # Without any loss the formula is 0 / 0.
    albedo = 1.0 - np.maximum(lost, 1e-7)
    forward = asymmetry**2
    tau = (1.0 - albedo * forward) * tau
    albedo = (1.0 - forward) * albedo / (1.0 - albedo * forward)
    g = asymmetry / (1.0 + asymmetry)
    g1, g2 = (7.0 - albedo * (4.0 + 3.0 * g)) / 4.0, -(1.0 - albedo * (4.0 - 3.0 * g)) / 4.0
    g3 = (2.0 - 3.0 * g * mu) / 4.0
    g4 = 1.0 - g3
    a1, a2 = g1 * g4 + g2 * g3, g1 * g3 + g2 * g4
    k = np.sqrt(g1 * g1 - g2 * g2)
    # 1 - k^2 mu^2 vanishes at one angle.
    off = 1.0 - (k * mu) ** 2
    off = np.where(np.abs(off) < 1e-6, 1e-6, off)
    passed, direct = np.exp(-2.0 * k * tau), np.exp(-tau / mu)
    below = off * (k + g1 + (k - g1) * passed)
    half = np.exp(-k * tau)
    up = (1.0 - k * mu) * (a2 + k * g3) - (1.0 + k * mu) * (a2 - k * g3) * passed
    reflected = albedo / below * (up - 2.0 * k * (g3 - a2 * mu) * direct * half)
    down = (1.0 + k * mu) * (a1 + k * g4) - (1.0 - k * mu) * (a1 - k * g4) * passed
    through = direct - albedo / below * (direct * down - 2.0 * k * (g4 + a1 * mu) * half)
    return np.asarray(reflected), np.asarray(through)


@lru_cache(maxsize=16)
def cloud_table(bands: Bands) -> Array:
    """(2, CLOUD_PLACES, CLOUD_PLACES, 4) of water clouds, per band: reflectance over that of a
    cloud that absorbs nothing, and the share of the Sun's light that does not come through.

    By the root of the Sun's cosine and by the thickness code of shaders/planet/cloud.glsl.
    """
    tau = np.exp(_LOG_THICKEST * np.linspace(0.0, 1.0, CLOUD_PLACES))
    # On facets of rough tops, as there.
    mu = 0.4 + 0.46 * np.linspace(0.0, 1.0, CLOUD_PLACES)[:, None, None] ** 2
    white, _ = two_streams(np.zeros(1), _DROPLET_G, tau[None, :, None], mu)
    table = np.ones((2, CLOUD_PLACES, CLOUD_PLACES, CHANNELS))
    for index in range(len(bands.edges)):
        nm, share = _coarse(*photon_shares(bands, index))
        absorption, n = _column("water_absorption", nm), _column("water_index", nm)
        lost = _lost_by_a_grain(absorption, n, nm, DROPLET)
        reflected, through = two_streams(lost, _DROPLET_G, tau[None, :, None], mu)
        table[0, ..., index] = (reflected / white) @ share
        table[1, ..., index] = 1.0 - through @ share
    return table


def _coarse(nm: Array, share: Array) -> tuple[Array, Array]:
    """Wavelengths and shares in steps of some 10 nm."""
    parts = np.array_split(np.arange(len(nm)), max(len(nm) // 10, 1))
    sums = np.array([share[part].sum() for part in parts])
    return np.array([nm[part].mean() for part in parts]), sums


@lru_cache(maxsize=16)
def ice_cloud(bands: Bands) -> Array:
    """(4,) reflectance of thin high cloud over that of one that absorbs nothing, per band."""
    result = np.zeros(CHANNELS)
    tau, mu = np.array([1.0]), np.array([0.5])
    white, _ = two_streams(np.zeros(1), 0.74, tau, mu)
    for index in range(len(bands.edges)):
        nm, share = photon_shares(bands, index)
        absorption = _column("ice_absorption", nm)
        lost = _lost_by_a_grain(absorption, np.full(nm.shape, 1.3), nm, CRYSTAL)
        result[index] = np.sum(two_streams(lost, 0.74, tau, mu)[0] / white * share)
    return result
