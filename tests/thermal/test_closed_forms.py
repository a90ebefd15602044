"""Temperatures with closed forms: sphere, insulated plate, two plates, closed box; to 0.1 K."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh, box, plate
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.thermal_surface import ThermalPart, ThermalSurface
from simgl.thermal.body import STRUCTURE_HEAT_CAPACITY, thermal_body
from simgl.thermal.heat_loads import heat_loads
from simgl.thermal.history import steady_state
from simgl.thermal.network import SPACE_TEMPERATURE
from tests.thermal.thermal_scenes import (
    FINISHES,
    SUNLIGHT,
    heat_in_space,
    in_sunlight,
    merged,
    moved,
    surface,
    turned_inside_out,
)

# The goal for closed forms [K].
GOAL = 0.1


def painted(mesh: Mesh, *surfaces: ThermalSurface, **parts: ThermalPart) -> SpacecraftModel:
    """A model whose materials have these surfaces."""
    names = [f"part_{i}" for i in range(len(surfaces))]
    materials = tuple(
        Material(name=name, reflectance=(0.5, 0.5, 0.5, 0.5), thermal=s)
        for name, s in zip(names, surfaces, strict=True)
    )
    return SpacecraftModel(
        name="body", mesh=mesh, parts=tuple(names), materials=materials, thermal=parts
    )


def grey(emissivity: float, conductance: float = 0.0) -> ThermalSurface:
    """A surface of one emissivity for all light."""
    return ThermalSurface(
        solar_absorptance=emissivity,
        infrared_emissivity=emissivity,
        heat_capacity=1000.0,
        conductance=conductance,
    )


@pytest.mark.parametrize("finish", FINISHES)
def test_a_sphere_that_conducts_well_has_one_temperature(finish: str) -> None:
    alpha, epsilon = FINISHES[finish]
    # Differences within it are far below the goal at this conductance.
    model = {"sphere": {"radius_m": 1.0, "material": surface(alpha, epsilon, 1e5)}}
    scenario = in_sunlight(model)
    body = thermal_body("body", scenario.models["body"], 600)
    scene = scenario.at(scenario.epoch_tai_ns)
    state = steady_state(body, scene, heat_in_space(scene))
    expected = (alpha * SUNLIGHT / (4.0 * epsilon * STEFAN_BOLTZMANN)) ** 0.25
    assert np.abs(state.temperatures - expected).max() < GOAL


@pytest.mark.parametrize("finish", FINISHES)
def test_a_plate_insulated_behind(finish: str) -> None:
    alpha, epsilon = FINISHES[finish]
    model = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": surface(alpha, epsilon)}}
    scenario = in_sunlight(model)
    body = thermal_body("body", scenario.models["body"], 200)
    scene = scenario.at(scenario.epoch_tai_ns)
    state = steady_state(body, scene, heat_in_space(scene))
    expected = (alpha * SUNLIGHT / (epsilon * STEFAN_BOLTZMANN)) ** 0.25
    front = body.patches.normals[:, 0, 2] > 0.5
    # The plate's skin conducts around its edges: away from them nothing does.
    assert state.temperatures[: body.patch_count][front].max() == pytest.approx(expected, abs=GOAL)


@pytest.mark.parametrize("emissivity", [0.9, 0.2])
def test_a_closed_box_of_one_temperature_radiates_like_a_black_body(emissivity: float) -> None:
    # Whatever its emissivity, the light within is sigma T^4: a part of it at another temperature
    # gets eps (sigma T^4 - sigma t^4).
    body = thermal_body(
        "body", painted(turned_inside_out(box((1.0, 2.0, 3.0))), grey(emissivity)), 400
    )
    network, count = body.network, body.patch_count
    t = np.full(len(network.capacity), 300.0)
    scale = STEFAN_BOLTZMANN * 300.0**4
    # Symmetry and closure hold to rounding, whatever rays missed.
    assert np.abs(network.net_heat(t, np.zeros(len(t)))).max() < 1e-7 * scale
    assert network.to_space.sum() < 1e-7 * body.patches.areas.sum()
    t[0] = 250.0
    # By radiation: without what its neighbours conduct to it.
    gained = (network.net_heat(t, np.zeros(len(t))) + network.conduction @ t)[0]
    share = body.patches.areas[0] / body.patches.areas[:count].sum()
    expected = emissivity * body.patches.areas[0] * (scale - STEFAN_BOLTZMANN * 250.0**4)
    # What the cold patch sees of itself by reflection, at most (1 - eps) of its share.
    assert gained == pytest.approx(expected, rel=2.0 * share / emissivity + 1e-3)


def exchange_of_two_plates(gap: float) -> tuple[float, float]:
    """What two plates of 1 m exchange, 350 and 250 K warm, and the formula of parallel plates
    [W m-2].

    gap : between them [m]; the edges lose this share on four sides
    """
    low = plate(1.0, 1.0)
    # Half a turn about x.
    turn = np.array([1.0, -1.0, -1.0], dtype=np.float32)
    high = replace(low, positions=low.positions * turn, normals=low.normals * turn)
    high = moved(high, (0.0, 0.0, gap))
    eps_1, eps_2 = 0.8, 0.3
    body = thermal_body("body", painted(merged(low, high), grey(eps_1), grey(eps_2)), 300)
    z = body.patches.normals[:, 0, 2]
    inner_1 = np.flatnonzero((body.part == 0) & (z > 0.5))
    inner_2 = np.flatnonzero((body.part == 1) & (z < -0.5))
    difference = STEFAN_BOLTZMANN * (350.0**4 - 250.0**4)
    exchanged = float(body.network.coupling[inner_1][:, inner_2].sum())
    return exchanged * difference, difference / (1.0 / eps_1 + 1.0 / eps_2 - 1.0)


def test_two_plates_face_to_face_exchange_by_the_formula_of_parallel_plates() -> None:
    gap = 0.002
    flow, expected = exchange_of_two_plates(gap)
    # The edges lose the share gap / width on four sides, once for each of the few reflections.
    assert flow == pytest.approx(expected, rel=8.0 * gap)


def test_internal_power_leaves_by_radiation() -> None:
    power = 100.0
    model = painted(box((1.0, 1.0, 1.0)), grey(0.85, 1e5), part_0=ThermalPart(power=power))
    body = thermal_body("body", model, 200)
    t = body.network.steady(body.power)
    space = SPACE_TEMPERATURE**4
    expected = (power / (0.85 * 6.0 * STEFAN_BOLTZMANN) + space) ** 0.25
    assert np.abs(t - expected).max() < GOAL


def test_sunlight_on_a_sphere_is_its_cross_section() -> None:
    scenario = in_sunlight({"sphere": {"radius_m": 1.0, "material": surface(1.0, 1.0)}})
    body = thermal_body("body", scenario.models["body"], 600)
    scene = scenario.at(scenario.epoch_tai_ns)
    loads = heat_loads(body, scene, heat_in_space(scene))
    caught = float(body.patches.areas @ loads.sunlight)
    # The mesh of 192 segments has a cross-section 3.6e-4 smaller than the sphere's; the band
    # fraction of the Sun adds nothing at 5772 K.
    assert caught == pytest.approx(np.pi * SUNLIGHT, rel=5e-4)


def test_the_structure_of_a_part_goes_with_its_volume() -> None:
    size = (1.0, 2.0, 0.02)
    body = thermal_body("body", painted(moved(box(size), (5.0, 0.0, 0.0)), grey(0.8)), 60)
    expected = STRUCTURE_HEAT_CAPACITY * float(np.prod(size))
    assert body.network.capacity[-1] == pytest.approx(expected, rel=1e-5)
