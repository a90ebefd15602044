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
882 nm, where the model has 7.0 kR in and between all bands from 700 to 900 nm.

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

# Wavelength [m], radiance at the zenith [R]. Continua and groups of bands are given at their mean
# wavelength, weighted by energy.
_GLOW = np.array(
    [
        (557.7e-9, 190.0),  # O I
        (589.3e-9, 47.0),  # Na
        (555e-9, 530.0),  # FeO and NO2, continuous
        (448e-9, 410.0),  # O2, Herzberg and Chamberlain, and continuous
        (648e-9, 800.0),  # OH and continuous
        (892e-9, 15000.0),  # OH, and O2 at 864 nm
    ]
)
_ABSORBED_BELOW = np.array([(762e-9, 5000.0)])  # O2
# Used in bands of a scenario alone; each line stands for a group of 30 to 60 nm.
_INFRARED = np.array(
    [
        *((1030e-9, 12e3), (1085e-9, 20e3), (1145e-9, 22e3), (1215e-9, 20e3), (1310e-9, 12e3)),
        *((1270e-9, 30e3), (1435e-9, 60e3), (1505e-9, 70e3), (1550e-9, 55e3), (1600e-9, 85e3)),
        *((1650e-9, 75e3), (1700e-9, 70e3), (1760e-9, 50e3), (1850e-9, 60e3), (1950e-9, 50e3)),
        *((2020e-9, 40e3), (2100e-9, 35e3), (2180e-9, 25e3), (2250e-9, 10e3)),
    ]
)
_INFRARED_ABSORBED_BELOW = np.array([(1270e-9, 150e3)])
# Below this wavelength oxygen's layer shines, above it hydroxyl's.
_HYDROXYL = 600e-9
# Continua and groups of lines are this wide [m].
_WIDTH = 50e-9
_LINES = (557.7e-9, 589.3e-9, 762e-9)


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
    lines = _GLOW if from_below else np.concatenate([_GLOW, _ABSORBED_BELOW])
    if bands != BANDS:
        absorbed = _INFRARED[:0] if from_below else _INFRARED_ABSORBED_BELOW
        lines = np.concatenate([lines, _INFRARED, absorbed])
    wavelength, rayleighs = lines.T
    radiance = rayleighs * RAYLEIGH * PLANCK * LIGHT_SPEED / wavelength
    if bands != BANDS:
        glow = _in_bands(wavelength, radiance, bands)
    else:
        within = ((wavelength >= low) & (wavelength < high) for low, high in BANDS.edges)
        glow = np.array([radiance[one].sum() for one in within])
    glow.flags.writeable = False
    return glow


def _in_bands(wavelength: Array, radiance: Array, bands: Bands) -> Array:
    """(4,) of lines and groups, those of continua and groups spread over their widths."""
    result = np.zeros(CHANNELS)
    for one, power in zip(wavelength.tolist(), radiance.tolist(), strict=True):
        # What the model gives in one number from 700 to 1000 nm is as wide as that.
        half = 0.0 if one in _LINES else {892e-9: 100e-9, 1270e-9: 8e-9}.get(one, 0.5 * _WIDTH)
        for index, (low, high) in enumerate(bands.edges):
            inside = float(low <= one < high)
            if half > 0.0:
                inside = max(min(high, one + half) - max(low, one - half), 0.0) / (2.0 * half)
            passed = float(bands.transmission(np.array([np.clip(one, low, high)]))[0])
            result[index] += power * inside * passed
    return result


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
