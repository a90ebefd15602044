"""The Moon in the picture: its light, size, phase, and what it hides."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.constants import ASTRONOMICAL_UNIT, MOON_RADIUS
from simgl.physics.eclipse import past_the_moon
from simgl.physics.lunar_model import disc_reflectance
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState, SunAtPosition
from simgl.simulator import Simulator
from tests.passes.skies import picture, received, sky_scene, taken, turned

DISTANCE = 384_400e3  # [m]


def sun_at(state: SceneState, position: Array) -> SunAtPosition:
    """The scene's Sun at another place."""
    assert isinstance(state.sun, SunAtPosition)
    return replace(state.sun, position=position)


def moonlit(scenario: Scenario, phase_deg: float, side: Array) -> SceneState:
    """The Moon at its mean distance along +y at a phase angle, the Sun at 1 au off to one side."""
    a = np.radians(phase_deg)
    state = scenario.at(scenario.epoch_tai_ns)
    moon = np.array([0.0, DISTANCE, 0.0])
    to_sun = -np.cos(a) * np.array([0.0, 1.0, 0.0]) + np.sin(a) * side
    sun = replace(sun_at(state, moon + ASTRONOMICAL_UNIT * to_sun), visible=False)
    # A smooth Moon, whose two quarters are alike.
    return replace(state, moon=moon, sun=sun, stars=None, R_moon_from_icrf=None)


def camera(focal_length_mm: float, size: int = 128) -> dict[str, object]:
    """Looks along +y, north up: +x is to the right."""
    return {
        "boresight": [0, 1, 0],
        "focal_length_mm": focal_length_mm,
        "width_px": size,
        "height_px": size,
    }


RIGHT = np.array([1.0, 0.0, 0.0])


# Diameters of 0.3, 1.4, 12 and 97 pixels.
@pytest.mark.parametrize("focal_length_mm", [0.13, 0.6, 5.0, 40.0])
def test_the_picture_sums_to_the_measured_phase_curve(
    gl: moderngl.Context, focal_length_mm: float
) -> None:
    scenario = sky_scene(camera(focal_length_mm))
    with Simulator(scenario, gl) as simulator:
        for phase_deg in (0.5, 45.0, 90.0, 135.0):
            state = moonlit(scenario, phase_deg, RIGHT)
            light = received(taken(simulator, state), state.cameras["cam"].camera)
            reflectance = light / state.sun.seen_from(np.zeros(3)).irradiance
            reflectance *= (DISTANCE / MOON_RADIUS) ** 2
            expected = disc_reflectance(np.radians(phase_deg))
            # Points 1/192 of the disc apart: 0.5 % of the crescent's light at 135 deg, where the
            # law is steepest; the Sun is nearer to the camera than to the Moon by up to 0.2 %,
            # which is 0.4 %.
            np.testing.assert_allclose(reflectance, expected, rtol=0.01)


def test_a_full_moon_is_a_flat_disc_of_its_angular_size(gl: moderngl.Context) -> None:
    scenario = sky_scene(camera(40.0))
    image = picture(gl, scenario, moonlit(scenario, 0.0, RIGHT))[..., 1]
    radius = np.tan(np.arcsin(MOON_RADIUS / DISTANCE)) * scenario.cameras["cam"].focal_length_px
    covered = image.sum() / image[64, 64]
    # Coverage is exact; the disc function at full phase is 1/2 everywhere.
    np.testing.assert_allclose(covered, np.pi * radius**2, rtol=1e-3)
    inside = np.hypot(*(np.indices(image.shape) - 63.5)) < radius - 1.5
    np.testing.assert_allclose(image[inside], image[64, 64], rtol=1e-3)


def test_the_bright_limb_faces_the_sun(gl: moderngl.Context) -> None:
    scenario = sky_scene(camera(40.0))
    with Simulator(scenario, gl) as simulator:
        for t in np.radians([0.0, 70.0, 160.0, 250.0]):
            side = np.array([np.cos(t), 0.0, np.sin(t)])
            image = taken(simulator, moonlit(scenario, 120.0, side))[..., 1]
            rows, columns = np.indices(image.shape) - 63.5
            # North is up in the picture; rows go down.
            x, y = (image * columns).sum(), -(image * rows).sum()
            away = np.degrees(np.angle(np.exp(1j * (np.arctan2(y, x) - t))))
            # Pixels: a tenth of a pixel of 40.
            assert abs(away) < 0.2


def test_the_moon_is_redder_than_sunlight(gl: moderngl.Context) -> None:
    scenario = sky_scene(camera(40.0))
    state = moonlit(scenario, 30.0, RIGHT)
    colour = picture(gl, scenario, state).max(axis=(0, 1))
    colour /= state.sun.seen_from(np.zeros(3)).irradiance
    assert colour[2] < colour[1] < colour[0] < colour[3]


@pytest.mark.parametrize("off_moon_radii", [0.0, 0.4, 1.0, 1.7])
def test_the_new_moon_bites_the_suns_disc(gl: moderngl.Context, off_moon_radii: float) -> None:
    """What is left of the disc is what a spacecraft there gets of the sunlight."""
    scenario = sky_scene(camera(40.0))
    state = scenario.at(scenario.epoch_tai_ns)
    sun = sun_at(state, np.array([0.0, ASTRONOMICAL_UNIT, 0.0]))
    off = off_moon_radii * MOON_RADIUS / DISTANCE
    moon = DISTANCE * np.array([0.8 * np.sin(off), np.cos(off), 0.6 * np.sin(off)])
    state = replace(state, sun=sun, moon=moon, stars=None)
    seen = sun.seen_from(np.zeros(3))
    left = received(picture(gl, scenario, state), state.cameras["cam"].camera) / seen.irradiance
    expected = past_the_moon(np.zeros(3), moon, seen.direction_icrf, seen.angular_radius, seen.limb)
    # Pixels that both limbs cross take the product of their shares: 1e-3 of the disc.
    np.testing.assert_allclose(left, expected, atol=2e-3)


@pytest.mark.parametrize(("share", "altitude_deg"), [(0.5, 0.0), (1.0, 0.4), (0.0, -0.4)])
def test_the_moon_sets_behind_the_earth(
    gl: moderngl.Context, share: float, altitude_deg: float
) -> None:
    limb = np.arcsin(6371.0 / 6771.0) + np.radians(altitude_deg)
    towards = np.array([-np.cos(limb), np.sin(limb), 0.0])
    place = np.array([6.771e6, 0.0, 0.0])
    light = []
    for earth in ({"shape": "none"}, {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.0}):
        scenario = sky_scene(
            {**camera(20.0), "position_icrf_m": place.tolist()}, earth=earth, sky={"stars": False}
        )
        state = turned(scenario.at(scenario.epoch_tai_ns), towards, np.array([1.0, 0.0, 0.0]))
        state = replace(state, moon=place + DISTANCE * towards, R_moon_from_icrf=None)
        state = replace(state, sun=sun_at(state, -ASTRONOMICAL_UNIT * towards))
        light.append(received(picture(gl, scenario, state), state.cameras["cam"].camera))
    np.testing.assert_allclose(light[1] / light[0], share, atol=3e-3)


def test_a_scene_with_the_sun_fixed_by_hand_has_no_moon(gl: moderngl.Context) -> None:
    real = sky_scene(camera(5.0))
    moon = real.at(real.epoch_tai_ns).moon
    assert moon is not None
    look = {**camera(5.0), "boresight": moon.tolist()}
    assert picture(gl, sky_scene(look, sky={"stars": False})).max() > 0.0
    by_hand = {"direction_icrf": (-moon).tolist()}
    assert picture(gl, sky_scene(look, sun=by_hand)).max() == 0.0


def facing(scenario: Scenario, phase_deg: float, side: Array) -> SceneState:
    """A Moon with its seas, its mean face to the camera and its north up."""
    away = np.array([0.0, 1.0, 0.0])
    north = np.array([0.0, 0.0, 1.0])
    turn = np.stack([-away, np.cross(north, -away), north])
    return replace(moonlit(scenario, phase_deg, side), R_moon_from_icrf=turn)


def test_the_seas_lie_where_they_belong(gl: moderngl.Context) -> None:
    scenario = sky_scene(camera(100.0, 280))
    image = picture(gl, scenario, facing(scenario, 0.0, RIGHT))[..., 1]
    radius = np.tan(np.arcsin(MOON_RADIUS / DISTANCE)) * scenario.cameras["cam"].focal_length_px

    def at(east_deg: float, north_deg: float) -> float:
        east, north = np.radians([east_deg, north_deg])
        # East on the Moon is to the right with north up.
        x = 140.0 + radius * np.cos(north) * np.sin(east)
        y = 140.0 - radius * np.sin(north)
        return float(image[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2].mean())

    seas = [at(59.1, 17.0), at(17.5, 28.0), at(-15.6, 32.8), at(-38.6, -24.4), at(51.3, -7.8)]
    lands = [at(-59.1, -40.0), at(15.0, -40.0), at(59.1, 45.0), at(10.0, -10.0), at(30.0, -50.0)]
    assert max(seas) < 0.7 * min(lands)
    assert at(-11.4, -43.3) > max(lands)  # Tycho


def test_the_seas_leave_the_full_moon_its_light(gl: moderngl.Context) -> None:
    for focal_length_mm in (1.0, 10.0, 40.0):
        scenario = sky_scene(camera(focal_length_mm))
        optics = scenario.cameras["cam"]
        with Simulator(scenario, gl) as simulator:
            for phase_deg, tolerance in ((0.0, 0.01), (90.0, 0.2)):
                plain = taken(simulator, moonlit(scenario, phase_deg, RIGHT))
                real = taken(simulator, facing(scenario, phase_deg, RIGHT))
                # The map's mean over the disc is 1; the half with the eastern seas need not be.
                ratio = received(real, optics) / received(plain, optics)
                np.testing.assert_allclose(ratio, 1.0, atol=tolerance)


def test_earthshine_lights_the_night_side_of_the_moon(gl: moderngl.Context) -> None:
    """At 120 deg the Earth is 60 deg from full: p* 0.28 in G of a white Lambertian globe."""
    scenario = sky_scene(
        {**camera(40.0), "position_icrf_m": [0.0, 1e7, 0.0]}, earth={"albedo": 0.3}
    )
    state = moonlit(scenario, 120.0, RIGHT)
    image = picture(gl, scenario, state)[..., 1]
    a = np.radians(60.0)
    globe = 2.0 / (3.0 * np.pi) * (np.sin(a) + (np.pi - a) * np.cos(a))
    sunlight = state.sun.seen_from(np.zeros(3)).irradiance[1]
    earthlight = 0.28 * globe * sunlight * (6371.0e3 / DISTANCE) ** 2
    # The full Moon's radiance under it; the night side of the disc, off the limb.
    expected = earthlight * disc_reflectance(0.0)[1] / np.pi
    # 60 deg to 2e-3, by the Sun's distance.
    np.testing.assert_allclose(image[64, 40], expected, rtol=5e-3)
