"""The Moon's map: the shipped one is what the generator makes, and its disc has mean 1."""

from __future__ import annotations

import numpy as np
from PIL import Image

from simgl import assets
from tools.moon_map import HEIGHT, SCALE, WIDTH, reflectance


def test_the_shipped_map_is_the_generators() -> None:
    made = np.round(SCALE * reflectance())
    with Image.open(assets.data() / "sky" / "moon.png") as image:
        shipped = np.asarray(image).astype(np.float64)
    assert shipped.shape == (HEIGHT, WIDTH)
    # Another version of scipy may round noise the other way.
    assert np.abs(shipped - made).max() <= 1.0


def test_seas_are_half_as_bright_as_highlands() -> None:
    ground = reflectance()

    def at(east_deg: float, north_deg: float) -> float:
        row = int((90.0 - north_deg) / 180.0 * HEIGHT)
        column = int((east_deg + 180.0) / 360.0 * WIDTH)
        return float(ground[row - 2 : row + 3, column - 2 : column + 3].mean())

    # Noise of 5 % each.
    np.testing.assert_allclose(at(59.1, 17.0) / at(20.0, -45.0), 0.5, atol=0.08)
    np.testing.assert_allclose(at(17.5, 28.0) / at(20.0, -45.0), 0.5, atol=0.08)
