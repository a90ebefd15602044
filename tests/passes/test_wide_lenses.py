"""Lenses that see beyond 90 deg off the boresight: light, places and truth have no seams."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.camera.distortion import relative_illumination, sight_lines
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.simulator import Product, Simulator
from tests.passes.skies import lone_stars, sky_scene, taken
from tests.scenes import IN_BANDS, TOTAL, capture, lambert, scene

Array = np.ndarray[Any, np.dtype[Any]]

F = 40.0
# To 109 deg off the boresight along rows, to 154 in the corners.
FISHEYE: dict[str, Any] = {
    "width_px": 152,
    "height_px": 152,
    "focal_length_px": F,
    "optics": {"distortion": {"model": "fisheye", "k1": 0.001}},
}
AHEAD = {"position_icrf_m": [0, 0, 0], "boresight": [0, 0, 1], "up": [0, -1, 0]}
# On the edges of the cube's faces, on the corner of three, and behind the camera.
PLACES = {
    "ahead": (0.0, 0.0, 1.0),
    "edge": (1.0, 0.1, 1.0),
    "corner": (1.0, 1.0, 1.0),
    "beside": (-1.0, 0.05, 0.02),
    "edge of two that look aside": (0.7, -0.7, -0.1),
    "behind": (-0.6, 0.65, -0.5),
}
RADIUS, DISTANCE = 4.0, 10.0


def unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


@pytest.mark.parametrize("name", PLACES)
def test_a_sphere_across_the_faces_has_lamberts_light_range_and_normals(
    gl: moderngl.Context, name: str
) -> None:
    """24 deg wide, lit from beside the camera, pixel by pixel against closed forms."""
    centre = DISTANCE * unit(np.array(PLACES[name]))
    to_sun = -unit(np.array(PLACES[name]) + np.array([0.2, 0.1, -0.1]))
    ball = {"sphere": {"radius_m": RADIUS, "material": lambert(0.5)}}
    scenario = scene(
        {"ball": {"model": ball, "position_icrf_m": centre.tolist()}},
        {**FISHEYE, **AHEAD},
        sun_direction=tuple(to_sun.tolist()),
        render={"inter_reflection": False},
    )
    with Simulator(scenario, gl) as simulator:
        products = {Product.RADIANCE, Product.TRUTH, Product.NORMALS}
        made = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", products)
    assert made.radiance is not None
    assert made.truth is not None
    assert made.normals is not None
    row, column = np.mgrid[:152, :152] + 0.5
    rays = unit(scenario.cameras["cam"].rays(np.stack([column, row], axis=-1)))
    along = rays @ centre
    under_root: Array = along**2 - DISTANCE**2 + RADIUS**2
    # A pixel and a half within the limb, where a pixel's mean is close to what its middle sees.
    closest = np.sqrt(np.maximum(DISTANCE**2 - along**2, 0.0)) / DISTANCE
    inside = (along > 0.0) & (closest < np.sin(np.arcsin(RADIUS / DISTANCE) - 2.5 / F))
    assert inside.sum() > 300
    distance = along - np.sqrt(np.maximum(under_root, 0.0))
    normals = (rays * distance[..., None] - centre) / RADIUS
    light = made.radiance.radiance
    expected = TOTAL * 0.5 / np.pi * np.maximum(normals @ to_sun, 0.0)
    bands = light.sum(axis=-1) / light[inside].sum(axis=-1).max() * expected[inside].max()
    # A mean over a pixel (1.4 deg) beside its middle: its second moment, 1/24 of a pixel squared,
    # times the curvature of the cosine, up to (DISTANCE / RADIUS)^2 / cos^3 of the slant of 35 deg;
    # with five samples their middle lies 0.1 px off, on a slope of as many per cent.
    error = np.abs(bands - expected)[inside] / expected[inside].max()
    assert error.max() < 0.03
    assert error.mean() < 0.003
    # Of fine pixels half as large the nearest: 0.35 px of its middle at most. That pixel's depth
    # along its face's axis, up to 55 deg aside, is taken for the middle's.
    step = 0.36 / F * DISTANCE
    slant = np.maximum(-np.sum(rays * normals, axis=-1), 0.2)
    off = np.abs(made.truth.range - distance)[inside]
    assert np.all(off < step * (np.sqrt(1.0 - slant**2)[inside] / slant[inside] + np.sqrt(2.0)))
    turned = np.linalg.norm(made.normals.normals - normals, axis=-1)[inside]
    assert np.all(turned < 1.2 * step / slant[inside] / RADIUS)
    np.testing.assert_allclose(
        made.truth.depth, made.truth.range * sight_lines(scenario.cameras["cam"])[..., 2], rtol=1e-5
    )
    # Whole: all that it covers by its outline.
    covered = made.truth.part_id > 0
    true = (along > 0.0) & (under_root > 0.0)
    assert abs(int(covered.sum()) - int(true.sum())) < 0.02 * true.sum()


def test_stars_keep_their_light_and_place_across_the_faces(gl: moderngl.Context) -> None:
    scenario = sky_scene({**FISHEYE, "boresight": [0, 1, 0]})
    state = scenario.at(scenario.epoch_tai_ns)
    placed = state.cameras["cam"]
    lens = placed.camera
    assert len(pinhole_fields(lens)) > 4
    solid_angle = pinhole_fields(lens)[0].solid_angle / F**2
    y, x = np.mgrid[:152, :152] + 0.5
    places = unit(np.array(list(PLACES.values())))
    turns = np.random.default_rng(5).normal(0.0, 0.02, (6, *places.shape))
    with Simulator(scenario, gl) as simulator:
        for turn in turns:
            rays = unit(places + turn)
            stars = lone_stars(state, list(rays @ placed.R_camera_from_icrf), 1.0)
            light = taken(simulator, stars)[..., 0] * solid_angle
            for column, row in lens.project(rays):
                near = np.where(np.hypot(x - column, y - row) < 6.0, light, 0.0)
                # Solid angles change by 2 % from one fine pixel to the next at the cube's corners.
                assert near.sum() == pytest.approx(1.0, abs=5e-3), (column, row)
                middle = np.array([(near * x).sum(), (near * y).sum()]) / near.sum()
                # Pixels in a cube's corner are three times as long as wide.
                assert np.hypot(*(middle - (column, row))) < 0.02


@pytest.mark.parametrize("name", PLACES)
def test_the_sun_has_its_irradiance_across_the_faces(gl: moderngl.Context, name: str) -> None:
    direction = unit(np.array(PLACES[name]) + np.array([0.01, 0.02, 0.0]))
    scenario = scene({}, {**FISHEYE, **AHEAD}, sun_direction=tuple(direction.tolist()))
    image = capture(gl, scenario).radiance
    assert image is not None
    light = image.radiance.sum(axis=-1).astype(np.float64)
    lens = scenario.cameras["cam"]
    solid_angle = pinhole_fields(lens)[0].solid_angle / F**2
    column, row = lens.project(direction)
    y, x = np.mgrid[:152, :152] + 0.5
    near = np.hypot(x - column, y - row) < 4.0
    assert light[~near].max() == 0.0
    weights = (light * solid_angle)[near]
    middle = np.array([(weights * x[near]).sum(), (weights * y[near]).sum()]) / weights.sum()
    # Its disc is 0.37 px wide, 0.09 px rms: pixels place it to 0.27 px each way.
    assert np.hypot(*(middle - (column, row))) < 0.27 * np.sqrt(2.0)
    # Its coverage of fine pixels is sampled at some thousand places.
    assert weights.sum() == pytest.approx(IN_BANDS, rel=2e-3)


def test_a_circular_image_is_black_beside_its_circle(gl: moderngl.Context) -> None:
    """Where the lens images nothing there is neither light, electrons nor truth."""
    optics = {"distortion": {"model": "double_sphere", "xi": -0.27, "alpha": 0.57}}
    ball = {"sphere": {"radius_m": 30.0, "material": lambert(0.5)}}
    scenario = scene(
        {"ball": {"model": ball, "position_icrf_m": [0.0, 0.0, 0.0]}},
        {**FISHEYE, **AHEAD, "position_icrf_m": [0.0, 0.0, -30.05], "optics": optics}
        | {"focal_length_px": 9.0},
        sun_direction=(0.0, 0.0, -1.0),
        render={"inter_reflection": False},
    )
    made = capture(gl, scenario)
    assert made.radiance is not None
    assert made.truth is not None
    assert made.electrons is not None
    lens = scenario.cameras["cam"]
    blind = np.isnan(sight_lines(lens)[..., 0])
    assert 0.5 < blind.mean() < 0.95
    assert not relative_illumination(lens)[blind].any()
    for image in (made.radiance.radiance, made.electrons.electrons, made.truth.part_id):
        assert not image[blind].any()
        assert image[~blind].any()
