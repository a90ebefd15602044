"""Progress: a bar in a terminal, a line every ten seconds elsewhere, neither with --quiet."""

from __future__ import annotations

import io
import sys
import time
import warnings
from functools import partial
from pathlib import Path

import moderngl
import pytest
from rich.console import Console

from simgl import Product, cli, cli_progress, scenario_from_dict
from simgl.figures.maps import write_maps
from simgl.simulator import Simulator
from tests.patience import wait_until


@pytest.fixture
def fast_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines come every hundredth of a second, from a thread of this test."""
    monkeypatch.setattr(cli_progress, "LINE_INTERVAL", 0.01)
    monkeypatch.setattr(cli_progress, "_lines", None)


def said(capsys: pytest.CaptureFixture[str], text: str) -> None:
    """Wait until a line of progress begins with a text."""
    lines: list[str] = []

    def is_said() -> bool:
        lines.extend(capsys.readouterr().err.splitlines())
        return any(line.startswith(text) for line in lines)

    wait_until(is_said, text, 10.0)


@pytest.mark.usefixtures("fast_lines")
def test_lines_say_what_is_done_and_how_far_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    with cli_progress.activity("loading scene.toml") as shown:
        said(capsys, "simgl: loading scene.toml: 0 s")
        shown.begin_stage("tables of the air")
        shown(3, 9)
        said(capsys, "simgl: tables of the air: 3 of 9, 0 s")
    time.sleep(0.05)
    capsys.readouterr()
    time.sleep(0.1)
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("fast_lines")
def test_quiet_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    cli_progress.set_quiet(True)
    try:
        with cli_progress.activity("loading scene.toml") as shown:
            shown(1, 2)
            time.sleep(0.1)
    finally:
        cli_progress.set_quiet(False)
    assert capsys.readouterr().err == ""


def test_a_terminal_shows_a_bar_that_disappears() -> None:
    screen = io.StringIO()
    with cli_progress.activity("loading", Console(file=screen, force_terminal=True)) as shown:
        shown.begin_stage("tables of the air")
        shown(3, 9)
    text = screen.getvalue()
    assert "tables of the air" in text
    assert "3/9" in text
    # The line is erased, and the cursor is shown again.
    assert text.rindex("\x1b[2K") > text.rindex("3/9")
    assert text.rindex("\x1b[?25h") > text.rindex("\x1b[?25l")


def test_render_names_each_stage(
    gl: moderngl.Context, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stages: list[str] = []

    class Recorded(cli_progress._Text):
        def begin_stage(self, name: str) -> None:
            stages.append(name)
            super().begin_stage(name)

    monkeypatch.setattr(cli_progress, "_Text", Recorded)
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))
    monkeypatch.setattr(sys, "argv", ["simgl", "render", str(scene), "--out", str(tmp_path)])
    scene.write_text(scene.read_text().replace('shape = "none"', SPHERE))
    with pytest.raises(SystemExit):
        cli.main()
    assert stages == [
        "loading scene.toml",
        "opening OpenGL",
        "compiling shaders",
        "tables of the air",
        "light between surfaces of block",
        "drawing nav",
        "writing nav",
    ]


def test_maps_are_counted(gl: moderngl.Context, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {"direction_icrf": [1.0, 0.0, 0.0]},
            "earth": {"shape": "none"},
            "camera": {
                "c": {"position_icrf_m": [0, 0, 0], "boresight": [1, 0, 0], "up": [0, 0, 1]}
                | {"width_px": 16, "height_px": 16}
            },
        }
    )
    with Simulator(scenario, ctx=gl) as simulator:
        products = {Product.RADIANCE, Product.ELECTRONS}
        capture = simulator.capture_at(scenario.epoch_tai_ns, "c", products)
    paths = write_maps(capture, tmp_path, "c", lambda done, total: seen.append((done, total)))
    assert seen == [(number, len(paths)) for number in range(len(paths))]


SPHERE = 'shape = "sphere"\nradius_km = 6371.0\nalbedo = 0.3'


def test_libraries_keep_silent_before_our_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import logging

    def load(path: Path) -> None:
        warnings.warn("numpy will remove this", DeprecationWarning, stacklevel=1)
        logging.getLogger("trimesh").warning("odd file")
        logging.getLogger("simgl.disk_cache").warning("%s: full", path)

    monkeypatch.setattr("simgl.commands.render_commands.load", load)
    monkeypatch.setattr(sys, "warnoptions", [])
    monkeypatch.setattr(sys, "argv", ["simgl", "exposure", "x", "--camera", "c", "--target", "t"])
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    with warnings.catch_warnings(), pytest.raises(AttributeError):
        cli.main()
    assert capsys.readouterr().err == "simgl: x: full\n"
