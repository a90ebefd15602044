"""Shutters: which row sees what, and when."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import MAX_PARTS, duration, lean_and_blur, moments
from tests.passes.exposures import camera


def rolling(exposure_time: float, height: int = 960, row_time: float = 22.222e-6) -> Camera:
    return camera(exposure_time, width=8, height=height, row_time=row_time)


def test_the_read_out_of_the_source_studys_camera_takes_21_ms() -> None:
    # 959 rows of 22.222 us after the first, and the last one's exposure.
    assert duration(rolling(0.0005)) == pytest.approx(959 * 22.222e-6 + 0.0005, rel=1e-12)
    assert duration(camera(0.25)) == 0.25


@pytest.mark.parametrize("blur", [0.6, 1.0, 2.5, 25.0, 1e9])
def test_moments_have_the_mean_and_the_variance_of_the_exposure(blur: float) -> None:
    times = moments(camera(0.01), blur)
    assert times.mean() == pytest.approx(0.0, abs=1e-12)
    assert times.var() == pytest.approx(0.01**2 / 12.0, rel=1e-9)
    assert len(times) == max(2, min(np.ceil(blur), MAX_PARTS))


def test_what_moves_less_than_half_a_pixel_has_one_moment() -> None:
    np.testing.assert_array_equal(moments(camera(0.01), 0.5), [0.0])


def test_what_the_rows_see_of_a_motion_and_what_each_of_them_does() -> None:
    """In proportion to the times: 21.3 ms from the first row to the last, of 0.5 ms each."""
    lean, blur = lean_and_blur(rolling(0.0005), 100.0)
    assert lean + blur == pytest.approx(100.0, rel=1e-12)
    assert blur / lean == pytest.approx(0.0005 / (959 * 22.222e-6), rel=1e-9)
    assert lean_and_blur(camera(0.01), 3.0) == (0.0, 3.0)
