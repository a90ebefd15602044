"""Thermal images of bodies of known temperature, before space and the Earth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.thermal_radiation import band_radiance, band_temperature
from simgl.scenario.scenario import Scenario
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.history import ThermalState, steady_state
from simgl.thermal.infrared_detector import load_infrared_detector
from simgl.thermal.infrared_image import InfraredImage, infrared_image
from tests.thermal.thermal_scenes import in_sunlight, surface

LONG, MID = (8e-6, 14e-6), (3e-6, 5e-6)


def scene(emissivity: float, sun_z: float = -1.0) -> Scenario:
    """A plate of 2 m that fills the middle of a camera 10 m in front of it."""
    model = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": surface(0.2, emissivity)}}
    camera = {
        "position_icrf_m": [0.0, 0.0, 10.0],
        "look_at": "body",
        "width_px": 60,
        "height_px": 60,
        "focal_length_mm": 1.2,
        "pixel_pitch_um": 6.0,
        "exposure_time_s": 0.001,
    }
    return in_sunlight(
        model,
        camera={"cam": camera},
        sun={
            "irradiance_w_m2": 1367.0,
            "temperature_k": 5772.0,
            "angular_diameter_deg": 0.526,
            "direction_icrf": [0.0, 0.0, sun_z],
        },
    )


def image(
    scenario: Scenario, body: ThermalBody, kelvin: float, band: tuple[float, float]
) -> InfraredImage:
    """The camera's image with the plate at one temperature."""
    state = scenario.at(scenario.epoch_tai_ns)
    first = steady_state(body, state)
    thermal = replace(first, temperatures=np.full_like(first.temperatures, kelvin))
    return infrared_image(
        state, "cam", {"body": (body, thermal)}, band, lambda t: band_radiance(band, t)
    )


@pytest.mark.parametrize("band", [LONG, MID])
def test_a_black_plate_has_the_radiance_of_planck(band: tuple[float, float]) -> None:
    scenario = scene(1.0)
    body = thermal_body("body", scenario.models["body"], 60)
    seen = image(scenario, body, 300.0, band)
    # Head-on; 1.05 times 1 is clipped to 1. The goal is 1 % of band radiance.
    middle = float(seen.radiance[30, 30])
    assert middle == pytest.approx(float(band_radiance(band, 300.0)), rel=1e-6)
    assert seen.temperature[30, 30] == 300.0
    # Space at 2.7 K around it.
    assert float(band_temperature(LONG, seen.radiance[1, 1])) < 5.0 or band == MID
    assert np.isnan(seen.temperature[1, 1])


def test_the_area_of_a_plate_in_the_image() -> None:
    scenario = scene(1.0)
    body = thermal_body("body", scenario.models["body"], 60)
    seen = image(scenario, body, 300.0, LONG)
    # 2 m at 10 m and 200 px of focal length: 40 px.
    share = seen.radiance.sum() / seen.radiance[30, 30]
    assert share == pytest.approx(40.0**2, rel=1e-3)


def test_the_sun_is_reflected_in_the_mid_infrared() -> None:
    lit, dark = scene(0.5, 1.0), scene(0.5, -1.0)
    body = thermal_body("body", lit.models["body"], 60)
    by_sun = float((image(lit, body, 280.0, MID).radiance - image(dark, body, 280.0, MID).radiance)
                   [30, 30])  # fmt: skip
    total = 1367.0 * float(band_radiance(MID, 5772.0)) / (5.670374419e-8 * 5772.0**4 / np.pi)
    # Head-on emissivity is 21 / 20 of the hemispherical 0.5.
    expected = (1.0 - 0.525) * total / np.pi
    assert by_sun == pytest.approx(expected, rel=1e-3)


def test_a_frame_names_its_thermal_state_and_says_that_it_has_no_history() -> None:
    scenario = scene(0.8)
    body = thermal_body("body", scenario.models["body"], 60)
    state = scenario.at(scenario.epoch_tai_ns)
    thermal: ThermalState = steady_state(body, state)
    detector = load_infrared_detector("bolometer_lwir")
    first, second = (
        infrared_image(state, "cam", {"body": (body, thermal)}, detector.band, detector.emission)
        for _ in range(2)
    )
    assert first.digest == thermal.digest
    assert first.history == "steady"
    np.testing.assert_array_equal(first.radiance, second.radiance)
    dn = [detector.digitised(f.radiance, 3, state.tai_ns) for f in (first, second)]
    np.testing.assert_array_equal(dn[0], dn[1])
