"""Diffraction of a circular pupil: optical transfer function with defocus, and Airy tail."""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.camera.spectral_response import ResponseCurve
from simgl.physics.spectrum import BANDS, CHANNELS, Bands, planck_radiance

# Nodes per band: the mean of the transfer function over one of 100 nm is accurate to 1e-6.
_WAVELENGTHS = 5
# Of a polynomial on half the width of a band: where it is smaller, all light is at its roots.
_ONE_PLACE = 1e-6
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


@lru_cache(maxsize=16)
def band_wavelengths(
    temperature: float, bands: Bands = BANDS, pixels: tuple[ResponseCurve, ...] = ()
) -> tuple[Array, Array]:
    """Quadrature nodes: wavelengths (4, n) [m] and their fractions (4, n) of a band's electrons.

    Gauss' rule for the photons that pass the filter of the bands and make electrons: exact for
    polynomials of the degree 2 n - 1 in the wavelength, however the response varies in a band.

    temperature : of the black body that emits the light [K]
    pixels : responses, whose sum counts; none where photons of all wavelengths count alike
    """
    rules = []
    for index in range(len(bands.edges)):
        wavelength = bands.steps(index)
        photons = wavelength * planck_radiance(wavelength, temperature)
        photons = photons * bands.transmission(wavelength)
        electrons = photons * sum((pixel.at(wavelength) for pixel in pixels), np.zeros(1))
        rules.append(_gauss_rule(wavelength, electrons if electrons.any() else photons))
    rules += rules[-1:] * (CHANNELS - len(rules))
    nodes, shares = (np.stack(each) for each in zip(*rules, strict=True))
    nodes.flags.writeable = shares.flags.writeable = False
    return nodes, shares


def _gauss_rule(places: Array, weights: Array) -> tuple[Array, Array]:
    """(n,) nodes and (n,) fractions of a sum over weighted places.

    By the recurrence of their orthogonal polynomials (Stieltjes), whose matrix has the nodes as
    eigenvalues (Golub and Welsch 1969).
    """
    middle, half = 0.5 * (places[0] + places[-1]), 0.5 * (places[-1] - places[0])
    x = (places - middle) / half
    share = weights / weights.sum()
    before, now = np.zeros_like(x), np.ones_like(x)
    diagonal, off_diagonal = [], [0.0]
    for _ in range(_WAVELENGTHS):
        diagonal.append(float(np.sum(share * x * now * now)))
        following = (x - diagonal[-1]) * now - off_diagonal[-1] * before
        off_diagonal.append(float(np.sqrt(np.sum(share * following**2))))
        if off_diagonal[-1] < _ONE_PLACE:
            break
        before, now = now, following / off_diagonal[-1]
    matrix = np.diag(diagonal) + np.diag(off_diagonal[1 : len(diagonal)], 1)
    nodes, vectors = np.linalg.eigh(matrix + np.triu(matrix, 1).T)
    # Of so few places, the last one stands for those that are missing.
    missing = _WAVELENGTHS - len(nodes)
    return (
        np.pad(middle + half * nodes, (0, missing), mode="edge"),
        np.pad(vectors[0] ** 2, (0, missing)),
    )


def airy_tail(wavelength: float, f_number: float, pitch: float) -> float:
    """Far field of a point's image, averaged over the rings: pixel share times r^3, r in pixels.

    lambda N / (pi^3 p) with the pixel pitch p, from the cusp of the MTF at frequency 0.
    """
    return wavelength * f_number / (np.pi**3 * pitch)
