"""Warmth that goes from one spacecraft to another."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.camera.infrared_detector import load_infrared_detector
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.scenario.loader import scenario_from_dict
from simgl.scene.mesh import box
from simgl.scene.state import SceneState
from simgl.scene.thermal_surface import ThermalPart
from simgl.thermal.between_bodies import neighbours, scene_heat_loads
from simgl.thermal.body import ThermalBody
from simgl.thermal.heat_loads import heat_loads
from simgl.thermal.history import ThermalState
from simgl.thermal.scene_temperatures import ThermalBodies
from simgl.thermal.sky_light import EmptySkies, SkyLight
from simgl.thermal.thermal_view import thermal_view
from tests.thermal.test_closed_forms import grey, painted
from tests.thermal.thermal_scenes import Table, heat_in_space, in_sunlight, surface

GAP = 0.004  # [m]


def two(first: Table, second: Table, apart: float, patches: int = 200) -> tuple[
    dict[str, ThermalBody], SceneState
]:  # fmt: skip
    """Two spacecraft in the dark, the second above the first and turned to it [m]."""
    scenario = in_sunlight(
        first,
        sun={"irradiance_w_m2": 1e-9, "direction_icrf": [1.0, 0.0, 0.0]},
        spacecraft={
            "low": {"model": first, "position_icrf_m": [0.0, 0.0, 0.0]},
            "high": {
                "model": second,
                "position_icrf_m": [0.0, 0.0, apart],
                # Half a turn about x.
                "quaternion_icrf_from_body_xyzw": [1.0, 0.0, 0.0, 0.0],
            },
        },
    )
    state = scenario.at(scenario.epoch_tai_ns)
    many = ThermalBodies(patches, EmptySkies())
    return {name: many.of(name, body.model) for name, body in state.bodies.items()}, state


def dark(bodies: dict[str, ThermalBody], state: SceneState) -> dict[str, SkyLight]:
    """What surrounds them."""
    return {name: heat_in_space(state, name) for name in bodies}


def sheet(emissivity: float) -> Table:
    """A plate of 1 m."""
    return {"plate": {"width_m": 1.0, "height_m": 1.0, "material": surface(0.5, emissivity)}}


def towards_the_other(body: ThermalBody) -> np.ndarray:
    """The patches of a plate's front."""
    return np.flatnonzero(body.patches.normals[:, 0, 2] > 0.5)


def test_two_plates_of_two_spacecraft_exchange_by_the_formula_of_parallel_plates() -> None:
    eps, kelvin = {"low": 0.8, "high": 0.3}, {"low": 350.0, "high": 250.0}
    bodies, state = two(sheet(eps["low"]), sheet(eps["high"]), GAP)
    temperatures = {n: np.full(len(b.network.capacity), kelvin[n]) for n, b in bodies.items()}
    loads = scene_heat_loads(bodies, state, dark(bodies, state), temperatures)
    expected = STEFAN_BOLTZMANN * (350.0**4 - 250.0**4) / (1.0 / 0.8 + 1.0 / 0.3 - 1.0)
    for name, sign in (("low", -1.0), ("high", 1.0)):
        body = bodies[name]
        front = towards_the_other(body)
        area = float(body.patches.areas[front].sum())
        assert area == pytest.approx(1.0, rel=1e-3)
        emitted = eps[name] * STEFAN_BOLTZMANN * kelvin[name] ** 4
        gained = float(loads[name].heat[front].sum()) / area - emitted
        # What leaves at the edges: the gap over the width on four sides, of the larger emission
        # and for each of the few reflections, over what is exchanged.
        hottest = 0.8 * STEFAN_BOLTZMANN * 350.0**4
        assert gained == pytest.approx(sign * expected, abs=4.0 * GAP * hottest)


def test_a_gap_between_plates_of_one_temperature_is_black() -> None:
    # As a closed box is, whatever the emissivities.
    bodies, state = two(sheet(0.3), sheet(0.6), GAP)
    detector = load_infrared_detector("bolometer_lwir")
    warm = {
        name: (
            body,
            ThermalState(
                tai_ns=state.tai_ns,
                temperatures=np.full(len(body.network.capacity), 300.0),
                sunlight=np.zeros(body.patch_count),
                heat=np.zeros(len(body.network.capacity)),
                history="steady",
                digest=name,
            ),
        )
        for name, body in bodies.items()
    }
    skies = {name: EmptySkies().in_band(state, name, detector) for name in bodies}
    lights = thermal_view(state, detector, warm, skies).lights
    black = float(detector.watts(np.array(300.0)))
    for name in bodies:
        mesh, reflected = lights[name].mesh.mesh, lights[name].values[:, 0, 2]
        # Near the edges there is space beside.
        middle = np.linalg.norm(mesh.positions, axis=1) < 0.3
        front = mesh.normals[:, 2] > 0.5
        np.testing.assert_allclose(reflected[middle & front], black, rtol=0.04)
        # The sides that look away see none of it.
        assert float(reflected[middle & ~front].max()) < 1e-3 * black


def test_a_sphere_gets_its_view_factor_from_another() -> None:
    ball: Table = {"sphere": {"radius_m": 1.0, "material": surface(0.5, 1.0)}}
    bodies, state = two(ball, ball, 4.0)
    near = neighbours(bodies, state)
    for pair in (("low", "high"), ("high", "low")):
        areas = bodies[pair[0]].patches.areas
        share = float((areas @ near.factors[pair]).sum()) / areas.sum()
        # A million random rays know it to 0.8 %.
        assert share == pytest.approx(_spheres(4.0), rel=0.03)
    first, second = near.factors["low", "high"], near.factors["high", "low"]
    one, other = (bodies[n].patches.areas for n in ("low", "high"))
    np.testing.assert_allclose(
        (first.toarray() * one[:, None]), (second.toarray() * other[:, None]).T, atol=1e-12
    )


def _spheres(distance: float) -> float:
    """View factor between two spheres of radius 1: the share of even rays from one that meet the
    other."""
    rng = np.random.default_rng(1)
    count = 1_000_000
    normal = rng.standard_normal((count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    way = rng.standard_normal((count, 3))
    way = normal + way / np.linalg.norm(way, axis=1, keepdims=True)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    to = np.array([0.0, 0.0, distance]) - normal
    along = np.einsum("ij,ij->i", to, way)
    miss = np.einsum("ij,ij->i", to, to) - along**2
    return float(np.mean((along > 0.0) & (miss < 1.0)))


def test_spacecraft_far_apart_have_the_heat_of_one_alone() -> None:
    bodies, state = two(sheet(0.8), sheet(0.3), 100.0)
    temperatures = {n: np.full(len(b.network.capacity), 300.0) for n, b in bodies.items()}
    skies = dark(bodies, state)
    loads = scene_heat_loads(bodies, state, skies, temperatures)
    for name, body in bodies.items():
        np.testing.assert_array_equal(loads[name].heat, heat_loads(body, state, skies[name]).heat)


def test_what_one_absorbs_is_what_the_other_sends() -> None:
    # Black plates: the second gets what the first emits towards it, and nothing comes back.
    bodies, state = two(sheet(1.0), sheet(1.0), GAP)
    kelvin = {"low": 300.0, "high": 4.0}
    temperatures = {n: np.full(len(b.network.capacity), kelvin[n]) for n, b in bodies.items()}
    loads = scene_heat_loads(bodies, state, dark(bodies, state), temperatures)
    sent = STEFAN_BOLTZMANN * 300.0**4
    assert float(loads["high"].heat.sum()) == pytest.approx(sent, rel=4.0 * GAP)
    assert float(loads["low"].heat.sum()) < 1e-3 * sent


def test_a_warm_spacecraft_warms_a_cold_one() -> None:
    # Two black boxes that conduct well, each of one temperature, with 400 and 20 W inside: each
    # gives off its power and what it gets of the other.
    cube = box((1.0, 1.0, 1.0))
    cold = painted(cube, grey(1.0, 1e5), part_0=ThermalPart(power=20.0))
    warm = painted(cube, grey(1.0, 1e5), part_0=ThermalPart(power=400.0))
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {"irradiance_w_m2": 1e-9, "direction_icrf": [1.0, 0.0, 0.0]},
            "earth": {"shape": "none"},
            "spacecraft": {
                "low": {"model": "wedge", "position_icrf_m": [0.0, 0.0, 0.0]},
                "high": {"model": "wedge", "position_icrf_m": [0.0, 0.3, 1.5]},
            },
        },
        models={"low": warm, "high": cold},
    )
    state, many = scenario.at(scenario.epoch_tai_ns), ThermalBodies(200, EmptySkies())
    bodies = {name: many.of(name, body.model) for name, body in state.bodies.items()}
    areas = bodies["high"].patches.areas
    share = float((areas @ neighbours(bodies, state).factors["high", "low"]).sum()) / areas.sum()
    steady = many.steady(state)
    first, second = (float(steady[name].temperatures.mean()) for name in ("low", "high"))
    sent = np.linalg.solve([[1.0, -share], [-share, 1.0]], [400.0 / 6.0, 20.0 / 6.0])
    assert [first, second] == pytest.approx((sent / STEFAN_BOLTZMANN) ** 0.25, abs=0.1)
    assert second > (20.0 / 6.0 / STEFAN_BOLTZMANN) ** 0.25 + 20.0
    # In time it gets there, too.
    later = many.advanced(steady, scenario.at(scenario.epoch_tai_ns + 10**12))
    for name in bodies:
        now, before = later[name].temperatures, steady[name].temperatures
        np.testing.assert_allclose(now, before, atol=0.02)
