"""Heat from Sun and Earth, against view factors in closed form."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from simgl.physics.constants import SOLAR_CONSTANT
from simgl.physics.earth_infrared import MEAN_LONGWAVE
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.heat_loads import OuterLight, outer_light
from simgl.thermal.history import thermal_history
from simgl.thermal.sky_light import Skies
from tests.thermal.thermal_scenes import SUNLIGHT, heat_in_space, in_sunlight, surface

RADIUS, HEIGHT, ALBEDO, FLUX = 6371e3, 500e3, 0.12, 239.0


def over_a_sphere(
    sun: tuple[float, float, float], above: tuple[int, int, int] = (1, 0, 0), **earth: float
) -> Scenario:
    """A box of 1 m over a place of a spherical Earth, the Sun in a direction."""
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {
                "irradiance_w_m2": SUNLIGHT,
                "temperature_k": 5772.0,
                "angular_diameter_deg": 0.526,
                "direction_icrf": list(sun),
            },
            "earth": {"shape": "sphere", "radius_km": 1e-3 * RADIUS, "albedo": ALBEDO} | earth,
            "spacecraft": {
                "body": {
                    "model": {"box": {"size_m": [1.0, 1.0, 1.0], "material": surface(1.0, 1.0)}},
                    "position_icrf_m": [(RADIUS + HEIGHT) * axis for axis in above],
                }
            },
        }
    )


@pytest.fixture(scope="module")
def skies(module_gl: moderngl.Context, noon: Scenario) -> Iterator[Skies]:
    """What the box has around it."""
    with Simulator(noon, module_gl) as simulator:
        yield simulator.skies


@pytest.fixture(scope="module")
def noon() -> Scenario:
    """The Sun behind the box, over its nadir."""
    return over_a_sphere((1.0, 0.0, 0.0))


def body_in_light(gl: moderngl.Context, scenario: Scenario) -> tuple[ThermalBody, OuterLight]:
    """The body and the light on it."""
    body = thermal_body("body", scenario.models["body"], 60)
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        return body, outer_light(body, state, simulator.skies.heat(state, "body"))


def test_the_earth_on_faces_of_a_box(gl: moderngl.Context) -> None:
    # The same flux everywhere, for which there are closed forms.
    body, light = body_in_light(gl, over_a_sphere((1.0, 0.0, 0.0), longwave_w_m2=FLUX))
    x = body.patches.normals[:, 0, 0]
    h = (RADIUS + HEIGHT) / RADIUS
    # View factors from a plate to a sphere (Hamilton & Morgan 1952): towards it 1 / h^2, at right
    # angles to it, and away from it.
    root = np.sqrt(h * h - 1.0)
    sideways = (np.arctan(1.0 / root) - root / h**2) / np.pi
    for chosen, factor in ((x < -0.5, h**-2), (np.abs(x) < 0.5, sideways), (x > 0.5, 0.0)):
        mean = float(light.earth_infrared[chosen].mean())
        # 512 rays on cells of 7.5 deg, a quarter of which the limb crosses.
        assert mean / FLUX == pytest.approx(factor, abs=0.005)


def test_the_tropics_are_warmer_below_than_the_poles(gl: moderngl.Context) -> None:
    # Over the pole and over the equator, a plate that looks down: flux by latitude.
    warm, cold = (over_a_sphere((1.0, 0.0, 0.0), place) for place in ((1, 0, 0), (0, 0, 1)))
    fluxes = []
    for scenario, axis in ((warm, 0), (cold, 2)):
        body, light = body_in_light(gl, scenario)
        down = body.patches.normals[:, 0, axis] < -0.5
        h = (RADIUS + HEIGHT) / RADIUS
        fluxes.append(float(light.earth_infrared[down].mean()) * h * h)
    # By North's climate 14 K warmer than the mean, at noon 3.5 K more, and 28 K colder, in March by
    # 10 K cos(2 pi (79 - 205) / 365) more; at 2.09 W m-2 K-1. Seen are places up to 22 deg away:
    # 2 K on the way.
    assert fluxes[0] == pytest.approx(MEAN_LONGWAVE + 2.09 * 17.5, abs=4.0)
    assert fluxes[1] == pytest.approx(MEAN_LONGWAVE - 2.09 * (28.0 + 5.6), abs=4.0)


def test_sunlight_reflected_at_the_subsolar_point(gl: moderngl.Context, noon: Scenario) -> None:
    body, light = body_in_light(gl, noon)
    nadir = body.patches.normals[:, 0, 0] < -0.5
    # The integral of the ground's Lambertian radiance over the cap that is seen, with mu the cosine
    # of the angle at the Earth's centre.
    h = (RADIUS + HEIGHT) / RADIUS
    mu = np.linspace(1.0 / h, 1.0, 20001)
    distance2 = 1.0 + h * h - 2.0 * h * mu
    kernel = mu * (h * mu - 1.0) * (h - mu) / distance2**2
    factor = 2.0 * np.trapezoid(kernel, mu)
    expected = ALBEDO * SUNLIGHT * factor
    assert float(light.albedo[nadir].mean()) == pytest.approx(expected, rel=0.01)


def test_no_sunlight_in_the_earths_shadow(gl: moderngl.Context) -> None:
    _, light = body_in_light(gl, over_a_sphere((-1.0, 0.0, 0.0)))
    assert not light.sunlight.any()
    assert light.earth_infrared.max() > 0.8 * MEAN_LONGWAVE


def test_a_spacecraft_in_front_takes_the_sunlight() -> None:
    shade = {
        "model": {"box": {"size_m": [2.0, 2.0, 0.1], "material": surface(1.0, 1.0)}},
        "position_icrf_m": [0.0, 0.0, 5.0],
    }
    model = {"box": {"size_m": [1.0, 1.0, 1.0], "material": surface(1.0, 1.0)}}
    scenario = in_sunlight(model, spacecraft={
        "body": {"model": model, "position_icrf_m": [0.0, 0.0, 0.0]}, "shade": shade,
    })  # fmt: skip
    state = scenario.at(scenario.epoch_tai_ns)
    shaded, lit = (
        outer_light(
            thermal_body(name, scenario.models[name], 60), state, heat_in_space(state)
        ).sunlight
        for name in ("body", "shade")
    )
    assert shaded.max() == 0.0
    assert lit.max() == pytest.approx(SUNLIGHT, rel=1e-4)


def test_the_ephemeris_sun_has_its_total_irradiance(gl: moderngl.Context) -> None:
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-04-03T12:00:00"},
            "spacecraft": {
                "body": {
                    "model": {"sphere": {"radius_m": 1.0, "material": surface(1.0, 1.0)}},
                    "orbit": {"altitude_km": 36000.0, "inclination_deg": 0.0},
                }
            },
        }
    )
    body, light = body_in_light(gl, scenario)
    caught = float(body.patches.areas @ light.sunlight) / np.pi
    # In early April the Earth passes 1 au, to 0.1 % of the distance.
    assert caught == pytest.approx(SOLAR_CONSTANT, rel=3e-3)


def test_a_history_is_a_pure_function_and_says_what_it_is(noon: Scenario, skies: Skies) -> None:
    body = thermal_body("body", noon.models["body"], 60)
    again = thermal_body("body", noon.models["body"], 60)
    epochs = [noon.epoch_tai_ns + i * 10_000_000_000 for i in range(4)]
    first, second = (list(thermal_history(b, noon, epochs, skies)) for b in (body, again))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.temperatures, b.temperatures)
        assert a.digest == b.digest
    assert first[0].history == "steady"
    assert first[-1].history == "from the steady state"
    assert len({state.digest for state in first}) == len(first)
    # Another past, another name.
    shorter = list(thermal_history(body, noon, epochs[1:], skies))
    assert shorter[-1].digest != first[-1].digest


def test_a_periodic_start_comes_back(noon: Scenario, skies: Skies) -> None:
    body = thermal_body("body", noon.models["body"], 60)
    epochs = [noon.epoch_tai_ns + i * 60_000_000_000 for i in range(20)]
    states = list(thermal_history(body, noon, epochs, skies, "periodic"))
    change = np.abs(states[-1].temperatures - states[0].temperatures).max()
    assert change < 0.05
    assert states[0].history == "periodic"
