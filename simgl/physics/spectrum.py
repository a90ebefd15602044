"""Bands and spectra: light of a black body in each band, in watts and photons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.physics.constants import BOLTZMANN, LIGHT_SPEED, PLANCK, STEFAN_BOLTZMANN

# One number per band, R, G, B, N.
PerBand = tuple[float, float, float, float]

# Gauss-Legendre of this order integrates Planck's law over a 300 nm band to better than 1e-12.
_ORDER = 48

# Lines that stand for a continuous spectrum [m], 0.1 nm apart: 0.5 % of a filter of 20 nm with
# vertical edges.
_LINE_EDGES: Array = np.linspace(400e-9, 1000e-9, 6001)
_LINE_MIDDLES: Array = 0.5 * (_LINE_EDGES[1:] + _LINE_EDGES[:-1])


@dataclass(frozen=True)
class Bands:
    """Four wavelength intervals, stored in the order of the R, G, B, N channels.

    names : channel names
    edges : (4, 2) lower and upper wavelength [m]
    """

    names: tuple[str, str, str, str] = ("R", "G", "B", "N")
    edges: tuple[tuple[float, float], ...] = (
        (600e-9, 700e-9),
        (500e-9, 600e-9),
        (400e-9, 500e-9),
        (700e-9, 1000e-9),
    )


BANDS = Bands()


@dataclass(frozen=True, eq=False)
class BandLight:
    """Light per band, in watts and in photons.

    irradiance : (4,) [W m-2]
    photons_per_joule : (4,) photons per joule of this spectrum in each band [J-1]
    """

    irradiance: Array
    photons_per_joule: Array

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

    @property
    def band_shares(self) -> Array:
        """(4,) share of the full power in each band."""
        band = band_of(self.wavelength)
        return np.array([self.share[band == index].sum() for index in range(4)])


def band_of(wavelength: Array, bands: Bands = BANDS) -> IndexArray:
    """(n,) index of the band of each wavelength [m], -1 for none; an edge belongs to the band
    above it, and the last one to the band below."""
    result = np.full(np.shape(wavelength), -1)
    last = max(high for _, high in bands.edges)
    for index, (low, high) in enumerate(bands.edges):
        within = (wavelength >= low) & (wavelength < high)
        result[within | ((wavelength == high) & (high == last))] = index
    return result


def lines_of(wavelength: Array, power: Array) -> LineSpectrum:
    """A spectrum that is linear between points.

    wavelength : (n,) increasing [m]
    power : (n,) per wavelength interval, in any unit
    """
    points = np.unique(np.concatenate([_LINE_EDGES, wavelength]))
    values = np.interp(points, wavelength, power, left=0.0, right=0.0)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(points))])
    share = np.diff(np.interp(_LINE_EDGES, points, summed)) / summed[-1]
    return LineSpectrum(_LINE_MIDDLES, share)


def black_body_lines(temperature: float) -> LineSpectrum:
    """A black body of a temperature [K]."""
    total = STEFAN_BOLTZMANN * temperature**4 / np.pi
    power = planck_radiance(_LINE_MIDDLES, temperature) * np.diff(_LINE_EDGES)
    return LineSpectrum(_LINE_MIDDLES, power / total)


def planck_radiance(wavelength: Array, temperature: float) -> Array:
    """Spectral radiance of a black body [W m-2 sr-1 m-1] at wavelength [m], temperature [K]."""
    first = 2.0 * PLANCK * LIGHT_SPEED**2 / wavelength**5
    exponent = PLANCK * LIGHT_SPEED / (wavelength * BOLTZMANN * temperature)
    return first / np.expm1(exponent)


def _nodes(edges: tuple[float, float]) -> tuple[Array, Array]:
    x, w = np.polynomial.legendre.leggauss(_ORDER)
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
    for edges in bands.edges:
        wavelength, weight = _nodes(edges)
        power = weight * planck_radiance(wavelength, temperature)
        share.append(np.sum(power))
        photons.append(np.sum(power * wavelength) / (PLANCK * LIGHT_SPEED))
    # sigma T^4 / pi is the radiance over all wavelengths.
    total = STEFAN_BOLTZMANN * temperature**4 / np.pi
    return BandLight(
        irradiance=total_irradiance / total * np.array(share),
        photons_per_joule=np.array(photons) / np.array(share),
    )


def photon_mean(wavelength: Array, value: Array, temperature: float, bands: Bands = BANDS) -> Array:
    """(4,) mean of a tabulated curve over each band, weighted by a black body's photons.

    wavelength : (n,) increasing [m]
    value : (n,) the curve, linear between its points and zero outside
    temperature : of the black body [K]
    """
    means = []
    for low, high in bands.edges:
        # 1 nm resolves the corners of any datasheet curve.
        points = np.arange(low, high, 1e-9) + 0.5e-9
        photons = planck_radiance(points, temperature) * points
        curve = np.interp(points, wavelength, value, left=0.0, right=0.0)
        means.append(np.sum(photons * curve) / np.sum(photons))
    return np.array(means)
