"""The air without seams, in its colours, and before and behind spacecraft."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.passes.background import air_tables
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import SOURCE, STANDARD
from simgl.physics.sea_surface import fresnel, wave_slope_variance
from simgl.scenario.loader import load_scenario
from simgl.scene.earth import Earth
from simgl.simulator import Product, Simulator
from tests.authorities.us_standard_1976 import density_by_integration
from tests.passes.air_scenes import RADIUS, Window, sphere, window
from tests.scenes import lambert, opened, scene

UP, NORTH, EAST = np.eye(3)
EXAMPLE = Path(__file__).parents[2] / "examples" / "limb.toml"


def direction(elevation_deg: float, azimuth_deg: float = 0.0) -> Array:
    """Unit, from north over east; UP is the zenith."""
    e, a = np.radians([elevation_deg, azimuth_deg])
    return np.sin(e) * UP + np.cos(e) * (np.cos(a) * NORTH + np.sin(a) * EAST)


def column(look: Window, height: float, sun: Array, *, pixel: float, rows: int) -> Array:
    """(rows, 4) radiance factors up across the limb, the geometric horizon in the middle."""
    place = (RADIUS + height) * UP
    dip = np.degrees(np.arccos(RADIUS / (RADIUS + height)))
    picture = look.picture(
        sphere(0.3), place, direction(-dip), sun, up=UP, size=(3, rows), pixel=pixel
    )
    return np.asarray(picture[::-1, 1], np.float64)


@pytest.mark.parametrize("sun_deg", [60.0, -3.0])
def test_nothing_jumps_where_the_camera_enters_the_air(
    gl: moderngl.Context, sun_deg: float
) -> None:
    """At its top within 100 m, along rays with the same lowest height or angle on the ground."""
    with window(gl) as look:
        for lowest in (-3e6, -1e4, 1e3, 5e3, 20e3, 60e3):
            for azimuth in (0.0, 90.0, 180.0):
                seen = []
                for height in (AIR_TOP - 100.0, AIR_TOP + 100.0):
                    dip = np.degrees(np.arccos((RADIUS + lowest) / (RADIUS + height)))
                    view, place = direction(-dip, azimuth), (RADIUS + height) * UP
                    seen.append(look.ray(sphere(0.3), place, view, direction(sun_deg)))
                # One step of 12 bits where a white surface facing the Sun is full scale. At the
                # terminator the lowest point moves by 0.01 deg of the Sun's angle besides: 1 %.
                rtol = 0.0 if sun_deg > 0.0 else 1e-2
                np.testing.assert_allclose(
                    seen[1], seen[0], rtol=rtol, atol=1.0 / 4096, err_msg=f"{lowest}"
                )


@pytest.mark.parametrize("height", [2.0, 1e4, 4e5, 3.6e7])
def test_the_horizon_is_no_line(gl: moderngl.Context, height: float) -> None:
    """Ground and limb meet in the pixel that holds both: no pixel is darker or brighter than what
    lies on its two sides."""
    with window(gl) as look:
        # 100 m of tangent height a pixel, or 1/20 deg from below it.
        distance = np.sqrt(height * (2 * RADIUS + height))
        pixel = min(100.0 / distance, 1e-3)
        c = column(look, height, direction(40.0), pixel=pixel, rows=41)
    edge = c[18:23]
    low, high = np.minimum(c[17], c[23]), np.maximum(c[17], c[23])
    slack = 0.02 * high
    assert np.all(edge > low - slack)
    assert np.all(edge < high + slack)


def test_the_sky_is_even_about_the_suns_azimuth(gl: moderngl.Context) -> None:
    """Across azimuth 0 and 180 from the Sun: equal on both sides, and no kink beyond the slope."""
    with window(gl) as look:
        for azimuth in (0.0, 180.0):
            for height, elevation in ((2.0, 20.0), (4e5, -30.0), (4e5, -19.2)):
                place, sun = (RADIUS + height) * UP, direction(15.0)
                steps = [
                    look.ray(sphere(0.3), place, direction(elevation, azimuth + a), sun)
                    for a in (-2.0, -1.0, 0.0, 1.0, 2.0)
                ]
                np.testing.assert_allclose(steps[0], steps[4], rtol=2e-4)
                np.testing.assert_allclose(steps[1], steps[3], rtol=2e-4)
                # Even and smooth: 1 deg off the axis differs by less than a sharp aureole does.
                np.testing.assert_allclose(steps[2], steps[1], rtol=2e-2)


def test_the_terminator_has_no_edge(gl: moderngl.Context) -> None:
    """From day into night, 0.5 deg of the Sun's angle a step: light falls steadily."""
    place, earth = (RADIUS + 4e5) * UP, sphere(0.3)
    with window(gl) as look:
        angles = np.arange(82.0, 100.0, 0.5)
        seen = [look.ray(earth, place, -UP, direction(90.0 - angle)) for angle in angles]
    fall = np.diff(np.log(np.array(seen)[:, :3]), axis=0)
    assert np.all(fall < 0.0)
    # Neither the ratio nor its change leaps: e in 1.5 deg at most, from step to step alike.
    assert fall.min() > -1.0
    assert np.abs(np.diff(fall, axis=0)).max() < 0.25


def chromaticity(factor: Array) -> Array:
    """x, y of CIE 1931 from red, green and blue radiance factors, as sRGB primaries under D65."""
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    value = xyz @ factor[:3]
    return value[:2] / value.sum()


def test_the_sky_is_blue_at_noon_and_red_at_sunset(gl: moderngl.Context) -> None:
    white = np.array([0.3127, 0.3290])
    earth = replace(sphere(0.2), air=STANDARD)
    place = (RADIUS + 2.0) * UP
    with window(gl) as look:
        noon = look.ray(earth, place, direction(60.0, 90.0), direction(70.0))
        sunset = look.ray(earth, place, direction(2.0), direction(0.5))
        dusk = look.ray(earth, place, direction(90.0), direction(-4.0))
    # A clear blue sky lies near (0.25, 0.26), 10,000 K and beyond on the daylight curve.
    assert np.all(chromaticity(noon) < white - 0.03)
    assert noon[2] > 1.5 * noon[1] > 1.5 * 1.3 * noon[0]
    # A setting Sun's sky is orange: x beyond 0.45.
    assert chromaticity(sunset)[0] > 0.45
    assert sunset[0] > 1.5 * sunset[1] > 1.5 * 2.0 * sunset[2]
    # The Chappuis band keeps the zenith blue after sunset, where Rayleigh alone leaves it yellow.
    assert dusk[2] > dusk[1]


def limb(look: Window, heights: Array) -> Array:
    """(k, 4) of the standard air by tangent height, from 400 km, with the Sun 60 deg high."""
    place, earth = (RADIUS + 4e5) * UP, sphere(0.3, STANDARD)
    angles = np.degrees(np.arccos((RADIUS + heights) / (RADIUS + 4e5)))
    return np.array([look.ray(earth, place, direction(-a), direction(60.0, 90.0)) for a in angles])


def test_the_limb_is_even_where_it_is_opaque(gl: moderngl.Context) -> None:
    """Green, below 8 km, where nothing is seen through it."""
    with window(gl) as look:
        green = limb(look, 1e3 * np.array([2.0, 4.0, 6.0, 8.0]))[:, 1]
    assert green.min() > 0.85 * green.max()


def test_the_limb_ends_at_the_heights_of_the_standards_density(gl: moderngl.Context) -> None:
    """Where its light has fallen to a share of that at 48 km, by a line integral of our own.

    Thin air is as bright as there is air in the ray: the Sun is high, and the light from below
    changes by 2 % with the height over the Earth.
    """
    seen, integrated = np.arange(46e3, 112e3, 1e3), np.arange(46e3, 84e3, 2e3)
    chords = []
    for lowest in RADIUS + integrated:
        along = np.linspace(0.0, np.sqrt((RADIUS + 120e3) ** 2 - lowest**2), 4001)
        height = np.hypot(lowest, along) - RADIUS
        # From 86 to 90 km the standard's density falls by e in 5.6 km.
        beyond = np.exp(-np.maximum(height - 86e3, 0.0) / 5.6e3)
        chords.append(np.trapezoid(density_by_integration(height) * beyond, along))
    with window(gl) as look:
        light = limb(look, seen)
    at_48 = np.interp(48e3, integrated, np.log(chords))
    for band in range(4):
        log_light = np.log(light[:, band] / light[2, band])
        for share in (0.5, 0.1, 0.03, 0.01):
            edge = np.interp(-np.log(share), -log_light, seen)
            expected = np.interp(-np.log(share), at_48 - np.log(chords), integrated)
            # 2 % of the light are 140 m of height.
            assert edge == pytest.approx(expected, abs=140.0), (band, share)
        # No step: from kilometre to kilometre a scale height of 5.5 to 9 km, past 100 km as below.
        falls = np.diff(log_light)
        assert np.all((falls < -1.0 / 9.5) & (falls > -1.0 / 5.0)), band
        assert np.abs(np.diff(falls)).max() < 0.03, band


def test_bending_lifts_the_limb(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Air at 5 km looks as high as n r of it: 1.1 km higher. By its transmittance."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(air_tables, "ORDERS", 0)
    straight = replace(STANDARD, refractivity=(0.0, 0.0, 0.0, 0.0))
    place = (RADIUS + 4e5) * UP
    seen = np.arange(3e3, 12e3, 250.0)
    angles = np.degrees(np.arccos((RADIUS + seen) / (RADIUS + 4e5)))
    passed = {}
    with window(gl) as look:
        for air in (STANDARD, straight):
            pictures = [
                look.picture(sphere(0.0, air), place, direction(-a), direction(-80.0), behind=1.0)[
                    1, 1, 1
                ]
                for a in angles
            ]
            passed[air] = np.log(np.array(pictures, np.float64))
    for true in (3e3, 5e3, 8e3):
        # What the straight ray at this height lets pass is seen so much higher.
        lifted = np.interp(np.interp(true, seen, passed[straight]), passed[STANDARD], seen)
        density = float(density_by_integration(np.array(true))) / 1.225
        lift = STANDARD.refractivity[1] * density * (RADIUS + true)
        assert lifted - true == pytest.approx(lift, abs=30.0)


def test_molecules_scatter_with_kings_correction(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Thin air over black ground, the Sun straight ahead and aside: (1 + d) / 2 of it."""
    # No light that was scattered before.
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(air_tables, "ORDERS", 0)
    nothing = (0.0, 0.0, 0.0, 0.0)
    thin = replace(STANDARD, rayleigh=(1e-3,) * 4, aerosol=nothing, ozone=nothing)
    place = (RADIUS + 60e3) * UP - 1.6e6 * NORTH
    with window(gl) as look:
        ahead, aside = (look.ray(sphere(0.0, thin), place, NORTH, sun) for sun in (NORTH, EAST))
    expected = 0.5 * (1.0 + STANDARD.depolarisation)
    np.testing.assert_allclose(aside / ahead, expected, rtol=2e-3)


@pytest.mark.parametrize(
    ("sun_zenith_deg", "lowest_km", "highest_km"), [(60.0, 2.0, 6.0), (90.0, 8.0, 16.0)]
)
def test_the_green_limb_peaks_low_by_day_and_higher_at_the_terminator(
    gl: moderngl.Context, sun_zenith_deg: float, lowest_km: float, highest_km: float
) -> None:
    """With the Sun aside. The truth table has 0.416 at 5 km and 0.198 at 20 km by day; with the Sun
    on the horizon 0.0842 and 0.0786, so that the peak between them is flat: 12 km, 4 either way."""
    heights = np.array([0.5, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 25.0])
    angle = np.radians(sun_zenith_deg)
    sun = np.cos(angle) * UP + np.sin(angle) * EAST
    earth = replace(sphere(0.3), air=SOURCE)
    with window(gl) as look:
        green = []
        for r in RADIUS + 1e3 * heights:
            # A ray along y whose lowest point lies on the x axis, from 400 km.
            place = r * UP - np.sqrt((RADIUS + 4e5) ** 2 - r**2) * NORTH
            green.append(look.ray(earth, place, NORTH, sun)[1])
    assert lowest_km <= heights[int(np.argmax(green))] <= highest_km


def test_space_above_the_air_is_black(gl: moderngl.Context) -> None:
    with window(gl) as look:
        place = (RADIUS + 4e5) * UP
        angle = np.degrees(np.arccos((RADIUS + AIR_TOP + 1e3) / (RADIUS + 4e5)))
        assert look.ray(sphere(0.3), place, direction(-angle), direction(60.0)).max() == 0.0
        assert look.ray(sphere(0.3), place, direction(20.0), direction(60.0)).max() == 0.0


def test_a_camera_below_the_ground_is_an_error(gl: moderngl.Context) -> None:
    with window(gl) as look, pytest.raises(ConfigError, match="below the Earth's surface"):
        look.ray(sphere(0.3), (RADIUS - 2.0) * UP, UP, UP)


def test_a_wall_is_as_bright_before_ground_limb_and_space(gl: moderngl.Context) -> None:
    """One Lambertian wall from above, across the limb, and from below: its light is the same."""
    wall = {"plate": {"width_m": 6.0, "height_m": 6.0, "material": lambert(0.5)}}
    place = 6.771e6 * UP
    scenarios = [
        scene(
            # The plate's normal is body z: it faces south, where the cameras stand.
            {
                "wall": {
                    "model": wall,
                    "position_icrf_m": place.tolist(),
                    "quaternion_icrf_from_body_xyzw": [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)],
                }
            },
            {
                "position_icrf_m": (place - 400.0 * direction(-drop_deg)).tolist(),
                "look_at": "wall",
                "up": UP.tolist(),
                "focal_length_mm": 8.0,
                "width_px": 65,
                "height_px": 65,
            },
            sun_direction=tuple(direction(30.0, 180.0)),
            earth={"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3, "atmosphere": "source"},
        )
        for drop_deg in (70.0, 19.8, -40.0)
    ]
    with opened(gl, scenarios[0]) as drawn:
        images = [drawn(scenario) for scenario in scenarios]
    seen = [image[32, 32] for image in images]
    behind = [image[32, 2, 2] for image in images]
    assert behind[0] > behind[2] == 0.0
    np.testing.assert_allclose(seen[1], seen[0], rtol=1e-4)
    np.testing.assert_allclose(seen[2], seen[0], rtol=1e-4)


def test_a_craft_over_the_limb_has_its_own_light_and_nothing_of_what_lies_behind(
    gl: moderngl.Context,
) -> None:
    """The shipped scene: wherever the craft covers a pixel, the picture is its light by itself."""
    scenario = load_scenario(EXAMPLE)
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        exposure = simulator.capture(state, "limb", {Product.RADIANCE, Product.LAYERS})
    assert exposure.radiance is not None
    assert exposure.layers is not None
    layers = exposure.layers.layers
    whole, behind = exposure.radiance.radiance, layers["background"]
    own = np.sum([layers[name] for name in layers if name != "background"], axis=0)
    covered = (behind == 0.0).all(axis=-1) & (np.abs(own).max(axis=-1) > 0.0)
    rows = np.flatnonzero(covered.any(axis=1))
    sky, ground = behind[:, :40].mean(axis=(1, 2)), rows
    assert covered.sum() > 3000
    np.testing.assert_allclose(whole[covered], own[covered], rtol=1e-4)
    # Ground, lit air and black space all stand behind it.
    assert sky[ground].max() > 5.0
    assert sky[ground].min() == 0.0


@pytest.mark.parametrize(
    ("camera_km", "ball_km", "slant"),
    [
        # From the ground at the end of the air, from space at the ground, and from inside to both.
        (0.002, 99.0, 60.0),
        (400.0, 0.2, -60.0),
        (400.0, 0.2, -20.2),
        (8.0, 0.2, -10.0),
        (8.0, 99.0, 5.0),
    ],
)
def test_a_black_ball_at_the_end_of_the_air_looks_like_what_is_behind(
    gl: moderngl.Context, camera_km: float, ball_km: float, slant: float
) -> None:
    """Over black ground, or before black space, all light that is seen there is the air's own."""
    ball = {"sphere": {"radius_m": 100.0, "material": lambert(0.0)}}
    place = (RADIUS + 1e3 * camera_km) * UP
    view = direction(slant, 50.0)
    b = float(np.dot(place, view))
    d = b * b - np.dot(place, place) + (RADIUS + 1e3 * ball_km) ** 2
    way = -b - np.sqrt(d) if camera_km > ball_km else -b + np.sqrt(d)
    # Over the camera no image shows it.
    scenarios = [
        scene(
            {"ball": {"model": ball, "position_icrf_m": position.tolist()}},
            {
                "position_icrf_m": place.tolist(),
                "boresight": view.tolist(),
                "up": UP.tolist(),
                "focal_length_mm": 8e-3 * way / 1e3,
                "width_px": 33,
                "height_px": 33,
            },
            sun_direction=tuple(direction(35.0)),
            earth={"shape": "sphere", "radius_km": 6371.0, "albedo": 0.0, "atmosphere": "source"},
            sun={"visible": False},
        )
        for position in (place + way * view, 2.0 * place)
    ]
    with opened(gl, scenarios[0]) as drawn:
        pictures = [drawn(scenario)[16, 16] for scenario in scenarios]
    # The march itself against the view's table: 0.3 %. Below the ball 200 m of air are missing.
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=3e-2 if ball_km < 1.0 else 5e-3)
    assert pictures[0].min() > 0.0


@pytest.mark.parametrize("zenith", [60.0, 89.0])
def test_the_sea_mirrors_the_sky_by_fresnels_law_on_every_wave(
    gl: moderngl.Context, zenith: float
) -> None:
    """Near infrared, where water is black, square to the Sun's azimuth, where no glint is."""
    up, east, north = np.eye(3)
    z = np.radians(zenith)
    sun = np.cos(z) * up + np.sin(z) * east
    earth = Earth(equatorial_radius=RADIUS, polar_radius=RADIUS, air=STANDARD, wind=7.0)
    place = (RADIUS + 2.0) * up
    heights = np.radians([0.1, 1.0, 3.0, 6.0, 10.0, 16.0, 25.0, 40.0, 60.0, 89.0])
    turns = np.linspace(0.0, np.pi, 9)

    def towards(height: float, turn: float) -> Array:
        level = np.cos(turn) * east + np.sin(turn) * north
        return np.sin(height) * up + np.cos(height) * level

    variance = wave_slope_variance(7.0)
    steps = np.linspace(-4.0, 4.0, 81) * np.sqrt(0.5 * variance)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    length = np.sqrt(1.0 + x * x + y * y)
    with window(gl) as seen:
        values = [[seen.ray(earth, place, towards(h, t), sun)[3] for h in heights] for t in turns]
        sky = RegularGridInterpolator((turns, heights), values)
        for angle in (0.5, 5.0, 20.0, 45.0):
            look = towards(-np.radians(angle), np.pi / 2.0)
            normal = (up + x[..., None] * east - y[..., None] * north) / length[..., None]
            incidence = np.maximum(-(normal @ look), 0.0)
            weight = np.exp(-(x * x + y * y) / variance) * incidence * length
            sent = look + 2.0 * incidence[..., None] * normal
            height = np.clip(np.arcsin(sent @ up), heights[0], heights[-1])
            turn = np.arctan2(np.abs(sent @ north), sent @ east)
            light = sky(np.stack([turn, height], axis=-1))
            expected = np.sum(weight * fresnel(incidence) * light) / np.sum(weight)
            # Two heights on one azimuth stand for all that is mirrored; the sky bends less than
            # this between them. Foam adds up to 1e-4 / 4e-3 of it.
            found = seen.ray(earth, place, look, sun)[3]
            assert found == pytest.approx(expected, rel=0.2), angle
