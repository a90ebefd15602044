"""Reflectance of land from an image of it.

An image such as NASA's Blue Marble holds display values with more contrast than the ground has, and
so with stronger colours: the red dunes of the Simpson Desert have 4 times as much red as green in
its linear light (inverse sRGB). So each channel is a power of that. The power gives steppe and
cropland the albedo that CERES sees of them through clear air.

Each channel is scaled by the sand of Libya-4, by whose light at the top of the air satellites are
calibrated (Chaity et al. 2021, Remote Sens. 13, 1538; Guo et al. 2024, Remote Sens. 16, 1406).
There it is 0.45, 0.34, 0.25 and 0.58 in R, G, B and N. Under simgl's clear air with the Sun 20 to
45 deg from the zenith that takes 0.47, 0.355, 0.207 and 0.587 on the ground. B is then 0.44 of R;
in the image, from which its makers took the air, it is 0.41.

Snow, which such images darken, is scaled to up to 0.85. The darkest land gets a floor of about
0.01, most in blue, of which the image has half of what leaves have: tropical forests get 0.026,
0.040, 0.019, a canopy of leaves has 0.027, 0.050, 0.020 (spectra.csv). The near infrared is
estimated from the colours.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32, Image8

# Of linear light, and of reflectance.
_SAND_IN_IMAGES, _SAND = (0.619, 0.456, 0.254), (0.47, 0.355, 0.207)
_CONTRAST = 0.75
# Of linear light over the sand's, below which there is no telling from black.
_DARKEST = 1e-4
SNOW = 0.85
FLOOR = (0.008, 0.010, 0.012)
_GROWN = 0.18


def linear_from_srgb(code: Image8) -> Array32:
    """Linear light 0..1 of 8-bit sRGB values."""
    v = np.arange(256) / 255.0
    table = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4).astype(np.float32)
    return table[code]


def reflectance_from_display(code: Image8) -> Array32:
    """(..., 3) reflectance in red, green, blue of 8-bit sRGB values."""
    linear = linear_from_srgb(code)
    sand, in_images = np.array(_SAND, dtype=np.float32), np.array(_SAND_IN_IMAGES, dtype=np.float32)
    floor = np.array(FLOOR, dtype=np.float32)
    of_sand = np.maximum(linear / in_images, _DARKEST)
    bare = (sand - floor) * of_sand ** np.float32(_CONTRAST) + floor
    # Only snow and salt have a high reflectance in blue.
    t = np.clip((linear[..., 2:] - 0.35) / 0.4, 0.0, 1.0)
    snow = t * t * (3.0 - 2.0 * t)
    return np.asarray(bare + (SNOW * linear - bare) * snow, dtype=np.float32)


def near_infrared(rgb: Array32) -> Array32:
    """(...,) reflectance of land at 700-1000 nm, estimated from its (..., 3) R, G, B.

    Sand is brighter than in red, snow slightly darker. Dark land has some leaves or grass; more
    where it is greener than red: 0.25 to 0.4.
    """
    red, green, blue = np.moveaxis(rgb, -1, 0)
    # The floor says nothing of vegetation.
    excess = np.maximum((green - FLOOR[1]) - 0.82 * (red - FLOOR[0]), 0.0)
    greenness = 1.0 - np.exp(-10.0 * excess / (green + red))
    dimness = np.clip(1.0 - red / 0.35, 0.0, 1.0)
    snow = np.clip((blue - 0.3) / 0.3, 0.0, 1.0)
    bare = (1.25 - 0.40 * snow) * red
    return np.clip(bare + (0.10 + _GROWN * greenness) * dimness, 0.0, 0.95)
