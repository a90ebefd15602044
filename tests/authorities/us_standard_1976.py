"""Density of the air in the U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562), by height.

``DENSITIES`` as printed; ``density_by_integration`` from the standard's temperatures alone.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_simpson

from simgl.arrays import Array

# (geometric height [km], density [kg m-3])
DENSITIES = (
    (0.0, 1.2250),
    (10.0, 4.1351e-1),
    (20.0, 8.8910e-2),
    (30.0, 1.8410e-2),
    (40.0, 3.9957e-3),
    (50.0, 1.0269e-3),
    (60.0, 3.0968e-4),
    (70.0, 8.2829e-5),
    (80.0, 1.8458e-5),
    (90.0, 3.416e-6),
    (100.0, 5.604e-7),
    (110.0, 9.708e-8),
    (120.0, 2.222e-8),
)

# Geopotential heights [km] and temperatures [K] of the corners.
_CORNERS = (0.0, 11.0, 20.0, 32.0, 47.0, 51.0, 71.0, 84.852)
_TEMPERATURES = (288.15, 216.65, 216.65, 228.65, 270.65, 270.65, 214.65, 186.946)


def density_by_integration(height: Array) -> Array:
    """Of air in hydrostatic balance under a gravity that falls with height, up to 86 km [m]."""
    steps = np.linspace(0.0, 86e3, 8601)
    geopotential = 6356.766 * steps / (6356.766e3 + steps)
    temperature = np.interp(geopotential, _CORNERS, _TEMPERATURES)
    gravity = 9.80665 * (6356.766e3 / (6356.766e3 + steps)) ** 2
    slope = gravity * 28.9644 / (8314.32 * temperature)
    density = 1.225 * 288.15 / temperature
    density *= np.exp(-cumulative_simpson(slope, x=steps, initial=0.0))
    return np.exp(np.interp(height, steps, np.log(density)))
