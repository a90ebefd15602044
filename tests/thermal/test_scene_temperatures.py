"""Temperatures of a scene at any time: a pure function of it, in sequences as well."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import OpenEXR
import pytest

from simgl.errors import SimglError
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.sequence.run_sequence import Output, Plan, run
from simgl.simulator import Simulator
from simgl.thermal.scene_temperatures import (
    RememberedTemperatures,
    TemperatureHistory,
    ThermalBodies,
    UnknownTemperaturesError,
    name_of,
)
from simgl.thermal.sky_light import Skies
from tests.thermal.test_thermal_image import sheet

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """A plate in orbit, with a visible and a thermal camera."""
    seen = {
        "about": {"target": "body", "azimuth_deg": 30.0, "elevation_deg": 40.0, "range_m": 10.0},
        "width_px": 48,
        "height_px": 40,
        "focal_length_px": 150.0,
    }
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3},
            "spacecraft": {
                "body": {"model": sheet(0.8), "orbit": {"altitude_km": 500.0}},
            },
            "camera": {
                "infrared": seen | {"thermal": {"detector": "bolometer_lwir"}},
                "visible": seen,
            },
            "thermal": {"patches": 40, "step_s": 20.0},
        }
    )


@pytest.fixture(scope="module")
def skies(module_gl: moderngl.Context, scenario: Scenario) -> Iterator[Skies]:
    """What the plate has around it."""
    with Simulator(scenario, module_gl) as simulator:
        yield simulator.skies


def history(scenario: Scenario, skies: Skies) -> TemperatureHistory:
    """Its temperatures, nothing of them worked out yet."""
    bodies = ThermalBodies(scenario.thermal_patches, skies)
    return TemperatureHistory(bodies, scenario.at, scenario.epoch_tai_ns, 20 * SECOND)


def test_temperatures_depend_on_the_time_alone(scenario: Scenario, skies: Skies) -> None:
    first = scenario.epoch_tai_ns
    times = [first + second * SECOND for second in (0, 30, 130, 70, 20, 131)]
    asked_in_turn = history(scenario, skies)
    together = {time: asked_in_turn.at(time) for time in times}
    for time, known in together.items():
        alone = history(scenario, skies).at(time)
        assert name_of(alone) == name_of(known)
        np.testing.assert_array_equal(alone["body"].temperatures, known["body"].temperatures)
    assert together[first]["body"].history == "steady"
    assert together[times[1]]["body"].history == "from the steady state"
    assert len({name_of(known) for known in together.values()}) == len(times)


def test_named_temperatures_go_on_and_branch(scenario: Scenario, skies: Skies) -> None:
    bodies, known = ThermalBodies(40, skies), RememberedTemperatures()
    at = [scenario.at(scenario.epoch_tai_ns + second * SECOND) for second in (0, 20, 40)]
    start = name_of(known.reached(bodies, at[0], ""))
    middle = name_of(known.reached(bodies, at[1], start))
    slow = known.reached(bodies, at[2], middle)
    # Another way to the same time is another state.
    fast = known.reached(bodies, at[2], start)
    assert name_of(slow) != name_of(fast)
    assert name_of(known.reached(bodies, at[2], middle)) == name_of(slow)
    # The same instant again: the temperatures that it names.
    assert name_of(known.reached(bodies, at[1], middle)) == middle
    with pytest.raises(SimglError, match="20 s later than tai_ns"):
        known.reached(bodies, at[0], middle)
    with pytest.raises(UnknownTemperaturesError, match="not remembered"):
        known.reached(bodies, at[2], "f" * 32)


def test_a_sequence_has_both_cameras_and_their_temperatures(
    gl: moderngl.Context, scenario: Scenario, skies: Skies, tmp_path: Path
) -> None:
    epochs = [scenario.epoch_tai_ns + second * SECOND for second in (0, 50)]
    plan = Plan(
        scenario=scenario,
        cameras=("visible", "infrared"),
        epochs=epochs,
        outputs=frozenset({Output.DN, Output.VIEW, Output.EXR}),
    )
    with Simulator(scenario, gl) as simulator:
        run(plan, simulator, tmp_path / "both")
    later = history(scenario, skies).at(epochs[1])
    with OpenEXR.File(str(tmp_path / "both/infrared/000001.thermal.exr")) as file:
        header = dict(file.header())
    assert header["thermalState"] == name_of(later)
    assert header["thermalHistory"] == "from the steady state"
    written = {p.relative_to(tmp_path / "both").as_posix() for p in tmp_path.rglob("*.*")}
    assert {"visible/000001.radiance.exr", "infrared/000000.view.png"} <= written
