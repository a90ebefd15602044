"""Colour of a spectrum as the CIE 1931 2 deg observer sees it: chromaticity and lumens."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from simgl.arrays import Array

MAXIMUM_EFFICACY = (
    683.0  # [lm W-1] at 540 THz, exact by definition of the SI; at 555 nm within 1e-5
)

# Fine enough for a midpoint sum over the 5 nm table, whose curves are linear in between.
_STEP = 0.5e-9  # [m]


@lru_cache(maxsize=1)
def _observer() -> tuple[Array, Array]:
    """(n,) wavelength [m] and (n, 3) colour-matching functions."""
    table = np.loadtxt(Path(__file__).with_name("cie_1931_2deg.txt"))
    return table[:, 0] * 1e-9, table[:, 1:]


def tristimulus(wavelength: Array, power: Array) -> Array:
    """(3,) X, Y, Z of a spectrum, in the unit of ``power`` times metre; Y in watts of green light.

    wavelength : (n,) increasing [m]
    power : (n,) spectral power, radiance or irradiance, linear between its points, zero outside
    """
    table, curves = _observer()
    points = np.arange(table[0], table[-1], _STEP) + 0.5 * _STEP
    spectrum = np.interp(points, wavelength, power, left=0.0, right=0.0)
    seen = [np.sum(spectrum * np.interp(points, table, c)) * _STEP for c in curves.T]
    return np.array(seen)


def chromaticity(xyz: Array) -> Array:
    """(2,) x, y of tristimulus values (3,)."""
    return xyz[:2] / np.sum(xyz)


def luminous_efficacy(wavelength: Array, power: Array, total: float) -> float:
    """Lumens for each watt of a spectrum [lm W-1].

    wavelength, power : as for ``tristimulus``
    total : power over all wavelengths, in the unit of ``power`` times metre
    """
    return float(MAXIMUM_EFFICACY * tristimulus(wavelength, power)[1] / total)


def correlated_temperature(x: float, y: float) -> float:
    """Temperature of the black body nearest in colour [K], within a few kelvin from 4000 to 8000 K.

    McCamy (1992), Color Research & Application 17, 142.
    """
    n = (x - 0.3320) / (y - 0.1858)
    return float(-449.0 * n**3 + 3525.0 * n**2 - 6823.3 * n + 5520.33)
