"""Pictures of the whole Earth from files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from PIL import Image, UnidentifiedImageError

from simgl.errors import AssetError

# Larger textures are not promised by OpenGL 3.3 drivers that run simgl.
LARGEST = 16384


@lru_cache(maxsize=4)
def read_picture(path: Path, mode: str) -> Image.Image:
    """An equirectangular picture, twice as wide as high, as mode "RGB" or "L".

    Raises AssetError where the file is missing, no picture, damaged, or of another shape.
    """
    try:
        with Image.open(path) as picture:
            width, height = picture.size
            if width != 2 * height or width > LARGEST:
                raise AssetError(
                    f"{path} must be twice as wide as high and at most {LARGEST} pixels wide, "
                    f"it is {width} x {height}"
                )
            return picture.convert(mode)
    except FileNotFoundError:
        raise AssetError(f"there is no file {path}") from None
    except UnidentifiedImageError:
        raise AssetError(f"{path} is not a picture that Pillow can read") from None
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise AssetError(f"{path} is damaged: {error}") from None
