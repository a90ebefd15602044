"""The Moon's map: the shipped one has its seas where they are, and a disc of mean 1."""

from __future__ import annotations

import numpy as np
from PIL import Image

from simgl import assets
from simgl.arrays import Array
from tools.moon_map import SCALE, over_the_disc


def shipped() -> Array:
    with Image.open(assets.data() / "sky" / "moon.png") as image:
        return np.asarray(image, dtype=np.float64) / SCALE


def test_the_shipped_maps_disc_has_mean_1() -> None:
    ground = shipped()
    # Codes are rounded to 1/256 of the mean each; together that is nothing.
    np.testing.assert_allclose(over_the_disc(ground), ground, rtol=1e-3)


def test_seas_are_half_as_bright_as_highlands() -> None:
    ground = shipped()
    height, width = ground.shape

    def at(east_deg: float, north_deg: float) -> float:
        row = int((90.0 - north_deg) / 180.0 * height)
        column = int((east_deg + 180.0) / 360.0 * width)
        return float(ground[row - 4 : row + 5, column - 4 : column + 5].mean())

    # Crises and Serenity against the southern highlands (Allen, 4th ed., section 12: half).
    np.testing.assert_allclose(at(59.1, 17.0) / at(20.0, -45.0), 0.5, atol=0.08)
    np.testing.assert_allclose(at(17.5, 28.0) / at(20.0, -45.0), 0.5, atol=0.08)
    # Tycho's rim and rays.
    assert at(-11.4, -43.3) > at(20.0, -45.0)
