"""The source study's false colours and relative flux."""

from __future__ import annotations

import math

import numpy as np
import pytest

from simgl.figures.false_colour import (
    LEGEND,
    false_colour,
    relative_flux,
    relative_luminance,
    scene_value,
)

# Legend of the source study: value, and its distance from 0.18 in powers of two.
VALUES = {
    "low clip": (0.0001762728758, -9.99597),
    "-7.5 EV": (0.00099436891, -7.5),
    "-5 EV": (0.005625, -5.0),
    "-2.5 EV": (0.031819805, -2.5),
    "0 EV": (0.18009142, 0.000733),
    "+2.17 EV": (0.80779930598, 2.166),
    "+4.33 EV": (3.62857262286, 4.333333),
    "high clip": (16.29174024, 6.5),
}


@pytest.mark.parametrize("name", VALUES)
def test_the_legend_has_the_values_of_the_study(name: str) -> None:
    (step,) = (step for step in LEGEND if step.name == name)
    value, powers = VALUES[name]
    # The printed digits; 0.18 2^-2.5 is given to nine.
    assert step.value == pytest.approx(value, abs=1e-9 if name != "-2.5 EV" else 5e-10)
    assert math.log2(step.value / 0.18) == pytest.approx(powers, abs=5e-6)


def test_colours_at_the_values_are_those_of_the_legend() -> None:
    values = np.array([[step.value for step in LEGEND]])
    actual = false_colour(values)[0]
    for colour, step in zip(actual, LEGEND, strict=True):
        assert "#{:02x}{:02x}{:02x}".format(*colour) == step.colour


def test_beyond_the_ends_all_is_black_or_white() -> None:
    low, high = LEGEND[0].value, LEGEND[-1].value
    actual = false_colour(np.array([[0.0, 0.5 * low, 2.0 * high, np.inf]]))[0]
    np.testing.assert_array_equal(actual, [[0] * 3, [0] * 3, [255] * 3, [255] * 3])
    # Just inside the ends colours begin.
    assert false_colour(np.array([[low * 1.5]])).any()


def test_a_white_plate_in_sunlight_has_the_solar_constant() -> None:
    white = np.array([[[154.4, 174.8, 171.9, 313.4]]]) / np.pi
    radiance = white.astype(np.float32)
    # float32.
    assert relative_luminance(radiance)[0, 0] == pytest.approx(1.0, rel=1e-6)
    assert relative_flux(radiance)[0, 0] == pytest.approx(1367.0, rel=1e-6)
    # At the study's setting -8.17 it lies 3.1 EV above the grey one.
    value = scene_value(radiance, -8.17)[0, 0]
    assert value == pytest.approx(1367.0 / np.pi * 2.0**-8.17, rel=1e-6)


def test_primaries_have_the_weights_of_a_display() -> None:
    for band, weight in enumerate((0.2126, 0.7152, 0.0722)):
        radiance = np.zeros((1, 1, 4), dtype=np.float32)
        radiance[0, 0, band] = (154.4, 174.8, 171.9)[band] / np.pi
        assert relative_luminance(radiance)[0, 0] == pytest.approx(weight, rel=1e-6)
