"""The Sun's disc in the picture: its light at every scale, its darkening, its place."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from tests.passes.skies import direction_of_pixel, picture, received, sky_scene, taken, turned

BANDS = np.array([154.43947526, 174.7738123, 171.94738469, 313.35751052])  # [W m-2]
RADIUS = np.radians(0.263)


def sunny(focal_length_mm: float, size: int, **sun: object) -> Scenario:
    """A camera that looks at a darkened Sun fixed by hand."""
    return sky_scene(
        {
            "boresight": [0, 1, 0],
            "focal_length_mm": focal_length_mm,
            "width_px": size,
            "height_px": size,
        },
        sun={
            "irradiance_w_m2": 1367.0,
            "temperature_k": 5777.0,
            "angular_diameter_deg": 0.526,
            "direction_icrf": [0.0, 1.0, 0.0],
            "limb_darkening": True,
            **sun,
        },
    )


@pytest.mark.parametrize(
    ("focal_length_mm", "diameter_px"),
    [(2.0, 1e-3), (2.0, 0.08), (2.0, 0.5), (2.0, 0.97), (2.0, 3.2), (8.0, 20.0), (15.0, 37.0),
     (200.0, 490.0)],
)  # fmt: skip
def test_the_disc_sends_the_suns_irradiance_at_every_scale(
    gl: moderngl.Context, focal_length_mm: float, diameter_px: float
) -> None:
    size = 520 if diameter_px > 100 else 64
    diameter_deg = float(np.degrees(diameter_px * 3.75e-3 / focal_length_mm))
    scenario = sunny(focal_length_mm, size, angular_diameter_deg=diameter_deg)
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"].camera
    R = state.cameras["cam"].R_camera_from_icrf
    with Simulator(scenario, gl) as simulator:
        for x, y in [(0.0, 0.0), (0.5, 0.5), (0.37, 0.12), (0.96, 0.51)]:
            # The camera looks past the Sun, which then stands so many pixels off the middle.
            aim = direction_of_pixel(camera, R, 0.5 * size - x, 0.5 * size - y)
            image = taken(simulator, turned(state, aim, np.array([0.0, 0.0, 1.0])))
            # A pixel of the widest field is 0.1 deg; cos^3 varies over it by 1e-5. float32 knows
            # pixel coordinates to 4e-6, which moves the disc but does not count.
            np.testing.assert_allclose(received(image, camera), BANDS, rtol=2e-4)


@pytest.mark.parametrize("off_axis_deg", [20.0, 40.0])
@pytest.mark.parametrize("focal_length_mm", [0.3, 1.5])
def test_the_disc_sends_the_suns_irradiance_far_from_the_boresight(
    gl: moderngl.Context, focal_length_mm: float, off_axis_deg: float
) -> None:
    scenario = sunny(focal_length_mm, 1000)
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"].camera
    a = np.radians(off_axis_deg)
    # Diagonally, where the disc's ellipse leans against the rows.
    aim = np.array([np.sin(a), np.cos(a), np.sin(a) * 0.9])
    image = picture(gl, scenario, turned(state, aim, np.array([0.0, 0.0, 1.0])))
    # cos^3 varies by 3 tan(40 deg) 0.0046 = 1 % over the disc, evenly to both sides.
    np.testing.assert_allclose(received(image, camera), BANDS, rtol=1e-3)


def test_the_disc_is_a_circle_of_its_angular_radius_dark_at_the_edge(gl: moderngl.Context) -> None:
    scenario = sunny(200.0, 520)
    image = picture(gl, scenario)
    f = scenario.cameras["cam"].focal_length_px
    mean = BANDS / (np.pi * np.sin(RADIUS) ** 2)
    seen = image[..., 1] > 0.0
    np.testing.assert_allclose(seen.any(axis=0).sum(), 2.0 * np.tan(RADIUS) * f, atol=2.0)
    np.testing.assert_allclose(seen.any(axis=1).sum(), 2.0 * np.tan(RADIUS) * f, atol=2.0)
    middle = image[260, 260] / mean
    edge = image[260, int(260 + 0.9 * RADIUS * f)] / mean
    # Cox (2000): at mu = 0.436 in green (1 - 0.564 (0.474 + 0.564 0.227)) / 0.804.
    np.testing.assert_allclose(middle[1], 1.0 / 0.8043, rtol=2e-3)
    np.testing.assert_allclose(edge[1] / middle[1], 0.661, rtol=1e-2)
    assert edge[2] < edge[1] < edge[0] < edge[3]


def test_a_uniform_disc_has_one_radiance(gl: moderngl.Context) -> None:
    image = picture(gl, sunny(50.0, 160, limb_darkening=False))
    inside = image[60:100, 60:100]
    mean = BANDS / (np.pi * np.sin(RADIUS) ** 2)
    # Differences of chords 1/61 of the radius long, in float32.
    np.testing.assert_allclose(inside, np.broadcast_to(mean, inside.shape), rtol=1e-5)


@pytest.mark.parametrize(("share", "altitude_deg"), [(0.5, 0.0), (1.0, 0.4), (0.0, -0.4)])
def test_the_earth_cuts_the_disc(gl: moderngl.Context, share: float, altitude_deg: float) -> None:
    """At 400 km the limb of a black sphere stands at asin(R / r) from nadir."""
    limb = np.arcsin(6371.0 / 6771.0) + np.radians(altitude_deg)
    sun = [-np.cos(limb), np.sin(limb), 0.0]
    scenario = sky_scene(
        {
            "position_icrf_m": [6.771e6, 0, 0],
            "boresight": sun,
            "up": [1, 0, 0],
            "focal_length_mm": 20.0,
        },
        earth={"shape": "sphere", "radius_km": 6371.0, "albedo": 0.0},
        sun={"direction_icrf": sun, "limb_darkening": True, "angular_diameter_deg": 0.526},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    whole = state.sun.seen_from(np.zeros(3)).irradiance
    light = received(picture(gl, scenario), state.cameras["cam"].camera)
    # The limb is straight to 1e-3 of the disc; a row of pixels is 2 % of the disc's height, cut by
    # its share.
    np.testing.assert_allclose(light / whole, share, atol=2e-3)


def test_an_invisible_sun_is_not_drawn(gl: moderngl.Context) -> None:
    assert picture(gl, sunny(20.0, 64, visible=False)).max() == 0.0
