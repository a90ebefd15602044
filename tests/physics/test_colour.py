"""Colour of black bodies and of lines against published numbers."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.physics.spectrum import planck_radiance
from tests.reference.colour import (
    MAXIMUM_EFFICACY,
    chromaticity,
    correlated_temperature,
    luminous_efficacy,
    tristimulus,
)

WAVELENGTH = np.arange(300e-9, 900e-9, 1e-9, dtype=np.float64)


def black_body(temperature: float) -> Array:
    return planck_radiance(WAVELENGTH, temperature)


def test_the_source_studys_sun_has_its_colour_and_its_lumens() -> None:
    power = black_body(5777.0)
    # As printed: half a unit of the last digit. The 5 nm table, taken as linear, errs by 6e-6.
    xy = chromaticity(tristimulus(WAVELENGTH, power))
    np.testing.assert_allclose(xy, [0.32645, 0.33574], atol=5e-5)
    total = STEFAN_BOLTZMANN * 5777.0**4 / np.pi
    assert abs(luminous_efficacy(WAVELENGTH, power, total) - 92.07) < 0.01


@pytest.mark.parametrize("temperature", [4500.0, 5000.0, 5777.0, 6500.0])
def test_the_colour_of_a_black_body_tells_its_temperature(temperature: float) -> None:
    xy = chromaticity(tristimulus(WAVELENGTH, black_body(temperature)))
    assert abs(correlated_temperature(*xy) - temperature) < 10.0


def test_equal_energy_is_white() -> None:
    # The curves have equal areas; their sums over the table differ by 2e-5, their ends by as much.
    xy = chromaticity(tristimulus(WAVELENGTH, np.ones_like(WAVELENGTH)))
    np.testing.assert_allclose(xy, 1.0 / 3.0, atol=5e-5)


def test_a_green_line_has_the_largest_efficacy() -> None:
    # A tent of 2 nm about 555 nm, where the eye is best: 1 nm off the peak it has lost 0.1 %.
    line = np.array([554e-9, 555e-9, 556e-9])
    efficacy = luminous_efficacy(line, np.array([0.0, 1.0, 0.0]), 1e-9)
    np.testing.assert_allclose(efficacy, MAXIMUM_EFFICACY, rtol=2e-3)


def test_light_beyond_red_is_not_seen() -> None:
    infrared = np.array([840e-9, 1000e-9])
    assert not tristimulus(infrared, np.ones(2)).any()
