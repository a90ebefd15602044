"""The whole Earth through its air: clouds at their height, tiles and pixels, known reflectances."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.passes.background import planet_blocks
from simgl.scenario.scenario import Scenario
from simgl.scene.earth import Clouds
from simgl.view.background_tiles import ground_tiles, unevenness
from tests.passes.test_ground import RADIUS, SUN, icrf_from_itrf, looking_down, tilted_sun, up_at
from tests.scenes import opened, radiance, scene

Array = np.ndarray[Any, Any]

SEA = (-30.0, -110.0)


@pytest.fixture
def overcast(tmp_path: Path) -> str:
    """A picture of cloud everywhere."""
    path = tmp_path / "cloud.png"
    Image.fromarray(np.full((16, 32), 255, dtype=np.uint8)).save(path)
    return str(path)


def seen_over_sun(image: Array, zenith: float) -> Array:
    """(4,) mean of pi L / (E cos z)."""
    return np.pi * image.mean(axis=(0, 1)) / SUN / np.cos(np.radians(zenith))


def oblique(place: tuple[float, float], slant: float, sun: Array, earth: Any) -> Scenario:
    """640 x 480 pixels from 400 km over a place; slant: from nadir to the north [deg]."""
    R, up = icrf_from_itrf(), up_at(*place)
    north = np.array([0.0, 0.0, 1.0]) - up[2] * up
    north /= np.linalg.norm(north)
    view = -np.cos(np.radians(slant)) * up + np.sin(np.radians(slant)) * north
    camera = {
        "position_icrf_m": (R @ up * (RADIUS + 400.0) * 1e3).tolist(),
        "boresight": (R @ view).tolist(),
        "up": (R @ up).tolist() if slant > 1.0 else R[:, 2].tolist(),
        "width_px": 640,
        "height_px": 480,
        "pixel_pitch_um": 3.75,
        "focal_length_mm": 3.75e-3 * 640 / (2.0 * np.tan(np.radians(15.0))),
    }
    return scene({}, camera, sun_direction=tuple(R @ sun), earth=earth)


def fast_over_exact(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    place: tuple[float, float],
    slant: float,
    zenith: float,
    earth: Any,
) -> tuple[Array, list[float]]:
    """How far a picture of tiles is from one of pixels alone, over its mean; the tiles' shares."""
    scenario = oblique(place, slant, tilted_sun(place, zenith, 240.0), earth)
    shares: list[float] = []

    def none(*arguments: Any) -> Array:
        bend = unevenness(*arguments)
        shares.append(float((bend < 1.0).mean()))
        return np.full_like(bend, np.inf)

    with opened(gl, scenario) as drawn, monkeypatch.context() as patched:
        fast = drawn(scenario)
        patched.setattr("simgl.view.background_tiles.unevenness", none)
        exact = drawn(scenario)
    return (fast - exact) / exact.mean(axis=(0, 1)), shares


@pytest.mark.parametrize(
    ("slant", "zenith"), [(0.0, 40.0), (45.0, 60.0), (60.0, 30.0), (0.0, 91.0)]
)
def test_tiles_found_at_their_corners_show_what_pixels_show(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, slant: int, zenith: int
) -> None:
    earth = {"clouds": {"cover": 0.0}}
    off, shares = fast_over_exact(gl, monkeypatch, (5.0, 20.0), slant, zenith, earth)
    assert shares[0] > 0.4
    # Places lie off by less than 1/8 pixel, which shows at shores; light by less than 0.1 %.
    assert np.sqrt((off**2).mean()) < 0.01
    assert abs(off.mean()) < 2e-4
    assert abs(off).max() < 0.25


# Inland, on open sea, across shores, across the date line, at an edge of the noise's cube.
@pytest.mark.parametrize(
    "place", [(18.0, 10.0), (-30.0, -20.0), (5.0, 0.0), (-40.0, 179.9), (10.0, 45.0)]
)
def test_tiles_leave_out_only_what_none_of_their_pixels_shows(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, place: tuple[float, float]
) -> None:
    """Sea on land, land on the sea, and thin high cloud where the weather has none."""
    scenario = oblique(place, 30.0, tilted_sun(place, 40.0, 240.0), {"shape": "wgs84"})
    searched = 0

    def of_nothing_known(
        planet: Any, turns: Any, k: Any, size: Any, cells: Any, **rest: Any
    ) -> Any:
        nonlocal searched
        assert cells is not None
        searched += 1
        return ground_tiles(planet, turns, k, size, **rest)

    with opened(gl, scenario) as drawn:
        known = drawn(scenario)
        monkeypatch.setattr("simgl.passes.background.planet.ground_tiles", of_nothing_known)
        unknown = drawn(scenario)
    assert searched == 1
    np.testing.assert_allclose(known, unknown, rtol=1e-5)


@pytest.mark.parametrize(("place", "cover"), [((5.0, 45.0), 0.0), ((35.26, 45.0), 0.6)])
def test_so_do_tiles_at_an_edge_and_a_corner_of_the_noises_cube(
    gl: moderngl.Context,
    monkeypatch: pytest.MonkeyPatch,
    place: tuple[float, float],
    cover: float,
) -> None:
    off, shares = fast_over_exact(gl, monkeypatch, place, 0.0, 40.0, {"clouds": {"cover": cover}})
    assert shares[0] > 0.9
    assert np.sqrt((off**2).mean()) < 0.01
    assert abs(off.mean()) < 2e-4
    # The edge, a meridian, runs down the middle: it keeps the same limit there.
    assert np.sqrt((off[:, 288:352] ** 2).mean()) < 0.01


def test_a_higher_cloud_has_less_air_before_it(gl: moderngl.Context, overcast: str) -> None:
    """Seen at a slant under a low Sun, air takes more of a low cloud's blue than its veil gives."""
    sun = tilted_sun(SEA, 60.0, 90.0)
    blueness = []
    for height in (1.0, 5.0, 20.0):
        clouds = {"picture": overcast, "height_km": height, "optical_thickness": 50.0}
        image = radiance(gl, oblique(SEA, 55.0, sun, {"clouds": clouds}))[200:280, 280:360]
        red, _, blue, _ = seen_over_sun(image, 60.0)
        blueness.append(blue / red)
    assert blueness[0] < blueness[1] < blueness[2]
    # At 20 km what is left is ozone: three quarters of 0.02 in red, over a way of 2 + 2.
    assert blueness[2] == pytest.approx(np.exp(0.06), abs=0.03)


@pytest.mark.parametrize("thickness", [4.0, 15.0])
def test_air_under_a_deck_has_the_light_that_comes_through(
    gl: moderngl.Context, overcast: str, thickness: float
) -> None:
    """A deck over nearly all air: what the air adds to its blue, as layers add up."""
    sun = tilted_sun(SEA, 60.0, 90.0)
    deck = {"clouds": {"picture": overcast, "height_km": 20.0, "optical_thickness": thickness}}
    bare = {"atmosphere": "none"}

    def blue(earth: Any) -> float:
        return float(seen_over_sun(looking_down(gl, SEA, sun, earth, width=40.0), 60.0)[2])

    none = {"clouds": {"cover": 0.0}}
    # Two streams: what the deck reflects of the Sun's light, and of light from all sides.
    tau = (1.0 - 0.85**2) * thickness
    g = 0.85 / 1.85
    g1, g3 = 0.75 * (1.0 - g), 0.5 - 0.75 * g * 0.5
    sent = (g1 * tau + (g3 - 0.5 * g1) * (1.0 - np.exp(-2.0 * tau))) / (1.0 + g1 * tau)
    back = g1 * tau / (1.0 + g1 * tau)

    def through(beneath: float) -> float:
        return (1.0 - sent) * beneath * (1.0 - back) / (1.0 - beneath * back)

    # Air in full sunlight would add 0.03 more; ozone over the deck takes 0.01 of the thick one.
    expected = through(blue(none)) - through(blue(none | bare))
    assert blue(deck) - blue(deck | bare) == pytest.approx(expected, abs=0.01)


def test_a_camera_under_the_clouds_sees_none_on_the_ground(
    gl: moderngl.Context, overcast: str
) -> None:
    sun = tilted_sun(SEA, 60.0, 90.0)
    earth = {"shape": "sphere", "radius_km": RADIUS, "atmosphere": "standard"}
    seen = []
    for altitude in (2.0, 6.0):
        clouds = {"picture": overcast, "height_km": 4.0, "optical_thickness": 50.0}
        image = looking_down(
            gl, SEA, sun, earth | {"clouds": clouds}, altitude=altitude, width=1.0, pixels=32
        )
        seen.append(seen_over_sun(image, 60.0)[1])
    assert seen[0] < 0.1
    assert seen[1] > 0.5


def looking_up(sun: Array, zenith: float, earth: Any, place: tuple[float, float]) -> Scenario:
    """A camera 2 m up, which looks so far from the zenith to the north [deg], in 3 x 3 pixels."""
    R, up = icrf_from_itrf(), up_at(*place)
    north = np.array([0.0, 0.0, 1.0]) - up[2] * up
    north /= np.linalg.norm(north)
    a = np.radians(zenith)
    camera = {
        "position_icrf_m": (R @ up * (RADIUS + 0.002) * 1e3).tolist(),
        "boresight": (R @ (np.cos(a) * up + np.sin(a) * north)).tolist(),
        "up": (R @ np.cross(up, north)).tolist(),
        "width_px": 3,
        "height_px": 3,
        "pixel_pitch_um": 3.75,
        "focal_length_mm": 3.75e-3 * 3 / (2.0 * np.tan(np.radians(60.0))),
    }
    return scene({}, camera, sun_direction=tuple(R @ sun), earth=earth)


def skies(
    gl: moderngl.Context, sun_zenith: float, azimuth: float, zenith: float, earth: Any
) -> list[Array]:
    """(3, 3, 4) radiance over twelve places: noise makes cloud thinner or thicker at any one."""
    places = [(SEA[0], SEA[1] + 9.0 * step) for step in range(12)]
    scenarios = [
        looking_up(tilted_sun(place, sun_zenith, azimuth), zenith, earth, place) for place in places
    ]
    with opened(gl, scenarios[0]) as drawn:
        return [drawn(scenario) for scenario in scenarios]


@pytest.mark.parametrize("thickness", [5.0, 20.0, 80.0])
def test_an_overcast_sky_sends_down_what_two_streams_let_through(
    gl: moderngl.Context, overcast: str, thickness: float
) -> None:
    """Without air, far from the Sun: pi L / (E cos z) = 1 - R - T, T what passes unscattered.

    R by Meador and Weaver (1980), eq. 24; droplets of asymmetry 0.85, scaled by its square.
    """
    mu = np.cos(np.radians(50.0))
    scaled, g = thickness * (1.0 - 0.85**2), 0.85 / 1.85
    g1, g3 = 0.75 * (1.0 - g), 0.5 - 0.75 * g * mu
    direct = np.exp(-scaled / mu)
    reflected = (g1 * scaled + (g3 - g1 * mu) * (1.0 - direct)) / (1.0 + g1 * scaled)
    clouds = {"picture": overcast, "optical_thickness": thickness, "height_km": 20.0}
    earth = {"shape": "sphere", "radius_km": RADIUS, "atmosphere": "none", "clouds": clouds}
    # The Sun in the south, 100 deg from the middle pixel, which spans 40 km: of the noise, waves of
    # 64 km are left, which make the layer thinner or thicker by a third at any one place.
    images = [image[1:2, 1:2] for image in skies(gl, 50.0, 180.0, 50.0, earth)]
    # Droplets throw 2 % of the direct light so far aside.
    wanted = 1.0 - reflected - direct
    seen = seen_over_sun(np.concatenate(images), 50.0)
    np.testing.assert_allclose(seen, wanted, rtol=0.12, atol=0.02 * direct)


def test_an_overcast_sky_is_grey_and_a_clear_one_blue(gl: moderngl.Context, overcast: str) -> None:
    earth = {"shape": "sphere", "radius_km": RADIUS, "atmosphere": "standard"}

    def sky(clouds: dict[str, Any]) -> Array:
        images = skies(gl, 60.0, 90.0, 30.0, earth | {"clouds": clouds})
        return seen_over_sun(np.concatenate(images), 60.0)

    # The clear sky is blue, the overcast one grey, and brighter.
    blue, pale = sky({"cover": 0.0}), sky({"picture": overcast, "optical_thickness": 30.0})
    assert blue[2] > 1.7 * blue[0]
    # The air below the clouds is lit as if they were not there, which adds some of its blue.
    assert pale[2] < 1.35 * pale[0]
    assert np.all(pale[:3] > blue[:3])


def test_a_thick_cloud_and_a_clear_sea_reflect_what_is_known(
    gl: moderngl.Context, overcast: str
) -> None:
    sun = tilted_sun(SEA, 40.0, 0.0)
    clouds = {"picture": overcast, "optical_thickness": 30.0}
    cloud = seen_over_sun(looking_down(gl, SEA, sun, {"clouds": clouds}), 40.0)
    sea = seen_over_sun(looking_down(gl, SEA, sun, {"clouds": {"cover": 0.0}}), 40.0)
    assert np.all((cloud > 0.6) & (cloud < 0.85))
    assert 0.03 < sea[1] < 0.1


# Light of a disc over the mean of the four, by CERES's mean albedos (docs/flight_truth.md).
DISCS = [(-150.0, 0.946), (-60.0, 1.014), (20.0, 1.022), (110.0, 1.018)]


@pytest.mark.parametrize(("longitude", "share"), DISCS)
def test_the_full_disc_reflects_what_was_measured_of_the_earth_at_all_phases(
    gl: moderngl.Context, longitude: float, share: float
) -> None:
    place = (0.0, longitude)
    image = looking_down(
        gl, place, up_at(*place), {"shape": "wgs84"}, altitude=36_000.0, width=13_000.0, pixels=160
    )
    # The disc from 42,378 km is so much smaller in its plane: cos of its own half angle.
    shown = RADIUS * 36_000.0 / np.sqrt((RADIUS + 36_000.0) ** 2 - RADIUS**2)
    disc = np.pi * shown**2 / (13_000.0 / 160) ** 2
    reflectance = np.pi * image.sum(axis=(0, 1)) / disc / SUN
    # The geometric albedo from 400 to 700 nm is 0.242 +- 0.005 (Robinson 2025, arXiv:2507.22258);
    # the weather of a day changes a disc by some per cent more.
    mean = np.average(reflectance[:3], weights=SUN[:3])
    np.testing.assert_allclose(mean, 0.242 * share, rtol=0.1)


def test_clouds_send_as_much_light_to_space_in_pixels_of_any_size(gl: moderngl.Context) -> None:
    """Noon over the storms of Africa and the Atlantic, in pixels of 20 km and up to 325 km."""
    place = (10.0, 0.0)

    def light(pixels: int) -> Array:
        earth, sun = {"shape": "sphere", "radius_km": RADIUS}, up_at(*place)
        image = looking_down(
            gl, place, sun, earth, altitude=36_000.0, width=13_000.0, pixels=pixels
        )
        return np.asarray(image.mean(axis=(0, 1)))

    fine = light(640)
    for pixels in (40, 80, 160):
        # Levels of the map reflect as much light from all sides as the map. From the zenith thick
        # clouds gain most, and the levels reflect up to 1 % less; through their mean cover comes up
        # to 2 % less of the light of the ground, which is a third. Means of cover and thickness
        # each for itself lost 5 to 10 % of R and G.
        np.testing.assert_allclose(light(pixels), fine, rtol=0.015)


def test_towers_of_storms_stand_over_the_limb_of_the_tropics(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside the same weather without towers, something brighter stands over the layer at 4 km, and
    nothing over the tropopause at 13 km."""
    # The limb to the east lies 19.8 deg off, past a storm near 3 N, 102 E.
    place = (2.9, 82.7)
    R, up = icrf_from_itrf(), up_at(*place)
    east = np.array([-up[1], up[0], 0.0]) / np.hypot(up[0], up[1])
    # From 400 km the ground's limb lies 70.2 deg from nadir.
    view, field = np.sin(np.radians(70.2)) * east - np.cos(np.radians(70.2)) * up, 24.0
    width, height = 640, 96
    camera = {
        "position_icrf_m": (R @ up * (RADIUS + 400.0) * 1e3).tolist(),
        "boresight": (R @ view).tolist(),
        "up": (R @ up).tolist(),
        "width_px": width,
        "height_px": height,
        "pixel_pitch_um": 3.75,
        "focal_length_mm": 3.75e-3 * width / (2.0 * np.tan(np.radians(0.5 * field))),
    }
    earth = {"shape": "sphere", "radius_km": RADIUS}
    looked = scene({}, camera, sun_direction=tuple(R @ tilted_sun(place, 30.0, 240.0)), earth=earth)
    towering = radiance(gl, looked)
    monkeypatch.setattr(Clouds, "top", property(lambda self: self.height))
    # What is cached of an Earth has its towers.
    of_earth = "simgl.passes.background.planet.earth_values"
    monkeypatch.setattr(of_earth, planet_blocks.earth_values.__wrapped__)
    level = radiance(gl, looked)
    more = (towering - level)[..., 0] / level[..., 0].max()
    x, y = (np.arange(n) + 0.5 - 0.5 * n for n in (width, height))
    focal = width / (2.0 * np.tan(np.radians(0.5 * field)))
    right = np.cross(view, up)
    right /= np.linalg.norm(right)
    down = np.cross(view, right)
    rays = focal * view + x[:, None] * right + y[:, None, None] * down
    cosine = -(rays @ up) / np.linalg.norm(rays, axis=-1)
    lowest = (RADIUS + 400.0) * np.sqrt(1.0 - cosine**2) - RADIUS
    # A pixel spans 1.5 km there.
    over_layer = lowest > 4.0 + 1.5
    assert (more[over_layer] > 0.02).sum() > 10
    assert more[over_layer].min() > -1e-3
    assert abs(more[lowest > 13.0 + 1.5]).max() == 0.0
