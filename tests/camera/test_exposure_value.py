"""Exposure values against numbers worked by hand."""

from __future__ import annotations

import math

import pytest

from simgl.camera.camera_equation import (
    blender_exposure,
    exposure_time,
    exposure_value,
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
