"""Images and arrays in the bytes of a file, decoded within bounds; ValueError for all others."""

from __future__ import annotations

import io
import math
import struct
import warnings
import zipfile
import zlib

import numpy as np
from PIL import Image, UnidentifiedImageError

from simgl.arrays import AnyArray, Image8

# Pillow reads more, some of them by starting other programs.
IMAGE_FORMATS = ("PNG", "JPEG", "TIFF", "WEBP", "BMP", "GIF", "PPM", "JPEG2000")
# Of one file's arrays together.
_MAX_ARRAY_BYTES = 4 << 30
# Of an image that are copied together.
_STRIP_ROWS = 16
# What numpy reads of the text before an array, and more.
_MAX_HEADER_BYTES = 1 << 16


def decoded_image(content: bytes, max_pixels: int) -> Image.Image:
    """The image in a file, its pixels decoded.

    Raises ValueError, to be read after the file's name, for no image, a damaged one, and one of
    more pixels, which are counted before any is decoded.
    """
    try:
        with warnings.catch_warnings():
            # The limit is ours.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(content), formats=IMAGE_FORMATS)
            width, height = image.size
            if width * height > max_pixels:
                problem = f"has {width} x {height} pixels, at most {max_pixels} in all are read"
                raise _TooLargeError(problem)
            image.load()
    except UnidentifiedImageError:
        raise ValueError("is not an image that Pillow can read") from None
    except _TooLargeError as error:
        raise ValueError(str(error)) from None
    except Exception as error:  # Pillow raises whatever its decoders raise
        text = " ".join(str(error).split())
        raise ValueError(f"is damaged: {text or type(error).__name__}") from None
    return image


class _TooLargeError(Exception):
    """More pixels than are read."""


def copy_pixels(image: Image.Image, pixels: Image8) -> None:
    """Copy an image's pixels to an array (h, w, channels).

    Strip by strip: of a large image at once Pillow makes two more copies, in memory that is new to
    the process and has to be cleared for them.
    """
    shape = -1, image.width, pixels.shape[2]
    for top in range(0, image.height, _STRIP_ROWS):
        bottom = min(top + _STRIP_ROWS, image.height)
        strip = np.asarray(image.crop((0, top, image.width, bottom)))
        pixels[top:bottom] = strip.reshape(shape)


def array_in(content: bytes | memoryview, *, view: bool = False) -> AnyArray:
    """The array of a .npy file; ValueError for a damaged one, one of objects, or one cut short.

    view : of numbers of one byte, those of the content, read-only; others may lie askew there
    """
    file = io.BytesIO(content[:_MAX_HEADER_BYTES])
    try:
        version = np.lib.format.read_magic(file)  # ValueError for other files
        readers = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }
        shape, by_columns, dtype = readers[version](file)
        # A few bytes can promise more numbers than there is memory.
        if math.prod(shape) * dtype.itemsize != len(content) - file.tell():
            raise ValueError("does not hold what its header says")
        values = np.frombuffer(content, dtype, offset=file.tell())
        values = values.reshape(shape, order="F" if by_columns else "C")
        return values if view and dtype.itemsize == 1 else values.copy(order="K")
    except (KeyError, TypeError, struct.error, OverflowError, SyntaxError) as error:
        raise ValueError(f"is not a .npy file ({type(error).__name__})") from None


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, content: bytes) -> bytes | memoryview:
    """The checked bytes of a member; of one that is not compressed without copying them."""
    if info.compress_type != zipfile.ZIP_STORED:
        return archive.read(info)
    # The header before the data repeats the name, and has fields of its own.
    name_bytes, field_bytes = struct.unpack_from("<HH", content, info.header_offset + 26)
    start = info.header_offset + 30 + name_bytes + field_bytes
    data = memoryview(content)[start : start + info.file_size]
    if zlib.crc32(data) != info.CRC:
        raise zipfile.BadZipFile(f"bad checksum of {info.filename}")
    return data


def arrays_in(content: bytes) -> dict[str, AnyArray]:
    """The arrays of a .npz file by name; ValueError for a damaged one: each has a checksum.

    Arrays of bytes that fill much of the file, such as a map of the Earth of 130 MB and its first
    halvings, are not copied, and read-only.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(info.file_size for info in archive.infolist()) > _MAX_ARRAY_BYTES:
                raise ValueError("holds arrays of more than 4 GiB")
            return {
                info.filename.removesuffix(".npy"): array_in(
                    _member(archive, info, content), view=32 * info.file_size > len(content)
                )
                for info in archive.infolist()
            }
    except (zipfile.BadZipFile, zlib.error, struct.error, OSError, EOFError, KeyError) as error:
        raise ValueError(f"is not a .npz file ({error})") from None
    except (NotImplementedError, RuntimeError) as error:  # compressed or encrypted otherwise
        raise ValueError(f"is not a .npz file ({error})") from None
