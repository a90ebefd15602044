"""What a server draws before it says that it is ready."""

from __future__ import annotations

from pathlib import Path
from typing import cast
from unittest.mock import MagicMock

import pytest
from simgl_bridge.processes import RendererOptions
from simgl_bridge.render_process import Renderer, ServerLink, open_renderer

from simgl.gpu import fullscreen, tile_quads
from simgl.passes import outline_program

SCENE = """
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "none"
[spacecraft.ball]
model = { sphere = { radius_m = 1.0, material = { reflectance = 0.5 } } }
orbit = { altitude_km = 400.0 }
[camera.near]
about = { target = "ball", azimuth_deg = 30.0, range_m = RANGE }
width_px = 32
height_px = 24
"""


def opened(folder: Path, range_m: float) -> Renderer:
    path = folder / "scene.toml"
    path.write_text(SCENE.replace("RANGE", f"{range_m}"))
    return open_renderer(RendererOptions(scenario=str(path)), cast(ServerLink, MagicMock()))


def test_no_request_near_the_epoch_waits_for_a_shader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(tmp_path, 9.0).session as session:
        scenario = session.scenario
        for module in (fullscreen, tile_quads, outline_program):
            monkeypatch.setattr(module, "load_program", None)
        capture = session.capture(scenario.at(scenario.epoch_tai_ns + 10**9), "near")
        assert capture.digital is not None
        assert capture.digital.dn.any()


def test_a_scene_without_an_image_at_its_epoch_is_served(tmp_path: Path) -> None:
    """The camera stands inside the ball."""
    with opened(tmp_path, 0.5).session as session:
        assert list(session.scenario.cameras) == ["near"]
