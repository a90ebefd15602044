"""The Moon's surface as a law of reflection, fitted to the light of the whole disc.

Radiance at cosine of incidence mu0 and of emergence mu, under the Sun's band irradiance E:

    L = E 2 p / pi  f(alpha)  mu0 / (mu0 + mu)

The disc function is Lommel and Seeliger's, which gives the full Moon its flat disc; f makes the sum
over the disc follow the measured phase curve; p is the geometric albedo.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# V: the full Moon's -12.74 at 384,400 km (Allen's Astrophysical Quantities, 4th ed., section 12)
# against the Sun's -26.76 at 1 au (Willmer 2018, ApJS 236, 47) over a disc of 1737.4 km.
_ALBEDO_V = 10.0 ** (-0.4 * (26.76 - 12.74)) * (384_400.0 / 1737.4) ** 2
# Other bands over V: the slope of the disc's reflectance, by the phase-free terms of the lunar
# irradiance model of Kieffer & Stone (2005, AJ 129, 2887), table 4, read at the bands' middles.
GEOMETRIC_ALBEDO = _ALBEDO_V * np.array([1.22, 1.0, 0.81, 1.44])

# The measured curve reaches to crescents of two days; f is held from here on [rad].
_LAST_PHASE = np.radians(150.0)


def disc_brightness(phase: float) -> float:
    """Light of the disc at a phase angle [rad] over that of the full Moon: Allen (1976).

    Without the opposition surge: a smooth law through 0.
    """
    degrees = np.degrees(abs(phase))
    return float(10.0 ** (-0.4 * (0.026 * degrees + 4e-9 * degrees**4)))


def _lommel_seeliger_disc(phase: float) -> float:
    """The same of a sphere that follows mu0 / (mu0 + mu) alone."""
    half = 0.5 * abs(phase)
    if half < 1e-6:
        return 1.0
    return float(1.0 + np.sin(half) * np.tan(half) * np.log(np.tan(0.5 * half)))


def surface_factor(phase: float) -> float:
    """f of the module's law at a phase angle [rad]."""
    held = min(abs(phase), _LAST_PHASE)
    return disc_brightness(held) / _lommel_seeliger_disc(held)
