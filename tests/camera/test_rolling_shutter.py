"""Shutters: which row sees what, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import MAX_PARTS, duration, instants, moments, parts, row_shares
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
    assert shares.shape == (count + 1, cam.detector.height)
    assert shares.min() >= 0.0
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)


def test_all_rows_of_a_global_shutter_see_every_part_alike() -> None:
    """The trapezoidal rule."""
    wanted = np.array([0.1, 0.2, 0.2, 0.2, 0.2, 0.1])
    shares = row_shares(camera(0.01), 5)
    np.testing.assert_allclose(shares, np.broadcast_to(wanted[:, None], shares.shape), rtol=1e-12)


@pytest.mark.parametrize("exposure_time", [1e-6, 1e-5, 0.0005, 0.01, 0.05])
@pytest.mark.parametrize("count", [1, 7, 50])
def test_the_middle_of_each_rows_light_is_the_middle_of_its_exposure(
    exposure_time: float, count: int
) -> None:
    cam = rolling(exposure_time)
    seen = instants(cam, count) @ row_shares(cam, count)
    middles = (np.arange(960) - 479.5) * 22.222e-6
    # Linear interpolation is exact for a place that moves evenly; differences of squares of 0.02 s
    # over an exposure of 1 us: 1e-16 / (1e-6 of them).
    np.testing.assert_allclose(seen, middles, atol=1e-9 * duration(cam) + 1e-16 / exposure_time)


@pytest.mark.parametrize("exposure_time", [1e-5, 0.0005])
def test_a_short_exposure_is_mixed_of_the_instants_around_it(exposure_time: float) -> None:
    cam = rolling(exposure_time)
    count = 20
    length = duration(cam) / count
    middles = (np.arange(960) - 479.5) * 22.222e-6
    apart = np.abs(instants(cam, count)[:, None] - middles)
    # Instants farther away than a part and half of the exposure have none of it.
    assert row_shares(cam, count)[apart > length + 0.5 * exposure_time].max() < 1e-9


def test_moving_pixels_get_two_parts_each() -> None:
    still = camera(0.01)
    assert [parts(still, m) for m in (0.0, 0.4, 0.5, 0.6, 3.0, 1e9)] == [0, 0, 0, 2, 6, MAX_PARTS]


@pytest.mark.parametrize("blur", [0.6, 1.0, 2.5, 25.0, 1e9])
def test_moments_have_the_mean_and_the_variance_of_the_exposure(blur: float) -> None:
    times = moments(camera(0.01), blur)
    assert times.mean() == pytest.approx(0.0, abs=1e-12)
    assert times.var() == pytest.approx(0.01**2 / 12.0, rel=1e-9)
    assert len(times) == max(2, min(np.ceil(blur), MAX_PARTS))


def test_what_moves_less_than_half_a_pixel_has_one_moment() -> None:
    np.testing.assert_array_equal(moments(camera(0.01), 0.5), [0.0])


def test_rows_that_see_another_time_get_parts_for_less_motion() -> None:
    """What one instant for all rows leaves is 0.02 px rms: 0.07 px from the first to the last."""
    assert [parts(rolling(1e-5), m) for m in (0.0, 0.06, 0.08, 0.4, 0.6)] == [0, 0, 1, 1, 2]
    # Nearly all of this exposure is the same for all rows.
    assert parts(rolling(1.0), 0.4) == 0


def test_one_row_is_a_global_shutter() -> None:
    cam = rolling(0.001, height=1)
    still = replace(cam, detector=replace(cam.detector, row_time=0.0))
    np.testing.assert_array_equal(row_shares(cam, 4), row_shares(still, 4))
