"""Two balls over the Earth, as the window opens on them."""

from __future__ import annotations

from pathlib import Path

import pytest

from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.viewer.view_settings import ViewSettings, opening_settings

# A grey ball above the lit Earth, a small one 40 m behind it, and a camera of another shape.
SCENARIO = """
[epoch]
utc = "2026-03-20T12:00:00"

[spacecraft.ball]
model.sphere = { radius_m = 2.0, material = { reflectance = 0.5 } }
orbit = { altitude_km = 845.0, inclination_deg = 5.0, true_anomaly_deg = 35.0 }

[spacecraft.small]
model.sphere = { radius_m = 0.5, material = { reflectance = 0.5 } }
relative_to = "ball"
position_lvlh_m = [-40.0, 0.0, 0.0]

[camera.square]
about = { target = "ball", azimuth_deg = 20.0, range_m = 20.0 }
width_px = 200
height_px = 200
"""


@pytest.fixture
def scenario_path(tmp_path: Path) -> Path:
    path = tmp_path / "two_balls.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@pytest.fixture
def scenario(scenario_path: Path) -> Scenario:
    return load_scenario(scenario_path)


@pytest.fixture
def look(scenario: Scenario) -> ViewSettings:
    return opening_settings(scenario, None)
