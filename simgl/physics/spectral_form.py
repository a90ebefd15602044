"""Surfaces with values in R, G, B, N and a spectrum of which the form counts, in other bands.

Within each of R, G, B and N the spectrum is scaled to the value there; what lies below 400 nm goes
with B, what lies beyond 1000 nm with N. So bands that are R, G, B and N give the values back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from simgl.arrays import Array
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.spectrum import BANDS, CHANNELS, Bands, planck_radiance

# Reflectance at wavelengths (n,) [nm].
Form = Callable[[Array], Array]


def photon_shares(bands: Bands, index: int) -> tuple[Array, Array]:
    """Wavelengths (n,) [nm] in a band, and their shares of its photons of sunlight."""
    points = bands.steps(index)
    photons = planck_radiance(points, SOLAR_TEMPERATURE) * points * bands.transmission(points)
    return points * 1e9, photons / np.sum(photons)


def parts_of_form(form: Form, bands: Bands) -> tuple[Array, Array]:
    """(4,) means of a spectrum over R, G, B, N; (4, 4) the parts of its means over the bands (rows)
    that lie in each of them."""
    of_default = (photon_shares(BANDS, k) for k in range(CHANNELS))
    wide = np.array([np.sum(form(nm) * share) for nm, share in of_default])
    parts = np.zeros((CHANNELS, CHANNELS))
    for index in range(len(bands.edges)):
        nm, share = photon_shares(bands, index)
        # R, G, B, N of a wavelength.
        of = np.select([nm < 500.0, nm < 600.0, nm < 700.0], [2, 1, 0], 3)
        for k in range(CHANNELS):
            parts[index, k] = np.sum((form(nm) * share)[of == k])
    return wide, parts


def scaled(values: Sequence[float], form: Form, bands: Bands) -> Array:
    """(4,) reflectance in the bands of a surface with a spectrum and values in R, G, B, N.

    form : its reflectance, of which only the form counts
    """
    if bands == BANDS:
        return np.array(values)
    wide, parts = parts_of_form(form, bands)
    return np.asarray(parts @ (np.array(values) / wide))
