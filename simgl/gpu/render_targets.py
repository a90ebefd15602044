"""Render targets: textures, a depth buffer, and the framebuffers over them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np

from simgl.arrays import AnyArray, Array32
from simgl.gpu.context import is_software, wait_for_draws
from simgl.gpu.release import all_or_nothing, release_all
from simgl.lru_cache import MANY, LruCache

# x, y, width, height of a rectangle of an image [pixels].
Area = tuple[int, int, int, int]


@dataclass(frozen=True)
class Format:
    """Channels and moderngl type of an attachment: ("f4", 4) is RGBA32F.

    packed : the channels of a texel hold neighbouring pixels of a row, one value each
    halves : each channel, "u4", holds two of 16 bits, the left one in its low half
    """

    dtype: str
    channels: int = 1
    packed: bool = False
    halves: bool = False

    @property
    def pixels(self) -> int:
        """Neighbouring pixels of a row in a texel."""
        return self.channels * (2 if self.halves else 1) if self.packed else 1

    @property
    def values(self) -> str:
        """numpy type of a pixel's values in memory."""
        return "<u2" if self.halves else f"<{self.dtype}"

    @property
    def nbytes(self) -> int:
        """Of a pixel."""
        return (1 if self.packed else self.channels) * int(self.values[2:])


class ImageTarget:
    """A framebuffer of image size whose attachments can be read, sampled and released."""

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        size: tuple[int, int],
        formats: Sequence[Format],
        *,
        depth: bool = False,
    ) -> None:
        self._ctx = ctx
        self.size = size
        self.formats = tuple(formats)
        # Attachments of one framebuffer have one size.
        (pixels,) = {f.pixels for f in formats}
        texels = (-(-size[0] // pixels), size[1])
        self.textures = [
            ctx.texture(texels, f.channels, dtype=f.dtype, alignment=1) for f in formats
        ]
        for texture in self.textures:
            read_by_texel(texture)
        self._depth = ctx.depth_renderbuffer(texels) if depth else None
        try:
            self.framebuffer = ctx.framebuffer(self.textures, self._depth)
        except moderngl.Error:
            self._release_attachments()
            raise

    def read(self, attachment: int = 0) -> AnyArray:
        """(height, width) or (height, width, channels) values; row 0 is the top of the image."""
        kind = self.formats[attachment]
        wait_for_draws(self._ctx)
        data = np.frombuffer(self.textures[attachment].read(alignment=1), dtype=kind.values)
        width, height = self.size
        if kind.packed:
            return np.ascontiguousarray(data.reshape(height, -1)[:, :width])
        shape = (height, width, kind.channels)
        return data.reshape(shape if kind.channels > 1 else shape[:2])

    def blacken(self) -> None:
        """Set all pixels to 0."""
        # With the area, for a clear without one keeps to the scissor of the last draw.
        self.framebuffer.clear(viewport=(0, 0, *self.size))

    def read_into(self, values: AnyArray, attachment: int = 0) -> None:
        """Fill a contiguous array of the shape and type that ``read`` returns.

        The attachment is not packed.
        """
        wait_for_draws(self._ctx)
        self.textures[attachment].read_into(values.data, alignment=1)

    def read_area_into(self, values: AnyArray, area: Area) -> None:
        """The same of a rectangle of the first attachment."""
        kind = self.formats[0]
        wait_for_draws(self._ctx)
        self.framebuffer.read_into(
            values.data,
            viewport=area,
            components=kind.channels,
            alignment=1,
            dtype=kind.dtype,
        )

    def write(self, values: AnyArray, attachment: int = 0) -> None:
        """Fill an attachment of one value a pixel with (height, width) values."""
        kind = self.formats[attachment]
        texels = self.textures[attachment].width
        spare = texels * kind.pixels - values.shape[1]
        rows = np.pad(values, ((0, 0), (0, spare))) if spare else values
        self.textures[attachment].write(np.ascontiguousarray(rows, dtype=kind.values).data)

    def release(self) -> None:
        """Free the framebuffer and its attachments."""
        self.framebuffer.release()
        self._release_attachments()

    def _release_attachments(self) -> None:
        for texture in self.textures:
            texture.release()
        if self._depth is not None:
            self._depth.release()


# A frame needs about as many RGBA32F targets of its image's size at the same time.
_AT_ONCE = 3


def can_draw(ctx: moderngl.Context, size: tuple[int, int]) -> bool:
    """Whether the driver gives the targets of an image of a width and height [pixels]."""
    if max(size) > largest_edge(ctx):
        return False
    count = _AT_ONCE
    if is_software(ctx):
        # It fills what it gives; one target shows the driver's own limit.
        count = 1
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        if _AT_ONCE * 16 * size[0] * size[1] > memory:
            return False
    textures: list[moderngl.Texture] = []
    try:
        for _ in range(count):
            textures.append(ctx.texture(size, 4, dtype="f4"))
    except moderngl.Error:
        return False
    finally:
        # Without memory the texture is there, and an error.
        error = ctx.error
        for texture in textures:
            texture.release()
    return error == "GL_NO_ERROR"


def drawable_part(ctx: moderngl.Context, size: tuple[int, int]) -> tuple[int, int]:
    """An image size, or the first of its halves, quarters and so on that can be drawn."""
    while size != (1, 1) and not can_draw(ctx, size):
        size = max(size[0] // 2, 1), max(size[1] // 2, 1)
    return size


def largest_edge(ctx: moderngl.Context) -> int:
    """Largest width and height of an image on this driver [pixels]."""
    info = ctx.info
    edges = info["GL_MAX_TEXTURE_SIZE"], info["GL_MAX_RENDERBUFFER_SIZE"]
    return int(min(*edges, *info["GL_MAX_VIEWPORT_DIMS"]))


# Of the targets of images of other sizes, such as a window had that is resized.
_MAX_BYTES = 512 << 20
# The targets of one image, which stay whatever their sizes.
_OF_AN_IMAGE = 8


def read_by_texel(texture: moderngl.Texture) -> None:
    """Let shaders read a texture as ``shaders/common/texels.glsl`` does."""
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    # llvmpipe would take as long to wrap a place as for the rest.
    texture.repeat_x = texture.repeat_y = False


def table_texture(ctx: moderngl.Context, values: Array32) -> moderngl.Texture:
    """(height, width) or (height, width, channels) values as a texture, read texel by texel."""
    height, width = values.shape[:2]
    channels = values.shape[2] if values.ndim > 2 else 1
    texture = ctx.texture((width, height), channels, values.tobytes(), dtype="f4")
    read_by_texel(texture)
    return texture


class TargetStore:
    """Targets by what they are for and by size; those unused for longest are freed."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._targets = LruCache[tuple[str, tuple[int, int]], ImageTarget](
            MANY, partial(release_all, ctx), max_bytes=_MAX_BYTES
        )
        self._targets.reserve(_OF_AN_IMAGE)

    def of(
        self, use: str, size: tuple[int, int], formats: Sequence[Format], *, depth: bool = False
    ) -> ImageTarget:
        """The target for a use; each has one set of formats."""
        pixels = size[0] * size[1]
        values = sum(f.nbytes for f in formats)
        return self._targets.get(
            (use, size),
            lambda: ImageTarget(self._ctx, size, formats, depth=depth),
            pixels * (values + 4 * depth),
        )

    def release(self) -> None:
        """Free them all."""
        self._targets.clear()


# Sizes grow by multiples of this, so that a moving spacecraft does not reallocate each frame.
_SIZE_STEP = 256


class GrowingTarget:
    """Framebuffers over textures that share one depth buffer and grow with what is drawn.

    groups : for each framebuffer its textures, counted from 0
    kind : of the textures
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        groups: Sequence[Sequence[int]],
        kind: Format = Format("f4", 4),
    ) -> None:
        self._ctx, self._kind = ctx, kind
        self._groups = tuple(tuple(group) for group in groups)
        self._size = (0, 0)
        self._framebuffers: list[moderngl.Framebuffer] = []
        self._textures: list[moderngl.Texture] = []
        self._depth: moderngl.Renderbuffer | None = None
        self._made_depth: moderngl.Renderbuffer | None = None

    def covering(
        self, size: tuple[int, int], depth: moderngl.Renderbuffer | None = None
    ) -> list[moderngl.Framebuffer]:
        """The framebuffer of each group, of a size or larger.

        depth : a buffer of at least that size instead of its own
        """
        large_enough = self._size[0] >= size[0] and self._size[1] >= size[1]
        if large_enough and (depth is None or depth is self._depth):
            return self._framebuffers
        columns, rows = (
            _SIZE_STEP * -(-max(present, needed) // _SIZE_STEP)
            for present, needed in zip(self._size, size, strict=True)
        )
        self.release()
        if depth is None:
            depth = self._made_depth = self._ctx.depth_renderbuffer((columns, rows))
        # All of a framebuffer have one size: that buffer may have grown with more.
        columns, rows = depth.size
        self._depth = depth
        kind = self._kind
        for _ in range(1 + max(index for group in self._groups for index in group)):
            texture = self._ctx.texture((columns, rows), kind.channels, dtype=kind.dtype)
            read_by_texel(texture)
            self._textures.append(texture)
        for group in self._groups:
            textures = [self._textures[index] for index in group]
            self._framebuffers.append(self._ctx.framebuffer(textures, self._depth))
        # Only now that all are there.
        self._size = columns, rows
        return self._framebuffers

    def written(self, values: AnyArray) -> moderngl.Texture:
        """The only texture, with (rows, columns) values in its first rows and columns."""
        size = values.shape[1], values.shape[0]
        (framebuffer,) = self.covering(size)
        (texture,) = textures_of(framebuffer)
        texture.write(np.ascontiguousarray(values).data, viewport=(0, 0, *size))
        return texture

    def release(self) -> None:
        """Free everything; the next use makes it again."""
        release_all(self._ctx, *self._framebuffers, *self._textures)
        if self._made_depth is not None:
            self._made_depth.release()
        self._framebuffers, self._textures = [], []
        self._depth = self._made_depth = None
        self._size = (0, 0)


def textures_of(framebuffer: moderngl.Framebuffer) -> tuple[moderngl.Texture, ...]:
    """The textures that a framebuffer draws on."""
    return tuple(t for t in framebuffer.color_attachments if isinstance(t, moderngl.Texture))
