"""Shadows: where they must fall, and where they must not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.motion.trajectory import FixedAttitude, Motion, UniformMotion
from tests.passes.thin_casters import Place, solids
from tests.scenes import lambert, radiance, scene

Bar = tuple[Place, Place, float]
Image = np.ndarray[Any, np.dtype[np.float32]]

GREEN = 174.7738123  # [W m-2] of the Sun in 500-600 nm

# A camera over the origin, and how it shows direct sunlight alone.
FROM_ABOVE = {
    "position_icrf_m": [0, 0, 32.0],
    "boresight": [0, 0, -1],
    "up": [0, 1, 0],
    "focal_length_mm": 8.0,
}
FINE = {"inter_reflection": False, "samples_per_pixel": 64}


def plate(size: float, reflectance: float = 0.5) -> dict[str, Any]:
    return {"plate": {"width_m": size, "height_m": size, "material": lambert(reflectance)}}


def box(size: tuple[float, float, float]) -> dict[str, Any]:
    return {"box": {"size_m": list(size), "material": lambert(0.5)}}


def sun_at(incidence_deg: float, azimuth_deg: float = 0.0) -> tuple[float, float, float]:
    t, a = np.radians(incidence_deg), np.radians(azimuth_deg)
    return float(np.sin(t) * np.cos(a)), float(np.sin(t) * np.sin(a)), float(np.cos(t))


def seen_from_above(
    gl: moderngl.Context, bars: list[Bar], incidence: float, samples_per_pixel: int = 64
) -> tuple[Image, float]:
    """(128, 128) share of full sunlight on bars, from the side of +x; the width of a pixel [m]."""
    still = Motion(
        trajectory=UniformMotion(position=np.zeros(3), velocity=np.zeros(3), epoch_tai_ns=0),
        attitude=FixedAttitude(R_icrf_from_body=np.eye(3)),
    )
    empty = scene(
        {},
        FROM_ABOVE,
        sun_direction=sun_at(incidence),
        render={**FINE, "samples_per_pixel": samples_per_pixel},
    )
    scenario = replace(empty, models={"bars": solids("bars", bars)}, motions={"bars": still})
    full = 0.5 / np.pi * GREEN * np.cos(np.radians(incidence))
    return radiance(gl, scenario)[..., 1] / full, 32.0 / scenario.cameras["cam"].focal_length_px


@pytest.mark.parametrize("incidence", [0.0, 20.0, 45.0, 70.0, 80.0, 85.0])
@pytest.mark.parametrize("distance", [50.0, 2.0])
def test_a_plane_does_not_shadow_itself(
    gl: moderngl.Context, incidence: float, distance: float
) -> None:
    scenario = scene(
        {"plate": {"model": plate(8.0), "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0.3, 0.2, distance], "look_at": "plate", "focal_length_mm": 8.0},
        sun_direction=sun_at(incidence, 33.0),
    )
    image = radiance(gl, scenario)[..., 1]
    inner = image[40:88, 40:88]
    np.testing.assert_allclose(
        inner, 0.5 / np.pi * GREEN * np.cos(np.radians(incidence)), rtol=5e-6
    )


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_a_curved_body_has_no_spots_on_its_lit_side(gl: moderngl.Context, shape: str) -> None:
    """Each pixel whose surface is lit at up to 85 deg has the radiance of its own normal."""
    sizes = {"sphere": {"radius_m": 1.0}, "cylinder": {"radius_m": 1.0, "length_m": 2.0}}
    model = {shape: {**sizes[shape], "material": lambert(0.5)}}
    sun = np.array([0.8, 0.0, 0.6])
    scenario = scene(
        {"body": {"model": model, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, -60, 0],
            "boresight": [0, 1, 0],
            "up": [0, 0, 1],
            "focal_length_mm": 8.0,
        },
        sun_direction=(0.8, 0.0, 0.6),
    )
    image = radiance(gl, scenario)[..., 1]
    f = scenario.cameras["cam"].focal_length_px
    y, x = (np.mgrid[0:128, 0:128] + 0.5 - 64.0) / f * 60.0
    if shape == "sphere":
        inside = x**2 + y**2 < 0.9
        normal = np.stack([x, -np.sqrt(np.maximum(1 - x**2 - y**2, 0)), -y])
    else:
        inside = (np.abs(x) < 0.95) & (np.abs(y) < 0.9)
        normal = np.stack([x, -np.sqrt(np.maximum(1 - x**2, 0)), np.zeros_like(x)])
    cosine = np.einsum("i,ijk->jk", sun, normal)
    lit = inside & (cosine > np.cos(np.radians(85.0)))
    expected = 0.5 / np.pi * GREEN * cosine
    assert lit.sum() > 1000
    # Pixels are 0.9 % of the radius: the mean over one and perspective move the normal by as much.
    assert np.abs(image - expected)[lit].max() < 0.012 * expected.max()


def test_a_boxs_shadow_falls_where_geometry_puts_it(gl: moderngl.Context) -> None:
    """A cube of 1 m floats 2 m over a plate, the Sun at 45 deg: its shadow lies 2 m downwind."""
    scenario = scene(
        {
            "plate": {"model": plate(12.0), "position_icrf_m": [0, 0, 0]},
            "cube": {"model": box((1.0, 1.0, 1.0)), "position_icrf_m": [0, 0, 2.5]},
        },
        {"position_icrf_m": [0, 0, 300], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        sun_direction=sun_at(45.0),
    )
    image = radiance(gl, scenario)[..., 1]
    f = scenario.cameras["cam"].focal_length_px
    row = image[64]
    ground = (np.arange(128) + 0.5 - 64.0) / f * 300.0
    full = 0.5 / np.pi * GREEN * np.cos(np.radians(45.0))
    # Light comes from +x, so the shadow of heights 2..3 m spans x = -3.5 .. -1.5; the cube itself
    # hides |x| < 0.5.
    # Half a pixel of 9 cm, the Sun's penumbra of 3 cm, a shadow texel: 2 x 8.6 m / 2048 = 8 mm.
    dark = (ground > -3.41) & (ground < -1.59)
    clear = (ground < -3.59) | ((ground > -1.4) & (ground < -0.6)) | (ground > 0.6)
    clear &= np.abs(ground) < 5.4
    assert row[dark].max() < 1e-6 * full
    np.testing.assert_allclose(row[clear], full, rtol=1e-5)


def test_a_thin_boom_casts(gl: moderngl.Context) -> None:
    """A rod of 1 cm over a plate of 4 m removes its own width of light."""
    scenario = scene(
        {
            "plate": {"model": plate(4.0), "position_icrf_m": [0, 0, 0]},
            "rod": {"model": box((0.01, 6.0, 0.01)), "position_icrf_m": [0.0, 0, 0.5]},
        },
        {"position_icrf_m": [0, 0, 120], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        sun_direction=sun_at(45.0),
    )
    image = radiance(gl, scenario)[..., 1]
    f = scenario.cameras["cam"].focal_length_px
    full = 0.5 / np.pi * GREEN * np.cos(np.radians(45.0))
    ground = (np.arange(128) + 0.5 - 64.0) / f * 120.0
    band = np.abs(ground + 0.5) < 0.1
    missing = (1.0 - image[20:108, band] / full).sum(axis=1) / f * 120.0
    # The rod's square section seen at 45 deg throws 2 cm on the plate, half a pixel. A row alone
    # scatters by its samples, by 18 %; 88 of them by 2 %.
    np.testing.assert_allclose(missing.mean(), 0.02, rtol=0.04)
    np.testing.assert_allclose(missing[44], 0.02, atol=0.003)


@pytest.mark.parametrize("incidence", [20.0, 60.0])
@pytest.mark.parametrize("height", [0.003, 0.006])
def test_a_low_step_shades_its_lee_by_its_height_and_nothing_to_windward(
    gl: moderngl.Context, height: float, incidence: float
) -> None:
    """A slab of half a metre on a floor, in pixels of 15 mm: a shadow map's texels are about as
    large as the step is high."""
    scenario = scene(
        {
            "floor": {"model": box((1.4, 1.4, 0.2)), "position_icrf_m": [0, 0, -0.1]},
            "slab": {"model": box((0.5, 0.5, 0.1)), "position_icrf_m": [0, 0, height - 0.05]},
        },
        FROM_ABOVE,
        sun_direction=sun_at(incidence),
        render={"inter_reflection": False},
    )
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    pixel = 32.0 / scenario.cameras["cam"].focal_length_px
    x = (np.arange(128) + 0.5 - 64.0) * pixel
    middle = np.abs(x) < 0.2
    full = 0.5 / np.pi * GREEN * np.cos(np.radians(incidence))
    missing = (1.0 - image[middle] / full)[:, np.abs(x) < 0.6]
    sunny = x[np.abs(x) < 0.6] > 0.0
    assert missing[:, sunny].sum(axis=1).max() * pixel < 1e-4
    shadow = height * np.tan(np.radians(incidence))
    lee = missing[:, ~sunny].sum(axis=1).mean() * pixel
    # A tenth of a texel; there are three on a pixel's width.
    assert abs(lee - shadow) < 0.1 * pixel / 3.0


def test_shadows_in_grooves_are_as_fine_as_the_samples_that_are_asked_for(
    gl: moderngl.Context,
) -> None:
    """Grooves of 5 mm, 3 mm deep, in pixels of 15 mm, as between solar cells."""
    width, deep, pitch = 0.005, 0.003, 0.031
    floor: Bar = ((-0.7, 0.0, -0.7), (0.7, 0.0, -0.7), 1.4)
    edges = np.arange(-0.62, 0.62, pitch)
    high = pitch - width
    cells: list[Bar] = [
        ((x + 0.5 * high, -0.6, deep - 0.5 * high), (x + 0.5 * high, 0.6, deep - 0.5 * high), high)
        for x in edges
    ]
    image, pixel = seen_from_above(gl, [floor, *cells], 45.0, samples_per_pixel=256)
    x = (np.arange(128) + 0.5 - 64.0) * pixel
    middle = np.abs(x) < 0.5
    # Light comes from +x: the shadow lies below a groove's edge there.
    ends = np.array([x - 0.5 * pixel, x + 0.5 * pixel]) - edges[0]
    number = np.floor(ends / pitch)
    shaded = deep * number + np.clip(ends - pitch * number - (pitch - deep), 0.0, deep)
    share = 1.0 - (shaded[1] - shaded[0]) / pixel
    off = (image - share)[np.ix_(middle, middle)]
    # An eighth of a texel; there are six on a pixel's width. With three: 0.032.
    assert np.sqrt((off**2).mean()) < 0.125 / 6.0


@pytest.mark.parametrize("height", [0.003, 0.006])
def test_a_low_step_below_high_rods_shades_its_lee_alone(
    gl: moderngl.Context, height: float
) -> None:
    """Rods 3 m above the step make all of it a penumbra, in pixels of 15 mm, three texels."""
    slope = np.tan(np.radians(50.0))
    aside = 3.0 * slope
    floor: Bar = ((-0.7, 0.0, -0.7), (0.7, 0.0, -0.7), 1.4)
    slab: Bar = ((-0.25, 0.0, height - 0.25), (0.25, 0.0, height - 0.25), 0.5)
    # Askew, so that their own shadows are the same along the step.
    rods: list[Bar] = [
        ((aside + x - 0.42, -0.7, 3.0), (aside + x + 0.42, 0.7, 3.0), 0.003)
        for x in np.arange(-1.1, 1.15, 0.04)
    ]
    stepped, pixel = seen_from_above(gl, [floor, slab, *rods], 50.0)
    even, _ = seen_from_above(gl, [floor, *rods], 50.0)
    x = (np.arange(128) + 0.5 - 64.0) * pixel
    middle = np.abs(x) < 0.2
    missing = (even - stepped)[middle].mean(axis=0) / even[middle][:, middle].mean()
    sunny, lee = (missing[np.abs(x - edge) < 0.06].sum() * pixel for edge in (0.25, -0.25))
    # A tenth of a texel.
    assert abs(sunny) < 0.1 * pixel / 3.0
    # Rods hide the step from a fifth of the texels.
    np.testing.assert_allclose(lee, height * slope, rtol=0.2)


@pytest.mark.parametrize("incidence", [20.0, 60.0])
def test_a_rod_that_floats_over_a_floor_by_its_own_height_casts_all_of_its_shadow(
    gl: moderngl.Context, incidence: float
) -> None:
    """12 mm wide, 6 mm high and 6 mm over the floor, in pixels of 15 mm: it is no step."""
    scenario = scene(
        {
            "floor": {"model": box((1.4, 1.4, 0.2)), "position_icrf_m": [0, 0, -0.1]},
            "rod": {"model": box((0.012, 1.0, 0.006)), "position_icrf_m": [0, 0, 0.009]},
        },
        FROM_ABOVE,
        sun_direction=sun_at(incidence),
        render=FINE,
    )
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    pixel = 32.0 / scenario.cameras["cam"].focal_length_px
    x = (np.arange(128) + 0.5 - 64.0) * pixel
    full = 0.5 / np.pi * GREEN * np.cos(np.radians(incidence))
    missing = (1.0 - image[np.abs(x) < 0.3] / full)[:, np.abs(x) < 0.6].sum(axis=1).mean() * pixel
    # The rod itself hides the shadow's start: what is left is the way of its top's sunny edge.
    shadow = 0.012 * np.tan(np.radians(incidence))
    # A quarter of a texel; there are three on a pixel's width.
    assert abs(missing - shadow) < 0.25 * pixel / 3.0


def test_a_dozen_craft_in_one_tile_keep_their_own_shadows(gl: moderngl.Context) -> None:
    """Plates in a row, every second one under a blind: more maps than are kept between frames."""
    craft: dict[str, Any] = {}
    for i in range(12):
        x = 1.5 * (i - 5.5)
        craft[f"plate_{i}"] = {"model": plate(1.0), "position_icrf_m": [x, 0, 0]}
        if i % 2:
            craft[f"blind_{i}"] = {"model": plate(1.2), "position_icrf_m": [x, 0, 40.0]}
    # One long rod in front puts all of them into one tile.
    craft["rod"] = {"model": box((18.0, 0.05, 0.05)), "position_icrf_m": [0, 0.9, 0]}
    scenario = scene(
        craft,
        {
            "position_icrf_m": [0, -30.0, 0.5],
            "boresight": [0, 30, -0.5],
            "up": [0, 0, 1],
            "focal_length_mm": 4.0,
            "width_px": 800,
        },
    )
    image = radiance(gl, scenario)[..., 1]
    f = scenario.cameras["cam"].focal_length_px
    for i in range(12):
        column = int(400 + 1.5 * (i - 5.5) * f / 30.0)
        # The plate's rows; the rod lies behind them.
        assert (image[64:72, column].max() > 1.0) == (i % 2 == 0), i


@pytest.mark.parametrize("incidence", [80.0, 87.0, 89.0, 89.5, 89.8])
def test_what_shades_a_plate_that_stands_along_the_light_is_not_taken_for_the_plate(
    gl: moderngl.Context, incidence: float
) -> None:
    """Within a texel of the map such a plate rises past a box that is 0.7 m away."""
    scenario = scene(
        {
            "plate": {"model": plate(2.0), "position_icrf_m": [0, 0, 0]},
            "box": {"model": box((1.0, 9.0, 9.0)), "position_icrf_m": [2.2, 0, 0]},
        },
        {
            "position_icrf_m": [0.0, 0.0, 30.0],
            "look_at": "plate",
            "focal_length_mm": 8.0,
        },
        sun_direction=sun_at(incidence, 13.0),
    )
    image = radiance(gl, scenario)[..., 1]
    f = scenario.cameras["cam"].focal_length_px
    y, x = np.abs((np.mgrid[0:128, 0:128] + 0.5 - 64.0) / f * 30.0)
    inner = (x < 0.9) & (y < 0.9)
    assert inner.sum() > 50
    assert image[inner].max() == 0.0


@pytest.mark.parametrize("distance", [2.0, 10.0, 40.0])
def test_one_craft_shadows_another_behind_it(gl: moderngl.Context, distance: float) -> None:
    scenario = scene(
        {
            "screen": {"model": plate(2.0), "position_icrf_m": [0, 0, 0]},
            "blind": {"model": plate(1.0), "position_icrf_m": [0.0, 0.0, distance]},
        },
        {
            "position_icrf_m": [30.0, 0, 100],
            "boresight": [-30, 0, -100],
            "up": [0, 1, 0],
        },
    )
    image = radiance(gl, scenario)[..., 1]
    full = 0.5 / np.pi * GREEN
    assert image[64, 64] == 0.0
    # The screen is 69 px high, the shadow half of that: a column off the middle, and one outside.
    np.testing.assert_allclose(image[64 - 27, 64], full, rtol=1e-5)
    np.testing.assert_allclose(image[64, 64 + 26], full, rtol=1e-5)
