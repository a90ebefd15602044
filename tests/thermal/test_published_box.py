"""A published node model of a satellite, with the temperatures that ESATAN-TMS gave it.

Six nodes, the faces of a box of 1 m, 1000 J K-1 each, black on the outside, with 1 W K-1 between
neighbours and no radiation inside; 408 km high in the plane of the Sun, one face to the Earth; 20 C
at the start. F. Meijering, Modular Thermal Analysis for CubeSats and PocketQubes, MSc thesis, TU
Delft, 2024, whose repository has ESATAN's temperatures every 22 s over two orbits.
"""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.physics.frames import Pose
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import box
from simgl.scene.state import SceneState
from simgl.scene.thermal_surface import ThermalPart
from simgl.simulator import Simulator
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.heat_loads import heat_loads
from tests.thermal.test_closed_forms import grey, painted

RADIUS, HEIGHT, PERIOD = 6371e3, 408e3, 5560.99
# Not in the text: from ESATAN's fluxes on single plates, of the Sun, 1410.77, and over the subsolar
# point, 208.96 in the infrared and 379.55 reflected [W m-2], by view factors in closed form.
SUNLIGHT, LONGWAVE, ALBEDO = 1410.77, 236.6, 0.306
# Lowest and highest of the second orbit [K], by the outward normal of the face: x away from the
# Earth, y ahead, z along the orbit's normal.
PUBLISHED = {
    "away from the Earth": ((1, 0, 0), 179.33, 369.41),
    "ahead": ((0, 1, 0), 193.19, 364.35),
    "behind": ((0, -1, 0), 193.15, 372.87),
    "north": ((0, 0, 1), 193.57, 278.24),
    "south": ((0, 0, -1), 193.52, 278.15),
    "to the Earth": ((-1, 0, 0), 215.50, 305.86),
}
# ESATAN's infrared fluxes on plates to the Earth and at right angles, 208.96 and 68.64, have a
# ratio 1.2 % from that of the closed forms; so much of what the Earth sends to the face that looks
# at it is 1.1 K, and the others get half of that by conduction and their own share [K].
TOLERANCE = 1.5
STEP = 30.0


def _scenario() -> Scenario:
    # Neighbours are joined along 1 m, sqrt(1/2) m apart in the mean of both.
    skin = ThermalPart(sheet_conductance=float(np.sqrt(0.5)))
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-01-03T12:00:00"},
            "sun": {
                "irradiance_w_m2": SUNLIGHT,
                "temperature_k": 5772.0,
                "angular_diameter_deg": 0.54,
                "direction_icrf": [1.0, 0.0, 0.0],
            },
            "earth": {
                "shape": "sphere",
                "radius_km": 1e-3 * RADIUS,
                "albedo": ALBEDO,
                "longwave_w_m2": LONGWAVE,
            },
            "spacecraft": {
                "body": {"model": "wedge", "position_icrf_m": [RADIUS + HEIGHT, 0.0, 0.0]}
            },
        },
        models={"body": painted(box((1.0, 1.0, 1.0)), grey(1.0), part_0=skin)},
    )


def _at(scenario: Scenario, seconds: float) -> SceneState:
    angle = 2.0 * np.pi * seconds / PERIOD
    up = np.array([np.cos(angle), np.sin(angle), 0.0])
    ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])
    pose = Pose(
        position=(RADIUS + HEIGHT) * up,
        velocity=np.zeros(3),
        R_icrf_from_body=np.stack([up, ahead, np.array([0.0, 0.0, 1.0])], axis=1),
    )
    return scenario.with_poses(scenario.epoch_tai_ns + round(1e9 * seconds), {"body": pose})


def published_box() -> ThermalBody:
    """Its thermal network."""
    return thermal_body("body", _scenario().models["body"], 6)


def box_in_orbit(gl: moderngl.Context) -> dict[str, tuple[float, float]]:
    """Lowest and highest temperature of each face in the second orbit [K]."""
    scenario, body = _scenario(), published_box()
    kelvin, history = np.full(len(body.network.capacity), 293.15), []
    with Simulator(scenario, gl) as simulator:

        def heat(seconds: float) -> np.ndarray:
            state = _at(scenario, seconds)
            return heat_loads(body, state, simulator.skies.heat(state, "body")).heat

        before = heat(0.0)
        for number in range(1, round(2.0 * PERIOD / STEP) + 1):
            after = heat(number * STEP)
            kelvin = body.network.step(kelvin, before, after, STEP)
            before = after
            history.append(kelvin)
    second = np.array(history[len(history) // 2 :])
    normals = body.patches.normals[:, 0]
    of_face = {name: int(np.argmax(normals @ way)) for name, (way, *_) in PUBLISHED.items()}
    return {n: (float(second[:, i].min()), float(second[:, i].max())) for n, i in of_face.items()}


def test_a_box_has_the_conductances_of_its_description() -> None:
    body = published_box()
    assert body.patch_count == 6
    normals = body.patches.normals[:, 0]
    between = -body.network.conduction.toarray()[:6, :6]
    expected = np.where(np.abs(normals @ normals.T) < 0.5, 1.0, 0.0)
    np.fill_diagonal(expected, np.diag(between))
    np.testing.assert_allclose(between, expected, atol=1e-6)


def test_a_published_box_has_its_published_temperatures(gl: moderngl.Context) -> None:
    for name, (low, high) in box_in_orbit(gl).items():
        _, published_low, published_high = PUBLISHED[name]
        assert low == pytest.approx(published_low, abs=TOLERANCE)
        assert high == pytest.approx(published_high, abs=TOLERANCE)
