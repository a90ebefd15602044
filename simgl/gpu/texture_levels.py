"""Textures of bytes with levels that were made before.

moderngl makes the levels of a texture by drawing them, which takes a software renderer three times
as long as all the rest of a large map's way to it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.arrays import Image8
from simgl.gpu.window_systems import opengl_function

# Of a level, that is half as wide and high as the one before, rounded down: by number of channels.
_INTERNAL_FORMATS = {1: 0x8229, 2: 0x822B, 3: 0x8051, 4: 0x8058}
_FORMATS = {1: 0x1903, 2: 0x8227, 3: 0x1907, 4: 0x1908}
_TEXTURE_2D, _MAX_LEVEL, _UNPACK_ALIGNMENT, _UNSIGNED_BYTE = 0x0DE1, 0x813D, 0x0CF5, 0x1401
_POINTER, _INT, _UINT = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint


class _OwnedTexture(moderngl.Texture):
    """A texture by the name of another one (``extra``), which is released with it."""

    def release(self) -> None:
        """Free its memory."""
        super().release()
        self.extra.release()


def texture_with_levels(ctx: moderngl.Context, levels: Sequence[Image8]) -> moderngl.Texture:
    """A texture of codes (h, w, channels) and its levels, filtered between two of them.

    levels : each half as wide and high as the one before, rounded down, but at least 1
    """
    height, width, channels = levels[0].shape
    # moderngl gives the first level memory before a driver can know of the others, and Mesa then
    # all of them once more: two and a half times the memory, and twice the time.
    owner = ctx.texture((1, 1), channels)
    owner.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    level_image = opengl_function("glTexImage2D", _UINT, *[_INT] * 5, _UINT, _UINT, _POINTER)
    parameter = opengl_function("glTexParameteri", _UINT, _UINT, _INT)
    unpacking = opengl_function("glPixelStorei", _UINT, _INT)
    # Bound, for functions of OpenGL 3.3. Whoever draws binds what it reads.
    owner.use()
    unpacking(_UNPACK_ALIGNMENT, 1)
    parameter(_TEXTURE_2D, _MAX_LEVEL, len(levels) - 1)
    for level, codes in enumerate(levels):
        values = np.ascontiguousarray(codes, dtype=np.uint8)
        level_image(
            _TEXTURE_2D,
            level,
            _INTERNAL_FORMATS[channels],
            values.shape[1],
            values.shape[0],
            0,
            _FORMATS[channels],
            _UNSIGNED_BYTE,
            values.ctypes.data,
        )
    texture = ctx.external_texture(owner.glo, (width, height), channels, 0, "f1")
    texture.__class__ = _OwnedTexture
    texture.extra = owner
    return texture
