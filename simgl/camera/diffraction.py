"""Diffraction of a circular pupil: optical transfer function with defocus, and Airy tail."""

from __future__ import annotations

from functools import cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.spectrum import BANDS, Bands, planck_radiance

# Gauss-Legendre nodes per band: the mean of the transfer function is accurate to 1e-6.
_WAVELENGTHS = 5
# Nodes over the common area of two shifted pupils: accurate to 1e-7 up to 40 waves of defocus.
_PUPIL_NODES = 64


def diffraction_mtf(share: Array) -> Array:
    """MTF of a circular pupil.

    share : spatial frequency over the cut-off 1 / (lambda N)

    2 / pi (acos r - r sqrt(1 - r^2)), and 0 beyond the cut-off (Goodman, Introduction to Fourier
    Optics, 6.3).
    """
    r = np.minimum(np.abs(share), 1.0)
    return 2.0 / np.pi * (np.arccos(r) - r * np.sqrt(1.0 - r * r))


def defocus_otf(share: Array, waves: float) -> Array:
    """Optical transfer function of a circular pupil with ``waves`` of defocus at its edge.

    share : spatial frequency over the cut-off 1 / (lambda N)

    Autocorrelation of the pupil with the path difference 4 r x (Hopkins 1955). With the pupils'
    centres 2 r apart: 4 / pi of the integral over x from 0 to 1 - r of
    sqrt(1 - (x + r)^2) cos(2 pi waves 4 r x). Negative where contrast is reversed.
    """
    if waves == 0.0:
        return diffraction_mtf(share)
    r = np.minimum(np.abs(share), 1.0)
    node, weight = _pupil_nodes()
    # x = (1 - r) (1 - u^2) removes the infinite slope of the root at the end.
    u = 0.5 * (node + 1.0)
    total = np.zeros_like(r)
    for at, share_of_sum in zip(u, 0.5 * weight, strict=True):
        x = (1.0 - r) * (1.0 - at * at)
        height = np.sqrt(np.maximum(1.0 - (x + r) ** 2, 0.0))
        total += share_of_sum * height * np.cos(8.0 * np.pi * waves * r * x) * 2.0 * at
    return 4.0 / np.pi * (1.0 - r) * total


@cache
def _pupil_nodes() -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(_PUPIL_NODES)


def band_wavelengths(temperature: float, bands: Bands = BANDS) -> tuple[Array, Array]:
    """Quadrature nodes: wavelengths (4, n) [m] and their fractions (4, n) of a band's photons.

    Photons, not power, make electrons. Within a band a filter counts as even.

    temperature : of the black body that emits the light [K]
    """
    node, weight = np.polynomial.legendre.leggauss(_WAVELENGTHS)
    edges = bands.channel_edges
    middle, half = edges.mean(axis=1, keepdims=True), 0.5 * np.diff(edges, axis=1)
    wavelengths = middle + half * node
    photons = weight * wavelengths * planck_radiance(wavelengths, temperature)
    return wavelengths, photons / photons.sum(axis=1, keepdims=True)


def airy_tail(wavelength: float, f_number: float, pitch: float) -> float:
    """Far field of a point's image, averaged over the rings: pixel share times r^3, r in pixels.

    lambda N / (pi^3 p) with the pixel pitch p, from the cusp of the MTF at frequency 0.
    """
    return wavelength * f_number / (np.pi**3 * pitch)
