"""Bands and spectra: light of a black body in each band, in watts and photons."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.physics.constants import (
    BOLTZMANN,
    LIGHT_SPEED,
    PLANCK,
    SOLAR_TEMPERATURE,
    STEFAN_BOLTZMANN,
)

# One number per channel: of the bands R, G, B, N, or of a scenario's bands and 0 beyond them.
PerBand = tuple[float, float, float, float]

# Wavelengths [nm], increasing, and values.
Curve = tuple[tuple[float, ...], tuple[float, ...]]

CHANNELS = 4

# What bands may hold [nm].
SHORTEST_NM, LONGEST_NM = 300.0, 2500.0

# Gauss-Legendre of this order integrates Planck's law over a 300 nm band to better than 1e-12.
_ORDER = 48

# Distance of the lines that stand for a continuous spectrum [m]: 0.5 % of a filter of 20 nm with
# vertical edges.
_LINE_STEP = 1e-10
_FEWEST_LINES = 200
# Of a narrow band, in numerical integrals.
_FEWEST_STEPS = 20


@dataclass(frozen=True)
class Bands:
    """One to four wavelength intervals, which do not overlap, in the first channels of an image.

    names : of the channels
    edges : (bands, 2) lower and upper wavelength [m]
    filter : transmission before the first surface of the camera, linear between its points and 0
        outside; what is stored of light is what passes it. None for 1 everywhere
    """

    names: tuple[str, ...] = ("R", "G", "B", "N")
    edges: tuple[tuple[float, float], ...] = (
        (600e-9, 700e-9),
        (500e-9, 600e-9),
        (400e-9, 500e-9),
        (700e-9, 1000e-9),
    )
    filter: Curve | None = None

    @property
    def channel_edges(self) -> Array:
        """(4, 2) edges of each channel [m]; one without a band has those of the last band."""
        return np.array([*self.edges, *[self.edges[-1]] * (CHANNELS - len(self.edges))])

    @property
    def edges_nm(self) -> str:
        """The names with their edges [nm]."""
        return ", ".join(
            f"{name} {1e9 * low:.10g}-{1e9 * high:.10g}"
            for name, (low, high) in zip(self.names, self.edges, strict=True)
        )

    def transmission(self, wavelength: Array) -> Array:
        """(n,) of the filter at wavelengths [m]."""
        if self.filter is None:
            return np.ones(np.shape(wavelength))
        nm, value = self.filter
        return np.interp(wavelength * 1e9, nm, value, left=0.0, right=0.0)

    def nodes(self, index: int) -> tuple[Array, Array]:
        """Gauss-Legendre nodes [m] of a band, and their weights [m] times the transmission."""
        low, high = self.edges[index]
        within = () if self.filter is None else [1e-9 * nm for nm in self.filter[0]]
        corners = [low, *(corner for corner in within if low < corner < high), high]
        parts = [_nodes(edges) for edges in pairwise(corners)]
        wavelength = np.concatenate([x for x, _ in parts])
        weight = np.concatenate([w for _, w in parts])
        return wavelength, weight * self.transmission(wavelength)

    def steps(self, index: int) -> Array:
        """(n,) middles of equal steps of about 1 nm in a band [m], which resolve the corners of
        any data sheet's curve."""
        low, high = self.edges[index]
        step = round((high - low) / max(round((high - low) * 1e9), _FEWEST_STEPS), 15)
        return np.asarray(np.arange(low, high - 0.5 * step, step) + 0.5 * step)

    def photon_mean_of(self, curve: Curve, temperature: float = SOLAR_TEMPERATURE) -> PerBand:
        """Means of a curve, weighted by the photons of sunlight; its ends hold beyond them.

        Detectors count photons; a mean by watts differs by 1 % where a reflectance changes by a
        third over a band of 700 nm.

        temperature : of the black body that stands for the Sun [K]
        """
        means = []
        for index in range(len(self.edges)):
            points = self.steps(index)
            photons = planck_radiance(points, temperature) * points * self.transmission(points)
            value = np.interp(points * 1e9, *curve)
            means.append(float(np.sum(photons * value) / np.sum(photons)))
        return channels(means)

    def of_rgbn(self, values: Sequence[float], temperature: float = SOLAR_TEMPERATURE) -> PerBand:
        """Means of reflectances, transmissions or efficiencies given in the bands R, G, B, N.

        The values hold all over their bands, that of B also below 400 nm and that of N beyond
        1000 nm.

        temperature : of the black body that weights the wavelengths [K]
        """
        if self == BANDS:
            return channels(values)
        return self.photon_mean_of(rgbn_curve(values), temperature)

    def power_of_rgbn(self, power: Sequence[float]) -> PerBand:
        """Power, or radiance, of light given in the bands R, G, B, N, in which it is even.

        No light outside 400 to 1000 nm.
        """
        if self == BANDS:
            return channels(power)
        result = []
        for index in range(len(self.edges)):
            points = self.steps(index)
            width = (self.edges[index][1] - self.edges[index][0]) / len(points)
            band = band_of(points)
            density = np.array([p / (b - a) for p, (a, b) in zip(power, BANDS.edges, strict=True)])
            lit = np.where(band < 0, 0.0, density[band]) * self.transmission(points)
            result.append(float(np.sum(lit) * width))
        return channels(result)


BANDS = Bands()


def channels(values: Iterable[float]) -> PerBand:
    """One number per channel from one to four; 0 in channels without a band."""
    given = [float(value) for value in values]
    a, b, c, d = *given, *[0.0] * (CHANNELS - len(given))
    return a, b, c, d


def rgbn_curve(values: Sequence[float]) -> Curve:
    """The curve over wavelength [nm] that numbers for the bands R, G, B, N stand for."""
    r, g, b, n = (float(v) for v in values)
    # A step of 1e-6 nm at each border.
    return (500.0 - 1e-6, 500.0, 600.0 - 1e-6, 600.0, 700.0 - 1e-6, 700.0), (b, g, g, r, r, n)


@dataclass(frozen=True, eq=False)
class BandLight:
    """Light per band, in watts and in photons.

    irradiance : (4,) [W m-2]
    photons_per_joule : (4,) photons per joule of this spectrum in each band [J-1]
    bands : the bands; channels without one hold zeros
    """

    irradiance: Array
    photons_per_joule: Array
    bands: Bands = BANDS

    @property
    def photon_irradiance(self) -> Array:
        """(4,) [photons s-1 m-2]."""
        return self.irradiance * self.photons_per_joule


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """Light as lines; a continuous spectrum is many of them.

    wavelength : (n,) [m]
    share : (n,) of the light's full power in each; what lies in no band is left out
    """

    wavelength: Array
    share: Array

    def band_shares(self, bands: Bands = BANDS) -> Array:
        """(4,) share of the full power in each band."""
        band = band_of(self.wavelength, bands)
        return np.array([self.share[band == index].sum() for index in range(CHANNELS)])

    def through_filter(self, bands: Bands) -> LineSpectrum:
        """What passes the filter of the bands."""
        return replace(self, share=self.share * bands.transmission(self.wavelength))


def band_of(wavelength: Array, bands: Bands = BANDS) -> IndexArray:
    """(n,) index of the band of each wavelength [m], -1 for none; an edge belongs to the band
    above it, and the last one to the band below."""
    result = np.full(np.shape(wavelength), -1)
    last = max(high for _, high in bands.edges)
    for index, (low, high) in enumerate(bands.edges):
        within = (wavelength >= low) & (wavelength < high)
        result[within | ((wavelength == high) & (high == last))] = index
    return result


def _line_edges(bands: Bands) -> Array:
    """(n,) edges of the lines that stand for a continuous spectrum [m]."""
    low, high = min(a for a, _ in bands.edges), max(b for _, b in bands.edges)
    return np.linspace(low, high, max(round((high - low) / _LINE_STEP), _FEWEST_LINES) + 1)


def lines_of(wavelength: Array, power: Array, bands: Bands = BANDS) -> LineSpectrum:
    """A spectrum that is linear between points, from the first to the last of the bands.

    wavelength : (n,) increasing [m]
    power : (n,) per wavelength interval, in any unit
    """
    edges = _line_edges(bands)
    points = np.unique(np.concatenate([edges, wavelength]))
    values = np.interp(points, wavelength, power, left=0.0, right=0.0)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(points))])
    share = np.diff(np.interp(edges, points, summed)) / summed[-1]
    return LineSpectrum(0.5 * (edges[1:] + edges[:-1]), share)


def black_body_lines(temperature: float, bands: Bands = BANDS) -> LineSpectrum:
    """A black body of a temperature [K], from the first to the last of the bands."""
    total = STEFAN_BOLTZMANN * temperature**4 / np.pi
    edges = _line_edges(bands)
    middles = 0.5 * (edges[1:] + edges[:-1])
    power = planck_radiance(middles, temperature) * np.diff(edges)
    return LineSpectrum(middles, power / total)


def planck_radiance(wavelength: Array, temperature: float) -> Array:
    """Spectral radiance of a black body [W m-2 sr-1 m-1] at wavelength [m], temperature [K]."""
    first = 2.0 * PLANCK * LIGHT_SPEED**2 / wavelength**5
    exponent = PLANCK * LIGHT_SPEED / (wavelength * BOLTZMANN * temperature)
    return first / np.expm1(exponent)


@cache
def _unit_nodes() -> tuple[Array, Array]:
    x, w = np.polynomial.legendre.leggauss(_ORDER)
    return x, w


def _nodes(edges: tuple[float, float]) -> tuple[Array, Array]:
    x, w = _unit_nodes()
    low, high = edges
    half = 0.5 * (high - low)
    return low + half * (x + 1.0), half * w


def black_body_light(
    total_irradiance: float, temperature: float, bands: Bands = BANDS
) -> BandLight:
    """Light of a black body.

    total_irradiance : over all wavelengths [W m-2]
    temperature : [K]
    """
    share, photons = [], []
    for index in range(len(bands.edges)):
        wavelength, weight = bands.nodes(index)
        power = weight * planck_radiance(wavelength, temperature)
        share.append(np.sum(power))
        photons.append(np.sum(power * wavelength) / (PLANCK * LIGHT_SPEED))
    # sigma T^4 / pi is the radiance over all wavelengths.
    total = STEFAN_BOLTZMANN * temperature**4 / np.pi
    return BandLight(
        irradiance=total_irradiance / total * np.array(channels(share)),
        photons_per_joule=np.array(channels(np.array(photons) / np.array(share))),
        bands=bands,
    )


def photon_mean(wavelength: Array, value: Array, temperature: float, bands: Bands = BANDS) -> Array:
    """(4,) mean of a tabulated curve over each band, weighted by a black body's photons.

    wavelength : (n,) increasing [m]
    value : (n,) the curve, linear between its points and zero outside
    temperature : of the black body [K]
    """
    means = []
    for index in range(len(bands.edges)):
        points = bands.steps(index)
        photons = planck_radiance(points, temperature) * points * bands.transmission(points)
        curve = np.interp(points, wavelength, value, left=0.0, right=0.0)
        means.append(np.sum(photons * curve) / np.sum(photons))
    return np.array(channels(means))
