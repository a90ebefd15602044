"""Sea surface: roughness by wind, Fresnel reflection of the sky, foam, water-leaving light."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.earth_spectra import even_reflectance, foam_reflectance
from simgl.physics.spectral_form import scaled
from simgl.physics.spectrum import BANDS, Bands

# Reflectance of clear ocean water without surface reflection, R, G, B, N: pi times the
# remote-sensing reflectance at a chlorophyll concentration of 0.1 mg m-3 (Morel and Maritorena
# 2001, values for 412 to 670 nm averaged over the bands); water is black beyond 700 nm.
CLEAR_WATER = np.array([0.0008, 0.0065, 0.022, 0.0])
WATER_INDEX = 1.34
# Reflectance of flat water at normal incidence, F0 of Schlick's approximation.
SCHLICK = 0.021
# Reflectance of foam: visible (Koepke 1984), and half of that in the near infrared.
FOAM = np.array([0.22, 0.22, 0.22, 0.11])


def wave_slope_variance(wind: float) -> float:
    """Mean square slope of the sea, sum of both components (Cox and Munk 1954).

    wind : speed 12.5 m above the sea [m s-1]
    """
    return 0.003 + 0.00512 * wind


def fresnel(cosine: Array) -> Array:
    """Reflectance of flat water for unpolarised light at cosines of incidence."""
    c = np.asarray(cosine)
    g = np.sqrt(WATER_INDEX**2 - 1.0 + c * c)
    b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return 0.5 * ((g - c) / (g + c)) ** 2 * (1.0 + b * b)


def mirrored(variance: float, cosine: float) -> tuple[float, float, float]:
    """Reflection of the sky by waves: reflectance for a uniform sky, and elevation of what is seen.

    variance : mean square slope
    cosine : of the view's zenith angle
    returns : reflectance; mean and standard deviation of the sine of the reflected elevation

    Slopes are normally distributed and weighted by their visible area (Cox and Munk 1954). All
    slopes are assumed equally hidden by other waves; rays reflected below the horizon count as
    coming from the horizon.
    """
    slopes = np.linspace(-4.5, 4.5, 181) * np.sqrt(0.5 * variance)
    x, y = np.meshgrid(slopes, slopes, indexing="ij")
    length = np.sqrt(1.0 + x * x + y * y)
    view = np.array([np.sqrt(1.0 - cosine * cosine), cosine])
    incidence = np.maximum((view[1] - x * view[0]) / length, 0.0)
    seen = np.exp(-(x * x + y * y) / variance) * incidence * length
    sent = seen * fresnel(incidence)
    height = np.maximum(2.0 * incidence / length - view[1], 0.0)
    mean = np.sum(sent * height) / np.sum(sent)
    spread = np.sqrt(np.sum(sent * (height - mean) ** 2) / np.sum(sent))
    return float(np.sum(sent) / np.sum(seen)), float(mean), float(spread)


@lru_cache(maxsize=8)
def mirror_laws(variance: float) -> Array:
    """(3, 4) coefficients of cubics in the view's cosine that fit ``mirrored``.

    The first is the cosine with which Schlick's approximation gives the reflectance; the others are
    mean and standard deviation of the reflected elevation's sine.

    variance : mean square slope
    """
    angles = np.concatenate([np.arange(0.5, 30.0, 2.5), np.arange(30.0, 90.0, 5.0)])
    cosines = np.sin(np.radians(angles))
    mirror = np.array([mirrored(variance, c) for c in cosines])
    share = np.maximum((mirror[:, 0] - SCHLICK) / (1.0 - SCHLICK), 0.0)
    # Weighted by the relative change of the reflectance.
    weight = np.maximum(share, 1e-4) ** 0.8 / mirror[:, 0]
    powers = np.vander(cosines, 4, increasing=True)
    laws = [np.linalg.lstsq(powers * weight[:, None], (1.0 - share**0.2) * weight, rcond=None)[0]]
    laws += [np.linalg.lstsq(powers, heights, rcond=None)[0] for heights in mirror.T[1:]]
    return np.array(laws)


def foam_cover(wind: float) -> float:
    """Fraction of the sea under foam (Monahan and O'Muircheartaigh 1980); wind [m s-1]."""
    return float(min(3.84e-6 * wind**3.41, 1.0))


def clear_water(bands: Bands = BANDS) -> Array:
    """(4,) diffuse reflectance of water without foam and Fresnel reflection."""
    return scaled(CLEAR_WATER.tolist(), even_reflectance, bands)


def foam_in_bands(bands: Bands = BANDS) -> Array:
    """(4,) diffuse reflectance of foam."""
    return scaled(FOAM.tolist(), foam_reflectance, bands)
