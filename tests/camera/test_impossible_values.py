"""A camera with an impossible value is refused when it is made, and not drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tests.camera.cameras import camera


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_an_exposure_time_below_zero_or_without_a_value(seconds: float) -> None:
    with pytest.raises(ValueError, match="exposure_time must be 0 or more, got"):
        replace(camera(), exposure_time=seconds)


@pytest.mark.parametrize(
    ("key", "value"),
    [("f_number", 0.0), ("f_number", float("nan")), ("focal_length", -0.01), ("aspect", 0.0)],
)
def test_a_lens(key: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"lens: {key} must be above 0, got"):
        replace(camera().lens, **{key: value})


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("width", 0),
        ("height", -1),
        ("pixel_pitch", 0.0),
        ("full_well", float("nan")),
        ("gain_dn_per_e", 0.0),
        ("bits", 17),
        ("read_noise", -1.0),
    ],
)
def test_a_detector(key: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"detector: {key} must .*, got"):
        replace(camera().detector, **{key: value})
