"""Light between surfaces does not depend on who looks: the cameras of one state share it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl import Product, Simulator
from simgl.arrays import Array, Array32
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.solver import vertex_irradiance
from simgl.scene.state import DirectLight, SceneState, SunInDirection
from tests.radiosity.boxes import c6_scene

RADIANCE = frozenset({Product.RADIANCE})


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for each time that light is gathered at vertices."""
    times: list[int] = []

    def watched(*arguments: Any) -> Array32:
        times.append(1)
        return vertex_irradiance(*arguments)

    monkeypatch.setattr("simgl.passes.interreflection.vertex_irradiance", watched)
    return times


def four_cameras(state: SceneState) -> SceneState:
    """The camera of a state, and three that look from other places."""
    cam = state.cameras["cam"]
    cameras = {"cam": cam}
    for index in range(1, 4):
        moved = cam.position + np.array([0.3 * index, -0.2 * index, 1.0 * index])
        cameras[f"cam{index}"] = replace(
            cam, position=moved, camera=replace(cam.camera, name=f"cam{index}")
        )
    return replace(state, cameras=cameras)


def picture(simulator: Simulator, state: SceneState, camera: str) -> Array32:
    frame = simulator.capture(state, camera, RADIANCE).radiance
    assert frame is not None
    return frame.radiance


def test_four_cameras_of_a_state_share_one_solution(
    gl: moderngl.Context, solved: list[int]
) -> None:
    scenario = c6_scene(0.8, on=True)
    state = four_cameras(scenario.at(scenario.epoch_tai_ns))
    with Simulator(scenario, gl) as simulator:
        together = {name: picture(simulator, state, name) for name in state.cameras}
    assert len(solved) == 1
    for name, found in together.items():
        with Simulator(scenario, gl) as alone:
            np.testing.assert_array_equal(found, picture(alone, state, name))
    assert len(solved) == 5


def test_the_direct_light_of_a_state_is_worked_out_once_for_all_cameras(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    places: list[bytes] = []
    direct_light = SceneState._direct_light

    def watched(state: SceneState, point: Array) -> DirectLight:
        places.append(point.tobytes())
        return direct_light(state, point)

    monkeypatch.setattr(SceneState, "_direct_light", watched)
    scenario = c6_scene(0.8, on=True)
    state = four_cameras(scenario.at(scenario.epoch_tai_ns))
    with Simulator(scenario, gl) as simulator:
        places.clear()
        simulator.captures(state, dict.fromkeys(state.cameras, RADIANCE))
    assert len(places) == len(set(places)) > 0


def test_another_material_or_attitude_has_its_own_solution(
    gl: moderngl.Context, solved: list[int]
) -> None:
    scenario = c6_scene(0.8, on=True)
    state = scenario.at(scenario.epoch_tai_ns)
    (body,) = state.bodies.values()
    darker = tuple(c6_scene(0.4, on=True).models["box"].materials)
    repainted = replace(body, model=replace(body.model, materials=darker))
    # A quarter turn about the middle of its floor, (1, 0.5).
    turned = replace(
        body.pose,
        position=body.pose.position + np.array([1.5, -0.5, 0.0]),
        R_icrf_from_body=np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    )
    others = [
        replace(state, bodies={"box": repainted}),
        replace(state, bodies={"box": replace(body, pose=turned)}),
    ]
    with Simulator(scenario, gl) as simulator:
        first = picture(simulator, state, "cam")
        for other in others:
            assert np.any(picture(simulator, other, "cam") != first)
            np.testing.assert_array_equal(picture(simulator, state, "cam"), first)
    assert len(solved) == 5


def test_bodies_of_a_scene_stay_in_memory_whatever_their_size(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where they do not fit, each frame would solve all of them anew."""
    made: list[int] = []

    def watched(*arguments: Any) -> PrecomputedResponse:
        made.append(1)
        return PrecomputedResponse(*arguments)

    monkeypatch.setattr("simgl.radiosity.patch_light.PrecomputedResponse", watched)
    for module in ("radiosity.patch_light", "radiosity.transport_store"):
        monkeypatch.setattr(f"simgl.{module}.MAX_BYTES", 1)
    scenario = c6_scene(0.8, on=True)
    state = scenario.at(scenario.epoch_tai_ns)
    (body,) = state.bodies.values()
    darker = replace(body.model, materials=tuple(c6_scene(0.4, on=True).models["box"].materials))
    beside = replace(body.pose, position=body.pose.position + np.array([0.0, 1.0, 0.0]))
    bodies = {"box": body, "darker": replace(body, model=darker, pose=beside)}
    with Simulator(scenario, gl) as simulator:
        for frame in range(4):
            # Where it stands still, a frame takes the light of the last one.
            angle = np.radians(45.0 + 0.01 * frame)
            towards = np.array([-np.sin(angle), 0.0, np.cos(angle)])
            assert isinstance(state.sun, SunInDirection)
            sun = replace(state.sun, direction_icrf=towards)
            picture(simulator, replace(state, sun=sun, bodies=bodies), "cam")
    # The first frame does not know yet how many there are.
    assert 2 <= len(made) <= 3
