"""The MTF of a camera by a slanted edge (ISO 12233), and what optics says that it has to be.

Nothing here is computed by simgl: diffraction of a circular pupil, a Gaussian and the pixel's
aperture are written out, and the edge is measured in the image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array

# Bins per pixel of the edge spread function (ISO 12233), and its length on each side [px].
_FINER, _HALF = 4, 32
# Radiation constants, to weight wavelengths: h c / k [m K].
_HC_OVER_K = 1.438777e-2
_SUN_KELVIN = 5777.0


@dataclass(frozen=True, kw_only=True)
class Edge:
    """A straight edge in an image, bright on the side that its normal points to.

    place : (2,) column and row of a point on it [px from the image's corner]
    normal : direction of its normal, from the columns' axis towards the rows' [rad]
    """

    place: Array
    normal: float

    def distance(self, columns: Array, rows: Array) -> Array:
        """Of the middles of pixels from the edge, positive on the bright side [px]."""
        across = columns + 0.5 - self.place[0], rows + 0.5 - self.place[1]
        return across[0] * np.cos(self.normal) + across[1] * np.sin(self.normal)


def system_mtf(
    frequency: Array,
    normal: float,
    *,
    f_number: float,
    pitch: float,
    blur: float,
    bands: list[tuple[float, float, float]],
) -> Array:
    """Contrast of electrons by frequency [cycles per pixel] across an edge.

    pitch : of the pixels [m]
    blur : standard deviation of the Gaussian [m]
    bands : lowest and highest wavelength [m], quantum efficiency

    Sunlight on a grey surface, 5777 K. A wavelength counts by its photons, whose number goes with
    lambda^-4 / (exp(hc / (lambda k T)) - 1).
    """
    total, light = np.zeros_like(frequency), 0.0
    for low, high, efficiency in bands:
        for wavelength in np.linspace(low, high, 61):
            photons = efficiency / (
                wavelength**4 * np.expm1(_HC_OVER_K / (wavelength * _SUN_KELVIN))
            )
            photons *= high - low
            share = np.minimum(frequency * wavelength * f_number / pitch, 1.0)
            total += (
                photons * 2.0 / np.pi * (np.arccos(share) - share * np.sqrt(1.0 - share * share))
            )
            light += photons
    pixel = np.sinc(frequency * np.cos(normal)) * np.sinc(frequency * np.sin(normal))
    return pixel * np.exp(-2.0 * (np.pi * blur / pitch * frequency) ** 2) * total / light


def edge_spread(frequency: Array, mtf: Array, distance: Array) -> Array:
    """Values of an edge from 0 to 1 at distances [px], by its MTF up to where that ends."""
    # 1/2 + the integral of MTF sin(2 pi f x) / (pi f).
    step = frequency[1] - frequency[0]
    table = np.linspace(-1.5 * _HALF, 1.5 * _HALF, 3001)
    kernel = 2.0 * table[:, None] * np.sinc(2.0 * frequency * table[:, None])
    weights = np.full(len(frequency), step)
    weights[[0, -1]] *= 0.5
    return np.interp(distance, table, 0.5 + kernel @ (weights * mtf))


def measured_edge(distance: Array, values: Array) -> tuple[Array, Array]:
    """Places of the bins across an edge [px] and the means of the pixels in them."""
    near = np.abs(distance) < _HALF
    bins = np.floor(distance[near] * _FINER).astype(int) + _HALF * _FINER
    size = 2 * _HALF * _FINER
    count = np.bincount(bins, minlength=size)
    assert count.min() > 0
    mean = np.bincount(bins, weights=values[near], minlength=size) / count
    return (np.arange(size) + 0.5) / _FINER - _HALF, mean


def measured_mtf(distance: Array, values: Array, frequency: Array) -> Array:
    """Modulation transfer function of the pixels around an edge, as ISO 12233 finds it."""
    place, mean = measured_edge(distance, values)
    line = 0.5 * (mean[2:] - mean[:-2]) * np.hamming(len(mean) - 2)
    phase = np.exp(-2j * np.pi * frequency[:, None] * place[1:-1])
    # The difference of second neighbours, and the width of the bins.
    response = np.sinc(2.0 * frequency / _FINER) * np.sinc(frequency / _FINER)
    return np.abs(phase @ line) / line.sum() / response
