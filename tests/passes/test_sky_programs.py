"""Skies need no program during a flight that was not made before the first image."""

from __future__ import annotations

import moderngl
import pytest

from simgl.gpu import tile_quads
from simgl.gpu.context import current
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Simulator
from simgl.view.background import sky_view


def test_an_orbit_needs_no_new_program_for_skies(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    box = {"box": {"size_m": [1.0, 1.0, 1.0], "material": {"reflectance": 0.5}}}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"aurora_kp": 5.0},
            "spacecraft": {
                "box": {"model": box, "orbit": {"altitude_km": 400.0, "inclination_deg": 75.0}}
            },
            "camera": {"cam": {"about": {"target": "box", "azimuth_deg": 0.0, "range_m": 9.0}}},
        }
    )
    texels = set()
    with Simulator(scenario, gl) as simulator, current(gl):
        loaded: list[str] = []

        def load(_: moderngl.Context, name: str, **__: object) -> None:
            loaded.append(name)
            raise AssertionError(name)

        monkeypatch.setattr(tile_quads, "load_program", load)
        # Day, both terminators, land and sea, and a night with the Moon.
        for minutes in range(0, 92, 4):
            state = scenario.at(scenario.epoch_tai_ns + minutes * 60 * 10**9)
            sky = sky_view(state, "box", state.bodies["box"])
            assert sky is not None
            texels.add(sky.texels)
            simulator._renderer.skies.sky(sky)
        monkeypatch.undo()
    assert not loaded
    # Skies of every kind were drawn.
    assert texels == {64, 128, 256}
