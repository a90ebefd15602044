"""Reflectance of land from a picture of it.

A picture such as NASA's Blue Marble holds display values. Linear light (inverse sRGB) times 0.6
puts the Sahara near 0.45, 0.29, 0.16 in red, green, blue, as surface-reflectance products of MODIS
have it; snow, which the pictures hold back, gets up to 0.85, and the darkest land a floor of some
0.02, below which no forest goes. The near infrared is not in a picture and is guessed from its
colours.
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
    # Only snow and salt are bright in blue.
    t = np.clip((linear[..., 2:] - 0.35) / 0.4, 0.0, 1.0)
    bright = BRIGHTNESS + (SNOW - BRIGHTNESS) * t * t * (3.0 - 2.0 * t)
    return np.asarray(
        bright * linear + np.array(FLOOR, dtype=np.float32) * (1.0 - linear), dtype=np.float32
    )


def near_infrared(rgb: Array32) -> Array32:
    """(...,) reflectance 700-1000 nm guessed from (..., 3) red, green, blue of land.

    Soil and sand are a little brighter than in red, snow a little darker; leaves, which are greener
    than red and dark, reach 0.25 to 0.4.
    """
    red, green, blue = np.moveaxis(rgb, -1, 0)
    # Without the floor, which is grey.
    excess = np.maximum((green - FLOOR[1]) - 0.85 * (red - FLOOR[0]), 0.0)
    greenness = 1.0 - np.exp(-8.0 * excess / (green + red))
    dimness = np.clip(1.0 - red / 0.35, 0.0, 1.0)
    snow = np.clip((blue - 0.3) / 0.3, 0.0, 1.0)
    return np.clip((1.15 - 0.3 * snow) * red + 0.5 * greenness * dimness, 0.0, 0.95)
