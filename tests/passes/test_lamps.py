"""Lamps in the picture: their light and their shadows where geometry puts them."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.bench.scenes import bench_scenes
from simgl.scenario.loader import load_scenario
from simgl.scene.lamps import beam_solid_angle
from simgl.simulator import Product, Simulator
from simgl.view.lamp_views import MAP_SIZE, lamp_views
from tests.passes.lamp_scenes import (
    BLINDS,
    DOWN,
    POWER,
    box,
    dark_scene,
    ground,
    plate,
    soft_shadow,
)
from tests.reference.lamps import lamp_irradiance
from tests.scenes import lambert, radiance, scene

Array = np.ndarray[Any, np.dtype[np.float64]]
Table = dict[str, Any]


@pytest.mark.parametrize("height", [3.0, 10.0, 30.0])
def test_a_plate_under_the_lamp_has_the_radiance_of_the_formula(
    gl: moderngl.Context, height: float
) -> None:
    """Inverse square, cosine, cone and its edge at once: each pixel against the numpy function."""
    scenario = dark_scene(
        {"plate": {"model": plate(30.0), "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 400.0], **DOWN, "focal_length_mm": 12.0},
        {"edge_deg": 8.0},
        lamp_at=(0.0, 0.0, height),
    )
    row = radiance(gl, scenario)[64].astype(np.float64)
    x = ground(scenario, 400.0)
    spot = scenario.at(scenario.epoch_tai_ns).lamps[0]
    y = 0.5 * (x[1] - x[0]) * np.ones_like(x)
    points = np.stack([x, y, np.zeros_like(x)], axis=1)
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    expected = 0.5 / np.pi * lamp_irradiance(spot, points, up)
    # The carrier hides the middle.
    seen = (np.abs(x) > 0.3) & (np.abs(x) < 14.5)
    assert expected[seen, 1].min() == 0.0 or height == 30.0
    # A pixel is 12.5 cm: the mean of its samples differs from its middle by a tenth of the change
    # from pixel to pixel, and by the curve's bend over it.
    change = np.abs(np.gradient(expected, axis=0))
    bend = np.abs(np.gradient(np.gradient(expected, axis=0), axis=0))
    tolerance = 1e-3 * expected + 0.1 * change + 0.5 * bend + 1e-7 * expected.max()
    assert np.all(np.abs(row - expected)[seen] <= tolerance[seen])


@pytest.mark.parametrize(("radii", "limit"), [(1.5, 0.025), (2.0, 0.01), (3.0, 2e-3), (10.0, 1e-3)])
@pytest.mark.parametrize("lean_deg", [0.0, 40.0])
def test_a_lamp_lights_as_its_aperture_does(
    gl: moderngl.Context, radii: float, limit: float, lean_deg: float
) -> None:
    """A plate so many radii along the beam's axis: a point would give 32, 18, 8 and 0.7 % more."""
    lean = np.radians(lean_deg)
    beam = np.array([np.sin(lean), 0.0, -np.cos(lean)])
    lamp_at = -radii * 0.1 * beam
    # From the side, below the lamp's carrier.
    camera = np.array([0.0, -9.0, 4.0])
    scenario = dark_scene(
        {"plate": {"model": plate(20.0), "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": camera.tolist(),
            "boresight": (-camera / np.linalg.norm(camera)).tolist(),
            "up": [0, 0, 1],
            "focal_length_mm": 600.0,
            "width_px": 64,
            "height_px": 8,
        },
        {"half_angle_deg": 60.0, "radius_m": 0.1, "boresight": beam.tolist()},
        lamp_at=(float(lamp_at[0]), 0.0, float(lamp_at[2])),
    )
    state = scenario.at(scenario.epoch_tai_ns)
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    # Pixels of 62 um by 150 um: all see the same.
    point, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    expected = 0.5 / np.pi * lamp_irradiance(state.lamps[0], point, up)[0, 1]
    np.testing.assert_allclose(image[3:5, 30:34].mean(), expected, rtol=limit)


def test_the_watts_of_the_lamp_arrive_on_the_plate(gl: moderngl.Context) -> None:
    scenario = dark_scene(
        {"plate": {"model": plate(12.0), "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 800.0], **DOWN, "focal_length_mm": 24.0},
        {"half_angle_deg": 15.0},
    )
    image = radiance(gl, scenario).astype(np.float64)
    pixel = (ground(scenario, 800.0)[1] - ground(scenario, 800.0)[0]) ** 2
    arrived = np.pi / 0.5 * image.sum(axis=(0, 1)) * pixel
    # The carrier of 0.2 m hides as much of the plate at the middle.
    hidden = 0.04 * np.array(POWER) / (beam_solid_angle(*np.radians([15.0, 2.0])) * 100.0)
    np.testing.assert_allclose(arrived, np.array(POWER) - hidden, rtol=2e-3)


@pytest.mark.parametrize("incidence", [0.0, 20.0, 45.0, 70.0, 80.0, 85.0])
@pytest.mark.parametrize("distance", [2.0, 20.0])
def test_a_plane_does_not_shadow_itself(
    gl: moderngl.Context, incidence: float, distance: float
) -> None:
    t = np.radians(incidence)
    place = (distance * np.sin(t) * 0.8, distance * np.sin(t) * 0.6, distance * np.cos(t))
    scenario = dark_scene(
        {"plate": {"model": plate(3.0), "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [-8.0, 3.0, 18.0], "look_at": "plate", "focal_length_mm": 5.0},
        {"look_at": "plate", "half_angle_deg": 60.0},
        lamp_at=place,
    )
    inner = radiance(gl, scenario)[34:94, 34:94, 1].astype(np.float64)
    state = scenario.at(scenario.epoch_tai_ns)
    f = scenario.cameras["cam"].focal_length_px
    camera = state.cameras["cam"]
    rows, columns = np.mgrid[34:94, 34:94] + 0.5 - 64.0
    rays = np.stack([columns / f, rows / f, np.ones_like(rows)], axis=-1).reshape(-1, 3)
    rays = rays @ camera.R_camera_from_icrf
    points = camera.position - rays * (camera.position[2] / rays[:, 2:])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    light = 0.5 / np.pi * lamp_irradiance(state.lamps[0], points, up)[:, 1]
    expected = light.reshape(inner.shape)
    # Five samples spread over a pixel have their mean within a tenth of a pixel of its middle; a
    # texel in shadow would take a tenth of the light and more.
    change = np.sum(np.abs(np.gradient(expected)), axis=0)
    assert np.all(np.abs(inner - expected) < 1e-3 * expected + 0.1 * change)


@pytest.mark.parametrize("height", [1.0, 4.0, 8.0])
def test_a_plates_shadow_falls_where_geometry_puts_it(gl: moderngl.Context, height: float) -> None:
    """A square of 0.5 m between lamp and ground, its shadow larger by the ratio of distances."""
    scenario = dark_scene(
        {
            "plate": {"model": plate(12.0), "position_icrf_m": [0, 0, 0]},
            "blind": {"model": box((0.5, 0.5, 0.001)), "position_icrf_m": [0.6, 0.3, height]},
        },
        {"position_icrf_m": [0, 0, 300.0], **DOWN, "focal_length_mm": 16.0, "width_px": 512},
        {"half_angle_deg": 40.0},
        render={"samples_per_pixel": 64},
    )
    image = radiance(gl, scenario)
    x = ground(scenario, 300.0)
    pixel = x[1] - x[0]
    scale = 10.0 / (10.0 - height)
    high = 0.85 * scale
    # From beside the blind, which hides the ground up to 0.85 m, across the shadow's far edge.
    window = (x > max(0.9, 0.5 * high)) & (x < high + 1.0)
    x = x[window]
    f = scenario.cameras["cam"].focal_length_px
    row = image[int(64 - 0.3 * scale / 300.0 * f), window, 1].astype(np.float64)
    spot = scenario.at(scenario.epoch_tai_ns).lamps[0]
    points = np.stack([x, np.full_like(x, 0.3 * scale), np.zeros_like(x)], axis=1)
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    lit = row / (0.5 / np.pi * lamp_irradiance(spot, points, up)[:, 1])
    edge = x[-1] + 0.5 * pixel - lit.sum() * pixel
    # Half a texel of the map, 18 m / 1024 seen from 10 m, is 0.9 cm; pixels are 7 cm.
    assert abs(edge - high) < 0.15 * pixel


def test_the_lamp_is_the_only_light_behind_the_earth(gl: moderngl.Context) -> None:
    craft = {
        "plate": {"model": plate(2.0), "position_icrf_m": [0, 0, -7e6]},
        "carrier": {"model": box((0.2, 0.2, 0.2)), "position_icrf_m": [0, 0, -7e6 + 10.1]},
    }
    camera = {"position_icrf_m": [4.0, 0, -7e6 + 10], "look_at": "plate", "focal_length_mm": 20.0}
    spot = {
        "on": "carrier",
        "position_body_m": [0, 0, -0.1],
        "look_at": "plate",
        "half_angle_deg": 20.0,
        "power_w": POWER,
    }
    earth = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3}
    unlit = radiance(gl, scene(craft, camera, earth=earth))
    lit = radiance(gl, scene(craft, camera, earth=earth, lamp={"spot": spot}))
    assert unlit[40:88, 40:88].max() == 0.0
    expected = 0.5 / np.pi * np.array(POWER) / beam_solid_angle(*np.radians([20.0, 2.0])) / 100.0
    np.testing.assert_allclose(lit[64, 64], expected, rtol=1e-3)


def test_a_lamps_shadow_is_dark_on_plain_and_on_coated_plates(gl: moderngl.Context) -> None:
    """Points of layered materials, and of several spacecraft, are drawn apart from the others."""
    coated = {"reflectance": 0.5, "coat": {"strength": 1.0, "roughness": 0.3}}
    half = {"width_m": 3.0, "height_m": 6.0}
    scenario = dark_scene(
        {
            "plain": {
                "model": {"plate": {**half, "material": lambert(0.5)}},
                "position_icrf_m": [-1.5, 0, 0],
            },
            "coated": {
                "model": {"plate": {**half, "material": coated}},
                "position_icrf_m": [1.5, 0, 0],
            },
            "blind": {"model": box((1.0, 1.0, 0.001)), "position_icrf_m": [0, 0, 5.0]},
        },
        # From beside the lamp's way.
        {"position_icrf_m": [0, 80.0, 40.0], "boresight": [0, -2, -1], "focal_length_mm": 8.0},
        {"half_angle_deg": 30.0},
    )
    image = radiance(gl, scenario)[..., 1]
    middle, side = image[64, 46:82], np.concatenate([image[64, 14:18], image[64, 110:114]])
    # A blind of 1 m half way to the lamp shades 2 m, which are 48 pixels of 4 cm: a quarter of a
    # metre within, no light; a metre outside, all of it.
    assert middle.max() == 0.0
    assert side.min() > 0.0


@pytest.mark.parametrize("coat", [0.0, 1.0])
def test_without_sunlight_light_is_the_limit_of_faint_sunlight(
    gl: moderngl.Context, coat: float
) -> None:
    """A shader that knows of no Sun draws what one draws for a Sun of 1e-20 W/m2."""
    material = {"reflectance": 0.5, "roughness": 0.4, "coat": {"strength": coat, "roughness": 0.3}}
    tile = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": material}}
    images = []
    for irradiance in 0.0, 1e-20:
        scenario = dark_scene(
            {"plate": {"model": tile, "position_icrf_m": [0, 0, 0]}},
            {"position_icrf_m": [3.0, 0, 9.0], "look_at": "plate", "focal_length_mm": 20.0},
            {},
            sun={"irradiance_w_m2": irradiance},
        )
        images.append(radiance(gl, scenario))
    assert images[0][64, 64].min() > 0.0
    # Another order of the same sum: float32 through some twenty products.
    np.testing.assert_allclose(images[0], images[1], rtol=3e-6, atol=1e-15)


def test_a_housing_around_the_lamp_does_not_dim_it(gl: moderngl.Context) -> None:
    """The lamp sits on the face of its box, and 5 mm behind it."""
    for depth in (-0.1, -0.095):
        scenario = dark_scene(
            {"plate": {"model": plate(4.0), "position_icrf_m": [0, 0, 0]}},
            {"position_icrf_m": [3.0, 0, 40.0], "look_at": "plate"},
            {"position_body_m": [0, 0, depth]},
        )
        expected = 0.5 / np.pi * 2.0 / beam_solid_angle(*np.radians([20.0, 2.0])) / 100.0
        got = radiance(gl, scenario)[64, 64, 1]
        np.testing.assert_allclose(got, expected, rtol=3e-3)


def test_four_lamps_add_up_and_keep_their_own_shadows(gl: moderngl.Context) -> None:
    craft = {
        "plate": {"model": plate(6.0), "position_icrf_m": [0, 0, 0]},
        "blind": {"model": plate(0.4), "position_icrf_m": [0, 0, 5.0]},
        "carrier": {"model": box((4.0, 4.0, 0.1)), "position_icrf_m": [0, 0, 10.05]},
    }
    camera = {"position_icrf_m": [9.0, 0, 6.0], "look_at": "plate", "focal_length_mm": 1.0}
    lamps = {
        f"l{i}": {
            "on": "carrier",
            "position_body_m": [x, y, -0.05],
            "look_at": "plate",
            "half_angle_deg": 25.0,
            "power_w": (np.eye(4)[i] * 3.0).tolist(),
        }
        for i, (x, y) in enumerate([(1.5, 0.0), (-1.5, 0.0), (0.0, 1.5), (0.0, -1.5)])
    }
    together = radiance(gl, scene(craft, camera, sun={"irradiance_w_m2": 0.0}, lamp=lamps))
    shadows = []
    for i, (name, lamp) in enumerate(lamps.items()):
        alone = radiance(gl, scene(craft, camera, sun={"irradiance_w_m2": 0.0}, lamp={name: lamp}))
        np.testing.assert_array_equal(together[..., i], alone[..., i])
        shadows.append(alone[..., i] > 0.0)
    assert all(np.any(a != b) for a in shadows for b in shadows if a is not b)


def test_a_map_is_cut_to_what_the_beam_meets_and_kept_while_nothing_moves(
    gl: moderngl.Context,
) -> None:
    scenario = dark_scene(
        {"plate": {"model": plate(2.0), "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [3.0, 0, 40.0], "look_at": "plate"},
        {"half_angle_deg": 60.0},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    (view,) = lamp_views(state, state.cameras["cam"])
    # 2 m at 10 m distance fill the map.
    np.testing.assert_allclose(np.linalg.norm(view.column[:3]), MAP_SIZE / 0.2, rtol=0.02)
    later = scenario.at(scenario.epoch_tai_ns + 10**9)
    (same,) = lamp_views(later, later.cameras["cam"])
    assert same.key == view.key
    with Simulator(scenario, gl) as simulator:
        first, second = (
            simulator.capture(state, "cam", {Product.RADIANCE}).radiance for _ in range(2)
        )
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.radiance, second.radiance)


def test_a_map_holds_what_stands_before_the_aperture_beside_the_beam() -> None:
    """The line from a lit place to the edge of the aperture meets the blind 50 deg off the axis."""
    scenario = dark_scene(
        {
            "plate": {"model": plate(12.0), "position_icrf_m": [0, 0, 0]},
            "blind": {"model": box((0.3, 0.3, 0.3)), "position_icrf_m": [0.62, 0, 9.5]},
        },
        {"position_icrf_m": [0, 0, 40.0], **DOWN},
        {"half_angle_deg": 40.0, "radius_m": 0.3},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"]
    (view,) = lamp_views(state, camera)
    v = camera.R_camera_from_icrf @ [0.475, 0.0, -0.4]
    texel = [v @ along[:3] / (v @ view.axis) + along[3] for along in (view.column, view.row)]
    assert 0.0 < min(texel) <= max(texel) < MAP_SIZE


def test_a_lamp_that_meets_nothing_lights_nothing(gl: moderngl.Context) -> None:
    scenario = dark_scene(
        {"plate": {"model": plate(2.0), "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [3.0, 0, 40.0], "look_at": "plate"},
        {"boresight": [0, 0, 1], "position_body_m": [0, 0, 0.1]},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    assert lamp_views(state, state.cameras["cam"]) == ()
    assert radiance(gl, scenario).max() == 0.0


def test_a_lamp_keeps_its_map_while_it_stands_still_to_what_it_lights() -> None:
    """In orbit: rounding of places of 7,000 km, and the axes' turn, change no byte."""
    scenario = load_scenario(bench_scenes()["docking_20m"].path)
    keys = set()
    for seconds in (0, 1, 60):
        state = scenario.at(scenario.epoch_tai_ns + seconds * 10**9)
        (lamp,) = lamp_views(state, state.cameras["navcam"])
        keys.add(lamp.key)
    assert len(keys) == 1


@pytest.mark.parametrize(("size", "at", "radius"), BLINDS)
def test_a_shadow_is_as_soft_as_the_aperture_is_wide(
    gl: moderngl.Context,
    size: tuple[float, float, float],
    at: tuple[float, float, float],
    radius: float,
) -> None:
    """Sheets, boxes and a boom between lamp and ground, across the whole penumbra against rays."""
    lit, expected = soft_shadow(gl, size, at, radius)
    error = lit - expected
    # Within a pixel of 3.7 cm the share changes along a sharp edge.
    change = np.abs(np.gradient(expected))
    assert expected.min() < 0.9
    assert np.all(np.abs(error) < 0.02 + 0.5 * change)
    assert np.sqrt(np.mean(error**2)) < 0.01
