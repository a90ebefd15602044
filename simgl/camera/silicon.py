"""Silicon: its band gap, and the dark current that follows from it."""

from __future__ import annotations

import numpy as np

# [eV K-1] CODATA 2018, exact.
_BOLTZMANN_EV = 8.617333262e-5

# Temperature at which dark currents are stated [K].
REFERENCE_TEMPERATURE = 300.0


def band_gap(temperature: float) -> float:
    """Of silicon [eV] at a temperature [K]: 1.1557 - 7.021e-4 T^2 / (T + 1108) (Varshni 1967)."""
    return 1.1557 - 7.021e-4 * temperature**2 / (temperature + 1108.0)


def _depletion_current(temperature: float) -> float:
    """T^1.5 exp(-E / 2kT) [K^1.5]."""
    exponent = band_gap(temperature) / (2.0 * _BOLTZMANN_EV * temperature)
    return float(temperature**1.5 * np.exp(-exponent))


def dark_current_ratio(temperature: float) -> float:
    """Dark current at a temperature [K] over that at 300 K.

    I(T) = b I(300) T^1.5 exp(-E / 2kT), thermal generation in the depletion region; b makes it 1 at
    300 K. Diffusion, which follows E rather than E / 2, takes over in real sensors somewhere above
    0 C: data sheets then say "doubles every 5 to 7 K", where this doubles every 8.
    """
    return _depletion_current(temperature) / _depletion_current(REFERENCE_TEMPERATURE)
