"""The images of a glTF file as linear values."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from simgl.arrays import AnyArray, Array32
from simgl.errors import AssetError
from simgl.model_files.gltf_file import GltfFile

# A larger file is a mistake or an attack.
LARGEST = 8192
# Larger images are averaged down: 5 mm texels on a spacecraft of 10 m, 45 MB with mipmaps.
FINEST = 2048


def linear_from_srgb(encoded: AnyArray) -> AnyArray:
    """Linear values of sRGB ones, both 0..1 (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


# What a PNG file of several channels of 16 bits begins with, from its 24th byte on (ISO 15948).
_COLOURS_OF_16_BITS = bytes([16, 2]), bytes([16, 4]), bytes([16, 6])


def _of_16_bits(content: bytes) -> AnyArray | None:
    """(height, width, 4) values of a PNG file of several channels of 16 bits, which Pillow reads as
    8; None for all others."""
    if content[24:26] not in _COLOURS_OF_16_BITS or not content.startswith(b"\x89PNG"):
        return None
    # Its libraries take 0.1 s to load, and few models need them.
    import av

    with av.open(io.BytesIO(content), mode="r", format="png_pipe") as container:
        frame = next(container.decode(video=0))
        (plane,) = frame.planes
        rows = np.frombuffer(bytes(plane), dtype=">u2").reshape(frame.height, plane.line_size // 2)
        # One more than the file has where it names a colour that is transparent.
        count = len(frame.format.components)
        values = rows[:, : count * frame.width].astype(np.uint16)
    values = values.reshape(frame.height, frame.width, count)
    opaque = np.full_like(values[..., :1], 65535)
    if count == 2:
        return np.concatenate([values[..., [0, 0, 0]], values[..., 1:]], axis=-1)
    return values if count == 4 else np.concatenate([values, opaque], axis=-1)


def _decoded(file: GltfFile, index: int) -> AnyArray:
    """(height, width, 4) values of 8 bits, or 16 where the file has them."""
    uri = file.gltf.images[index].uri if index < len(file.gltf.images) else None
    name = f'image "{uri}"' if uri and not uri.startswith("data:") else f"image {index}"
    content = file.image(index)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Pillow.DecompressionBombWarning)
            with Pillow.open(io.BytesIO(content), formats=("PNG", "JPEG")) as image:
                width, height = image.size
                if max(width, height) <= LARGEST:
                    if image.mode.startswith("I"):
                        grey = np.asarray(image).astype(np.uint16)
                        opaque = np.full_like(grey, 65535)
                        return np.stack([grey, grey, grey, opaque], axis=-1)
                    image.load()
                    # Sound: another decoder would fill in what a damaged file lacks.
                    finer = _of_16_bits(content)
                    if finer is not None:
                        return finer
                    return np.asarray(image.convert("RGBA"))
    except Pillow.DecompressionBombError:
        problem = f"has more pixels than the {LARGEST} x {LARGEST} that are read"
        raise AssetError(f"{file.path}: {name} {problem}") from None
    except Exception as error:  # decoders raise whatever they raise
        problem = "is not a readable PNG or JPEG file"
        raise AssetError(f"{file.path}: {name} {problem}") from error
    problem = f"has {width} x {height} pixels, at most {LARGEST} x {LARGEST} are read"
    raise AssetError(f"{file.path}: {name} {problem}")


def _channels(
    pixels: AnyArray, wanted: str, curve: Callable[[AnyArray], AnyArray] | None = None
) -> Array32:
    """(height, width, len(wanted)) values of some of the channels r, g, b, a; a has no curve."""
    levels = np.linspace(0.0, 1.0, int(np.iinfo(pixels.dtype).max) + 1)
    straight = levels.astype(np.float32)
    curved = straight if curve is None else curve(levels).astype(np.float32)
    tables = [straight if channel == "a" else curved for channel in wanted]
    layers = [
        _averaged(t[pixels[..., "rgba".index(c)]]) for c, t in zip(wanted, tables, strict=True)
    ]
    return np.stack(layers, axis=-1)


def _averaged(channel: Array32) -> Array32:
    """One channel, its longer edge brought down to ``FINEST`` texels."""
    height, width = channel.shape
    if max(height, width) <= FINEST:
        return channel
    scale = FINEST / max(height, width)
    size = (max(round(width * scale), 1), max(round(height * scale), 1))
    small = Pillow.fromarray(channel).resize(size, Pillow.Resampling.BOX)
    return np.asarray(small)


# Kind of image, as in ``SurfaceTextures``, to its channels and the curve of all but alpha.
_KINDS: dict[str, tuple[str, Callable[[AnyArray], AnyArray] | None]] = {
    "base_colour": ("rgba", linear_from_srgb),
    "law": ("gb", None),
    "normal": ("rgb", None),
    "emission": ("rgb", linear_from_srgb),
}


def read_image(file: GltfFile, kind: str, index: int) -> NDArray[np.float16]:
    """(height, width, channels) linear values of an image, of a kind in ``SurfaceTextures``."""
    wanted, curve = _KINDS[kind]
    values = _channels(_decoded(file, index), wanted, curve)
    if kind == "normal":
        values = 2.0 * values - 1.0
        values = values / np.maximum(np.linalg.norm(values, axis=-1, keepdims=True), 1e-6)
    return values.astype(np.float16)
