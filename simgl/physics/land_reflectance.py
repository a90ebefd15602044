"""Reflectance of land from an image of it.

An image such as NASA's Blue Marble holds display values. Linear light (inverse sRGB) times 0.6
gives the Sahara 0.45, 0.29, 0.16 in R, G, B, as MODIS surface-reflectance products do. Snow, which
such images darken, is scaled to up to 0.85. The darkest land gets a floor of about 0.02, the lowest
reflectance of forest. The near infrared is estimated from the colours.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32, Image8

BRIGHTNESS = 0.6
SNOW = 0.85
FLOOR = (0.018, 0.022, 0.016)


def linear_from_srgb(code: Image8) -> Array32:
    """Linear light 0..1 of 8-bit sRGB values."""
    v = np.arange(256) / 255.0
    table = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4).astype(np.float32)
    return table[code]


def reflectance_from_display(code: Image8) -> Array32:
    """(..., 3) reflectance in red, green, blue of 8-bit sRGB values."""
    linear = linear_from_srgb(code)
    # Only snow and salt have a high reflectance in blue.
    t = np.clip((linear[..., 2:] - 0.35) / 0.4, 0.0, 1.0)
    bright = BRIGHTNESS + (SNOW - BRIGHTNESS) * t * t * (3.0 - 2.0 * t)
    return np.asarray(
        bright * linear + np.array(FLOOR, dtype=np.float32) * (1.0 - linear), dtype=np.float32
    )


def near_infrared(rgb: Array32) -> Array32:
    """(...,) reflectance of land at 700-1000 nm, estimated from its (..., 3) R, G, B.

    Soil and sand are slightly brighter than in red, snow slightly darker. Vegetation, which is dark
    and greener than red, gets 0.25 to 0.4.
    """
    red, green, blue = np.moveaxis(rgb, -1, 0)
    # The floor is grey and says nothing of vegetation.
    excess = np.maximum((green - FLOOR[1]) - 0.85 * (red - FLOOR[0]), 0.0)
    greenness = 1.0 - np.exp(-8.0 * excess / (green + red))
    dimness = np.clip(1.0 - red / 0.35, 0.0, 1.0)
    snow = np.clip((blue - 0.3) / 0.3, 0.0, 1.0)
    return np.clip((1.15 - 0.3 * snow) * red + 0.5 * greenness * dimness, 0.0, 0.95)
