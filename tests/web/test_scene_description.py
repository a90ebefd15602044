"""The 3-D view's data are those of the state: axes, angles, orbits and shapes."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from simgl import Scenario
from simgl.model_files.model_library import load_model
from simgl.physics.constants import EARTH_MU
from simgl.web.scene_description import model_bytes, scenario_description, scene_description
from tests.web.small_scene import BOX, box_scenario


@pytest.fixture(scope="module")
def orbiting() -> Scenario:
    return box_scenario(earth={}, sun={})


def test_range_and_phase_angle_are_those_of_the_camera(orbiting: Scenario) -> None:
    state = orbiting.at(orbiting.epoch_tai_ns)
    sight = scene_description(state)["cameras"]["nav"]["sees"]["box"]
    body, camera = state.bodies["box"].pose.position, state.cameras["nav"].position
    to_camera, to_sun = camera - body, state.sun.seen_from(body).direction_icrf
    cosine = to_camera @ to_sun / np.linalg.norm(to_camera)
    # The scenario's range, through positions of 7e6 m in float64: 1e-9 m.
    assert sight["range_m"] == pytest.approx(12.0, abs=1e-8)
    assert np.cos(np.radians(sight["phase_angle_deg"])) == pytest.approx(cosine, abs=1e-9)


def test_an_orbit_closes_after_the_sliders_span(orbiting: Scenario) -> None:
    described = scene_description(orbiting.at(orbiting.epoch_tai_ns))
    points = np.array(described["orbits"]["box"])
    axis = 0.5 * (np.linalg.norm(points, axis=1).max() + np.linalg.norm(points, axis=1).min())
    period = 2.0 * np.pi * np.sqrt(axis**3 / EARTH_MU)
    assert scenario_description(orbiting)["span_s"] == pytest.approx(period, rel=1e-6)
    assert points[0] == pytest.approx(described["spacecraft"]["box"]["position_m"], abs=1e-2)
    # The period is rounded to a nanosecond, which is 8 um.
    assert points[-1] == pytest.approx(points[0], abs=1e-2)


def test_a_scene_without_an_earth_has_neither_orbit_nor_earth() -> None:
    scenario = box_scenario()
    described = scene_description(scenario.at(scenario.epoch_tai_ns))
    assert described["earth"] is None
    assert described["orbits"] == {}
    assert scenario_description(scenario)["earth_radii_m"] is None


def test_a_pinholes_field_has_its_corners(orbiting: Scenario) -> None:
    state = orbiting.at(orbiting.epoch_tai_ns)
    placed = state.cameras["nav"]
    rays = np.array(scene_description(state)["cameras"]["nav"]["field_edge"])
    seen = placed.camera.project(rays @ placed.R_camera_from_icrf.T)
    assert seen[0] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert seen[len(seen) // 2] == pytest.approx([64.0, 48.0], abs=1e-9)


def test_a_camera_on_a_spacecraft_does_not_name_its_range() -> None:
    chaser = {"model": {"sphere": {"radius_m": 0.5, "material": {"reflectance": 0.5}}}}
    scenario = box_scenario(
        spacecraft={
            "box": {"model": BOX, "orbit": {"altitude_km": 400.0}},
            "chaser": {**chaser, "relative_to": "box", "position_lvlh_m": [-30.0, 0.0, 0.0]},
        },
        camera={
            "nav": {
                "on": "chaser",
                "position_body_m": [0.5, 0.0, 0.0],
                "boresight": [1.0, 0.0, 0.0],
                "up": [0.0, 0.0, -1.0],
            }
        },
    )
    described = scene_description(scenario.at(scenario.epoch_tai_ns))
    assert list(described["cameras"]["nav"]["sees"]) == ["box"]


def test_all_is_json(orbiting: Scenario) -> None:
    json.dumps(scene_description(orbiting.at(orbiting.epoch_tai_ns)), allow_nan=False)
    json.dumps(scenario_description(orbiting), allow_nan=False)


@pytest.mark.parametrize("name", ["space_rider", "cubesat_12u"])
def test_a_models_bytes_hold_its_mesh_sorted_by_rigid_group(name: str) -> None:
    model = load_model(name)
    data = model_bytes(model)
    (length,) = struct.unpack_from("<I", data)
    head = json.loads(data[4 : 4 + length])
    n, m, at = head["vertices"], head["triangles"], 4 + length
    assert at % 4 == 0
    assert len(data) == at + n * (12 + 12 + 4) + m * 12
    positions = np.frombuffer(data, "<f4", 3 * n, at).reshape(n, 3)
    assert np.array_equal(positions, model.mesh.positions)
    triangles = np.frombuffer(data, "<u4", 3 * m, at + n * 28).reshape(m, 3)
    assert sum(head["groups"]) == m
    in_any_order = np.sort(triangles.view("<u4,<u4,<u4"), axis=0)
    assert np.array_equal(
        in_any_order, np.sort(model.mesh.triangles.astype("<u4").view("<u4,<u4,<u4"), axis=0)
    )
