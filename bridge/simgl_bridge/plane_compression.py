"""Planes without loss in fewer bytes, for links between machines: one Zstandard frame each."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

from msgspec import structs

from simgl.errors import BridgeError, ConfigError
from simgl_bridge.message_parts import CameraImage

ZSTD = "zstd"
# Noise does not compress: higher levels take longer and save less than 5 % of DN.
_LEVEL = 1


def available() -> tuple[str, ...]:
    """The compressions that this installation has."""
    return (ZSTD,) if find_spec("zstandard") else ()


def check_wanted(compression: str) -> None:
    """Raise ConfigError for a compression that a client cannot undo."""
    if compression and compression not in available():
        problem = f'"{compression}" needs zstandard: pip install "simgl[compression]"'
        if compression != ZSTD:
            problem = f'must be "{ZSTD}" or empty, got "{compression}"'
        raise ConfigError("Client", "compression", problem)


def compressed(
    images: tuple[CameraImage, ...], planes: list[memoryview]
) -> tuple[tuple[CameraImage, ...], list[memoryview]]:
    """Images whose planes say that they are compressed, and these planes."""
    import zstandard

    compressor = zstandard.ZstdCompressor(level=_LEVEL)
    marked = tuple(
        structs.replace(
            image, planes=tuple(structs.replace(p, compression=ZSTD) for p in image.planes)
        )
        for image in images
    )
    return marked, [memoryview(compressor.compress(plane)) for plane in planes]


def decompressed(product: str, frame: memoryview, expected: int) -> Any:
    """The ``expected`` bytes of a plane; BridgeError for a frame of others."""
    import zstandard

    try:
        # Before memory is allocated for it.
        announced = zstandard.frame_content_size(frame)
        if announced == expected:
            return zstandard.ZstdDecompressor().decompress(frame)
    except zstandard.ZstdError as error:
        raise BridgeError(f'plane "{product}" cannot be decompressed ({error})') from None
    raise BridgeError(f'plane "{product}" announces {expected} bytes and brings {announced}')
