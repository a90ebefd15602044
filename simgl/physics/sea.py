"""The sea's roughness by wind, its foam, and the light that comes out of the water."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Reflectance of clear ocean water without its surface, R, G, B, N: pi times the remote-sensing
# reflectance at a chlorophyll concentration of 0.1 mg m-3 (Morel and Maritorena 2001, their figures
# for 412 to 670 nm, averaged over the bands); water is black beyond 700 nm.
CLEAR_WATER = np.array([0.0008, 0.0065, 0.022, 0.0])
# Of foam, in the visible (Koepke 1984); half of it in the near infrared.
FOAM = np.array([0.22, 0.22, 0.22, 0.11])


def wave_slope_variance(wind: float) -> float:
    """Mean square slope of the sea, both components together (Cox and Munk 1954).

    wind : 12.5 m above the sea [m s-1]
    """
    return 0.003 + 0.00512 * wind


def foam_cover(wind: float) -> float:
    """Share of the sea under foam (Monahan and O'Muircheartaigh 1980); wind [m s-1]."""
    return float(min(2.95e-6 * wind**3.52, 1.0))


def water_body(wind: float) -> NDArray[np.float64]:
    """(4,) reflectance of water and foam, the mirror of the surface left out."""
    foam = foam_cover(wind)
    return (1.0 - foam) * CLEAR_WATER + foam * FOAM
