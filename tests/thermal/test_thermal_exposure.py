"""What a thermal detector's pixels hold of a scene that moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from msgspec import structs

from simgl.arrays import Array
from simgl.scenario.loader import scenario_from_dict
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from simgl.view.thermal_exposure import bolometer_moments
from tests.thermal.test_thermal_image import at_one_temperature, thermal_camera
from tests.thermal.thermal_scenes import Table, surface

# Without noise, and so many DN that rounding is below what is measured.
_QUIET: Table = {"bits": 16, "gain_spread": 0.0, "offset_spread_k": 0.0, "netd_mk": 0.0}
_LONG = (8.0, 14.0)


@pytest.mark.parametrize("motion", [0.1, 0.6, 3.0, 40.0])
def test_moments_of_a_bolometer_have_the_mean_age_and_the_response_of_its_time_constant(
    motion: float,
) -> None:
    ages, shares = bolometer_moments(8e-3, motion)
    assert shares.sum() == pytest.approx(1.0, rel=1e-12)
    assert ages @ shares == pytest.approx(8e-3, rel=1e-12)
    assert np.all(ages > 0.0)
    # A pixel follows what changes at a rate w by 1 / (1 + i w tau), here where w tau is 1. A slice
    # of length h takes the mean of its own, short by (w h)^2 / 24, and what is older than five time
    # constants has one age.
    response = abs(np.exp(-1j * ages / 8e-3) @ shares)
    if len(ages) > 1:
        tolerance = (5.0 / len(ages)) ** 2 / 24.0 + np.exp(-5.0)
        assert response == pytest.approx(0.5**0.5, abs=tolerance)


def moving(
    gl: moderngl.Context, preset: str, speed_px_s: float, **quiet: Any
) -> tuple[Array, Array]:
    """DN of a warm plate that stands still, and of one that moves along the rows.

    The plate is 4 px wide and 10 m away, where 200 px are 10 m.
    """
    speed = speed_px_s / 20.0
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "none"},
            "camera": {
                "cam": thermal_camera(list(_LONG), thermal={"detector": preset}, look_at=None)
                | {"boresight": [0.0, 0.0, -1.0], "up": [0.0, 1.0, 0.0]}
            },
            "spacecraft": {
                "body": {
                    "model": {
                        "plate": {"width_m": 0.2, "height_m": 0.2, "material": surface(0.5, 0.9)}
                    },
                    "position_icrf_m": [0.0, 0.0, 0.0],
                }
            },
            "thermal": {"patches": 60},
        }
    )
    first = scenario.at(scenario.epoch_tai_ns)
    placed = first.cameras["cam"]
    detector = placed.camera.thermal
    assert detector is not None
    table = structs.replace(
        detector.table, band_um=_LONG, f_number=1.0, range_k=(2.0, 310.0), **_QUIET, **quiet
    )
    camera = replace(placed.camera, thermal=replace(detector, table=table))
    camera = replace(camera, exposure_time=8e-3)
    first = replace(first, cameras={"cam": replace(placed, camera=camera)})
    pose = first.bodies["body"].pose

    def during(tai_ns: int) -> SceneState:
        seconds = 1e-9 * (tai_ns - first.tai_ns)
        there = pose.position + np.array([speed * seconds, 0.0, 0.0])
        return scenario.with_poses(tai_ns, {"body": replace(pose, position=there)})

    with Simulator(scenario, gl) as simulator:
        warm = at_one_temperature(simulator, first, 300.0)
        taken = [
            simulator.capture(first, "cam", {Product.DN}, during=d, temperatures=warm).digital
            for d in (None, during)
        ]
    still, smeared = (one.dn.astype(np.float64) for one in taken if one is not None)
    return still, smeared


def along_rows(dn: Array) -> tuple[float, float, float]:
    """Sum, middle and variance of the light above space along the rows."""
    # Near the plate alone: shot noise far away would have the longest arm.
    light = (dn - np.median(dn))[20:40, 10:50].sum(axis=0)
    columns = np.arange(len(light))
    middle = float(light @ columns / light.sum())
    return float(light.sum()), middle, float(light @ (columns - middle) ** 2 / light.sum())


def test_a_moving_plate_trails_by_the_time_constant(gl: moderngl.Context) -> None:
    # 2 px within a time constant: the light is the same, comes from where the plate was 8 ms before
    # in the mean, and has the variance of an exponential trail, (v tau)^2, besides its own.
    still, smeared = (along_rows(dn) for dn in moving(gl, "bolometer_lwir", 250.0))
    assert smeared[0] == pytest.approx(still[0], rel=3e-3)
    assert smeared[1] - still[1] == pytest.approx(-2.0, abs=0.02)
    # Slices lose their own widths, a sixteenth of 0.5 px squared, and what is older than five.
    assert smeared[2] - still[2] == pytest.approx(4.0, rel=0.05)


def test_a_photon_detector_sees_the_middle_of_its_integration(gl: moderngl.Context) -> None:
    quiet = {"integration_time_ms": 8.0, "full_well_e": 4e9, "read_noise_e": 0.0}
    still, smeared = (along_rows(dn) for dn in moving(gl, "insb_mwir", 750.0, **quiet))
    assert smeared[0] == pytest.approx(still[0], rel=5e-3)
    assert smeared[1] - still[1] == pytest.approx(0.0, abs=0.02)
    assert smeared[2] - still[2] == pytest.approx(6.0**2 / 12.0, rel=0.05)
