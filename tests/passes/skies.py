"""Skies with hand-made answers, and what a picture of them adds up to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.physics.frames import camera_from_directions
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.star_catalogue import StarCatalogue, StarSky
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator


def towards(right_ascension_deg: float, declination_deg: float) -> Array:
    """(3,) unit direction in ICRS axes."""
    a, d = np.radians([right_ascension_deg, declination_deg])
    return np.array([np.cos(d) * np.cos(a), np.cos(d) * np.sin(a), np.sin(d)])


def sky_scene(camera: dict[str, Any], **tables: Any) -> Scenario:
    """A camera in deep space under the real sky; north is up unless the camera says otherwise."""
    usual = {"width_px": 128, "height_px": 96, "position_icrf_m": [0.0, 0.0, 0.0], "up": [0, 0, 1]}
    data = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "earth": {"shape": "none"},
        "camera": {"cam": {**usual, **camera}},
        **tables,
    }
    return scenario_from_dict(data)


def picture(gl: moderngl.Context, scenario: Scenario, state: SceneState | None = None) -> Array:
    """(height, width, 4) radiance."""
    if state is None:
        state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        return taken(simulator, state)


def taken(simulator: Simulator, state: SceneState) -> Array:
    """(height, width, 4) radiance, for many pictures of one scenario."""
    frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
    assert frame is not None
    return np.asarray(frame.radiance, dtype=np.float64)


def lone_stars(state: SceneState, directions: Sequence[Array], irradiance: float) -> SceneState:
    """The scene under so many stars and no more, of equal light in all bands, nothing moving."""
    n = len(directions)
    catalogue = StarCatalogue(
        hip=np.arange(1, n + 1, dtype=np.uint32),
        magnitude=np.zeros(n),
        direction=np.array(directions),
        motion=np.zeros((n, 3)),
        parallax=np.zeros(n),
        irradiance=np.full((n, 4), irradiance),
    )
    sky = StarSky(
        catalogue=catalogue, years=0.0, earth_position=np.zeros(3), earth_velocity=np.zeros(3)
    )
    return replace(state, stars=sky)


def direction_of_pixel(camera: Camera, R_camera_from_icrf: Array, x: float, y: float) -> Array:
    """(3,) unit direction in ICRF axes."""
    ray = np.linalg.inv(camera.intrinsics) @ np.array([x, y, 1.0])
    return R_camera_from_icrf.T @ (ray / np.linalg.norm(ray))


def turned(state: SceneState, boresight: Array, up: Array) -> SceneState:
    """The scene with its camera looking elsewhere."""
    camera = state.cameras["cam"]
    moved = replace(camera, R_camera_from_icrf=camera_from_directions(boresight, up))
    return replace(state, cameras={"cam": moved})


def received(image: Array, camera: Camera) -> Array:
    """(4,) irradiance of all that a picture shows, each pixel's facing it [W m-2].

    The solid angle of each pixel is exact, so that wide fields and few pixels cost nothing.
    """
    k, d = camera.intrinsics, camera.detector
    x = (np.arange(d.width + 1) - k[0, 2]) / k[0, 0]
    y = (np.arange(d.height + 1) - k[1, 2]) / k[1, 1]
    corner = np.arctan2(x[None, :] * y[:, None], np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2))
    solid_angle = np.diff(np.diff(corner, axis=0), axis=1)
    return np.sum(image * solid_angle[..., None], axis=(0, 1))
