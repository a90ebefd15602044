"""Zodiacal light, faint starlight and planets in the picture."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.assess.visible_stars import stars_in_view
from simgl.physics.frames import angle_between
from simgl.physics.starlight import band_irradiance
from simgl.physics.zodiacal_light import ecliptic_from_icrf, faint_starlight
from simgl.simulator import Simulator
from tests.passes.skies import lone_stars, received, sky_scene, taken, towards, turned

SOLAR_STAR = band_irradiance(np.array([10.0]), np.array([0.653]), np.array([0.702]))[0]


def test_zodiacal_light_is_the_published_tables(gl: moderngl.Context) -> None:
    """Leinert et al. (1998), table 17, at longitudes from the Sun and latitudes; at 500 nm."""
    scenario = sky_scene({"boresight": [0, 1, 0], "width_px": 16, "height_px": 16})
    state = lone_stars(scenario.at(scenario.epoch_tai_ns), [np.array([1.0, 0.0, 0.0])], 0.0)
    assert state.stars is not None
    state = replace(state, stars=replace(state.stars, diffuse=True))
    R = ecliptic_from_icrf()
    sun = R @ state.sun.seen_from(np.zeros(3)).direction_icrf
    sun_longitude = np.arctan2(sun[1], sun[0])
    with Simulator(scenario, gl) as simulator:
        for longitude, latitude, expected in ((90, 0, 259), (40, -30, 282), (-165, 45, 104)):
            at, b = sun_longitude + np.radians(longitude), np.radians(latitude)
            looking = R.T @ np.array([np.cos(b) * np.cos(at), np.cos(b) * np.sin(at), np.sin(b)])
            image = taken(simulator, turned(state, looking, np.array([0.0, 0.0, 1.0])))
            seen = image[8, 8] - faint_starlight(looking[None])[0]
            # Green's mean over 500 to 600 nm lies off the value at 500 nm by the Sun's spectrum
            # and by the reddening there, 0.6 to 0.8 times log10(1.1).
            one = SOLAR_STAR[1] * np.degrees(1.0) ** 2 / 1.28e-8
            elongation = np.degrees(angle_between(looking, R.T @ sun))
            red = 1.0 + (0.8 - 0.2 * np.clip((elongation - 30.0) / 60.0, 0.0, 1.0)) * np.log10(1.1)
            np.testing.assert_allclose(seen[1], expected * 1e-8 * one * red, rtol=0.02)


def test_the_milky_way_is_brighter_than_the_poles_of_the_galaxy() -> None:
    pole, centre = towards(192.86, 27.13), towards(266.4, -28.9)
    at_pole, in_plane = faint_starlight(np.stack([pole, centre]))
    np.testing.assert_allclose(in_plane / at_pole, 160.0 / 30.0, rtol=1e-3)


def test_spacecraft_are_lit_by_the_sky_that_cameras_see(gl: moderngl.Context) -> None:
    """Six pictures of the sky, added up but for the 30 deg around the Sun, spread over it."""
    side = 96
    scenario = sky_scene(
        {"boresight": [0, 1, 0], "width_px": side, "height_px": side, "pixel_pitch_um": 10.0}
        | {"focal_length_mm": 0.01 * side / 2}
    )
    state = scenario.at(scenario.epoch_tai_ns)
    assert state.stars is not None
    stars = replace(state.stars, tai_ns=None)
    state = replace(state, stars=stars)
    sun = state.sun.seen_from(np.zeros(3)).direction_icrf
    across = (np.arange(side) + 0.5) / (side / 2) - 1.0
    x, y = np.meshgrid(across, across)
    solid_angle = (x**2 + y**2 + 1.0) ** -1.5 * (2.0 / side) ** 2
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    light, seen = np.zeros(4), 0.0
    with Simulator(scenario, gl) as simulator:
        for axis in range(3):
            for sign in (1.0, -1.0):
                looking = turned(state, sign * np.eye(3)[axis], np.eye(3)[axis - 1])
                directions = rays @ looking.cameras["cam"].R_camera_from_icrf
                weight = solid_angle * (directions @ sun < np.cos(np.radians(30.0)))
                light += np.einsum("ij,ijk->k", weight, taken(simulator, looking))
                seen += weight.sum()
    np.testing.assert_allclose(seen, 2.0 * np.pi * (1.0 + np.cos(np.radians(30.0))), rtol=1e-3)
    # Few stars give much of the catalogue's light, and some of them stand beside the Sun.
    np.testing.assert_allclose(light / seen, stars.mean_radiance(state.bands), rtol=0.03)


@pytest.mark.parametrize("focal_length_mm", [2.0, 50.0])
def test_no_seams_and_no_gaps(gl: moderngl.Context, focal_length_mm: float) -> None:
    """Neighbouring pixels differ by the field's gradient alone."""
    scenario = sky_scene(
        {"boresight": towards(90, 60).tolist(), "focal_length_mm": focal_length_mm}
    )
    state = lone_stars(scenario.at(scenario.epoch_tai_ns), [np.array([1.0, 0.0, 0.0])], 0.0)
    assert state.stars is not None
    with Simulator(scenario, gl) as simulator:
        image = taken(simulator, replace(state, stars=replace(state.stars, diffuse=True)))
    assert image.min() > 1e-7
    for axis in (0, 1):
        step = np.abs(np.diff(image, axis=axis)) / image.mean()
        # A pixel is 0.1 deg at 2 mm; the plane of the galaxy falls to half in 5 deg.
        assert step.max() < 0.02


def test_venus_outshines_every_star_where_it_stands(gl: moderngl.Context) -> None:
    utc = "2020-04-28T00:00:00"
    scenario = sky_scene(
        {"boresight": towards(75.87, 27.63).tolist(), "focal_length_mm": 20.0}, epoch={"utc": utc}
    )
    state = scenario.at(scenario.epoch_tai_ns)
    first = stars_in_view(state, "cam")[0]
    assert (first.planet, first.hip) == ("venus", None)
    with Simulator(scenario, gl) as simulator:
        image = taken(simulator, state)
    x, y = first.pixel
    assert image[int(y), int(x), 1] == image[..., 1].max()
    near = image.copy()
    near[: int(y) - 2] = near[int(y) + 3 :] = 0.0
    near[:, : int(x) - 2] = near[:, int(x) + 3 :] = 0.0
    # The sky beside it gives less than 1e-4 of its light.
    light = received(near, state.cameras["cam"].camera)
    np.testing.assert_allclose(light, first.irradiance, rtol=1e-3)
