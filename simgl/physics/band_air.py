"""The air in the bands of a scenario: light scattered by wavelength, gases with their many lines.

What passes a band falls by no one exponential. Each band is cut into pieces of 5 nm; in each the
absorption coefficients of a gas are spread as Malkmus' model of random lines has them, an inverse
Gaussian distribution: a mean S and a width y, with which

    T(u) = exp(y (1 - sqrt(1 + 2 S u / y)))

passes u vertical columns. Pieces and coefficients are states in which light falls exponentially;
those that are alike are joined to a few terms (``BandAir``).

Table: ``simgl/data/air_absorption.csv``. How absorption grows with the path is fitted to 6S
(Vermote et al. 1997, IEEE Trans. Geosci. Remote Sens. 35, 675; version 1.1, public domain), for its
standard atmosphere with 1.42 g cm-2 of water and 300 Dobson units of ozone at 1 to 10 air masses:
within 0.01 nearly everywhere. How much there is of it is then set so that 1.5 air masses pass what
the direct beam of ASTM G173 (SMARTS 2.9.2; Gueymard 2004, Solar Energy 76, 423) has in the same
5 nm, over its window's aerosol. 6S alone takes a third less than that in oxygen's band at 762 nm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from simgl import assets
from simgl.arrays import Array, IndexArray
from simgl.physics.air_profile import Layers, UsStandard1976
from simgl.physics.atmosphere import STANDARD, Absorber, Atmosphere, BandAir
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.spectrum import CHANNELS, Bands, PerBand, channels, planck_radiance

_TABLE_STEP, _STEP = 5e-9, 0.1e-9
_OZONE_ATM_CM = 0.3
_GASES = ("water", "oxygen", "mixed")

# Water vapour of the US standard atmosphere by height [km], [g m-3]: 1.42 g cm-2 (McClatchey et
# al. 1972, AFCRL-72-0497).
_WATER = np.array(
    [
        *((0.0, 5.9), (1.0, 4.2), (2.0, 2.9), (3.0, 1.8), (4.0, 1.1), (5.0, 0.64), (6.0, 0.38)),
        *((7.0, 0.21), (8.0, 0.12), (9.0, 0.046), (10.0, 0.018), (11.0, 8.2e-3), (12.0, 3.7e-3)),
        *((13.0, 1.8e-3), (14.0, 8.4e-4), (15.0, 7.2e-4), (17.0, 5.2e-4), (20.0, 4.4e-4)),
        *((25.0, 6.6e-4), (30.0, 3.8e-4), (40.0, 6.7e-5), (50.0, 1.2e-5), (70.0, 1.5e-7)),
        *((100.0, 1e-9), (120.0, 1e-10)),
    ]
)
# Powers of the pressure that a gas's absorption goes with, besides its density. Lines are narrow
# where pressure is low, and those that are opaque in their middles absorb less. Water: LOWTRAN
# (Kneizys et al. 1980, AFGL-TR-80-0067); oxygen and the other mixed gases: chosen so that what lies
# above 4 and 10 km absorbs as in 6S.
_PRESSURE_POWER = {"water": 0.9, "oxygen": 0.6, "mixed": 0.25}

# Places of Gauss' rule in the distribution of a gas's coefficients, and their weights: the rare
# strong ones count for short paths, the weak ones for long ones.
_PARTS = ((0.0, 0.1), (0.1, 0.6), (0.6, 0.9), (0.9, 1.0))
_POINTS = 3
# Paths of so many vertical columns tell states apart, and terms must pass on them what states do.
_PATHS = np.array([0.02, 0.1, 0.3, 1.0, 2.0, 5.0, 12.0, 30.0])
_TERMS, _WITHIN = (1, 2, 3, 4, 6, 8), 5e-3


@dataclass(frozen=True, eq=False)
class _States:
    """Shares of a band's photons, and vertical optical depths of each constituent.

    share : (n,)
    depth : (n, 6) molecules, aerosol, ozone, and the gases
    """

    share: Array
    depth: Array


def rayleigh_depth(wavelength: Array) -> Array:
    """Vertical optical depth of molecules above sea level (Hansen and Travis 1974); [m]."""
    um2 = (wavelength * 1e6) ** -2
    return np.asarray(0.008569 * um2**2 * (1.0 + 0.0113 * um2 + 0.00013 * um2**2))


def refractivity(wavelength: float) -> float:
    """Of dry air of 15 deg C and 101325 Pa at a wavelength [m] (Ciddor 1996)."""
    um2 = (wavelength * 1e6) ** -2
    return 1e-8 * (5792105.0 / (238.0185 - um2) + 167917.0 / (57.362 - um2))


@lru_cache(maxsize=32)
def air_in_bands(bands: Bands) -> BandAir:
    """The air of ``STANDARD`` in other bands.

    Where all is alike in a band it is one term, else as many, up to eight, as bring the
    transmission of 0.02 to 30 air masses within 0.005 of that of the states, with and without the
    water.
    """
    terms = [_terms(_states(bands, index)) for index in range(len(bands.edges))]
    depth = np.concatenate([one.depth for one in terms])
    share = scipy.linalg.block_diag(*(one.share for one in terms))
    missing = -len(depth) % CHANNELS
    # Channels that are left are like the last, and count for nothing.
    depth = np.concatenate([depth, np.repeat(depth[-1:], missing, axis=0)])
    share = np.pad(share, ((0, CHANNELS - len(share)), (0, missing)))
    middle = [float(np.mean(edges)) for edges in bands.channel_edges]
    bending = channels(refractivity(wavelength) for wavelength in middle)
    starts = range(0, len(depth), CHANNELS)
    return BandAir(
        name=STANDARD.name,
        parts=tuple(_part(depth[i : i + CHANNELS], bending) for i in starts),
        shares=tuple(_four_rows(share[:, i : i + CHANNELS]) for i in starts),
        refractivity=bending,
    )


def _four_rows(values: Array) -> tuple[PerBand, PerBand, PerBand, PerBand]:
    a, b, c, d = (channels(row) for row in values.tolist())
    return a, b, c, d


def _part(depth: Array, bending: PerBand) -> Atmosphere:
    """Of (4, 6) vertical optical depths."""
    molecules, aerosol, ozone, *gases = (channels(one) for one in depth.T.tolist())
    return Atmosphere(
        name=STANDARD.name,
        rayleigh=molecules,
        depolarisation=STANDARD.depolarisation,
        aerosol=aerosol,
        aerosol_albedo=STANDARD.aerosol_albedo,
        aerosol_asymmetry=STANDARD.aerosol_asymmetry,
        ozone=ozone,
        refractivity=bending,
        rayleigh_profile=STANDARD.rayleigh_profile,
        aerosol_profile=STANDARD.aerosol_profile,
        ozone_profile=STANDARD.ozone_profile,
        absorbers=tuple(Absorber(of, _profile(gas)) for gas, of in zip(_GASES, gases, strict=True)),
    )


@lru_cache(maxsize=8)
def _profile(gas: str) -> Layers:
    """Density times a power of the pressure, in steps of 250 m."""
    height = np.arange(0.0, 120.1e3, 250.0)
    air = UsStandard1976().density(height)
    # Hydrostatic, but for the fall of gravity: 3 % of the pressure at 100 km.
    pressure = np.cumsum(air[::-1])[::-1] / np.sum(air)
    density = air
    if gas == "water":
        density = np.exp(np.interp(height, 1e3 * _WATER[:, 0], np.log(_WATER[:, 1])))
    values = density * pressure ** _PRESSURE_POWER[gas]
    return Layers(tuple(height.tolist()), tuple((values / values[0]).tolist()))


@lru_cache(maxsize=1)
def _table() -> Array:
    """(n, 8) rows of the file, its wavelengths in m."""
    table = np.loadtxt(assets.data() / "air_absorption.csv", delimiter=",", skiprows=1)
    table[:, 0] *= 1e-9
    return table


def _rows_at(wavelength: Array) -> IndexArray:
    """Rows of the table whose 5 nm hold wavelengths (n,)."""
    first = _table()[0, 0] - 0.5 * _TABLE_STEP
    places = np.floor((wavelength - first) / _TABLE_STEP + 1e-6).astype(np.intp)
    return np.asarray(np.clip(places, 0, len(_table()) - 1))


def _lines(gas: str, wavelength: Array) -> tuple[Array, Array]:
    """Mean and width of a gas's coefficients for its vertical column."""
    column = 2 + 2 * _GASES.index(gas)
    rows = _table()[_rows_at(wavelength)]
    return rows[:, column], rows[:, column + 1]


def _states(bands: Bands, index: int) -> _States:
    low, high = bands.edges[index]
    count = max(round((high - low) / _STEP), 1)
    points = low + (high - low) * (np.arange(count) + 0.5) / count
    photons = planck_radiance(points, SOLAR_TEMPERATURE) * points * bands.transmission(points)
    rows = _rows_at(points)
    share, depth = [], []
    for row in np.unique(rows):
        here = rows == row
        if not photons[here].any():
            continue
        wavelength = np.average(points[here], weights=photons[here])[None]
        weights, gases = _coefficients(wavelength)
        scattered = (
            rayleigh_depth(wavelength)[0],
            STANDARD.aerosol[1] * 550e-9 / wavelength[0],
            _table()[row, 1] * _OZONE_ATM_CM,
        )
        share.append(weights * np.sum(photons[here]))
        depth.append(np.column_stack([np.tile(scattered, (len(weights), 1)), gases]))
    shares = np.concatenate(share)
    return _States(shares / np.sum(shares), np.concatenate(depth))


def _coefficients(wavelength: Array) -> tuple[Array, Array]:
    """Shares (n,) of a piece of the spectrum (1,), and (n, 3) depths of the gases in each.

    Lines of different gases lie at random to each other.
    """
    shares, depths = np.ones(1), np.zeros((1, 0))
    for gas in _GASES:
        mean, width = (float(one[0]) for one in _lines(gas, wavelength))
        share, depth = np.ones(1), np.zeros(1)
        if mean > 0.0:
            share, depth = _spread(mean, width)
        count = len(shares)
        depths = np.column_stack([np.repeat(depths, len(share), axis=0), np.tile(depth, count)])
        shares = np.outer(shares, share).ravel()
    return shares, depths


@lru_cache(maxsize=2048)
def _spread(mean: float, width: float) -> tuple[Array, Array]:
    """Shares and values of the inverse Gaussian distribution of a mean and width * mean."""
    x, weight = np.polynomial.legendre.leggauss(_POINTS)
    place = np.concatenate([low + 0.5 * (high - low) * (x + 1.0) for low, high in _PARTS])
    share = np.concatenate([0.5 * (high - low) * weight for low, high in _PARTS])
    log_k = np.linspace(np.log(mean) - 25.0, np.log(mean) + 12.0, 1500)
    over = np.exp(log_k) / mean
    root = np.sqrt(width / over)
    # exp(2 width) times a vanishing share, by logarithms.
    second = np.exp(2.0 * width + scipy.special.log_ndtr(-root * (over + 1.0)))
    below = scipy.special.ndtr(root * (over - 1.0)) + second
    return share, np.exp(np.interp(place, np.maximum.accumulate(below), log_k))


def _terms(states: _States) -> _States:
    """The fewest terms that pass what the states pass."""
    terms = states
    for count in _TERMS:
        terms = _joined(states, count)
        if _misfit(states, terms) < _WITHIN:
            break
    return terms


def _passed(states: _States, *, wet: bool) -> Array:
    """(paths,) transmittance of paths of ``_PATHS`` columns, with the water or without."""
    depth = states.depth.sum(axis=1) - (0.0 if wet else states.depth[:, 3])
    return np.asarray(states.share @ np.exp(-np.outer(depth, _PATHS)))


def _misfit(states: _States, terms: _States) -> float:
    return max(
        float(np.abs(_passed(states, wet=wet) - _passed(terms, wet=wet)).max())
        for wet in (True, False)
    )


def _joined(states: _States, count: int) -> _States:
    """States that pass alike, joined in so many terms."""
    total = states.depth.sum(axis=1)
    passed = np.exp(-np.outer(total, _PATHS)).mean(axis=1)
    low, high = passed.min(), passed.max()
    bins = ((passed - low) / max(high - low, 1e-12) * count).astype(np.intp)
    share, depth = [], []
    for one in range(count):
        here = np.minimum(bins, count - 1) == one
        if not here.any():
            continue
        weight = states.share[here]
        # On a path that dims it by about e, light falls as that of the states together.
        typical = np.exp(np.average(np.log(total[here]), weights=weight))
        path = float(np.clip(1.0 / typical, _PATHS[0], 2.0))
        passes = np.average(np.exp(-path * total[here]), weights=weight)
        mean = np.average(states.depth[here], axis=0, weights=weight)
        absorbed = np.maximum(-np.log(passes) / path - mean[:2].sum(), 0.0)
        if mean[2:].sum() > 0.0:
            mean[2:] *= absorbed / mean[2:].sum()
        share.append(weight.sum())
        depth.append(mean)
    return _States(np.array(share), np.array(depth))
