"""Airglow: light emitted by the upper atmosphere at night, in thin layers about 90 km up.

Values are radiances towards the zenith, away from the poles, at mean solar activity (130 solar flux
units), in rayleighs (1 R = 1e10 / (4 pi) photons m-2 s-1 sr-1). Source: ESO's sky model for Cerro
Paranal (Noll et al. 2012, A&A 543, A92; Jones et al. 2013, A&A 560, A91), accurate to 20 %. From
its moonless zenith sky (tables of the package pydiet) these are subtracted: zodiacal light of
60 S10, as at the ecliptic pole (Leinert et al. 1998, A&AS 127, 1); the lines at 630 and 636 nm,
which are emitted at 250 km; and in B, G and R 5 % for scattered starlight. At 70 and 200 flux units
the model gives 0.7 and 1.35 times as much in B, G and R, 0.9 and 1.1 times in N. Real airglow
varies by a factor of two within hours. Aurorae are not modelled.

Other measurements: the green line 250 R over Japan (Vyas and Saraswat 2012) and 320 R in North
America (Johnston 1992, thesis); the latter also gives 4.4 kR in six hydroxyl bands at 728 to
882 nm, where the model has 7.0 kR in and between all bands from 700 to 900 nm. Below 400 nm there
is no value here.

Beyond 1 um hydroxyl is a hundred times brighter. Its bands (Delta v = 2 from 1.4 to 2.3 um) and
oxygen at 1.27 um are estimates: 400 kR from 1.5 to 1.8 um after the H band's 13.9 mag arcsec-2
(Ramsay et al. 1992, MNRAS 259, 751), the others by the relative strengths of the bands (Meinel).

Oxygen below the layers absorbs their light at 762 nm, so no ground-based sky model contains it. The
5 kR used here are a rounded value whose source could not be verified.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import LIGHT_SPEED, PLANCK
from simgl.physics.spectrum import BANDS, CHANNELS, Bands

# Bottom of the layer in each band, and its depth [m]; it is uniform. Oxygen emission peaks at 94 to
# 97 km, hydroxyl, which dominates red and near infrared, at 87 km.
GLOW_BOTTOM = np.array([82e3, 91e3, 91e3, 82e3])
GLOW_DEPTH = 10e3

RAYLEIGH = 1e10 / (4.0 * np.pi)  # [photons m-2 s-1 sr-1]

# Wavelength [nm], radiance at the zenith [R], and between which wavelengths it is spread [nm]:
# lines over none; continua and groups of bands, at their mean wavelength weighted by energy, over
# all that the model gives in one number.
_Rows = tuple[tuple[float, float, float, float], ...]
_GLOW: _Rows = (
    (557.7, 190.0, 557.7, 557.7),  # O I
    (589.3, 47.0, 589.3, 589.3),  # Na
    (555.0, 530.0, 500.0, 600.0),  # FeO and NO2, continuous
    (448.0, 410.0, 400.0, 500.0),  # O2, Herzberg and Chamberlain, and continuous
    (648.0, 800.0, 600.0, 700.0),  # OH and continuous
    (838.3, 7000.0, 700.0, 900.0),  # OH, and O2 at 864 nm
    (945.0, 8000.0, 900.0, 1000.0),  # OH
)
_ABSORBED_BELOW: _Rows = ((762.0, 5000.0, 762.0, 762.0),)  # O2
# Used in bands of a scenario alone; each row but oxygen's at 1270 nm stands for a group.
_GROUPS = (
    *((1030.0, 12e3), (1085.0, 20e3), (1145.0, 22e3), (1215.0, 20e3), (1310.0, 12e3)),
    *((1435.0, 60e3), (1505.0, 70e3), (1550.0, 55e3), (1600.0, 85e3), (1650.0, 75e3)),
    *((1700.0, 70e3), (1760.0, 50e3), (1850.0, 60e3), (1950.0, 50e3), (2020.0, 40e3)),
    *((2100.0, 35e3), (2180.0, 25e3), (2250.0, 10e3)),
)
_INFRARED: _Rows = (
    *((middle, glow, middle - 25.0, middle + 25.0) for middle, glow in _GROUPS),
    (1270.0, 30e3, 1262.0, 1278.0),
)
_INFRARED_ABSORBED_BELOW: _Rows = ((1270.0, 150e3, 1262.0, 1278.0),)
# Below this wavelength oxygen's layer shines, above it hydroxyl's.
_HYDROXYL = 600e-9


def glow_bottom(bands: Bands = BANDS) -> Array:
    """(4,) height of the layer's bottom in each band [m]."""
    if bands == BANDS:
        return GLOW_BOTTOM
    middle = bands.channel_edges.mean(axis=1)
    return np.where(middle < _HYDROXYL, GLOW_BOTTOM[1], GLOW_BOTTOM[0])


@lru_cache(maxsize=16)
def zenith_glow(*, from_below: bool, bands: Bands = BANDS) -> Array:
    """(4,) radiance of the layers along the vertical [W m-2 sr-1].

    from_below : seen from the ground, without the 762 nm line that the air below absorbs
    """
    rows = _GLOW if from_below else (*_GLOW, *_ABSORBED_BELOW)
    if bands != BANDS:
        absorbed = () if from_below else _INFRARED_ABSORBED_BELOW
        rows = (*rows, *_INFRARED, *absorbed)
    glow = np.zeros(CHANNELS)
    for wavelength, rayleighs, low, high in rows:
        power = rayleighs * RAYLEIGH * PLANCK * LIGHT_SPEED / (1e-9 * wavelength)
        for index in range(len(bands.edges)):
            glow[index] += power * _passed(bands, index, 1e-9 * low, 1e-9 * high)
    glow.flags.writeable = False
    return glow


def _passed(bands: Bands, index: int, low: float, high: float) -> float:
    """Fraction of what is spread evenly from ``low`` to ``high`` [m] that comes through a band."""
    if low == high:
        begin, end = bands.edges[index]
        return float(bands.transmission(np.array(low))) if begin <= low < end else 0.0
    middle = bands.steps(index)
    half = 0.5 * (bands.edges[index][1] - bands.edges[index][0]) / len(middle)
    inside = np.minimum(middle + half, high) - np.maximum(middle - half, low)
    return float(np.maximum(inside, 0.0) @ bands.transmission(middle)) / (high - low)


def path_in_layers(radius: float, lowest: Array, bands: Bands = BANDS) -> Array:
    """(n, 4) path length of a line of sight in each layer, for one of its two crossings [m].

    radius : of the ground [m]
    lowest : (n,) heights of the line's lowest point [m]

    Divided by the layer's thickness, this is van Rhijn's factor (1921) for a layer of finite
    thickness.
    """
    rim = radius + np.asarray(lowest)[:, None]
    low = glow_bottom(bands)
    top, bottom = (
        np.sqrt(np.maximum((radius + h) ** 2 - rim**2, 0.0)) for h in (low + GLOW_DEPTH, low)
    )
    return top - bottom


@lru_cache(maxsize=8)
def ground_irradiance(radius: float, bands: Bands = BANDS) -> Array:
    """(4,) irradiance of horizontal ground by the layers [W m-2], without the air below them.

    radius : of the ground [m]
    """
    x, weights = np.polynomial.legendre.leggauss(64)
    cosine, weights = 0.5 * (x + 1.0), 0.5 * weights
    # The straight line through the ground at this zenith angle has its lowest point at the radius
    # radius * sine, below the ground.
    path = path_in_layers(radius, radius * (np.sqrt(1.0 - cosine**2) - 1.0), bands)
    factor = 2.0 * np.pi * ((weights * cosine) @ path) / GLOW_DEPTH
    irradiance = factor * zenith_glow(from_below=True, bands=bands)
    irradiance.flags.writeable = False
    return irradiance
