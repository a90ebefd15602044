"""Radiance and differences as pictures for people."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from simgl.arrays import Array, Image8

# Full red and full blue: simgl brighter or darker by this much.
_FULL = 0.3
_SCALE = 3


def shown(radiance: Array, white: ArrayLike) -> Image8:
    """(height, width, 3) sRGB of R, G, B radiance; so much of each [W m-2 sr-1] is white."""
    linear = np.clip(radiance / np.asarray(white), 0.0, 1.0)
    low, high = 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, low, high) * 255.0 + 0.5, dtype=np.uint8)


def signed(relative: Array) -> Image8:
    """Red where simgl is brighter, blue where it is darker, white where they agree."""
    rest = 1.0 - np.clip(np.abs(relative) / _FULL, 0.0, 1.0)
    red, blue = np.where(relative > 0.0, 1.0, rest), np.where(relative < 0.0, 1.0, rest)
    return np.asarray(np.stack([red, rest, blue], axis=2) * 255.0 + 0.5, dtype=np.uint8)


def in_a_row(*images: Image8) -> Image8:
    """Pictures in a row, each pixel three wide."""
    row = np.hstack(images)
    return np.asarray(np.kron(row, np.ones((_SCALE, _SCALE, 1), dtype=np.uint8)), dtype=np.uint8)


def write_png(path: Path, *images: Image8) -> None:
    """Pictures in a row as a file."""
    Image.fromarray(in_a_row(*images)).save(path)
