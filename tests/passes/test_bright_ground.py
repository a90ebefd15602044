"""Ground that is brighter than the Earth's mean: what air and clouds send back to it, and up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.physics.land_reflectance import near_infrared, reflectance_from_display
from tests.passes.test_ground import SUN, Array, looking_down, tilted_sun

# In the Pacific, where the shipped relief is level.
PLACE = 5.0, -140.0


@pytest.fixture(scope="module")
def white(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """An Earth that is land of one colour throughout."""
    folder = tmp_path_factory.mktemp("white")
    for name, code in ("land", 235), ("water", 0):
        Image.new("RGB", (64, 32), (code,) * 3).save(folder / f"{name}.png")
    return {f"{name}_picture": str(folder / f"{name}.png") for name in ("land", "water")}


def reflectance() -> Array:
    """(4,) of that land."""
    rgb = reflectance_from_display(np.full((1, 1, 3), 235, dtype=np.uint8))
    return np.append(rgb[0, 0], near_infrared(rgb)[0, 0])


@pytest.mark.parametrize("zenith", [20.0, 70.0])
def test_white_ground_is_as_bright_as_in_an_air_made_for_it(
    gl: moderngl.Context, white: dict[str, Any], zenith: float
) -> None:
    """The tables of an Earth of one albedo hold all that goes back and forth.

    Eddington's method gives the air's albedo from below within 8 %: of 0.16 in blue, 1 % of the
    light. Hills below the maps' resolution change the mean by less than 1 %.
    """
    sun = tilted_sun(PLACE, zenith, 100.0)
    clear = {"clouds": {"cover": 0.0}}
    mapped = looking_down(gl, PLACE, sun, clear | white).mean(axis=(0, 1))
    even = looking_down(gl, PLACE, sun, {"albedo": reflectance().tolist()}).mean(axis=(0, 1))
    assert mapped == pytest.approx(even, rel=0.02)


def test_white_ground_and_a_cloud_send_light_back_and_forth(
    gl: moderngl.Context, white: dict[str, Any], tmp_path: Path
) -> None:
    """Of two layers the lower one adds T R T / (1 - R r), the sum over all passages between them.

    T and r: of the cloud, by Eddington's two-stream method, which absorbs nothing.
    """
    zenith, thickness = 40.0, 15.0
    Image.new("L", (64, 32), 255).save(tmp_path / "overcast.png")
    clouds = {"picture": str(tmp_path / "overcast.png"), "optical_thickness": thickness}
    # Grey like a code of 30.
    Image.new("RGB", (64, 32), (30,) * 3).save(tmp_path / "dark.png")
    sun = tilted_sun(PLACE, zenith, 100.0)
    over: list[Array] = []
    for pictures in (white, white | {"land_picture": str(tmp_path / "dark.png")}):
        earth = {"atmosphere": "none", "clouds": clouds} | pictures
        over.append(looking_down(gl, PLACE, sun, earth).mean(axis=(0, 1)))
    mu, g = np.cos(np.radians(zenith)), 0.85 / 1.85
    tau, g1, g3 = (
        (1.0 - 0.85**2) * thickness,
        0.75 * (1.0 - g),
        0.5 - 0.75 * g * np.cos(np.radians(zenith)),
    )
    direct = (g1 * tau + (g3 - g1 * mu) * (1.0 - np.exp(-tau / mu))) / (1.0 + g1 * tau)
    back = g1 * tau / (1.0 + g1 * tau)
    rgb = reflectance_from_display(np.full((1, 1, 3), 30, dtype=np.uint8))
    dark = np.append(rgb[0, 0], near_infrared(rgb)[0, 0])
    added = [r / (1.0 - r * back) for r in (reflectance(), dark)]
    expected = SUN * mu / np.pi * (1.0 - direct) * (1.0 - back) * (added[0] - added[1])
    assert over[0] - over[1] == pytest.approx(expected, rel=0.03)
