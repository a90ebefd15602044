"""The images of spacecraft on the GPU: one array of layers for each kind, uploaded once."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from simgl.arrays import IndexArray
from simgl.lru_cache import MANY, LruCache
from simgl.scene.textures import MIRROR, REPEAT, Image, SurfaceTextures

# Texture unit of each array of images in the programs that draw surfaces.
BASE_COLOUR_UNIT = 12
IMAGE_UNITS = {
    "base_colour_images": BASE_COLOUR_UNIT,
    "law_images": 13,
    "normal_images": 14,
    "emission_images": 15,
}
_EMPTY = Image(values=np.zeros((1, 1, 1), dtype=np.float16))


def resampled(image: Image, width: int, height: int) -> NDArray[np.float16]:
    """(height, width, channels) the image at another size.

    Linear between the middles of its texels, and across its edges as it wraps; the mean over the
    texels that fall into one where it shrinks.
    """
    values = image.values
    if values.shape[:2] == (height, width):
        return values
    columns, left = _and_around(values.shape[1], width, image.wrap[0])
    rows, above = _and_around(values.shape[0], height, image.wrap[1])
    inner = (left, above, left + values.shape[1], above + values.shape[0])
    channels = []
    for channel in np.moveaxis(values.astype(np.float32), -1, 0):
        source = Pillow.fromarray(channel[np.ix_(rows, columns)])
        small = source.resize((width, height), Pillow.Resampling.BILINEAR, box=inner)
        channels.append(np.asarray(small))
    return np.stack(channels, axis=-1).astype(np.float16)


def _and_around(count: int, wanted: int, wrap: int) -> tuple[IndexArray, int]:
    """Texels along one axis and those past its ends, which the filter needs; and how many those."""
    more = 1 + max(1, -(-count // wanted))
    index = np.arange(-more, count + more)
    if wrap == REPEAT:
        index %= count
    if wrap == MIRROR:
        index %= 2 * count
        index = np.minimum(index, 2 * count - 1 - index)
    return np.clip(index, 0, count - 1), more


# Of a palette, texel by texel the colours of parts, whose middles are looked up: as many texels at
# most along an edge, and so many in place of each where the size changes. A middle then mixes with
# 1/32 of its neighbours.
_PALETTE, _FINE = 32, 16


def _edge(sizes: Sequence[int]) -> int:
    """Texels along an edge of an array of images with so many: a power of two."""
    smallest = _power_of_two(max(sizes))
    changed = [_FINE * size for size in sizes if size <= _PALETTE and size not in (1, smallest)]
    return _power_of_two(max([smallest, *changed]))


def _power_of_two(size: int) -> int:
    return 1 << (size - 1).bit_length()


# Of the arrays that stay on the GPU; each model counts a little more than its size, so that their
# number is bounded.
MAX_BYTES = 1 << 30
_MORE_BYTES = 1 << 20


class TextureStore:
    """Arrays of images by the content of a model's images."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._arrays = LruCache[str, tuple[moderngl.TextureArray, ...]](
            MANY, _release, max_bytes=MAX_BYTES
        )

    def bind(self, textures: SurfaceTextures) -> None:
        """Bind all four arrays to their units."""
        kinds = textures.base_colour, textures.law, textures.normal, textures.emission
        arrays = self._arrays.get(
            textures.digest, lambda: tuple(self._array(images) for images in kinds), _size
        )
        for array, unit in zip(arrays, IMAGE_UNITS.values(), strict=True):
            array.use(unit)

    def _array(self, images: tuple[Image, ...]) -> moderngl.TextureArray:
        """All images of a kind at one size, a power of two, so that each level halves the last."""
        images = images or (_EMPTY,)
        width = _edge([image.values.shape[1] for image in images])
        height = _edge([image.values.shape[0] for image in images])
        content = b"".join(resampled(image, width, height).tobytes() for image in images)
        channels = images[0].values.shape[2]
        size = (width, height, len(images))
        array = self._ctx.texture_array(size, channels, content, alignment=1, dtype="f2")
        array.build_mipmaps()
        array.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        # Images that end at their edges are kept there by the shader.
        array.repeat_x = array.repeat_y = True
        return array

    def release(self) -> None:
        """Free all of them."""
        self._arrays.clear()


def _size(arrays: tuple[moderngl.TextureArray, ...]) -> int:
    """Bytes of half floats, with mipmaps."""
    texels = (array.width * array.height * array.layers * array.components for array in arrays)
    return 2 * sum(texels) * 4 // 3 + _MORE_BYTES


def _release(arrays: tuple[moderngl.TextureArray, ...]) -> None:
    for array in arrays:
        array.release()
