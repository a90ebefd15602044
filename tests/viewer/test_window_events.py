"""The window as a person uses it: real keys, mouse and resizing, and what it then says and saves.

One window serves all tests; each begins with ``x`` and ``0``, the scenario's settings on the orbit.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import av
import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl import Simulator, assets
from simgl.arrays import Image8
from simgl.display_images import display_from_dn, display_from_radiance
from simgl.figures.displays import images_of
from simgl.images import saturated
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.simulator import Capture, Product
from simgl.viewer.read_outs import pixel_lines
from simgl.viewer.view_commands import chosen_state
from simgl.viewer.view_settings import ViewSettings, opening_settings
from simgl.viewer.viewport import viewer_state
from tests.viewer.conftest import SCENARIO
from tests.viewer.harness import press
from tests.viewer.opened_window import ASIDE, OpenedWindow, opened_window

pytestmark = pytest.mark.display

# The sunlit ball fills half of the range of DN.
EXPOSURE = "exposure_time_s = 0.00004\n"
PRODUCTS = frozenset({Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("window")
    (folder / "two_balls.toml").write_text(SCENARIO + EXPOSURE, encoding="utf-8")
    shutil.copytree(assets.shaders(), folder / "shaders")
    return folder


@pytest.fixture(scope="module")
def _opened(display: str, folder: Path) -> Iterator[OpenedWindow]:
    scenario, shaders = str(folder / "two_balls.toml"), str(folder / "shaders")
    with opened_window(display, folder, scenario, "--shaders", shaders) as window:
        yield window


@pytest.fixture
def window(_opened: OpenedWindow) -> OpenedWindow:
    _opened.person.move(*ASIDE)
    _opened.press("x", says="as in the scenario")
    _opened.press("0", says="circles ball")
    return _opened


@pytest.fixture
def shown(folder: Path) -> Scenario:
    return load_scenario(folder / "two_balls.toml")


def capture(gl: moderngl.Context, scenario: Scenario, look: ViewSettings) -> Capture:
    """What a simulator of its own makes of the settings, in a window of the first size."""
    state, camera = viewer_state(scenario, look, (960, 640))
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(state, camera, PRODUCTS if look.camera else {Product.RADIANCE})


def close(a: Image8, b: Image8) -> bool:
    """Both round to 8 bits; another driver may place a sample on an edge differently."""
    difference = np.abs(a.astype(int) - b.astype(int)).max(axis=2)
    return bool(np.mean(difference > 2) < 1e-3)


def test_the_overlay_tells_epoch_range_phase_angle_and_brightness(
    window: OpenedWindow, shown: Scenario
) -> None:
    look = opening_settings(shown, None)
    state, camera = viewer_state(shown, look, (960, 640))
    place = state.cameras[camera].position
    ball = state.bodies["ball"].pose.position
    sun = state.sun.seen_from(ball).direction_icrf
    away = place - ball
    phase = np.degrees(np.arccos(sun @ away / np.linalg.norm(away)))
    lines = window.said()["boxes"]["info"]
    assert lines[0] == "2026-03-20T12:00:00 UTC"
    assert lines[1] == "+0.0 s, paused x 1"
    assert lines[3] == (f"ball: range {np.linalg.norm(away):.5g} m, phase angle {phase:.1f} deg")
    assert lines[4].startswith("small: range ")
    assert "display +0.0 EV" in lines


def test_h_opens_help_in_the_window_and_escape_closes_help_alone(window: OpenedWindow) -> None:
    window.person.key("h")
    said = window.wait_for(lambda said: "help" in said["boxes"], "help")
    assert any("play or pause" in line for line in said["boxes"]["help"])
    image, _ = window.screenshot()
    window.person.key("Escape")
    window.wait_for(lambda said: "help" not in said["boxes"], "no help")
    without, _ = window.screenshot()
    # Light text on a dark box in the middle, where the ball was.
    assert image[320, 480].max() < 80 < without[320, 480].min()
    assert image[200:440, 300:660].max() > 180


def test_keys_change_what_they_say(window: OpenedWindow) -> None:
    assert window.press("c", says="camera square, 200 x 200")["boxes"]["name 0"] == ["DN"]
    window.press("Up", "Up", "+", says="exposure 0.08 ms (+1.0 EV)")
    window.press("b", "b", "b", says="(x 0.5)")
    window.press("v", says="DN")
    window.press("bracketright", says="x 2")
    window.press("Right", says="+20.0 s, paused x 2")
    window.press("Left", says="+0.0 s, paused x 2")
    window.press("bracketleft", says="x 1")
    window.press("n", says="histogram off")
    window.press("n", says="histogram on")
    window.press("v", "v", "v", "v", "v", says="DN beside radiance")
    window.press("t", says="circles small")
    window.press("t", says="circles ball")


def test_dn_and_radiance_lie_side_by_side_and_are_those_of_a_capture(
    window: OpenedWindow, shown: Scenario, gl: moderngl.Context
) -> None:
    said = window.press("1", says="camera square")
    look = replace(opening_settings(shown, None), camera="square")
    made = capture(gl, shown, look)
    assert made.digital is not None
    assert made.radiance is not None
    dn, camera = made.digital.dn, shown.cameras["square"]
    share = float(np.mean(saturated(dn, camera.detector)))
    assert f"saturated {100.0 * share:.3g} %" in said["boxes"]["info"]
    assert said["boxes"]["name 1"][:2] == ["radiance, all bands", "W m-2 sr-1"]
    image, name = window.screenshot()
    # Two parts of 480 columns; their images of 476 x 476 pixels, enlarged by 2.38.
    left = image[82:558, :476]
    places = (np.arange(476) + 0.5) * 200.0 / 476.0
    expected = display_from_dn(dn, camera)[places.astype(int)][:, places.astype(int)]
    clear = np.s_[180:380]  # no box lies there
    assert close(left[clear, clear], expected[clear, clear])
    with Image.open(window.folder / f"{name}.dn.png") as saved:
        assert np.array_equal(np.asarray(saved), dn)
    with Image.open(window.folder / f"{name}.view.png") as saved:
        assert close(np.asarray(saved), display_from_radiance(made.radiance.radiance))
    assert (window.folder / f"{name}.radiance.exr").exists()


def test_the_pixel_under_the_mouse_is_that_of_a_capture(
    window: OpenedWindow, shown: Scenario, gl: moderngl.Context
) -> None:
    window.press("1", says="camera square")
    window.press("Up", says="exposure")
    look = press(replace(opening_settings(shown, None), camera="square"), shown, "up")
    images = images_of(capture(gl, shown, look), 0.0)
    # 2.38 window pixels each, below 82 rows; the second image begins at column 480.
    for x, y, column, row in ((239, 321, 100, 100), (719, 321, 100, 100), (1, 83, 0, 0)):
        window.person.move(x, y)
        lines = pixel_lines(images, column, row)
        assert lines[0] == f"pixel {column}, {row}"
        assert len(lines) >= 5
        window.wait_for_box("pixel", lines)
    window.person.move(*ASIDE)
    window.wait_for(lambda said: "pixel" not in said["boxes"], "no pixel")


def test_dragging_and_the_wheel_move_the_camera(window: OpenedWindow, shown: Scenario) -> None:
    before = opening_settings(shown, None).orbit
    window.person.scroll(away=False)
    nearer = before.zoomed(-1.0)
    window.wait_for(
        lambda said: f"range {nearer.range:.5g} m" in said["boxes"]["info"][3], "a longer range"
    )
    window.person.scroll(away=True)
    window.person.drag((400, 300), (450, 320))
    after = before.dragged(np.pi / 640.0 * 50.0, np.pi / 640.0 * 20.0)
    angles = f"{np.degrees(after.azimuth):.0f}, {np.degrees(after.elevation):.0f} deg"
    window.wait_for(lambda said: said["boxes"]["info"][2] == f"circles ball at {angles}", angles)
    window.person.drag((450, 320), (400, 300))


def test_a_resized_window_is_filled_anew(window: OpenedWindow) -> None:
    for width, height in ((500, 400), (960, 640)):
        window.person.resize(width, height)
        # Until then the old image lies in it.
        window.person.move(width - 1, height - 1)
        last = f"pixel {width - 1}, {height - 1}"
        window.wait_for_pixel(last)
        image, _ = window.screenshot()
        assert image.shape == (height, width, 3)
        # The Earth reaches the lower corners.
        assert image[-1, 200].min() > 20


def test_text_goes_and_comes_with_o(window: OpenedWindow) -> None:
    window.person.key("o")
    window.wait_for(lambda said: not said["boxes"], "no text")
    without, _ = window.screenshot()
    window.person.key("o")
    window.wait_for(lambda said: "info" in said["boxes"], "text")
    # The sky behind the first line.
    assert without[10:60, 10:200].max() == 0


def test_the_sun_is_moved_and_shown(window: OpenedWindow, shown: Scenario) -> None:
    moved = press(opening_settings(shown, None), shown, "l")
    assert moved.sun_deg is not None
    text = f"Sun at right ascension {moved.sun_deg[0]:.0f}, declination {moved.sun_deg[1]:.0f} deg"
    said = window.press("l", says=text)
    state = chosen_state(shown, moved)
    ball = state.bodies["ball"].pose.position
    away = viewer_state(shown, moved, (960, 640))[0].cameras["viewer"].position - ball
    sun = state.sun.seen_from(ball).direction_icrf
    phase = np.degrees(np.arccos(sun @ away / np.linalg.norm(away)))
    assert said["boxes"]["info"][3].endswith(f"phase angle {phase:.1f} deg")


def test_a_video_has_a_frame_for_each_step_of_time(window: OpenedWindow) -> None:
    window.press("r", says="records")
    window.press("space", says="playing")
    start = window.said()["number"]
    window.wait_for(lambda said: said["number"] >= start + 8, "some images")
    window.press("space", says="paused")
    said = window.press("r", says="saved")
    path = window.folder / str(said["message"]).split()[1]
    with av.open(str(path)) as container:
        (stream,) = container.streams.video
        assert (stream.width, stream.height) == (960, 640)
        assert stream.average_rate == 25
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(frames) >= 4
    assert frames[-1][300:340, 460:500].mean() > 80.0  # the ball
    # A frame is a 25th of a second of the scene: as many as the time that went by.
    steps = round(float(said["boxes"]["info"][1].split()[0]) * 25.0)
    assert steps <= len(frames) <= steps + 6
    for _ in range(2):
        window.person.key("Left")


def test_a_shader_is_loaded_again_and_one_with_an_error_is_refused(window: OpenedWindow) -> None:
    shader = window.folder / "shaders" / "resolve" / "resolve.frag"
    good = shader.read_text(encoding="utf-8")
    before, _ = window.screenshot()
    shader.write_text(good + "\nthis is no GLSL;\n", encoding="utf-8")
    said = window.wait_for(lambda said: bool(said["error"]), "an error")
    assert "resolve/resolve.frag" in said["error"]
    assert "resolve/resolve.frag" in " ".join(said["boxes"]["error"])
    # The last good ones go on.
    window.press("Up", says="display +0.3 EV")
    window.press("Down", says="display +0.0 EV")
    shader.write_text(good, encoding="utf-8")
    window.wait_for(
        lambda said: not said["error"] and "loaded again" in said["message"], "no error"
    )
    after, _ = window.screenshot()
    clear = np.s_[200:440, 300:660]
    assert np.array_equal(after[clear], before[clear])
