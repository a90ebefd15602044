"""The shipped map of the Moon's reflectance, from the colour map of NASA's CGI Moon Kit.

    python -m tools.moon_map lroc_color_poles_1k.jpg

The kit (NASA Scientific Visualization Studio, item 4720) is made of images by the wide-angle camera
of the Lunar Reconnaissance Orbiter, normalised to one illumination. Its codes are taken as
proportional to reflectance: images of the Moon from geostationary orbit agree with that best
(exponents of 0.8 and 1.2 agree less). Poleward of 70 deg it has no measured reflectance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from PIL import Image

from simgl.arrays import Array

# The file's codes over this are reflectance over that of the full disc.
SCALE = 128.0


def over_the_disc(ground: Array) -> Array:
    """A map over the mean of the disc seen from longitude and latitude 0.

    ground : (height, width) reflectance; row 0 is north, column 0 longitude -180 deg
    """
    height, width = ground.shape
    longitude = ((np.arange(width) + 0.5) / width - 0.5) * 2.0 * np.pi
    latitude = (0.5 - (np.arange(height) + 0.5) / height)[:, None] * np.pi
    # A texel's share of the disc: its area times the cosine to the line of sight.
    seen = np.cos(latitude) * np.cos(longitude)
    weight = np.maximum(seen, 0.0) * np.cos(latitude)
    return np.asarray(ground * weight.sum() / (ground * weight).sum())


def make(
    source: Annotated[Path, typer.Argument(help="The kit's map, 2:1, longitude 0 in the middle.")],
) -> None:
    """Write the map."""
    with Image.open(source) as image:
        ground = np.asarray(image.convert("L"), dtype=np.float64)
    code = np.clip(np.round(SCALE * over_the_disc(ground)), 0, 255).astype(np.uint8)
    path = Path(__file__).resolve().parents[1] / "simgl" / "data" / "sky" / "moon.png"
    Image.fromarray(code).save(path, optimize=True)


if __name__ == "__main__":
    typer.run(make)
