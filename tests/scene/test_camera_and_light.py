"""Camera numbers by hand, materials' limits, the Sun's light with distance, the camera equation."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.camera import Camera, Detector, Lens
from simgl.camera.camera_equation import irradiance_per_radiance, square_electrons_per_irradiance
from simgl.camera.detector import Mosaic
from simgl.physics.spectrum import black_body_light
from simgl.scene.earth import Earth
from simgl.scene.materials import Material
from simgl.scene.state import SunAtPosition, SunInDirection

AU = 149597870700.0  # [m]

CAMERA = Camera(
    name="nav",
    lens=Lens(focal_length=13e-3, f_number=2.8),
    detector=Detector(
        width=1280,
        height=960,
        pixel_pitch=3.75e-6,
        quantum_efficiency=(0.6, 0.7, 0.5, 0.2),
        full_well=24500.0,
        read_noise=4.0,
        bits=12,
        pedestal=64.0,
        gain_dn_per_e=0.1645,
    ),
    exposure_time=1e-3,
)


def electrons_per_radiance(camera: Camera, photons_per_joule: Array) -> Array:
    """The whole camera equation [e- W-1 m2 sr]."""
    first = square_electrons_per_irradiance(camera, photons_per_joule)[0]
    return irradiance_per_radiance(camera) * first


def test_thirteen_millimetres_are_3466_67_pixels_of_3_75_um() -> None:
    assert CAMERA.focal_length_px == pytest.approx(3466.6667, abs=1e-4)


def test_the_principal_point_is_the_middle_of_the_image() -> None:
    np.testing.assert_allclose(
        CAMERA.intrinsics,
        [[3466.66667, 0.0, 640.0], [0.0, 3466.66667, 480.0], [0.0, 0.0, 1.0]],
        rtol=0.0,
        atol=1e-5,
    )


def test_a_point_down_and_to_the_right_lands_below_and_right_of_the_middle() -> None:
    x, y, w = CAMERA.intrinsics @ np.array([0.1, 0.05, 1.0])
    np.testing.assert_allclose([x / w, y / w], [986.66667, 653.33333], rtol=0.0, atol=1e-5)


def test_the_sensor_of_4_8_by_3_6_mm_sees_20_92_by_15_77_deg() -> None:
    # 2 atan(2.4 / 13) and 2 atan(1.8 / 13).
    horizontal, vertical = np.degrees(CAMERA.fields_of_view)
    assert horizontal == pytest.approx(20.91982, abs=1e-5)
    assert vertical == pytest.approx(15.76628, abs=1e-5)


def test_the_camera_equation_by_hand() -> None:
    # pi / (4 2.8^2) = 0.10017834; (3.75 um)^2 = 1.40625e-11 m2; 1 ms: 1.4087579e-15 J for each
    # W m-2 sr-1. At 3e18 photons per joule: 4226.2736 photons, times the quantum efficiencies.
    electrons = electrons_per_radiance(CAMERA, np.full(4, 3e18))
    np.testing.assert_allclose(electrons, [2535.7642, 2958.3915, 2113.1368, 845.2547], rtol=1e-7)


def test_three_box_filters_share_out_the_worked_plate() -> None:
    """Albedo 0.5, 1367 W m-2 at 5777 K, f/4, 1/2000 s, 3.75 um, QE 0.6 in one band each."""
    boxes = Mosaic(
        order="RGGB",
        red=(0.6, 0.0, 0.0, 0.0),
        green=(0.0, 0.6, 0.0, 0.0),
        blue=(0.0, 0.0, 0.6, 0.0),
    )
    camera = replace(
        CAMERA,
        lens=Lens(focal_length=0.013, f_number=4.0),
        detector=replace(CAMERA.detector, mosaic=boxes),
        exposure_time=0.0005,
    )
    light = black_body_light(1367.0, 5777.0)
    irradiance = 0.5 * light.irradiance / np.pi * irradiance_per_radiance(camera)
    weights = square_electrons_per_irradiance(camera, light.photons_per_joule)
    # In the order of the square: red, green, green, blue; printed to 0.01 e-.
    np.testing.assert_allclose(
        weights @ irradiance, [16_620.67, 15_931.25, 15_931.25, 12_868.84], atol=0.006, rtol=0.0
    )


def test_signal_goes_with_time_and_transmission_and_with_the_inverse_square_of_the_stop() -> None:
    photons = np.full(4, 3e18)
    once = electrons_per_radiance(CAMERA, photons)
    slower = replace(CAMERA, exposure_time=3e-3)
    darker = replace(CAMERA, lens=replace(CAMERA.lens, transmission=(0.5, 0.25, 1.0, 0.0)))
    stopped = replace(CAMERA, lens=replace(CAMERA.lens, f_number=5.6))
    np.testing.assert_allclose(electrons_per_radiance(slower, photons), 3.0 * once, rtol=1e-14)
    np.testing.assert_allclose(
        electrons_per_radiance(darker, photons), once * [0.5, 0.25, 1.0, 0.0], rtol=1e-14
    )
    np.testing.assert_allclose(electrons_per_radiance(stopped, photons), once / 4.0, rtol=1e-14)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"reflectance": (0.5, 0.5, 0.5, 1.01)},
            'material "foil": reflectance and metallic lie in 0..1, got 1.01',
        ),
        (
            {"reflectance": (-0.1, 0.5, 0.5, 0.5)},
            'material "foil": reflectance and metallic lie in 0..1, got -0.1',
        ),
        (
            {"reflectance": (float("nan"), 0.5, 0.5, 0.5)},
            'material "foil": reflectance and metallic lie in 0..1, got nan',
        ),
        ({"metallic": 2.0}, 'material "foil": reflectance and metallic lie in 0..1, got 2'),
        ({"roughness": 0.0}, 'material "foil": roughness lies in 0.01..1, got 0'),
        ({"roughness": 1.5}, 'material "foil": roughness lies in 0.01..1, got 1.5'),
    ],
)
def test_an_impossible_material_is_refused(changes: dict[str, object], message: str) -> None:
    values: dict[str, object] = {"name": "foil", "reflectance": (0.5,) * 4, **changes}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Material(**values)  # type: ignore[arg-type]


SUN = SunAtPosition(
    position=np.array([AU, 0.0, 0.0]),
    light_at_1_au=black_body_light(1367.0, 5777.0),
    radius=6.957e8,
)


def test_sunlight_falls_with_the_square_of_distance_and_its_radiance_does_not() -> None:
    near, far = SUN.seen_from(np.zeros(3)), SUN.seen_from(np.array([-AU, 0.0, 0.0]))
    np.testing.assert_allclose(near.irradiance, SUN.light_at_1_au.irradiance, rtol=1e-15)
    np.testing.assert_allclose(far.irradiance, near.irradiance / 4.0, rtol=1e-15)
    # Radiance is conserved: irradiance and solid angle fall together.
    np.testing.assert_allclose(far.radiance, near.radiance, rtol=1e-13)


def test_the_sun_is_half_a_degree_wide_and_its_direction_points_to_it() -> None:
    seen = SUN.seen_from(np.array([0.0, AU, 0.0]))
    np.testing.assert_allclose(
        seen.direction_icrf, [np.sqrt(0.5), -np.sqrt(0.5), 0.0], rtol=0.0, atol=1e-15
    )
    # arcsin(6.957e8 / (sqrt 2 au)) = 0.1884105 deg.
    assert np.degrees(seen.angular_radius) == pytest.approx(0.1884105, abs=1e-7)


def test_the_disc_of_the_source_study_has_a_radiance_of_2_065e7() -> None:
    # All of 1367 W/m2 from a disc of half-angle 0.263 deg: 1367 / (pi sin^2) = 2.0651683e7.
    light = black_body_light(1367.0, 5777.0)
    sun = SunInDirection(
        direction_icrf=np.array([0.0, 0.0, 2.0]), light=light, angular_radius=np.radians(0.263)
    )
    seen = sun.seen_from(np.array([1e9, 0.0, 0.0]))
    np.testing.assert_allclose(seen.radiance, light.irradiance / 1367.0 * 2.0651683e7, rtol=3e-8)
    np.testing.assert_array_equal(seen.direction_icrf, [0.0, 0.0, 1.0])


def test_the_earth_is_flatter_by_21_385_km() -> None:
    a, b, c = Earth().radii
    assert a == b == 6378137.0
    assert a - c == pytest.approx(21384.686, abs=1e-3)
    # 1 / f of WGS84.
    assert a / (a - c) == pytest.approx(298.257223563, abs=1e-6)
