"""Small targets where a calibrated camera images them, over its whole field."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from tests.camera.test_projections import FISHEYE
from tests.passes.calibrated_targets import CAMERAS, place_errors
from tests.scenes import lambert, radiance, scene


@pytest.mark.parametrize("name", CAMERAS)
def test_targets_are_where_the_calibration_puts_them(gl: moderngl.Context, name: str) -> None:
    """Several of them share the buffers of their samples, and none shows in another's."""
    errors = place_errors(gl, name)
    # 4096 samples each, a tenth of a pixel apart: each of the 220 on the limb may miss 0.3 of
    # that. Their mean over 38 pixels: 0.1 x 0.3 x sqrt(220) x 0.1 x 3.5 / 38 = 0.004.
    # Behind the camera they are crescents, half as much light at the same limb.
    limit = 0.008 if name == "wide fisheye" else 0.004
    assert np.sqrt(np.mean(np.sum(np.square(errors), axis=1))) < limit
    assert np.abs(errors).max() < 2.5 * limit


def test_a_large_body_shows_no_seams_of_its_parts(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is lit in parts where it has many samples; a pixel's samples may lie in two of them."""
    camera = {
        "position_icrf_m": [0, 0, 0],
        "boresight": [0, 0, 1],
        "up": [0, -1, 0],
        "width_px": 160,
        "height_px": 120,
        "focal_length_px": 90.0,
        "optics": {"distortion": {"model": "fisheye", **FISHEYE}},
    }
    ball = {"sphere": {"radius_m": 3.0, "material": lambert(0.8)}}
    scenario = scene(
        {"ball": {"model": ball, "position_icrf_m": [-2.0, -1.0, 4.0]}},
        camera,
        sun_direction=(0.3, -0.4, -1.0),
        render={"samples_per_pixel": 64, "inter_reflection": False},
    )
    monkeypatch.setattr("simgl.view.frame_view._SAMPLES_AT_ONCE", 1 << 40)
    whole = radiance(gl, scenario)[..., 1]
    monkeypatch.setattr("simgl.view.frame_view._SAMPLES_AT_ONCE", 400_000)
    parts = radiance(gl, scenario)[..., 1]
    assert whole.max() > 30.0
    # Other samples, since the grid starts at the corner of a part: on a limb 8 of 64 more or less.
    assert np.abs(parts - whole).max() < 8.0 / 64.0 * whole.max()
