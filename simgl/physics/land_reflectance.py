"""Reflectance of land from an image of it.

An image such as NASA's Blue Marble holds display values with more contrast than the ground has,
but with its hues: its linear light (inverse sRGB) has 1.29 times as much red as green in the mean
over land without snow, as the mean of MODIS's reflectances (Roy et al. 2016, Remote Sens. Environ.
176, 255). So a power of the brightness scales all three. It gives the sand of Libya-4, a site by
which satellites are calibrated, 0.45, 0.34, 0.24 in R, G and B, and steppe and cropland the albedo
that CERES sees of them through clear air. Snow, which such images darken, is scaled to up to 0.85.
The darkest land gets a floor of about 0.01: forest has 0.024, 0.040, 0.016. The near infrared is
estimated from the colours.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32, Image8

# Of linear light, and of reflectance.
_SAND_IN_IMAGES, _SAND = (0.619, 0.456, 0.254), (0.45, 0.34, 0.24)
_CONTRAST = 0.75
# Of linear light over the sand's, below which there is no telling from black.
_DARKEST = 1e-4
SNOW = 0.85
FLOOR = (0.008, 0.010, 0.008)
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
    of_sand = linear / in_images
    # Of red and green: blue is a third of the others and the most disturbed by the air.
    brightness = np.maximum(of_sand[..., :2].mean(axis=-1, keepdims=True), _DARKEST)
    bare = (sand - floor) * of_sand * brightness ** np.float32(_CONTRAST - 1.0) + floor
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
    # The floor is grey and says nothing of vegetation.
    excess = np.maximum((green - FLOOR[1]) - 0.85 * (red - FLOOR[0]), 0.0)
    greenness = 1.0 - np.exp(-8.0 * excess / (green + red))
    dimness = np.clip(1.0 - red / 0.35, 0.0, 1.0)
    snow = np.clip((blue - 0.3) / 0.3, 0.0, 1.0)
    bare = (1.29 - 0.44 * snow) * red
    return np.clip(bare + (0.10 + _GROWN * greenness) * dimness, 0.0, 0.95)
