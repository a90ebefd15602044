"""No frame of the first minute waits for a program of a kind of the Earth's tiles that is new."""

from __future__ import annotations

import moderngl
import pytest

from simgl.gpu.program import load_program
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Simulator


def test_kinds_of_tiles_of_the_first_minute_are_compiled_before_the_first_image(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The view of the bench scene ``four_cameras`` on which glint comes after 10 s, and land under
    high clouds after 40 s."""
    box = {"box": {"size_m": [1.0, 1.0, 1.0], "material": {"reflectance": 0.5}}}
    orbit = {"altitude_km": 400.0, "inclination_deg": 5.0, "true_anomaly_deg": 35.0}
    about = {"target": "box", "azimuth_deg": 118.0, "range_m": 200.0}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"box": {"model": box, "orbit": orbit}},
            "camera": {"cam": {"about": about, "width_px": 600, "height_px": 600}},
            "render": {"inter_reflection": False},
        }
    )
    with Simulator(scenario, gl) as simulator:
        simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam")
        loaded: list[object] = []

        def load(*arguments: object, **options: object) -> moderngl.Program:
            loaded.append(options["defines"])
            return load_program(*arguments, **options)  # type: ignore[arg-type]

        monkeypatch.setattr("simgl.gpu.tile_quads.load_program", load)
        for seconds in (10, 20, 40, 60):
            simulator.capture(scenario.at(scenario.epoch_tai_ns + seconds * 10**9), "cam")
    assert not loaded
