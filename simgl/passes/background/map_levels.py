"""Maps of the whole Earth as bytes, with the levels that their textures have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import moderngl
import numpy as np
from PIL import Image

from simgl.arrays import Array32, Image8
from simgl.disk_cache import Arrays, computed_once
from simgl.gpu.texture_levels import texture_with_levels

# (h, w, channels) codes of a map, and its halvings down to one texel.
MapLevels = tuple[Image8, ...]


# Rows of a smaller map that are made together: what lies between fits a core's cache, and no memory
# that is new to the process has to be cleared for it.
_ROWS = 16


def map_levels(codes: Image8) -> MapLevels:
    """A map with its halvings.

    Each is the mean of the map's own texels, rounded once: means of rounded means drift.
    """
    return (codes, *(_rounded(means) for means in halvings(codes)))


def halvings(values: Image8 | Array32) -> Iterator[Array32]:
    """Means of a map (h, w, channels) in half the size each, down to one texel."""
    while values.shape[:2] != (1, 1):
        values = _half(values)
        yield values


def _rounded(means: Array32) -> Image8:
    codes = np.empty(means.shape, dtype=np.uint8)
    for start in range(0, len(means), _ROWS):
        codes[start : start + _ROWS] = np.round(means[start : start + _ROWS])
    return codes


def _half(values: Image8 | Array32) -> Array32:
    """Means over the texels of a map of half the width and height, rounded down, at least 1."""
    height, width, channels = values.shape
    size = max(width // 2, 1), max(height // 2, 1)
    if height % 2 == width % 2 == 0:
        # Of bytes in integers, at a third of the time.
        summed = np.uint16 if values.dtype == np.uint8 else np.float32
        half = np.empty((size[1], size[0], channels), dtype=np.float32)
        for start in range(0, size[1], _ROWS):
            part = values[2 * start : 2 * (start + _ROWS)]
            rows = np.add(part[0::2], part[1::2], dtype=summed)
            np.multiply(rows[:, 0::2] + rows[:, 1::2], 0.25, out=half[start : start + _ROWS])
        return half
    planes = np.moveaxis(values, -1, 0).astype(np.float32)
    halves = [Image.fromarray(plane).resize(size, Image.Resampling.BOX) for plane in planes]
    return np.stack([np.asarray(half) for half in halves], axis=-1)


def map_once(
    made_by: Sequence[str],
    inputs: object,
    make: Callable[[], Image8],
    levels: Callable[[Image8], MapLevels] = map_levels,
) -> MapLevels:
    """(h, 2 h, channels) codes of a map with its halvings, computed once on a machine.

    made_by : as for ``simgl.disk_cache.computed_once``, this module among them
    levels : the halvings of a map
    """

    def computed() -> Arrays:
        return {f"level_{k}": codes for k, codes in enumerate(levels(make()))}

    return tuple(computed_once("earth", made_by, inputs, computed, _are_levels).values())


def _are_levels(arrays: Arrays) -> bool:
    height, width, channels = arrays["level_0"].shape
    if width != 2 * height:
        return False
    for k in range(len(arrays)):
        codes = arrays[f"level_{k}"]
        if codes.dtype != np.uint8 or codes.shape != (height, width, channels):
            return False
        height, width = max(height // 2, 1), max(width // 2, 1)
    return codes.shape[:2] == (1, 1)


def size_of(levels: MapLevels) -> int:
    """Bytes of a map, for caches."""
    return sum(codes.nbytes for codes in levels)


def map_texture(ctx: moderngl.Context, levels: MapLevels) -> moderngl.Texture:
    """An equirectangular map as a texture that joins at 180 deg."""
    texture = texture_with_levels(ctx, levels)
    texture.repeat_x, texture.repeat_y = True, False
    return texture


def level_texture(ctx: moderngl.Context, levels: MapLevels, level: int) -> moderngl.Texture:
    """A halving of a map alone, or its smallest."""
    texture = map_texture(ctx, levels[min(level, len(levels) - 1) :][:1])
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    return texture
