"""Shutters: which row sees what, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import MAX_PARTS, duration, instants, parts, row_shares
from tests.passes.exposures import camera


def rolling(exposure_time: float, height: int = 960, row_time: float = 22.222e-6) -> Camera:
    return camera(exposure_time, width=8, height=height, row_time=row_time)


def test_the_read_out_of_the_source_studys_camera_takes_21_ms() -> None:
    # 959 rows of 22.222 us after the first, and the last one's exposure.
    assert duration(rolling(0.0005)) == pytest.approx(959 * 22.222e-6 + 0.0005, rel=1e-12)
    assert duration(camera(0.25)) == 0.25


@pytest.mark.parametrize("cam", [rolling(0.0005), rolling(0.03), rolling(1e-5), camera(0.01)])
@pytest.mark.parametrize("count", [1, 2, 7, 64])
def test_the_shares_of_each_row_add_up_to_its_exposure(cam: Camera, count: int) -> None:
    shares = row_shares(cam, count)
    assert shares.shape == (count, cam.detector.height)
    assert shares.min() >= 0.0
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)


def test_all_rows_of_a_global_shutter_see_every_part_alike() -> None:
    np.testing.assert_allclose(row_shares(camera(0.01), 5), 0.2, rtol=1e-12)


@pytest.mark.parametrize("exposure_time", [0.0005, 0.01, 0.05])
def test_the_middle_of_each_rows_light_is_the_middle_of_its_exposure(exposure_time: float) -> None:
    cam = rolling(exposure_time)
    count = 50
    seen = instants(cam, count) @ row_shares(cam, count)
    middles = (np.arange(960) - 479.5) * 22.222e-6
    # A part shows its own middle: half of its length at most, much less for a row of many parts.
    np.testing.assert_allclose(seen, middles, atol=0.5 * duration(cam) / count)
    assert abs(seen.mean()) < 1e-9


def test_moving_pixels_get_two_parts_each() -> None:
    assert [parts(m) for m in (0.0, 0.4, 0.5, 0.6, 3.0, 1e9)] == [1, 1, 1, 2, 6, MAX_PARTS]


def test_one_row_is_a_global_shutter() -> None:
    cam = rolling(0.001, height=1)
    still = replace(cam, detector=replace(cam.detector, row_time=0.0))
    np.testing.assert_array_equal(row_shares(cam, 4), row_shares(still, 4))
