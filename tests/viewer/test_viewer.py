"""The viewer: camera laws without a window, the display step headless, the window under Xvfb."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from simgl.errors import ConfigError, ContextError
from simgl.images import display_from_radiance
from simgl.passes.display import DisplayPass
from simgl.physics.frames import Pose, lvlh_from_icrf
from simgl.renderer import Renderer
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.mounts import OrbitingMount
from simgl.view.frame import frame_view
from simgl.viewer.look import HELP, Look, opening_look, title
from simgl.viewer.orbit import FIELD_OF_VIEW, OrbitCamera, orbit_axes
from simgl.viewer.painter import Painter, fitted, read_window, viewer_state, window_camera
from simgl.viewer.window import _BY_KEY, run

Array = NDArray[np.float64]

# A grey ball above the lit Earth, a small one 40 m behind it, and a camera of another shape.
SCENARIO = """
[epoch]
utc = "2026-03-20T12:00:00"

[spacecraft.ball]
model.sphere = { radius_m = 2.0, material = { reflectance = 0.5 } }
orbit = { altitude_km = 845.0, inclination_deg = 5.0, true_anomaly_deg = 35.0 }

[spacecraft.small]
model.sphere = { radius_m = 0.5, material = { reflectance = 0.5 } }
relative_to = "ball"
position_lvlh_m = [-40.0, 0.0, 0.0]

[camera.square]
about = { target = "ball", azimuth_deg = 20.0, range_m = 20.0 }
width_px = 200
height_px = 200
"""


@pytest.fixture
def scenario_path(tmp_path: Path) -> Path:
    path = tmp_path / "two_balls.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@pytest.fixture
def scenario(scenario_path: Path) -> Scenario:
    return load_scenario(scenario_path)


@pytest.fixture
def look(scenario: Scenario) -> Look:
    return opening_look(scenario, None)


def press(look: Look, scenario: Scenario, *keys: str) -> Look:
    for key in keys:
        look = _BY_KEY[key].effect(look, scenario)
    return look


def orbit_camera(
    azimuth: float = 0.3, elevation: float = 0.2, distance: float = 30.0
) -> OrbitCamera:
    return OrbitCamera(
        azimuth=azimuth, elevation=elevation, range=distance, nearest=5.0, farthest=5000.0
    )


def random_cameras(count: int) -> list[OrbitCamera]:
    rng = np.random.default_rng(5)
    angles = rng.uniform(-np.pi, np.pi, (count, 2))
    return [orbit_camera(float(a), float(e), rng.uniform(5.0, 5000.0)) for a, e in angles]


# ---------------------------------------------------------------- the orbit camera


@pytest.mark.parametrize("camera", random_cameras(5))
def test_dragging_keeps_the_range(camera: OrbitCamera) -> None:
    position, _ = camera.dragged(0.7, -1.9).pose(np.zeros(3), np.eye(3))
    # Two rotation matrices of float64: a few units in the last place.
    assert np.linalg.norm(position) == pytest.approx(camera.range, rel=1e-14)


@pytest.mark.parametrize("camera", random_cameras(5))
def test_dragging_to_the_right_by_a_whole_turn_returns(camera: OrbitCamera) -> None:
    turned = camera
    for _ in range(8):
        turned = turned.dragged(0.25 * np.pi, 0.0)
    assert turned.elevation == pytest.approx(camera.elevation, abs=1e-14)
    assert turned.azimuth == camera.azimuth


def test_zoom_steps_multiply_the_range() -> None:
    camera = orbit_camera(distance=100.0)
    assert camera.zoomed(1.0).range == pytest.approx(100.0 / 1.1)
    assert camera.zoomed(-2.0).range == pytest.approx(100.0 * 1.1**2)
    assert camera.zoomed(3.0).zoomed(-3.0).range == pytest.approx(100.0)


def test_zoom_stops_at_the_limits_of_the_range() -> None:
    assert orbit_camera().zoomed(1e3).range == 5.0
    assert orbit_camera().zoomed(-1e3).range == 5000.0


def test_a_range_outside_its_limits_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^range must lie in 5 to 5000 m, got 4$"):
        orbit_camera(distance=4.0)


@pytest.mark.parametrize("camera", random_cameras(20))
def test_the_boresight_runs_through_the_target(camera: OrbitCamera) -> None:
    position, R_camera_from_icrf = camera.pose(np.zeros(3), np.eye(3))
    target_camera = R_camera_from_icrf @ (np.zeros(3) - position)
    np.testing.assert_allclose(target_camera / camera.range, [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(R_camera_from_icrf @ R_camera_from_icrf.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R_camera_from_icrf) == pytest.approx(1.0)


@pytest.mark.parametrize("camera", random_cameras(5))
def test_the_pose_is_that_of_a_scenario_camera_with_the_same_angles(
    camera: OrbitCamera, scenario: Scenario
) -> None:
    mount = OrbitingMount(
        target="ball", azimuth=camera.azimuth, elevation=camera.elevation, range=camera.range
    )
    state = replace(scenario, mounts={"square": mount}).at(scenario.epoch_tai_ns)
    target, expected = state.bodies["ball"].pose, state.cameras["square"]
    position, R_camera_from_icrf = camera.pose(target.position, orbit_axes(target))
    # Positions of 7e6 m carry 1e-9 m.
    np.testing.assert_allclose(position, expected.position, rtol=0.0, atol=4e-9)
    np.testing.assert_allclose(R_camera_from_icrf, expected.R_camera_from_icrf, atol=1e-12)


@pytest.mark.parametrize("camera", random_cameras(20))
def test_the_target_follows_the_hand(camera: OrbitCamera) -> None:
    """A mark on the side that faces the camera moves right when dragged right, down when down."""
    mark = camera.pose(np.zeros(3), np.eye(3))[0] / camera.range

    def place(moved: OrbitCamera) -> Array:
        position, R_camera_from_icrf = moved.pose(np.zeros(3), np.eye(3))
        return np.asarray(R_camera_from_icrf @ (mark - position))

    right, down = place(camera.dragged(1e-3, 0.0)), place(camera.dragged(0.0, 1e-3))
    assert right[0] > 0.0
    assert abs(right[1]) < 1e-3 * right[0]
    assert down[1] > 0.0


def test_a_craft_at_rest_is_circled_with_celestial_north_up() -> None:
    place = np.array([1e7, 0.0, 0.0])
    rest = Pose(position=place, velocity=np.zeros(3), R_icrf_from_body=np.eye(3))
    _, R_camera_from_icrf = orbit_camera(0.0, 0.0).pose(rest.position, orbit_axes(rest))
    bottom_icrf = R_camera_from_icrf[1]
    np.testing.assert_allclose(bottom_icrf, [0.0, 0.0, -1.0], atol=1e-15)


# ---------------------------------------------------------------- what the window shows


def test_the_first_look_sees_the_lit_side_from_outside_the_whole_craft(
    scenario: Scenario, look: Look
) -> None:
    state = viewer_state(scenario, look, (960, 640))
    ball, camera = state.bodies["ball"], state.cameras["viewer"]
    outwards = camera.position - ball.pose.position
    assert np.dot(outwards, state.sun.seen_from(ball.pose.position).direction_icrf) > 0.0
    half_angle = np.arcsin(2.0 / np.linalg.norm(outwards))
    assert 0.25 * FIELD_OF_VIEW < half_angle < 0.35 * FIELD_OF_VIEW
    # Not upside down: the zenith lies towards the top of the picture.
    R_lvlh_from_icrf = lvlh_from_icrf(ball.pose.position, ball.pose.velocity)
    assert (camera.R_camera_from_icrf @ R_lvlh_from_icrf.T @ [0.0, 0.0, -1.0])[1] < 0.0


def test_the_window_camera_has_forty_degrees_from_top_to_bottom() -> None:
    assert np.degrees(window_camera((960, 640)).fields_of_view[1]) == pytest.approx(40.0)


def test_keys_change_what_is_shown(scenario: Scenario, look: Look) -> None:
    assert press(look, scenario, "space").playing
    assert press(look, scenario, "space", "space") == look
    assert press(look, scenario, "up", "+", "=").exposure_value == pytest.approx(1.0)
    assert press(look, scenario, "down", "-").exposure_value == pytest.approx(-2.0 / 3.0)
    assert press(look, scenario, "right").tai_ns == look.tai_ns + 10 * 10**9
    assert press(look, scenario, "]", "left").tai_ns == look.tai_ns - 20 * 10**9
    assert press(look, scenario, "]", "[") == look
    assert press(look, scenario, *["]"] * 99).speed == 4096.0
    assert press(look, scenario, *["["] * 99).speed == 1.0 / 64.0


def test_exposure_needs_no_new_picture_but_time_and_angle_do(
    scenario: Scenario, look: Look
) -> None:
    assert look.same_picture(press(look, scenario, "up", "space", "]"))
    assert not look.same_picture(press(look, scenario, "right"))
    assert not look.same_picture(replace(look, orbit=look.orbit.dragged(0.1, 0.0)))
    through = press(look, scenario, "c")
    assert not look.same_picture(through)
    assert through.same_picture(replace(through, orbit=look.orbit.dragged(0.1, 0.0)))


def test_c_looks_through_each_scenario_camera_and_comes_back(
    scenario: Scenario, look: Look
) -> None:
    assert press(look, scenario, "c").camera == "square"
    assert press(look, scenario, "c", "c") == look


def test_t_goes_round_the_spacecraft_at_the_same_apparent_size(
    scenario: Scenario, look: Look
) -> None:
    other = press(look, scenario, "t")
    assert other.target == "small"
    assert other.orbit.range / other.orbit.nearest == pytest.approx(
        look.orbit.range / look.orbit.nearest
    )
    back = press(other, scenario, "t")
    assert back.target == "ball"
    assert back.orbit.range == pytest.approx(look.orbit.range)


def test_a_scenario_camera_keeps_its_field_and_shape_in_the_window(
    scenario: Scenario, look: Look
) -> None:
    state = viewer_state(scenario, press(look, scenario, "c"), (960, 640))
    shown, own = state.cameras["viewer"].camera, scenario.cameras["square"]
    assert (shown.detector.width, shown.detector.height) == (640, 640)
    assert shown.fields_of_view == pytest.approx(own.fields_of_view)


def test_a_picture_is_centred_in_the_window_without_stretching() -> None:
    assert fitted((200, 200), (960, 640)) == (160, 0, 640, 640)
    assert fitted((300, 100), (90, 90)) == (0, 30, 90, 30)
    assert fitted((960, 640), (960, 640)) == (0, 0, 960, 640)


def test_the_title_says_what_when_and_how(scenario: Scenario, look: Look) -> None:
    changed = replace(press(look, scenario, "up"), orbit=orbit_camera(0.0, np.pi / 6, 25.5))
    assert title(changed) == (
        "simgl | ball az 0 el 30 deg, 25.5 m | 2026-03-20T12:00:00 UTC | +0.3 EV | paused x1"
    )
    assert title(press(changed, scenario, "space", "c"), 24.6) == (
        "simgl | square | 2026-03-20T12:00:00 UTC | +0.3 EV | playing x1 | 25 fps"
    )


def test_help_names_every_key() -> None:
    for key in (*_BY_KEY, "drag", "scroll", "s", "h", "q", "escape"):
        assert f" {key} " in HELP


def test_a_scenario_without_spacecraft_is_refused() -> None:
    empty = scenario_from_dict({"epoch": {"utc": "2026-03-20T12:00:00"}})
    with pytest.raises(ConfigError, match="spacecraft is missing; the viewer circles a"):
        opening_look(empty, None)


def test_an_unknown_target_is_refused_with_a_suggestion(scenario: Scenario) -> None:
    with pytest.raises(ConfigError, match=r'--target "bal" is not in .*; did you mean "ball"\?'):
        opening_look(scenario, "bal")


# ---------------------------------------------------------------- the display step


def shown_by_gpu(
    gl: moderngl.Context,
    radiance: NDArray[np.float32],
    size: tuple[int, int],
    rectangle: tuple[int, int, int, int],
    exposure_value: float = 0.0,
) -> NDArray[np.uint8]:
    """(height, width, 3) of a window of a size that holds a picture in a rectangle."""
    texture = gl.texture(radiance.shape[1::-1], 4, radiance.tobytes(), dtype="f4")
    window = gl.framebuffer([gl.renderbuffer(size, 4)])
    display = DisplayPass(gl)
    window.clear(0.0, 0.0, 0.0, 1.0)
    display.draw(texture, window, rectangle, exposure_value)
    picture = read_window(window, size)
    # moderngl keeps a released framebuffer bound, and then stumbles over it.
    gl.detect_framebuffer(0).use()
    display.release()
    window.color_attachments[0].release()
    window.release()
    texture.release()
    return picture


def random_radiance(height: int, width: int) -> NDArray[np.float32]:
    """From deep black to four times white, every decade as often."""
    rng = np.random.default_rng(11)
    return (10.0 ** rng.uniform(-4.0, np.log10(220.0), (height, width, 4))).astype(np.float32)


def code_difference(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> int:
    assert a.shape == b.shape
    return int(np.abs(a.astype(int) - b.astype(int)).max())


def test_the_window_shows_what_display_from_radiance_gives(gl: moderngl.Context) -> None:
    radiance = random_radiance(48, 80)
    picture = shown_by_gpu(gl, radiance, (80, 48), (0, 0, 80, 48))
    # Both round to 8 bits; a value on the edge may fall to either side.
    assert code_difference(picture, display_from_radiance(radiance)) <= 1
    assert {0, 255} <= set(picture.ravel().tolist())


def test_one_exposure_value_doubles_the_light(gl: moderngl.Context) -> None:
    radiance = random_radiance(16, 16)
    picture = shown_by_gpu(gl, radiance, (16, 16), (0, 0, 16, 16), 1.0)
    assert code_difference(picture, display_from_radiance(2.0 * radiance)) <= 1


def test_a_smaller_picture_is_enlarged_upright_into_its_rectangle(gl: moderngl.Context) -> None:
    radiance = random_radiance(4, 4)
    picture = shown_by_gpu(gl, radiance, (20, 10), (6, 1, 8, 8))
    expected = np.zeros((10, 20, 3), np.uint8)
    expected[1:9, 6:14] = display_from_radiance(radiance).repeat(2, axis=0).repeat(2, axis=1)
    assert code_difference(picture, expected) <= 1


def assert_shows(
    picture: NDArray[np.uint8], gl: moderngl.Context, scenario: Scenario, look: Look
) -> None:
    """A window's picture is what a headless renderer makes of the same state."""
    height, width, _ = picture.shape
    state = viewer_state(scenario, look, (width, height))
    with Renderer(gl) as renderer:
        view = frame_view(state, "viewer", sample_budget=renderer.sample_budget)
        radiance = renderer.radiance(view).read() * np.float32(2.0**look.exposure_value)
    difference = np.abs(picture.astype(int) - display_from_radiance(radiance)).max(axis=2)
    # Another driver may place a sample on an edge differently: one pixel in a thousand may differ.
    assert np.mean(difference > 2) < 1e-3


def test_the_painter_shows_the_renderers_radiance_and_leaves_nothing(
    gl: moderngl.Context, scenario: Scenario, look: Look
) -> None:
    window = gl.framebuffer([gl.renderbuffer((96, 64), 4)])
    brighter = press(look, scenario, "up")
    with Painter(gl, scenario) as painter:
        painter.render(look, (96, 64))
        painter.show(brighter, (96, 64), window)
        picture = read_window(window, (96, 64))
    gl.detect_framebuffer(0).use()
    window.color_attachments[0].release()
    window.release()
    assert_shows(picture, gl, scenario, brighter)


# ---------------------------------------------------------------- the window


def test_without_a_display_the_reason_and_a_remedy_are_given(
    monkeypatch: pytest.MonkeyPatch, scenario_path: Path
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ContextError) as caught:
        run(scenario_path)
    assert str(caught.value) == (
        "no display: DISPLAY is not set; use simgl render, or run under xvfb-run"
    )


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="X11 is not the window system")
def test_a_display_that_does_not_answer_is_named(
    monkeypatch: pytest.MonkeyPatch, scenario_path: Path
) -> None:
    monkeypatch.setenv("DISPLAY", ":4095")
    with pytest.raises(ContextError, match=r"no window: .*:4095; use simgl render"):
        run(scenario_path)


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """An X server of our own, on a number that it finds free."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("Xvfb is not installed (apt-get install xvfb)")
    reading, writing = os.pipe()
    screen = ["-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-displayfd", str(writing)]
    with subprocess.Popen(
        [server, *screen], pass_fds=[writing], stderr=subprocess.DEVNULL
    ) as process:
        os.close(writing)
        with os.fdopen(reading) as pipe:
            number = pipe.readline().strip()
        if not number:
            process.wait()
            pytest.skip(f"Xvfb does not start (exit status {process.returncode})")
        yield f":{number}"
        process.terminate()


def on_display(display: str, *command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("WAYLAND", "XDG_"))}
    return subprocess.run(
        [sys.executable, "-W", "error", *command],
        env={**environment, "DISPLAY": display},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.display
def test_the_window_holds_the_off_screen_picture_the_right_way_up(
    gl: moderngl.Context, display: str, tmp_path: Path, scenario_path: Path
) -> None:
    out = tmp_path / "shot.png"
    command = ["-m", "simgl", "view", str(scenario_path), "--screenshot", str(out)]
    done = on_display(display, *command, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    with Image.open(out) as image:
        picture = np.asarray(image)
    height, width, _ = picture.shape
    assert (width, height) == (960, 640)
    middle = picture[height // 2 - 20 : height // 2 + 20, width // 2 - 20 : width // 2 + 20]
    assert middle.mean() > 100.0  # a half-white ball in the Sun
    assert picture[:40, :40].max() == 0  # the sky
    assert picture[-40:].mean() > 20.0  # the Earth
    assert picture[:40].max() == 0
    scenario = load_scenario(scenario_path)
    assert_shows(picture, gl, scenario, opening_look(scenario, None))


# Plays a list of events where the window would wait for the user's.
SCRIPT = """
import sys
import time
from pathlib import Path
from dataclasses import replace
import glfw
from simgl.viewer.orbit import OrbitCamera
from simgl.viewer.window import run

callbacks = {}
for kind in ("char", "key", "scroll", "cursor_pos"):
    setattr(glfw, f"set_{kind}_callback", lambda window, f, kind=kind: callbacks.update({kind: f}))
glfw.get_mouse_button = lambda window, button: glfw.PRESS
# Where the small ball is: no picture can be taken there.
inside = OrbitCamera(azimuth=0.0, elevation=0.0, range=40.0, nearest=2.1, farthest=2000.0)
events = [
    ("char", ord("+")), ("key", glfw.KEY_UP, 0, glfw.PRESS, 0), ("scroll", 0.0, -3.0),
    ("cursor_pos", 50.0, 20.0), ("char", ord("s")), ("char", ord("]")), ("char", ord(" ")),
    ("char", ord("c")), ("size", 500, 400), ("char", ord(" ")), ("wait",), ("char", ord("S")),
    ("scroll", 0.0, 1.0), ("char", ord("t")), ("char", ord("h")), ("key", glfw.KEY_F1, 0, 1, 0),
    ("char", ord("t")), ("char", ord(" ")), ("jump",), ("scroll", 0.0, -1e3), ("char", ord("q")),
]
real_poll, real_wait = glfw.poll_events, glfw.wait_events_timeout

def step(real):
    kind, *values = events.pop(0)
    window = glfw.get_current_context()
    if kind == "size":
        glfw.set_window_size(window, *values)
        while glfw.get_framebuffer_size(window) != tuple(values):
            real_wait(0.1)
    elif kind == "jump":
        session = callbacks["char"].__self__
        session._look = replace(session._look, orbit=inside)
    elif kind == "wait":
        time.sleep(0.3)
        real_poll()
    else:
        real_poll()
        callbacks[kind](window, *values)

glfw.poll_events = lambda: step(real_poll)
glfw.wait_events_timeout = lambda seconds: step(real_wait)
run(Path(sys.argv[1]))
"""


@pytest.mark.display
def test_the_window_obeys_keys_mouse_and_resizing_until_it_is_closed(
    gl: moderngl.Context, display: str, tmp_path: Path, scenario_path: Path
) -> None:
    done = on_display(display, "-c", SCRIPT, str(scenario_path), folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "simgl_view_001.png" in done.stdout
    assert 'is inside the body of "small"' in done.stderr
    with Image.open(tmp_path / "simgl_view_001.png") as image:
        first = np.asarray(image)
    scenario = load_scenario(scenario_path)
    brighter = press(opening_look(scenario, None), scenario, "+", "up")
    angle = np.pi / 640.0  # of one pixel's drag
    orbit = brighter.orbit.zoomed(-3.0).dragged(50.0 * angle, 20.0 * angle)
    assert_shows(first, gl, scenario, replace(brighter, orbit=orbit))
    # The second was taken through the square camera in a window of 500 x 400 pixels.
    with Image.open(tmp_path / "simgl_view_002.png") as image:
        second = np.asarray(image)
    assert second.shape == (400, 500, 3)
    assert second[:, :50].max() == 0
    assert second[:, 450:].max() == 0
    assert second[:, 50:450].max() > 100
