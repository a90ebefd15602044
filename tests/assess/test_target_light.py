"""The assessment of one frame against cases whose answer is known by hand."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.assess.target_light import FrameAssessment, assess_frame
from simgl.errors import ConfigError
from tests.scenes import capture, lambert, scene

PLATE = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(0.5)}}


def assessed(gl: moderngl.Context, **camera: float) -> FrameAssessment:
    """A plate 50 m away, Sun 60 deg from its normal and from the camera's line of sight."""
    scenario = scene(
        {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 50], "look_at": "plate", **camera},
        sun_direction=(float(np.sin(np.radians(60))), 0.0, 0.5),
    )
    exposure = capture(gl, scenario)
    return assess_frame(exposure, scenario.at(scenario.epoch_tai_ns), "plate")


def test_geometry_is_that_of_the_scene(gl: moderngl.Context) -> None:
    found = assessed(gl)
    assert found.range == pytest.approx(50.0, abs=1e-9)
    assert np.degrees(found.phase_angle) == pytest.approx(60.0, abs=1e-9)
    assert np.degrees(found.sun_to_boresight) == pytest.approx(120.0, abs=1e-9)
    assert found.sunlight == 1.0
    # 1 m at 50 m and 3,466.7 px focal length: 69.3 pixels on a side.
    assert found.target_pixels == pytest.approx(69.33**2, rel=0.03)


def test_the_exposure_decides_between_dark_usable_and_saturated(gl: moderngl.Context) -> None:
    # At f/4 the plate collects about 40,000 e- in 1 ms; full well 24,500 e-, read noise 4 e-.
    assert assessed(gl, exposure_time_s=1e-2).saturated == 1.0
    assert assessed(gl, exposure_time_s=1e-4).usable == 1.0
    assert assessed(gl, exposure_time_s=1e-7).dark == 1.0


def test_signal_over_noise_is_that_of_shot_noise(gl: moderngl.Context) -> None:
    found = assessed(
        gl,
        exposure_time_s=1.0 / 2000.0,
        quantum_efficiency=[0.6, 0.6, 0.6, 0.0],  # type: ignore[arg-type]
    )
    # Half of the worked plate's 45,421 e-: at 60 deg incidence.
    signal = 45420.755 * 0.5
    assert found.median_snr == pytest.approx(signal / np.sqrt(signal + 16.08), rel=1e-3)


def test_an_unknown_target_is_refused(gl: moderngl.Context) -> None:
    scenario = scene(
        {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 50], "look_at": "plate"},
    )
    exposure = capture(gl, scenario)
    with pytest.raises(
        ConfigError, match='target "plat" is not in the scenario; did you mean "pla'
    ):
        assess_frame(exposure, scenario.at(scenario.epoch_tai_ns), "plat")
