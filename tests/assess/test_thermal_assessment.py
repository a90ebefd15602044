"""Assessments by a thermal camera: temperatures, and what stands out of the background."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from typer.testing import CliRunner

from simgl.assess.target_light import FrameAssessment, assess_frame
from simgl.camera.infrared_detector import measured_netd
from simgl.commands.application import app
from simgl.errors import ConfigError
from simgl.scenario.schema import UsabilityCriteria
from simgl.simulator import Product, Simulator
from tests.thermal.test_thermal_image import at_one_temperature, scene, sheet

_WANTED = {Product.DN, Product.THERMAL, Product.TRUTH}

SCENARIO = """
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "none"
[spacecraft.box]
model = { box = { size_m = [1.0, 1.0, 1.0], material = "white_paint" } }
orbit = { altitude_km = 500.0 }
[camera.nav]
about = { target = "box", azimuth_deg = 20.0, range_m = 9.0 }
width_px = 48
height_px = 36
focal_length_mm = 4.0
pixel_pitch_um = 12.0
f_number = 4.0
exposure_time_s = 1e-4
[camera.ir]
about = { target = "box", azimuth_deg = 20.0, range_m = 9.0 }
width_px = 48
height_px = 36
focal_length_mm = 4.0
thermal = { detector = "bolometer_lwir" }
[thermal]
patches = 60
step_s = 600.0
"""


def of_plates(gl: moderngl.Context, front: float, behind: float | None) -> FrameAssessment:
    """A black plate of some temperature, before a black body or before space [K]."""
    scenario = scene(sheet(1.0))
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        warm = at_one_temperature(simulator, state, front)
        capture = simulator.capture(state, "cam", _WANTED, temperatures=warm)
        if behind is not None:
            assert capture.thermal is not None
            assert capture.digital is not None
            assert capture.truth is not None
            detector = capture.info.camera.thermal
            assert detector is not None
            empty = capture.truth.instance == 0
            emission = float(detector.emission(np.array(behind)))
            radiance = np.where(empty, np.float32(emission), capture.thermal.radiance)
            dn = detector.digitised(radiance.astype(np.float64), (0, 1), state.tai_ns)
            capture = replace(
                capture,
                thermal=replace(capture.thermal, radiance=radiance),
                digital=replace(capture.digital, dn=dn),
            )
    return assess_frame(capture, state, "body", UsabilityCriteria())


def test_a_target_stands_out_by_its_difference_over_the_netd(gl: moderngl.Context) -> None:
    seen = of_plates(gl, 300.0, 299.0)
    assert seen.temperatures is not None
    assert seen.temperatures.mean == pytest.approx(300.0, abs=1e-3)
    assert seen.temperatures.brightness == pytest.approx(300.0, abs=0.02)
    assert seen.temperatures.background == pytest.approx(299.0, abs=0.02)
    # 1 K of 40 mK: 25. Its rows beside the edge are diffracted, and some noise is fixed pattern.
    assert seen.temperatures.netd == pytest.approx(0.040, rel=0.01)
    assert seen.median_snr == pytest.approx(25.0, rel=0.1)
    assert seen.mean_radiance is None
    assert seen.exitance is None


def test_a_target_as_warm_as_what_is_behind_is_lost(gl: moderngl.Context) -> None:
    seen = of_plates(gl, 300.0, 300.0)
    assert seen.median_snr < 1.5
    # With the fixed pattern, 0.1 % of the signal and 20 mK, pixels differ by 1.7 times the noise in
    # time: 92 % of them by less than three times.
    assert seen.dark == pytest.approx(0.92, abs=0.06)
    cold = of_plates(gl, 150.0, None)
    # Below the lowest DN, 203 K.
    assert cold.dark == 1.0


def test_the_preset_s_netd_is_the_one_assessed(gl: moderngl.Context) -> None:
    seen = of_plates(gl, 300.0, None)
    assert seen.temperatures is not None
    assert seen.temperatures.background == pytest.approx(0.0, abs=60.0)
    detector = scene(sheet(1.0)).cameras["cam"].thermal
    assert detector is not None
    assert seen.temperatures.netd == pytest.approx(measured_netd(detector), rel=0.03)


def test_reports_have_thermal_images_beside_visible_ones_and_temperatures(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENARIO)
    span = ["--duration", "1200", "--count", "2"]
    for camera in ("nav", "ir"):
        out = tmp_path / camera
        words = ["assess", str(path), *span, "--camera", camera, "--out", str(out)]
        result = CliRunner().invoke(app, words, catch_exceptions=False)
        assert result.exit_code == 0
        page = (out / "report.html").read_text()
        other = "ir; temperatures steady" if camera == "nav" else "nav:"
        assert f"The same by {other}" in page
        assert "Temperatures of the target" in page
        assert (out / "heat_map.png").stat().st_size > 10_000
        with (out / "temperatures.csv").open() as file:
            of_parts = list(csv.DictReader(file))
        with (out / "frames.csv").open() as file:
            frames = list(csv.DictReader(file))
        assert [row["utc"] for row in of_parts] == [row["utc"] for row in frames]
        assert ("target_mean_k" in frames[0]) == (camera == "ir")
    (part,) = {name.split(".")[0] for name in of_parts[1] if name.endswith(".min_k")}
    low, high = (float(of_parts[1][f"{part}.{kind}_k"]) for kind in ("min", "max"))
    # What the camera sees of the box lies between the lowest and highest of all of it.
    assert low - 0.1 < float(frames[1]["target_lowest_k"]) < float(frames[1]["target_highest_k"])
    assert float(frames[1]["target_highest_k"]) < high + 0.1
    # After 20 min of another side in the Sun its temperatures are not those of a steady state.
    assert "steady, from the steady state" in page


@pytest.mark.parametrize(
    ("more", "options", "line"),
    [
        ("", ["--sweep", "f_number=2,4"], "--sweep requires visible light"),
        ("[uncertainty]\ndraws = 2\n", [], "uncertainty requires visible light"),
    ],
)
def test_what_goes_with_visible_light_is_refused_in_one_line(
    tmp_path: Path, more: str, options: list[str], line: str
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENARIO + more)
    words = ["assess", str(path), "--camera", "ir", *options, "--out", str(tmp_path / "out")]
    with pytest.raises(ConfigError) as caught:
        CliRunner().invoke(app, words, catch_exceptions=False)
    assert line in str(caught.value)
    assert 'camera "ir" sees thermal radiation' in str(caught.value)
    assert not (tmp_path / "out").exists()
