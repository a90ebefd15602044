"""Radiance and irradiance of Lambertian bodies in sunlight, against closed forms."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.physics.spectrum import black_body_light
from tests.scenes import IN_BANDS, TOTAL, capture, lambert, radiance, scene

PLATE = {"plate": {"width_m": 4.0, "height_m": 4.0, "material": lambert(0.5)}}


def tilted_sun(degrees: float) -> tuple[float, float, float]:
    t = np.radians(degrees)
    return float(np.sin(t)), 0.0, float(np.cos(t))


# Irradiance on a plate tilted from a 0.526 deg Sun of 1367 W m-2; past 89.7 deg its own horizon
# cuts the disc. Quadrature over the disc, independent of this code.
@pytest.mark.parametrize(
    ("tilt", "expected", "tolerance"),
    [
        # float32 through a handful of products: 1e-6
        (0.0, 1367.0, 1e-6),
        (30.0, 1183.8567, 1e-6),
        (60.0, 683.5, 1e-6),
        (85.0, 119.1419, 2e-6),
        # cos(89.8 deg) = 3.5e-3 carries a float32 error of 6e-8: 2e-5 of the value
        (89.8, 4.8129, 1e-4),
        (90.2, 0.0412, 2e-3),
    ],
)
def test_plate_radiance_is_rho_e_over_pi(
    gl: moderngl.Context, tilt: float, expected: float, tolerance: float
) -> None:
    scenario = scene(
        {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 50], "look_at": "plate"},
        sun_direction=tilted_sun(tilt),
    )
    image = radiance(gl, scenario)
    whole_spectrum = image[64, 64].sum(dtype=np.float64) * TOTAL / IN_BANDS
    np.testing.assert_allclose(whole_spectrum, 0.5 * expected / np.pi, rtol=tolerance)


@pytest.mark.parametrize("phase", [0.0, 30.0, 60.0, 90.0, 120.0, 150.0])
def test_lambert_sphere_follows_its_phase_law(gl: moderngl.Context, phase: float) -> None:
    """Irradiance at a camera 200 m from a sphere of 1 m, over the sphere's 290 pixels.

    Truth for the finite distance and disc: quadrature in float64, and a path tracer.
    """
    truth = {
        0.0: 1.143433e-2,
        30.0: 1.006613e-2,
        60.0: 6.945523e-3,
        90.0: 3.615402e-3,
        120.0: 1.228359e-3,
        150.0: 1.637098e-4,
    }
    ball = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}
    p = np.radians(phase)
    scenario = scene(
        {"ball": {"model": ball, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, 200],
            "look_at": "ball",
            "focal_length_mm": 108.75,  # 29,000 px: the sphere is 290 px wide
            "width_px": 320,
            "height_px": 320,
        },
        sun_direction=(float(np.sin(p)), 0.0, float(np.cos(p))),
    )
    image = radiance(gl, scenario).sum(axis=2, dtype=np.float64) * TOTAL / IN_BANDS
    f = scenario.cameras["cam"].focal_length_px
    y, x = (np.mgrid[0:320, 0:320] + 0.5 - 160.0) / f
    cos4 = 1.0 / (1.0 + x * x + y * y) ** 2
    irradiance = float(np.sum(image * cos4) / f**2)
    # 192 segments: chords lose up to 2.7e-4 of a disc's area, more of a thin crescent; the
    # silhouette falls on some 900 edge pixels of 5 or more
    # samples. The crescent needs 0.5 %.
    np.testing.assert_allclose(irradiance, truth[phase], rtol=5e-3)


def test_sunlight_falls_with_the_distance_squared() -> None:
    from simgl.scene.state import SunAtPosition

    light = black_body_light(1361.0, 5772.0)
    sun = SunAtPosition(
        position=np.array([ASTRONOMICAL_UNIT, 0.0, 0.0]), light_at_1_au=light, radius=6.957e8
    )
    near = sun.seen_from(np.array([0.5 * ASTRONOMICAL_UNIT, 0.0, 0.0]))
    far = sun.seen_from(np.array([-ASTRONOMICAL_UNIT, 0.0, 0.0]))
    np.testing.assert_allclose(near.irradiance / far.irradiance, 16.0, rtol=1e-14)
    # The disc's radiance does not depend on the distance: E / (pi sin^2 a).
    np.testing.assert_allclose(near.radiance, far.radiance, rtol=1e-12)


def test_worked_plate_gives_45421_electrons(gl: moderngl.Context) -> None:
    scenario = scene(
        {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, 50],
            "look_at": "plate",
            "f_number": 4.0,
            "exposure_time_s": 1.0 / 2000.0,
            "pixel_pitch_um": 3.75,
            "quantum_efficiency": [0.6, 0.6, 0.6, 0.0],
            "width_px": 129,
            "height_px": 129,
        },
    )
    frame = capture(gl, scenario).electrons
    assert frame is not None
    # 4 N^2 form. float32: 1e-6; the middle pixel is a half pixel wide in cos^4: 1e-7.
    np.testing.assert_allclose(frame.electrons[64, 64], 45420.755, rtol=2e-6)


def test_twice_the_exposure_gives_twice_the_electrons(gl: moderngl.Context) -> None:
    frames = []
    for seconds in (0.001, 0.002):
        scenario = scene(
            {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
            {"position_icrf_m": [0, 0, 50], "look_at": "plate", "exposure_time_s": seconds},
        )
        electrons = capture(gl, scenario).electrons
        assert electrons is not None
        frames.append(electrons.electrons)
    np.testing.assert_allclose(frames[1], 2.0 * frames[0], rtol=1e-6)


def test_cos4_at_the_corner_of_a_wide_lens(gl: moderngl.Context) -> None:
    scenario = scene(
        {
            "plate": {
                "model": {
                    "plate": {"width_m": 4000.0, "height_m": 4000.0, "material": lambert(0.5)}
                },
                "position_icrf_m": [0, 0, 0],
            }
        },
        {
            "position_icrf_m": [0, 0, 50],
            "look_at": "plate",
            "focal_length_mm": 4.0,
            "width_px": 1280,
            "height_px": 960,
        },
        render={"samples_per_pixel": 5},
    )
    frame = capture(gl, scenario).electrons
    assert frame is not None
    r = np.hypot(639.5, 479.5) * 3.75e-6
    middle = np.hypot(0.5, 0.5) * 3.75e-6
    f = 4e-3
    expected = ((f**2 + middle**2) / (f**2 + r**2)) ** 2
    np.testing.assert_allclose(
        frame.electrons[0, 0] / frame.electrons[480, 640], expected, rtol=5e-6
    )


def test_without_a_sun_there_are_no_electrons(gl: moderngl.Context) -> None:
    scenario = scene(
        {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, 50],
            "look_at": "plate",
            "read_noise_e": 0.0,
            "dsnu_e": 0.0,
            "dark_current_e_s": 0.0,
        },
        sun={"irradiance_w_m2": 0.0},
    )
    exposure = capture(gl, scenario)
    assert exposure.electrons is not None
    assert exposure.digital is not None
    assert np.all(exposure.electrons.electrons == 0.0)
    assert np.all(exposure.digital.dn == 64)
