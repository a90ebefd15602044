"""The example trajectories load, and their cameras see the target during a whole revolution."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.scenario.loader import load_scenario

FOLDER = Path(__file__).parents[2] / "examples" / "trajectories"
MINUTE = 60_000_000_000


@pytest.mark.parametrize(("name", "target"), [("files", "target"), ("tle", "station")])
def test_the_chaser_stays_near_and_looks_at_the_target(name: str, target: str) -> None:
    scenario = load_scenario(FOLDER / f"{name}.toml")
    for minutes in (0, 20, 47, 95):
        state = scenario.at(scenario.epoch_tai_ns + minutes * MINUTE)
        camera = state.cameras["navcam"]
        line = state.bodies[target].pose.position - camera.position
        distance = np.linalg.norm(line)
        assert 50.0 < distance < 600.0
        ahead = camera.R_camera_from_icrf @ line / distance
        np.testing.assert_allclose(ahead, [0.0, 0.0, 1.0], atol=1e-9)
        altitude = np.linalg.norm(state.bodies[target].pose.position) - 6378137.0
        assert 3.8e5 < altitude < 4.4e5
