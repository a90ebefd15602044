"""``simgl camera test`` of thermal detectors."""

from __future__ import annotations

import json
from dataclasses import replace

import msgspec
import pytest
from typer.testing import CliRunner

from simgl.assess.infrared_measurement import InfraredResult, examine_infrared
from simgl.camera.infrared_detector import infrared_detectors
from simgl.commands.application import app


@pytest.mark.parametrize("name", sorted(infrared_detectors()))
def test_a_shipped_detector_is_measured_as_its_preset_says(name: str) -> None:
    result = CliRunner().invoke(app, ["camera", "test", name, "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    results = json.loads(result.output)["results"]
    assert all(r["passed"] for r in results)
    quantities = [r["quantity"] for r in results]
    assert "NETD at 300 K" in quantities
    assert ("time constant" in quantities) == (name == "bolometer_lwir")


def test_the_bench_sees_what_frames_show_not_what_the_preset_says() -> None:
    detector = infrared_detectors()["bolometer_lwir"]
    honest = {r.quantity: r.measured for r in examine_infrared(detector)}

    noisy = replace(detector, table=msgspec.structs.replace(detector.table, netd_mk=80.0))
    worse = {r.quantity: r.measured for r in examine_infrared(noisy)}
    assert worse["NETD at 300 K"] == pytest.approx(2.0 * honest["NETD at 300 K"], rel=0.03)
    assert worse["response at 300 K"] == pytest.approx(honest["response at 300 K"], rel=0.01)


def test_a_result_passes_within_its_tolerance() -> None:
    assert InfraredResult("x", "", 10.0, 10.09, 0.01).passed
    assert not InfraredResult("x", "", 10.0, 10.11, 0.01).passed
