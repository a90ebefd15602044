"""Light that the air itself gives off at night, in thin layers about 90 km up.

Round numbers for a quiet night away from the poles, in Rayleighs (1 R: 1e10 / (4 pi) photons
m-2 s-1 sr-1) towards the zenith. Green line: 250 R (190 R is the mean over Cerro Paranal: Noll et
al. 2012, A&A 543, A92). Sodium: 20 R in D1 (Slanger and Osterbrock 2000), 1.6 times as much in D2
(Slanger and Plane 2005). Molecular oxygen at 762 nm: 5 kR, swallowed by the oxygen beneath it.
Hydroxyl and what is continuous: what remains of the dark sky over Paranal, B 22.6, R 20.9, I 19.7
mag per square arcsecond (Patat 2003, A&A 400, 1183), less stars and zodiacal light, about a half in
B and R and a fifth in I. Real glow comes and goes by a factor of two within hours; red 630 nm light
from 250 km and aurorae are left out.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from simgl.physics.constants import LIGHT_SPEED, PLANCK
from simgl.physics.spectrum import BANDS

Array = NDArray[np.float64]

# Heights in each band between which it shines, evenly [m]: oxygen peaks at 94 to 97 km, hydroxyl,
# which is most of red and near infrared, at 87.
GLOW_BOTTOM = np.array([82e3, 91e3, 91e3, 82e3])
GLOW_TOP = GLOW_BOTTOM + 10e3

_RAYLEIGH = 1e10 / (4.0 * np.pi)  # [photons m-2 s-1 sr-1]

# Wavelength [m], radiance at the zenith [R].
_GLOW = np.array(
    [
        (557.7e-9, 250.0),  # O I
        (589.3e-9, 52.0),  # Na
        (550e-9, 250.0),  # NO2 and FeO, continuous
        (450e-9, 200.0),  # O2, Herzberg and Chamberlain
        (650e-9, 800.0),  # OH and continuous
        (870e-9, 9000.0),  # OH
    ]
)
_ABSORBED_BELOW = np.array([(762e-9, 5000.0)])  # O2


def zenith_glow(*, from_below: bool) -> Array:
    """(4,) radiance of the layers, looked at along the vertical [W m-2 sr-1].

    from_below : from the ground, which sees nothing of molecular oxygen's
    """
    lines = _GLOW if from_below else np.concatenate([_GLOW, _ABSORBED_BELOW])
    wavelength, rayleighs = lines.T
    radiance = rayleighs * _RAYLEIGH * PLANCK * LIGHT_SPEED / wavelength
    return np.array(
        [radiance[(wavelength >= low) & (wavelength < high)].sum() for low, high in BANDS.edges]
    )


def path_in_layers(radius: float, lowest: Array) -> Array:
    """(n, 4) length within each layer of one of the two passages of a line from space to space [m].

    radius : of the ground; lowest : (n,) heights of the line's lowest point [m]

    Over a layer's thickness, this is the factor of van Rhijn (1921) for a layer that is not thin.
    """
    rim = radius + np.asarray(lowest)[:, None]
    top, bottom = (
        np.sqrt(np.maximum((radius + h) ** 2 - rim**2, 0.0)) for h in (GLOW_TOP, GLOW_BOTTOM)
    )
    return np.asarray(top - bottom)


@lru_cache(maxsize=8)
def ground_irradiance(radius: float) -> Array:
    """(4,) of the layers on horizontal ground [W m-2], the air beneath it left out."""
    x, weights = np.polynomial.legendre.leggauss(64)
    cosine, weights = 0.5 * (x + 1.0), 0.5 * weights
    # A ray that leaves the ground at this cosine would pass at radius * sine, so deep below it.
    path = path_in_layers(radius, radius * (np.sqrt(1.0 - cosine**2) - 1.0))
    factor = 2.0 * np.pi * ((weights * cosine) @ path) / (GLOW_TOP - GLOW_BOTTOM)
    found = np.asarray(factor * zenith_glow(from_below=True))
    found.flags.writeable = False
    return found
