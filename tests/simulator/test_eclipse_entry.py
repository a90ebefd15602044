"""Light of an exposure in which a spacecraft enters the Earth's shadow."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from tests.scenes import lambert
from tests.simulator.moving_scenes import electrons

# From the epoch until half of the Sun's light is gone [s].
DUSK = 1681.0


def craft(exposure_time_s: float, **camera: object) -> Scenario:
    """A ball in low orbit, before a camera that flies along."""
    place = {"target": "craft", "azimuth_deg": 150, "elevation_deg": 60, "range_m": 50.0}
    size = {"width_px": 64, "height_px": 64, "exposure_time_s": exposure_time_s}
    model = {"sphere": {"radius_m": 0.3, "material": lambert(0.5)}}
    orbit = {"altitude_km": 400, "inclination_deg": 51.6}
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:10:00"},
            "spacecraft": {"craft": {"model": model, "orbit": orbit}},
            "camera": {"cam": {"about": place, "shutter": "global", **size, **camera}},
        }
    )


def sunlight(one: Scenario, seconds: float) -> Array:
    state = one.at(one.epoch_tai_ns + round(1e9 * seconds))
    return state.sunlight(state.bodies["craft"].pose.position)


def test_sunlight_is_the_mean_over_the_exposure(gl: moderngl.Context) -> None:
    """Of 5 s, within 0.5 % of still images of 10 instants."""
    one, length = craft(5.0), 5.0
    middle = one.epoch_tai_ns + round(1e9 * (DUSK + 6.0))
    shares = (np.arange(10) + 0.5) / 10.0 - 0.5
    times = (middle + np.round(1e9 * length * shares).astype(int)).tolist()
    with Simulator(one, gl) as simulator:
        still = electrons(simulator, one.at(middle), None).sum()
        image = electrons(simulator, one.at(middle), one.around(middle)).sum()
        wanted = np.mean([electrons(simulator, one.at(time), None).sum() for time in times])
    # The light of the middle is 5 % off, or more.
    assert abs(still - wanted) > 0.03 * wanted
    assert image == pytest.approx(wanted, rel=5e-3)


def test_of_short_exposures_the_light_of_the_middle_is_the_mean() -> None:
    """Of 0.2 s to 5e-5 of full sunlight, all along the penumbra."""
    one = craft(0.1)
    assert sunlight(one, DUSK - 30.0).min() > 0.9999
    assert sunlight(one, DUSK + 30.0).max() < 1e-3
    for seconds in np.arange(DUSK - 12.0, DUSK + 16.0, 2.0).tolist():
        ends = [sunlight(one, seconds + side * 0.1) for side in (-1.0, 1.0)]
        middle = sunlight(one, seconds)
        # Simpson's rule.
        mean = (ends[0] + 4.0 * middle + ends[1]) / 6.0
        np.testing.assert_allclose(middle, mean, atol=5e-5)
