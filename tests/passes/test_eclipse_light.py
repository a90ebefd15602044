"""The eclipse as a camera sees it: a plate's radiance follows the light past the limb."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.simulator import Product, Simulator
from tests.scenes import lambert, scene

R, ALTITUDE = 6.371e6, 5.0e5
PLATE = {"plate": {"width_m": 4.0, "height_m": 4.0, "material": lambert(0.5)}}


@pytest.mark.parametrize("atmosphere", ["source", "none"])
@pytest.mark.parametrize("tangent_height_km", [-40.0, 0.0, 20.0, 200.0])
def test_a_plate_facing_the_setting_sun_has_its_share_of_the_light(
    gl: moderngl.Context, atmosphere: str, tangent_height_km: float
) -> None:
    angle = np.arcsin((R + 1e3 * tangent_height_km) / (R + ALTITUDE))
    # Light along -z: the plate's position is turned so that the Sun stands at +z.
    place = (R + ALTITUDE) * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    scenario = scene(
        {"plate": {"model": PLATE, "position_icrf_m": place.tolist()}},
        {"position_icrf_m": (place + np.array([0.0, 0.0, 50.0])).tolist(), "look_at": "plate"},
        earth={"shape": "sphere", "radius_km": 6371.0, "albedo": 0.0, "atmosphere": atmosphere},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    share = state.sunlight(place)
    # By itself: the bright limb lights the plate besides.
    with Simulator(scenario, gl) as simulator:
        frame = simulator.capture(state, "cam", {Product.LAYERS}).layers
    assert frame is not None
    image = frame.layers["sun"][64, 64]
    full = 0.5 / np.pi * np.array([154.43947526, 174.7738123, 171.94738469, 313.35751052])
    np.testing.assert_allclose(image, share * full, rtol=2e-6)
    if tangent_height_km == 0.0 and atmosphere == "source":
        assert image[0] / full[0] > 5.0 * image[1] / full[1] > 50.0 * image[2] / full[2]
    if tangent_height_km == 0.0 and atmosphere == "none":
        # The limb of a bare sphere halves the disc; its curvature takes 0.03 % of it.
        np.testing.assert_allclose(share, 0.5, atol=1e-3)
    if tangent_height_km == 20.0 and atmosphere == "none":
        np.testing.assert_allclose(share, share[0])
