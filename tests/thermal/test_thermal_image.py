"""Thermal frames of bodies of known temperature, before space and the Earth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.images import Capture, ThermalFrame
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.physics.thermal_radiation import band_radiance
from simgl.rays import RayTracer
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import box
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from simgl.thermal.history import ThermalState
from simgl.thermal.sky_light import EmptySkies
from simgl.thermal.thermal_view import thermal_view
from tests.thermal.earth_reference import earth_radiance
from tests.thermal.test_closed_forms import grey, painted
from tests.thermal.thermal_scenes import Table, in_sunlight, surface, turned_inside_out

LONG, MID = [8.0, 14.0], [3.0, 5.0]
# What the table of Planck's law and float32 leave.
EXACT = 5e-5


def thermal_camera(band_um: list[float], **more: Any) -> Table:
    """A camera of 200 px of focal length, 10 m above the origin, that looks down."""
    return {
        "position_icrf_m": [0.0, 0.0, 10.0],
        "look_at": "body",
        "width_px": 60,
        "height_px": 60,
        "focal_length_px": 200.0,
        "thermal": {"detector": "bolometer_lwir", "band_um": band_um, "f_number": 1.0},
    } | more


def scene(model: Table, band_um: list[float] = LONG, sun_z: float = -1.0, **more: Any) -> Scenario:
    """A body before such a camera."""
    return in_sunlight(
        model,
        camera={"cam": thermal_camera(band_um)},
        sun={
            "irradiance_w_m2": 1367.0,
            "temperature_k": 5772.0,
            "angular_diameter_deg": 0.526,
            "direction_icrf": [0.0, 0.0, sun_z],
        },
        thermal={"patches": 60},
        **more,
    )


def sheet(emissivity: float) -> Table:
    """A plate of 2 m, 40 px wide in the image."""
    return {"plate": {"width_m": 2.0, "height_m": 2.0, "material": surface(0.6, emissivity)}}


def at_one_temperature(
    simulator: Simulator, state: SceneState, kelvin: float
) -> Mapping[str, ThermalState]:
    """All spacecraft as warm as that."""
    steady = simulator.thermal_bodies.steady(state)
    return {
        name: replace(one, temperatures=np.full_like(one.temperatures, kelvin))
        for name, one in steady.items()
    }


def frame(gl: moderngl.Context, scenario: Scenario, kelvin: float | None = None) -> ThermalFrame:
    """What the camera sees, everything at one temperature; None for that of the steady state."""
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        given = None if kelvin is None else at_one_temperature(simulator, state, kelvin)
        seen = simulator.capture(state, "cam", {Product.THERMAL}, temperatures=given).thermal
    assert seen is not None
    return seen


@pytest.mark.parametrize("band_um", [LONG, MID])
def test_a_black_plate_has_the_radiance_of_planck(
    gl: moderngl.Context, band_um: list[float]
) -> None:
    seen = frame(gl, scene(sheet(1.0), band_um), 300.0)
    band = 1e-6 * band_um[0], 1e-6 * band_um[1]
    expected = float(band_radiance(band, 300.0))
    assert seen.radiance[30, 30] == pytest.approx(expected, rel=EXACT)
    assert seen.brightness_temperature[30, 30] == pytest.approx(300.0, abs=0.01)
    assert seen.temperature[30, 30] == pytest.approx(300.0, rel=1e-6)
    # Space at 2.7 K around it.
    assert seen.radiance[1, 1] < 1e-9 * expected
    assert seen.temperature[1, 1] == 0.0


def test_the_area_of_a_plate_in_the_image(gl: moderngl.Context) -> None:
    seen = frame(gl, scene(sheet(1.0)), 300.0)
    share = float(seen.radiance.sum()) / float(seen.radiance[30, 30])
    assert share == pytest.approx(40.0**2, rel=1e-3)


def test_the_sun_is_reflected_in_the_mid_infrared(gl: moderngl.Context) -> None:
    lit, dark = (frame(gl, scene(sheet(0.5), MID, z), 280.0).radiance[30, 30] for z in (1.0, -1.0))
    sun = float(band_radiance((3e-6, 5e-6), 5772.0)) / (STEFAN_BOLTZMANN * 5772.0**4 / np.pi)
    # Head-on emissivity is 21 / 20 of the hemispherical 0.5.
    assert lit - dark == pytest.approx((1.0 - 0.525) * 1367.0 * sun / np.pi, rel=1e-3)


@pytest.mark.parametrize("emissivity", [0.9, 0.5, 0.1])
def test_a_sphere_sends_its_hemispherical_emissivity(
    gl: moderngl.Context, emissivity: float
) -> None:
    # Over the disc of a sphere each direction has the weight that it has in a hemisphere.
    ball = {"sphere": {"radius_m": 1.0, "material": surface(0.2, emissivity)}}
    seen = frame(gl, scene(ball), 300.0)
    flux = float(seen.radiance.sum()) / float(band_radiance((8e-6, 14e-6), 300.0))
    # The outline as seen from 10 m.
    area = np.pi * 200.0**2 / (10.0**2 - 1.0)
    assert flux / area == pytest.approx(emissivity, rel=0.005)


def within_a_closed_box(gl: moderngl.Context, emissivity: float) -> ThermalFrame:
    """What a camera sees in a box of 300 K."""
    model: SpacecraftModel = painted(turned_inside_out(box((1.0, 2.0, 3.0))), grey(emissivity))
    within = thermal_camera(LONG, position_icrf_m=[0.1, 0.2, 0.3], focal_length_px=20.0)
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "none"},
            "spacecraft": {"body": {"model": "wedge", "position_icrf_m": [0.0, 0.0, 0.0]}},
            "camera": {"cam": within | {"look_at": None, "boresight": [0.0, 0.0, 1.0]}},
            "thermal": {"patches": 400},
        },
        models={"body": model},
    )
    return frame(gl, scenario, 300.0)


def black_plate_brightness(gl: moderngl.Context, band_um: list[float]) -> float:
    """Brightness temperature of a black plate of 300 K [K]."""
    return float(frame(gl, scene(sheet(1.0), band_um), 300.0).brightness_temperature[30, 30])


def closed_box_brightness(gl: moderngl.Context, emissivity: float) -> float:
    """Mean brightness temperature within a closed box of 300 K [K]."""
    return float(within_a_closed_box(gl, emissivity).brightness_temperature.mean())


@pytest.mark.parametrize("emissivity", [0.9, 0.2])
def test_a_closed_box_looks_black_whatever_its_emissivity(
    gl: moderngl.Context, emissivity: float
) -> None:
    seen = within_a_closed_box(gl, emissivity)
    expected = float(band_radiance((8e-6, 14e-6), 300.0))
    # The sum of reflections ends 1e-5 before its end, times 1 / emissivity.
    np.testing.assert_allclose(seen.radiance, expected, rtol=1e-3)


def test_a_frame_is_that_of_rays(gl: moderngl.Context) -> None:
    # The same light, interpolated where a ray through each pixel's middle meets the surface.
    scenario = scene(
        {"box": {"size_m": [1.6, 1.0, 1.2], "material": surface(0.6, 0.7)}},
        spacecraft={
            "body": {
                "model": {"box": {"size_m": [1.6, 1.0, 1.2], "material": surface(0.6, 0.7)}},
                "position_icrf_m": [0.0, 0.0, 0.0],
                "quaternion_icrf_from_body_xyzw": [0.3, 0.4, 0.1, 0.8602325],
            }
        },
        sun_z=0.4,
    )
    state, seen = scenario.at(scenario.epoch_tai_ns), frame(gl, scenario)
    with Simulator(scenario, gl) as simulator:
        body = simulator.thermal_bodies.of("body", scenario.models["body"])
        thermal = simulator.thermal_bodies.steady(state)["body"]
    placed = state.cameras["cam"]
    detector = placed.camera.thermal
    assert detector is not None
    skies = {"body": EmptySkies().in_band(state, "body", detector)}
    values = thermal_view(state, detector, {"body": (body, thermal)}, skies).lights["body"].values
    column, row = np.meshgrid(np.arange(60) + 0.5, np.arange(60) + 0.5)
    lines = placed.camera.rays(np.stack([column, row], axis=-1).reshape(-1, 2))
    lines = lines @ placed.R_camera_from_icrf @ state.bodies["body"].pose.R_icrf_from_body
    lines /= np.linalg.norm(lines, axis=1, keepdims=True)
    eye = state.bodies["body"].in_body(placed.position)
    hit, distance = RayTracer(body.mesh).hits(np.tile(eye, (len(lines), 1)), lines)
    met = np.flatnonzero(hit >= 0)
    corners = body.mesh.triangles[hit[met].astype(np.int64)]
    places = body.mesh.positions[corners].astype(np.float64)
    spot = eye + distance[met, None] * lines[met] - places[:, 0]
    edges = np.moveaxis(places[:, 1:] - places[:, :1], 1, 2)
    share = np.array(
        [np.linalg.lstsq(e, s, rcond=None)[0] for e, s in zip(edges, spot, strict=True)]
    )
    weight = np.column_stack([1.0 - share.sum(axis=1), share])
    kelvin, emissivity, reflected, _ = np.einsum("kc,kcv->vk", weight, values[corners, 0])
    normals = np.cross(edges[..., 0], edges[..., 1])
    cosine = np.abs(np.einsum("ij,ij->i", normals, lines[met])) / np.linalg.norm(normals, axis=1)
    towards = np.minimum(1.05 * emissivity * (1.0 - (1.0 - cosine) ** 5), 1.0)
    expected = towards * band_radiance(detector.band, kelvin) + (1.0 - towards) * reflected
    # Away from edges, where a pixel holds two surfaces.
    full = np.zeros(3600)
    full[met] = expected
    ratio = (seen.radiance.ravel()[met] / expected).reshape(-1)
    assert np.median(np.abs(ratio - 1.0)) < 1e-4
    assert float(np.mean(np.abs(ratio - 1.0) < 0.01)) > 0.85
    assert float(seen.radiance.sum()) == pytest.approx(full.sum(), rel=0.01)


OVER_EARTH: Table = {
    "epoch": {"utc": "2026-07-20T12:00:00"},
    "earth": {"shape": "wgs84", "albedo": 0.3, "atmosphere": "standard"},
    "spacecraft": {
        "body": {
            "model": {"sphere": {"radius_m": 0.1, "material": surface(0.5, 0.5)}},
            "orbit": {"altitude_km": 800.0, "inclination_deg": 60.0, "true_anomaly_deg": 40.0},
        }
    },
    "camera": {
        "cam": {
            "on": "body",
            "position_body_m": [0.0, 0.0, 0.2],
            "boresight": [0.5, 0.2, 1.0],
            "axes": "lvlh",
            "width_px": 64,
            "height_px": 64,
            "focal_length_px": 40.0,
            "thermal": {"detector": "bolometer_lwir"},
        }
    },
    "thermal": {"patches": 60},
}


@pytest.mark.parametrize("band_um", [LONG, MID])
def test_the_earth_has_the_climate_and_the_air_of_the_equations(
    gl: moderngl.Context, band_um: list[float]
) -> None:
    # To float32 away from the limb.
    camera = OVER_EARTH["camera"]["cam"]
    thermal = {"detector": "bolometer_lwir", "band_um": band_um}
    scenario = scenario_from_dict(OVER_EARTH | {"camera": {"cam": camera | {"thermal": thermal}}})
    seen = frame(gl, scenario)
    state = scenario.at(scenario.epoch_tai_ns)
    placed = state.cameras["cam"]
    detector = placed.camera.thermal
    assert detector is not None
    column, row = np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5)
    lines = placed.camera.rays(np.stack([column, row], axis=-1).reshape(-1, 2))
    lines = lines @ placed.R_camera_from_icrf
    lines /= np.linalg.norm(lines, axis=1, keepdims=True)
    expected = earth_radiance(state, placed.position, lines, detector.band, detector.watts)
    expected = expected.reshape(64, 64)
    ground = expected > 0.5 * np.median(expected)
    inside = ground.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            inside &= np.roll(ground, step, axis)
    inside &= seen.temperature == 0.0
    assert inside.mean() > 0.5
    np.testing.assert_allclose(seen.radiance[inside], expected[inside], rtol=2e-3)


def test_clouds_are_where_the_visible_image_has_them_and_cold(gl: moderngl.Context) -> None:
    camera = OVER_EARTH["camera"]["cam"]
    visible = {k: v for k, v in camera.items() if k != "thermal"}
    scenario = scenario_from_dict(
        OVER_EARTH | {"earth": {}, "camera": {"cam": camera, "visible": visible}}
    )
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        wanted = {"cam": {Product.THERMAL}, "visible": {Product.RADIANCE}}
        warm, white = simulator.captures(state, wanted)
    assert warm.thermal is not None
    assert white.radiance is not None
    kelvin, red = warm.thermal.brightness_temperature, white.radiance.radiance[..., 0]
    inside = (warm.thermal.temperature == 0.0) & (kelvin > 200.0)
    low, high = np.percentile(red[inside], [25.0, 75.0])
    cold, warm_ground = kelvin[inside & (red > high)], kelvin[inside & (red < low)]
    # White cloud of the mean height of 4 km is 26 K colder than the ground, less what the air above
    # clear ground takes, 8 K, and what is mixed at 25 km a pixel.
    assert warm_ground.mean() - cold.mean() == pytest.approx(13.0, abs=6.0)


def both(gl: moderngl.Context, scenario: Scenario, **how: Any) -> Capture:
    """DN and thermal frame."""
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        return simulator.capture(state, "cam", {Product.DN, Product.THERMAL}, **how)


def test_a_frame_without_history_says_that_it_is_steady_and_is_a_function_of_its_state(
    gl: moderngl.Context,
) -> None:
    first, second, other = (both(gl, scene(sheet(0.8), sun_z=1.0), draw=n) for n in (0, 0, 1))
    for one in (first, second, other):
        assert one.thermal is not None
        assert one.digital is not None
        assert one.thermal.history == "steady"
        assert first.thermal is not None
        assert one.thermal.state == first.thermal.state
        np.testing.assert_array_equal(one.thermal.radiance, first.thermal.radiance)
    assert first.digital is not None
    assert second.digital is not None
    assert other.digital is not None
    np.testing.assert_array_equal(first.digital.dn, second.digital.dn)
    # Another draw has other noise: of 0.04 K, a few DN.
    assert np.any(first.digital.dn != other.digital.dn)


def test_a_thermal_camera_has_no_visible_light(gl: moderngl.Context) -> None:
    scenario = scene(sheet(0.8))
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        with pytest.raises(ConfigError, match="it has dn, normals, thermal, truth, not radiance"):
            simulator.capture(state, "cam", {Product.RADIANCE})


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"preset": "imx249"}, "preset is not allowed with thermal; write thermal.d"),
        ({"f_number": 2.0}, "f_number is not allowed with thermal; write thermal.f"),
        ({"read_noise_e": 3.0}, "read_noise_e is not allowed with thermal"),
        ({"thermal": {"detector": "bolometer"}}, "thermal.detector: no infrared detector"),
        (
            {"thermal": {"detector": "insb_mwir", "netd_mk": 40.0}},
            "thermal.netd_mk requires a bolometer detector; insb_mwir is none",
        ),
        (
            {"thermal": {"detector": "insb_mwir", "band_um": [5.0, 3.0]}},
            "thermal.band_um must rise within 1..100, got 5 and 3",
        ),
    ],
)
def test_contradictions_give_one_line(keys: Table, line: str) -> None:
    camera = {k: v for k, v in thermal_camera(LONG).items() if k not in keys} | keys
    with pytest.raises(Exception, match=r"camera\.cam") as caught:
        in_sunlight(sheet(0.8), camera={"cam": camera})
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)
