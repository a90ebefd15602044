"""A Sun without light, which a scenario may ask for, still rises and sets."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import simgl


@pytest.mark.parametrize(("side", "share"), [(1.0, 1.0), (-1.0, 0.0)])
def test_the_share_of_its_light_is_that_of_any_sun(side: float, share: float) -> None:
    tables = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {"direction_icrf": [1.0, 0.0, 0.0], "irradiance_w_m2": 0.0},
        "camera": {"c": {"position_icrf_m": [7e6, 0, 0], "boresight": [1, 0, 0], "up": [0, 0, 1]}},
    }
    scenario = simgl.scenario_from_dict(tables)
    with warnings.catch_warnings(action="error"):
        seen = scenario.at(scenario.epoch_tai_ns).sunlit_share(np.array([side * 7e6, 0.0, 0.0]))
    assert seen == share
