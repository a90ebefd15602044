"""What the Earth sends to spacecraft as heat: its light as images show it, its warmth by place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.rendering.spacecraft_skies import ALL_WAVELENGTHS
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from simgl.thermal.heat_loads import outer_light
from simgl.thermal.history import ThermalState
from tests.passes.earth_light_scenes import (
    EARTH,
    PLACE,
    UP,
    as_irradiance,
    attitude,
    before,
    facing,
    plate,
)
from tests.scenes import SUN, TOTAL, lambert, scene

Array = np.ndarray[Any, np.dtype[np.float64]]
WGS84 = {"shape": "wgs84"}
# Long-wave heat has its own air.
AIRLESS = WGS84 | {"atmosphere": "none"}
SUN_X = np.array([1.0, 0.0, 0.0])
HEIGHT = 5e5
NADIR_PLATE = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(0.5)}}


def over(place: Array, sun: Array, earth: dict[str, Any] = WGS84) -> Scenario:
    """A plate that looks down on a place (3,), unit vector from the Earth's centre."""
    position = (6.378e6 + HEIGHT) * place
    plate_down = {
        "model": NADIR_PLATE,
        "position_icrf_m": position.tolist(),
        "quaternion_icrf_from_body_xyzw": attitude(-place).as_quat().tolist(),
    }
    direction = (float(sun[0]), float(sun[1]), float(sun[2]))
    camera = {"position_icrf_m": (1.1 * position).tolist(), "look_at": "body"}
    return scene({"body": plate_down}, camera, sun_direction=direction, earth=earth)


def on_the_plate(simulator: Simulator, scenario: Scenario) -> tuple[float, float]:
    """Reflected sunlight and long-wave heat of the Earth on the front of the plate [W m-2]."""
    state = scenario.at(scenario.epoch_tai_ns)
    body = simulator.thermal_bodies.of("body", state.bodies["body"].model)
    light = outer_light(body, state, simulator.skies.heat(state, "body"))
    front = body.patches.normals[:, 0, 2] > 0.5
    return float(light.albedo[front].mean()), float(light.earth_infrared[front].mean())


@pytest.mark.parametrize("zenith", [0.0, 60.0, 85.0])
def test_a_plate_gets_the_light_that_a_white_plate_shows(
    gl: moderngl.Context, zenith: float
) -> None:
    # Over maps, clouds and air: the image of a white plate that looks down, and its heat load.
    down = facing(0.0, 0.0)
    seen = before(plate(lambert(1.0)), attitude(down), -UP, zenith, earth=WGS84)
    with Simulator(seen, gl) as simulator:
        reflected, _ = on_the_plate(simulator, seen)
        state = seen.at(seen.epoch_tai_ns)
        frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
    assert frame is not None
    shown = as_irradiance(frame.radiance.astype(np.float64))
    assert reflected / ALL_WAVELENGTHS == pytest.approx(shown, rel=0.02)
    assert zenith > 80.0 or reflected > 20.0


def test_no_sunlight_comes_from_an_earth_that_is_dark(gl: moderngl.Context) -> None:
    # From the middle of the shadow the Earth's night side alone is seen.
    scenario = over(np.array([1.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]))
    with Simulator(scenario, gl) as simulator:
        reflected, warmth = on_the_plate(simulator, scenario)
    assert reflected < 1e-3
    assert warmth > 150.0


@pytest.fixture(scope="module")
def clouded(module_gl: moderngl.Context) -> Iterator[Simulator]:
    """Over the usual clouds."""
    with Simulator(over(SUN_X, SUN_X, AIRLESS), module_gl) as simulator:
        yield simulator


def spread_over_the_earth(count: int) -> Array:
    """(count, 3) places, evenly (Fibonacci's spiral)."""
    k = np.arange(count) + 0.5
    z, longitude = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(longitude), level * np.sin(longitude), z], axis=1)


def warmth_at(simulator: Simulator, places: Array, earth: dict[str, Any] = AIRLESS) -> Array:
    """(k,) long-wave heat of plates that look down [W m-2]."""
    return np.array([on_the_plate(simulator, over(one, SUN_X, earth))[1] for one in places])


PLACES = spread_over_the_earth(200)


@pytest.fixture(scope="module")
def fluxes(clouded: Simulator) -> Array:
    """(k,) what plates get that look down, spread over the Earth [W m-2]."""
    return warmth_at(clouded, PLACES)


def test_240_watts_leave_each_square_metre_in_the_mean(fluxes: Array) -> None:
    # What plates all over a sphere get that look down is what goes through it.
    mean = float(fluxes.mean()) * ((6.378e6 + HEIGHT) / 6.371e6) ** 2
    # By place the flux has 37 W m-2 rms, weather half of that, which 200 places average to 1.3;
    # cells of 7.5 deg along the limb know a plate's flux to 0.5 %.
    assert mean == pytest.approx(240.0, abs=3.0)


def test_high_cloud_sends_less_than_clear_land_and_sea_beside_it(
    clouded: Simulator, fluxes: Array
) -> None:
    tropical = np.abs(PLACES[:, 2]) < 0.25
    covered = fluxes[tropical]
    clear = warmth_at(clouded, PLACES[tropical], AIRLESS | {"clouds": {"cover": 0.0}})
    # The same ground at the same hour. A plate sees 22 deg around, which hold clouds and none
    # everywhere; under the rain belt's they take three times as much as over deserts.
    taken = clear - covered
    assert np.all(taken > 0.0)
    assert taken.max() > 3.0 * taken.min()
    cold, warm = covered[np.argmax(taken)], covered[np.argmin(taken)]
    assert cold < warm - 10.0


def test_spacecraft_that_share_a_sky_turn_it(gl: moderngl.Context) -> None:
    # The second spacecraft of a place sees the sky that was drawn in the axes of the first one.
    down, zenith = facing(0.0, 0.0), 60.0
    beside = {
        "model": NADIR_PLATE,
        "position_icrf_m": (PLACE + np.array([0.0, 0.0, 10.0])).tolist(),
        "quaternion_icrf_from_body_xyzw": attitude(np.array([0.6, 0.0, 0.8])).as_quat().tolist(),
    }
    got = []
    for other in (None, beside):
        scenario = before(NADIR_PLATE, attitude(down), -UP, zenith, earth=EARTH, beside=other)
        with Simulator(scenario, gl) as simulator:
            got.append(on_the_plate(simulator, scenario))
    # Cells of 1.9 deg, of which the limb crosses some, are turned to the nearest.
    np.testing.assert_allclose(got[1], got[0], rtol=0.01)


def test_the_heat_of_the_sun_does_not_depend_on_the_bands(gl: moderngl.Context) -> None:
    def absorbed(bands: dict[str, Any] | None) -> ThermalState:
        data: dict[str, Any] = {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {**SUN, "direction_icrf": [0.0, 0.0, 1.0]},
            "earth": {"shape": "none"},
            "spacecraft": {"body": {"model": NADIR_PLATE, "position_icrf_m": [0.0, 0.0, 0.0]}},
        }
        scenario = scenario_from_dict(data if bands is None else data | {"bands": bands})
        with Simulator(scenario, gl) as simulator:
            return simulator.thermal_bodies.steady(scenario.at(scenario.epoch_tai_ns))["body"]

    usual, narrow = absorbed(None), absorbed({"edges_nm": [[500.0, 600.0]]})
    assert usual.sunlight.max() == pytest.approx(TOTAL, rel=1e-3)
    assert narrow.sunlight.max() == pytest.approx(TOTAL, rel=1e-3)
