"""The window itself, under Xvfb."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.errors import ContextError
from simgl.scenario.loader import load_scenario
from simgl.viewer.view_settings import opening_look
from simgl.viewer.window import run
from tests.patience import run_to_end
from tests.viewer.harness import assert_shows, press


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


def on_display(display: str, *command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("WAYLAND", "XDG_"))}
    return run_to_end(
        [sys.executable, "-W", "error", *command],
        env={**environment, "DISPLAY": display},
        cwd=folder,
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
from simgl.viewer.orbit_camera import OrbitCamera
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
