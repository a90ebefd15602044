"""The sea's roughness by wind, its foam, and the light that comes out of the water."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array

# Reflectance of clear ocean water without its surface, R, G, B, N: pi times the remote-sensing
# reflectance at a chlorophyll concentration of 0.1 mg m-3 (Morel and Maritorena 2001, their figures
# for 412 to 670 nm, averaged over the bands); water is black beyond 700 nm.
CLEAR_WATER = np.array([0.0008, 0.0065, 0.022, 0.0])
WATER_INDEX = 1.34
# Of flat water straight down, the foot of Schlick's form of Fresnel's law.
SCHLICK = 0.021
# Of foam, in the visible (Koepke 1984); half of it in the near infrared.
FOAM = np.array([0.22, 0.22, 0.22, 0.11])


def wave_slope_variance(wind: float) -> float:
    """Mean square slope of the sea, both components together (Cox and Munk 1954).

    wind : 12.5 m above the sea [m s-1]
    """
    return 0.003 + 0.00512 * wind


def fresnel(cosine: Array) -> Array:
    """Reflectance of flat water for unpolarised light at cosines of incidence."""
    c = np.asarray(cosine)
    g = np.sqrt(WATER_INDEX**2 - 1.0 + c * c)
    b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return 0.5 * ((g - c) / (g + c)) ** 2 * (1.0 + b * b)


def mirrored(variance: float, cosine: float) -> tuple[float, float, float]:
    """What waves mirror of the sky: the share of an even sky, and where that comes from.

    variance : mean square slope; cosine : of the view from the vertical
    returns : reflectance; mean and standard deviation of the sine of the height over the horizon of
        what is mirrored

    Slopes are normally distributed; each counts as it is seen (Cox and Munk 1954). Waves before it
    hide all of them alike, and what is sent below the horizon comes from there.
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
    """(3, 4) coefficients of cubics in the view's cosine: what Schlick's form takes as the cosine
    to give the reflectance of ``mirrored``, and the two heights there."""
    angles = np.concatenate([np.arange(0.5, 30.0, 2.5), np.arange(30.0, 90.0, 5.0)])
    cosines = np.sin(np.radians(angles))
    found = np.array([mirrored(variance, c) for c in cosines])
    share = np.maximum((found[:, 0] - SCHLICK) / (1.0 - SCHLICK), 0.0)
    # An error counts as it shows: by what it changes of the reflectance, in parts.
    weight = np.maximum(share, 1e-4) ** 0.8 / found[:, 0]
    powers = np.vander(cosines, 4, increasing=True)
    laws = [np.linalg.lstsq(powers * weight[:, None], (1.0 - share**0.2) * weight, rcond=None)[0]]
    laws += [np.linalg.lstsq(powers, heights, rcond=None)[0] for heights in found.T[1:]]
    return np.array(laws)


def foam_cover(wind: float) -> float:
    """Share of the sea under foam (Monahan and O'Muircheartaigh 1980); wind [m s-1]."""
    return float(min(2.95e-6 * wind**3.52, 1.0))


def water_body(wind: float) -> Array:
    """(4,) reflectance of water and foam, the mirror of the surface left out."""
    foam = foam_cover(wind)
    return (1.0 - foam) * CLEAR_WATER + foam * FOAM
