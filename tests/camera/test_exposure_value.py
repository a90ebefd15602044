"""Exposure values against numbers worked by hand."""

from __future__ import annotations

import math

import pytest

from simgl.camera.camera_equation import (
    blender_exposure,
    exposure_time,
    exposure_value,
    value_for_illuminance,
    value_for_luminance,
    value_from_blender,
)


@pytest.mark.parametrize(
    ("f_number", "time", "expected"),
    [
        (4.0, 1.0 / 2000.0, 14.965784),
        (4.0, 1.0 / 4096.0, 16.0),
        (math.sqrt(32.0), 1.0 / 2000.0, 15.965784),
    ],
)
def test_value_of_an_aperture_and_a_time(f_number: float, time: float, expected: float) -> None:
    assert exposure_value(f_number, time) == pytest.approx(expected, abs=5e-7)
    assert exposure_time(expected, f_number) == pytest.approx(time, rel=1e-6)


def test_the_source_studys_setting() -> None:
    # Its own example: EV 16 is -6.584.
    assert blender_exposure(16.0) == pytest.approx(-6.584)
    assert value_from_blender(blender_exposure(12.3)) == pytest.approx(12.3)


@pytest.mark.parametrize(
    ("luminance", "expected"),
    # A plate of 0.5 in sunlight at 1 au, a card of 18 %, and the plate with 683 lm for each watt.
    [(20031.7, 17.290), (20031.7 * 0.36, 15.816), (148597.0, 20.18)],
)
def test_value_that_a_meter_advises(luminance: float, expected: float) -> None:
    assert value_for_luminance(luminance) == pytest.approx(expected, abs=5e-3)


def test_value_of_sunlight() -> None:
    assert value_for_illuminance(125863.0) == pytest.approx(15.620, abs=5e-4)
