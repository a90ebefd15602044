"""Radiance and differences as pictures for people."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from simgl.arrays import Array, Image8
from simgl.display_colours import WHITE_RADIANCE

# Full red and full blue: simgl brighter or darker by this much.
_FULL = 0.3
_SCALE = 3


def shown(radiance: Array, gain: float) -> Image8:
    """(height, width, 3) sRGB of R, G, B radiance; white at 1 / gain of a sunlit white plate."""
    linear = np.clip(radiance * gain / WHITE_RADIANCE, 0.0, 1.0)
    low, high = 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, low, high) * 255.0 + 0.5, dtype=np.uint8)


def signed(relative: Array) -> Image8:
    """Red where simgl is brighter, blue where it is darker, white where they agree."""
    rest = 1.0 - np.clip(np.abs(relative) / _FULL, 0.0, 1.0)
    red, blue = np.where(relative > 0.0, 1.0, rest), np.where(relative < 0.0, 1.0, rest)
    return np.asarray(np.stack([red, rest, blue], axis=2) * 255.0 + 0.5, dtype=np.uint8)


def write_png(path: Path, *images: Image8) -> None:
    """Pictures side by side, each pixel three wide."""
    row = np.hstack(images)
    Image.fromarray(np.kron(row, np.ones((_SCALE, _SCALE, 1), dtype=np.uint8))).save(path)
