"""What people see of radiance in bands: its white, and its colours as linear sRGB."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgl.arrays import Array32, Image8
from simgl.physics.spectrum import BANDS, Bands, black_body_light

# Displayed as white, R G B: a white surface that faces a 5777 K Sun of 1367 W m-2 [W m-2 sr-1].
WHITE_RADIANCE = np.array([154.4, 174.8, 171.9], dtype=np.float32) / np.float32(np.pi)

# Linear sRGB of the bands R G B over those of the white: exact for sunlight and for sunlight that
# molecules scattered, and for other spectra least squares (CIE 1931 observer, adapted to the Sun).
SRGB_FROM_RGBN = np.array(
    [[0.816, 0.253, -0.069], [-0.109, 1.166, -0.057], [-0.042, -0.011, 1.053]], dtype=np.float32
)


# Of an image that is displayed, at a time: what it takes in between stays small, and in the cache.
_STRIP_PIXELS = 2**18


def in_strips(display: Callable[[Array32], Image8], image: Array32) -> Image8:
    """What a function of single pixels makes of an image (height, width, ...), strip by strip."""
    rows = max(_STRIP_PIXELS // max(image.shape[1], 1), 1)
    strips = [display(image[top : top + rows]) for top in range(0, len(image), rows)]
    return np.concatenate(strips) if len(strips) != 1 else strips[0]


def shown_channels(bands: Bands) -> list[int]:
    """The channels shown as red, green and blue: the first three; the last one fills up fewer."""
    return [min(channel, len(bands.edges) - 1) for channel in range(3)]


def white_radiance(bands: Bands) -> Array32:
    """(3,) radiance of ``shown_channels`` that is displayed as white [W m-2 sr-1]."""
    if bands == BANDS:
        return WHITE_RADIANCE
    sunlight = black_body_light(1367.0, 5777.0, bands).irradiance / np.pi
    return sunlight[shown_channels(bands)].astype(np.float32)


def srgb_from_bands(bands: Bands) -> Array32:
    """(3, 3) linear sRGB of ``shown_channels`` over those of the white."""
    return SRGB_FROM_RGBN if bands == BANDS else np.eye(3, dtype=np.float32)
