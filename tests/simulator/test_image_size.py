"""An image that the driver cannot draw is refused with the first scenario that asks for it."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import pytest
from simgl_bridge.render_session import RenderSession

from simgl.errors import ConfigError
from simgl.gpu import render_targets
from simgl.gpu.render_targets import can_draw, largest_edge
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from tests.scenes import lambert, scene

PLATE = {
    "model": {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(0.5)}},
    "position_icrf_m": [0.0, 0.0, 0.0],
}
CAMERA = {"position_icrf_m": [0.0, 0.0, 5.0], "look_at": "plate"}


def scenario(width: int, height: int, **optics: object) -> Scenario:
    size = {"width_px": width, "height_px": height}
    return scene({"plate": PLATE}, {**CAMERA, **size, "optics": optics})


@pytest.fixture
def small_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver that draws no more than nine million pixels."""
    monkeypatch.setattr(
        render_targets, "can_draw", lambda _ctx, size: size[0] * size[1] <= 9_000_000
    )


def resized(state: SceneState, width: int, height: int) -> SceneState:
    """A scene whose camera has another size, such as one that a client sends."""
    placed = state.cameras["cam"]
    detector = replace(placed.camera.detector, width=width, height=height)
    camera = replace(placed.camera, detector=detector)
    return replace(state, cameras={"cam": replace(placed, camera=camera)})


def test_a_driver_is_asked_without_leaving_errors_or_objects(gl: moderngl.Context) -> None:
    edge = largest_edge(gl)
    assert can_draw(gl, (64, 48))
    assert not can_draw(gl, (edge + 1, 1))
    assert not can_draw(gl, (1, edge + 1))
    # No driver has sixteen times the memory of its largest texture; the fixture finds what is left.
    can_draw(gl, (edge, edge))
    assert gl.error == "GL_NO_ERROR"


@pytest.mark.usefixtures("small_driver")
def test_a_scenario_beyond_the_driver_is_refused_before_anything_is_drawn(
    gl: moderngl.Context,
) -> None:
    with pytest.raises(ConfigError) as caught:
        Simulator(scenario(6000, 4000), gl)
    name = gl.info["GL_RENDERER"]
    assert str(caught.value) == (
        "scenario [camera.cam]: width_px, height_px are 6000 x 4000; "
        f"{name} cannot draw that, but could draw 3000 x 2000"
    )


@pytest.mark.usefixtures("small_driver")
def test_a_lens_with_distortion_needs_a_finer_image(gl: moderngl.Context) -> None:
    """Fine pixels are half as large, and there are a few more of them around the field."""
    with pytest.raises(ConfigError, match=r"are 2000 x 1500, for whose distortion \d+ x \d+ are"):
        Simulator(scenario(2000, 1500, distortion={"k1": -1e-3}), gl)


@pytest.mark.usefixtures("small_driver")
def test_a_camera_that_grows_is_refused_and_the_next_image_is_right(gl: moderngl.Context) -> None:
    small = scenario(16, 12)
    with Simulator(small, gl) as simulator:
        state = small.at(small.epoch_tai_ns)
        for _ in range(2):
            with pytest.raises(ConfigError, match="cannot draw that"):
                simulator.capture(resized(state, 6000, 4000), "cam")
        assert simulator.capture(state, "cam").digital is not None


@pytest.mark.usefixtures("small_driver")
def test_a_server_says_that_it_is_of_no_use_to_ask_again(gl: moderngl.Context) -> None:
    with pytest.raises(ConfigError, match="cannot draw that"):
        RenderSession(scenario(6000, 4000), open_simulator=lambda s: Simulator(s, gl))
