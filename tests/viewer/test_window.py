"""The window itself, under Xvfb."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.errors import ContextError
from simgl.scenario.loader import load_scenario
from simgl.viewer.view_settings import opening_settings
from simgl.viewer.window import run
from tests.patience import run_to_end
from tests.viewer.harness import assert_shows


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
    # Progress, which a slow machine would show, is no error.
    command = ["-m", "simgl", "view", str(scenario_path), "--screenshot", str(out), "--quiet"]
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
    assert_shows(picture, gl, scenario, opening_settings(scenario, None))
