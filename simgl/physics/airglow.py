"""Light that the air itself gives off at night, in thin layers about 90 km up.

Towards the zenith, away from the poles, at the Sun's mean activity (130 solar flux units), in
Rayleighs (1 R: 1e10 / (4 pi) photons m-2 s-1 sr-1). From ESO's model of the sky over Cerro Paranal
(Noll et al. 2012, A&A 543, A92; Jones et al. 2013, A&A 560, A91), good to 20 %: its moonless sky at
the zenith, by way of the tables in the package pydiet, less zodiacal light of 60 S10, as at the
ecliptic's pole (Leinert et al. 1998, A&AS 127, 1), less the lines at 630 and 636 nm, which shine
250 km up, and in B, G and R less a twentieth for scattered starlight. At 70 and 200 units it has
0.7 and 1.35 times as much in B, G and R, 0.9 and 1.1 in N; real glow comes and goes by a factor of
two within hours. Aurorae are left out.

Measured elsewhere: the green line 250 R over Japan (Vyas and Saraswat 2012), 320 R in North America
(Johnston 1992, thesis), who has 4.4 kR in six bands of hydroxyl at 728 to 882 nm, where the model
has 7.0 kR in and between all bands from 700 to 900 nm.

The oxygen beneath swallows its own light at 762 nm, which no sky of the ground shows: 5 kR is a
round figure whose source could not be checked.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import LIGHT_SPEED, PLANCK
from simgl.physics.spectrum import BANDS

# Heights in each band between which it shines, evenly [m]: oxygen peaks at 94 to 97 km, hydroxyl,
# which is most of red and near infrared, at 87.
GLOW_BOTTOM = np.array([82e3, 91e3, 91e3, 82e3])
GLOW_TOP = GLOW_BOTTOM + 10e3

_RAYLEIGH = 1e10 / (4.0 * np.pi)  # [photons m-2 s-1 sr-1]

# Wavelength [m], radiance at the zenith [R]. What is continuous or a crowd of bands stands at its
# mean wavelength, weighed by energy.
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
    return top - bottom


@lru_cache(maxsize=8)
def ground_irradiance(radius: float) -> Array:
    """(4,) of the layers on horizontal ground [W m-2], the air beneath it left out."""
    x, weights = np.polynomial.legendre.leggauss(64)
    cosine, weights = 0.5 * (x + 1.0), 0.5 * weights
    # A ray that leaves the ground at this cosine would pass at radius * sine, so deep below it.
    path = path_in_layers(radius, radius * (np.sqrt(1.0 - cosine**2) - 1.0))
    factor = 2.0 * np.pi * ((weights * cosine) @ path) / (GLOW_TOP - GLOW_BOTTOM)
    found = factor * zenith_glow(from_below=True)
    found.flags.writeable = False
    return found
