"""What the tests of the viewer share: keys, cameras, and what a picture has to be."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import Image8
from simgl.display_images import display_from_radiance
from simgl.rendering.renderer import Renderer
from simgl.scenario.scenario import Scenario
from simgl.view.frame_view import frame_view
from simgl.viewer.orbit_camera import OrbitCamera
from simgl.viewer.view_commands import BY_KEY
from simgl.viewer.view_settings import ViewSettings
from simgl.viewer.viewport import viewer_state


def press(look: ViewSettings, scenario: Scenario, *keys: str) -> ViewSettings:
    """The look after some keys."""
    for key in keys:
        look = BY_KEY[key].effect(look, scenario)
    return look


def orbit_camera(
    azimuth: float = 0.3, elevation: float = 0.2, distance: float = 30.0
) -> OrbitCamera:
    """About a craft whose surface is 5 m away at the nearest."""
    return OrbitCamera(
        azimuth=azimuth, elevation=elevation, range=distance, nearest=5.0, farthest=5000.0
    )


def assert_shows(
    picture: Image8, gl: moderngl.Context, scenario: Scenario, look: ViewSettings
) -> None:
    """A window's picture is what a headless renderer makes of the same state."""
    height, width, _ = picture.shape
    state, camera = viewer_state(scenario, look, (width, height))
    with Renderer(gl) as renderer:
        view = frame_view(state, camera, sample_budget=renderer.sample_budget)
        radiance = renderer.radiance(view).read() * np.float32(2.0**look.exposure_value)
    difference = np.abs(picture.astype(int) - display_from_radiance(radiance)).max(axis=2)
    # Another driver may place a sample on an edge differently: one pixel in a thousand may differ.
    assert np.mean(difference > 2) < 1e-3
