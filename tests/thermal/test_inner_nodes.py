"""Nodes without a surface and links: closed forms, the heat balance, and the model card."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from typer.testing import CliRunner

from simgl.arrays import Array
from simgl.commands.application import app
from simgl.errors import ConfigError, SimglError
from simgl.model_files.model_library import load_model
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.scene.mesh import box
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.thermal_surface import ThermalLink, ThermalNode, ThermalPart
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.network import SPACE_TEMPERATURE
from tests.thermal.cubesat import PUBLISHED, cubesat_body, node, under_published_heat
from tests.thermal.test_closed_forms import grey, painted
from tests.thermal.test_thermal_command import card

AREA, EMISSIVITY = 0.06, 0.85
CUBE = painted(box((0.1, 0.1, 0.1)), grey(EMISSIVITY, 1e6), part_0=ThermalPart(heat_capacity=200.0))
TABLES = """
[thermal_node.board]
heat_capacity_j_k = 40.0
power_w = 1.0
[thermal_node.battery]
heat_capacity_j_k = 80.0
[[thermal_link]]
between = ["board", "wedge"]
conductance_w_k = 0.5
[[thermal_link]]
between = ["board", "battery"]
radiative_coupling_m2 = 0.004
"""


def with_inside(
    model: SpacecraftModel, nodes: Mapping[str, ThermalNode], *links: ThermalLink
) -> ThermalBody:
    """The network of a model with nodes inside."""
    return thermal_body("body", replace(model, thermal_nodes=nodes, thermal_links=links), 24)


def conducting(first: str, second: str, conductance: float) -> ThermalLink:
    """A link that does not radiate."""
    return ThermalLink(between=(first, second), conductance=conductance)


def test_power_inside_leaves_over_links_in_series() -> None:
    # Battery to board to part by conduction, a lamp to the part by radiation alone.
    body = with_inside(
        CUBE,
        {
            "battery": ThermalNode(heat_capacity=80.0, power=2.0),
            "board": ThermalNode(heat_capacity=20.0, power=1.0),
            "lamp": ThermalNode(heat_capacity=5.0, power=0.5),
        },
        conducting("battery", "board", 0.5),
        conducting("part_0", "board", 0.25),
        ThermalLink(between=("lamp", "part_0"), radiative_coupling=0.002),
    )
    t = body.network.steady(body.power)
    outside = 3.5 / (EMISSIVITY * STEFAN_BOLTZMANN * AREA) + SPACE_TEMPERATURE**4
    part = outside**0.25
    # The balance of 3e-7 of the flows of 7 W, over 0.25 W K-1.
    assert t[: body.patch_count + 1] == pytest.approx(part, abs=1e-4)
    assert t[node(body, "board")] == pytest.approx(part + 3.0 / 0.25, abs=1e-4)
    assert t[node(body, "battery")] == pytest.approx(part + 3.0 / 0.25 + 2.0 / 0.5, abs=1e-4)
    lamp = outside + 0.5 / (STEFAN_BOLTZMANN * 0.002)
    assert t[node(body, "lamp")] == pytest.approx(lamp**0.25, abs=1e-3)


def test_a_chain_of_three_follows_an_orbit_of_two_levels() -> None:
    # Without radiation the law is linear: T = T_end + exp(-t L / C) (T_start - T_end) with all
    # heat, which grows with time, taken off: exp of one matrix that holds the heat as well.
    dark = replace(CUBE, materials=painted(box((0.1, 0.1, 0.1)), grey(0.0, 1e6)).materials)
    body = with_inside(
        dark,
        {"a": ThermalNode(heat_capacity=60.0), "b": ThermalNode(heat_capacity=25.0, power=1.5)},
        conducting("part_0", "a", 0.4),
        conducting("a", "b", 0.1),
    )
    capacity = np.array([200.0 + 1000.0 * AREA, 60.0, 25.0])
    rates = np.array([[-0.4, 0.4, 0.0], [0.4, -0.5, 0.1], [0.0, 0.1, -0.1]]) / capacity[:, None]
    places = [body.patch_count, node(body, "a"), node(body, "b")]
    lit = np.zeros(len(body.power))
    lit[: body.patch_count] = 12.0 * body.patches.areas / AREA
    t, exact, step = np.full(len(lit), 280.0), np.full(3, 280.0), 2.0
    for share, seconds in ((1.0, 3400.0), (-0.6, 2100.0)) * 2:
        heat = np.array([12.0 * share, 0.0, 1.5])
        exact = _after(rates, heat / capacity, exact, seconds)
        for _ in range(round(seconds / step)):
            light = share * lit + body.power
            t = body.network.step(t, light, light, step)
        # Implicit Euler is off by half a step of the change of the rates, 12 W over 200 J K-1: of
        # that the second order leaves a step over the shortest time of the chain, 60 s.
        first_order = 0.5 * step * 12.0 * 1.6 / 260.0
        np.testing.assert_allclose(t[places], exact, atol=first_order * step / 60.0)


def _after(rates: Array, driven: Array, start: Array, seconds: float) -> Array:
    """Of dT/dt = rates T + driven."""
    both = np.zeros((4, 4))
    both[:3, :3], both[:3, 3] = rates, driven
    return np.asarray((expm(seconds * both) @ np.append(start, 1.0))[:3])


def test_the_heat_balance_closes_with_nodes_inside() -> None:
    body, rng = cubesat_body(), np.random.default_rng(4)
    network = body.network
    t = rng.uniform(240.0, 310.0, len(network.capacity))
    for seconds in (1.0, 10.0, 60.0, 600.0):
        heat = body.power.copy()
        heat[: body.patch_count] += rng.uniform(0.0, 5.0, body.patch_count)
        after = network.implicit_step(t, heat, seconds)
        stored = float(network.capacity @ (after - t)) / seconds
        lost = float(STEFAN_BOLTZMANN * network.to_space @ (after**4 - SPACE_TEMPERATURE**4))
        assert abs(heat.sum() - stored - lost) < 1e-6 * (heat.sum() + lost)
        t = after


def test_a_published_cubesat_has_its_published_temperatures() -> None:
    body = cubesat_body()
    assert len(body.network.capacity) - body.patch_count == 78
    assert body.network.capacity.sum() == pytest.approx(1029.25, abs=0.05)
    for name, seen in under_published_heat(body).items():
        # The published solver is good for 0.12 K, and holds the light of the last 5 s.
        assert seen == pytest.approx(PUBLISHED[name], abs=0.2), name


def test_a_card_has_nodes_and_links(tmp_path: Path) -> None:
    model = load_model(str(card(tmp_path, TABLES)))
    assert model.thermal_nodes["board"] == ThermalNode(heat_capacity=40.0, power=1.0)
    assert model.thermal_links[1] == ThermalLink(
        between=("board", "battery"), radiative_coupling=0.004
    )
    body = thermal_body("wedge", model, 40)
    t = body.network.steady(body.power)
    board, battery = node(body, "board"), node(body, "battery")
    assert t[board] - t[body.patch_count] == pytest.approx(1.0 / 0.5, abs=1e-3)
    assert t[battery] == pytest.approx(t[board], abs=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('["board", "wedge"]', '["board", "wegde"]',
         'card.toml: thermal_link[0].between has "wegde", no part or thermal_node; did you mean '
         '"wedge"? (allowed: battery, board, wedge)'),
        ('["board", "wedge"]', '["board", "board"]',
         'card.toml: thermal_link[0].between joins "board" with itself'),
        ("conductance_w_k = 0.5", "",
         "card.toml: thermal_link[0] needs conductance_w_k or radiative_coupling_m2 above 0, "
         "and none below"),
        ("conductance_w_k = 0.5", "conductance_w_k = -0.5",
         "card.toml: thermal_link[0].conductance_w_k must be a number >= 0.0, got -0.5"),
        ('["board", "wedge"]', '["board"]',
         'card.toml: thermal_link[0].between must be a list of length 2, got ["board"]'),
        ("heat_capacity_j_k = 80.0", "",
         "card.toml [thermal_node.battery]: heat_capacity_j_k is missing"),
        ("heat_capacity_j_k = 80.0", "heat_capacity_j_k = 0.0",
         "card.toml [thermal_node.battery]: heat_capacity_j_k must be a number > 0.0, got 0.0"),
        ("heat_capacity_j_k = 80.0", "heat_capacity = 80.0",
         "card.toml [thermal_node.battery]: heat_capacity is not a key here; did you mean "
         '"heat_capacity_j_k"? (allowed: heat_capacity_j_k, power_w)'),
        ("[thermal_node.battery]\nheat_capacity_j_k = 80.0", "[thermal_node]\nbattery = 80.0",
         "card.toml [thermal_node.battery]: must be a table, got 80.0"),
        ("[thermal_node.battery]", "[thermal_node.wedge]",
         "card.toml: thermal_node.wedge has the name of a part"),
        ('["board", "wedge"]', '["board", "battery"]',
         "card.toml: thermal_node.board is joined to no part by any thermal_link"),
    ],
)  # fmt: skip
def test_a_bad_node_or_link_is_one_line(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    assert TABLES.count(old) == 1
    with pytest.raises(ConfigError, match=re.escape(complaint)) as caught:
        load_model(str(card(tmp_path, TABLES.replace(old, new))))
    assert "\n" not in str(caught.value)


def test_a_model_in_memory_with_a_bad_link_is_refused() -> None:
    with pytest.raises(SimglError, match=r"model body: thermal_link\[0\]\.between"):
        with_inside(CUBE, {}, conducting("part_0", "board", 1.0))


def test_a_link_to_one_of_two_parts_of_a_name_is_refused() -> None:
    model = replace(CUBE, parts=("leg", "leg"), thermal={})
    with pytest.raises(SimglError, match='between has part "leg", of which the file has 2'):
        with_inside(
            model, {"board": ThermalNode(heat_capacity=1.0)}, conducting("leg", "board", 1.0)
        )


def test_the_table_of_temperatures_has_the_nodes(tmp_path: Path) -> None:
    path = card(tmp_path, TABLES)
    scenario = tmp_path / "scene.toml"
    scenario.write_text(
        '[epoch]\nutc = "2026-03-20T12:00:00"\n[earth]\nshape = "none"\n[spacecraft.wedge]\n'
        f'model = "{path}"\nposition_icrf_m = [7.0e6, 0.0, 0.0]\n'
        "[thermal]\npatches = 40\n"
    )
    words = ["thermal", str(scenario), "--duration", "30"]
    result = CliRunner().invoke(app, [*words, "--out", str(tmp_path)], catch_exceptions=False)
    assert result.exit_code == 0
    with (tmp_path / "wedge.thermal.csv").open() as file:
        rows = list(csv.DictReader(file))
    # 1 W over 0.5 W K-1 in the steady state at the start.
    gap = float(rows[0]["board.node_k"]) - float(rows[0]["wedge.structure_k"])
    assert gap == pytest.approx(2.0, abs=0.01)
    assert float(rows[0]["battery.node_k"]) == pytest.approx(
        float(rows[0]["board.node_k"]), abs=0.01
    )
