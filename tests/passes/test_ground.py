"""The planet as a camera sees it: land, sea, lamps and clouds where they are, and as bright."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import map_coordinates

from simgl.passes.background.cloud_map import noise_texture, weather_codes
from simgl.passes.background.earth_maps import ground_textures, land_map, shore_map
from simgl.physics.ephemeris import itrf_from_icrf, tai_ns_from_utc
from simgl.scene.earth import Clouds, EarthMaps
from tests.scenes import radiance, scene

Array = np.ndarray[Any, Any]

CLEAR = {"atmosphere": "none", "clouds": {"cover": 0.0}}
SUN = np.array([154.43947526, 174.7738123, 171.94738469, 313.35751052])  # [W m-2]
RADIUS = 6378.137  # [km]


@lru_cache
def icrf_from_itrf() -> Array:
    return itrf_from_icrf(tai_ns_from_utc("2026-03-20T12:00:00")).T


def up_at(latitude: float, longitude: float) -> Array:
    """Unit vector, ITRF; degrees."""
    lat, lon = np.radians([latitude, longitude])
    return np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def looking_down(
    gl: moderngl.Context,
    place: tuple[float, float],
    sun: Array,
    earth: dict[str, Any],
    *,
    altitude: float = 400.0,
    width: float = 300.0,
    pixels: int = 96,
) -> Array:
    """(n, n, 4) radiance of a square of ground seen from above, north up.

    place : latitude and longitude [deg]; sun : direction, ITRF; altitude, width : [km]
    """
    R, up = icrf_from_itrf(), up_at(*place)
    camera = {
        "position_icrf_m": (R @ up * (RADIUS + altitude) * 1e3).tolist(),
        "boresight": (-R @ up).tolist(),
        "up": R[:, 2].tolist(),
        "width_px": pixels,
        "height_px": pixels,
        "pixel_pitch_um": 3.75,
        "focal_length_mm": 3.75e-3 * pixels * altitude / width,
    }
    return radiance(gl, scene({}, camera, sun_direction=tuple(R @ sun), earth=earth))


def tilted_sun(place: tuple[float, float], zenith: float, azimuth: float) -> Array:
    """Sun at a zenith angle, to a side counted from north through east [deg]; ITRF."""
    up = up_at(*place)
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= np.linalg.norm(east)
    z, a = np.radians([zenith, azimuth])
    level = np.cos(a) * np.cross(up, east) + np.sin(a) * east
    return np.cos(z) * up + np.sin(z) * level


def test_the_maps_have_the_means_that_the_documentation_states() -> None:
    is_land = shore_map(None)[0][::3, ::3, 0] < 128
    height, width = is_land.shape
    rows = np.cos(np.radians(90.0 - (np.arange(height) + 0.5) * 180.0 / height))[:, None]
    weights = rows * is_land
    # Land, with lakes counted as water, is 28.7 % of the Earth (29.2 % less 0.5 % of lakes).
    assert weights.sum() / (rows.sum() * width) == pytest.approx(0.287, abs=0.005)
    reflectance = (land_map(None)[0][::2, ::2] / np.float32(255.0)) ** 2
    weights = on_map_of(reflectance, weights)
    mean = [np.average(reflectance[..., band], weights=weights) for band in range(4)]
    np.testing.assert_allclose(mean, [0.215, 0.198, 0.154, 0.340], atol=0.005)


def on_map_of(other: Array, values: Array) -> Array:
    """(h, w) the texels of a map at the places of another's."""
    rows, columns = (
        ((np.arange(n) + 0.5) * m / n).astype(int)
        for n, m in zip(other.shape[:2], values.shape, strict=True)
    )
    return np.asarray(values[np.ix_(rows, columns)])


def texel_at(latitude: float, longitude: float, shape: tuple[int, ...]) -> tuple[float, float]:
    """Row and column, whole in the middles of texels."""
    return (
        (90.0 - latitude) / 180.0 * shape[0] - 0.5,
        (longitude + 180.0) / 360.0 * shape[1] - 0.5,
    )


@pytest.mark.parametrize("zenith", [20.0, 45.0])
def test_the_sand_of_libya_4_shows_what_satellites_see_there(
    gl: moderngl.Context, zenith: float
) -> None:
    """Through clear air, looked down on: satellites are calibrated by the light that they get
    there, not by what the ground reflects. The Sun is as high as at most of their passes.
    """
    place = (28.55, 23.39)
    sun = tilted_sun(place, zenith, 130.0)
    image = looking_down(gl, place, sun, {"clouds": {"cover": 0.0}}, width=50.0, pixels=48)
    seen = np.pi * image.mean(axis=(0, 1)) / SUN / np.cos(np.radians(zenith))
    np.testing.assert_allclose(seen, [0.45, 0.34, 0.25, 0.58], rtol=0.05)


CAPES = {
    "Cabo da Roca": (38.7806, -9.4989),
    "Lizard Point": (49.9600, -5.2022),
    "Cape Agulhas": (-34.8288, 20.0092),
    "Cape Byron": (-28.6386, 153.6363),
    "Land's End": (50.0660, -5.7150),
    "Dungeness": (50.9133, 0.9760),
    "Cap Gris-Nez": (50.8694, 1.5831),
    "Cape Hatteras": (35.2506, -75.5288),
    "Montauk Point": (41.0710, -71.8570),
    "Cabo de Sao Vicente": (37.0228, -8.9963),
    "Cabo Finisterre": (42.8824, -9.2719),
    "Point Conception": (34.4486, -120.4710),
    "Cape Leeuwin": (-34.3744, 115.1361),
    "Cape Flattery": (48.3917, -124.7367),
    "Kap Arkona": (54.6796, 13.4326),
}


def test_shores_stand_where_lighthouses_do() -> None:
    """Tips of capes, which texels of 2.5 km round off: within half of one and the 0.3 km by which
    towers stand inland, 0.7 km in the mean."""
    shore = shore_map(None)[0][..., 0]
    places = np.transpose([texel_at(*cape, shape=shore.shape) for cape in CAPES.values()])
    km = (map_coordinates(shore, places, order=1, output=np.float32) - 128.0) / 6.0
    assert np.abs(km).max() < 1.55
    assert np.abs(km).mean() < 0.7


@pytest.mark.parametrize(
    ("name", "place"),
    {
        "Geneva, 8 km wide": (46.45, 6.55),
        "Constance, 10 km": (47.60, 9.40),
        "Garda, 10 km": (45.60, 10.67),
        "Balaton, 8 km": (46.85, 17.75),
        "Tanganyika": (-6.0, 29.5),
        "Titicaca": (-15.8, -69.4),
        "Congo at Mbandaka, 6 km": (0.05, 18.2),
        "Congo at Bumba, 6 km": (2.15, 22.45),
        "Amazon at Santarem, 5 km": (-2.38, -54.73),
        "Brahmaputra, 5 km": (25.5, 89.7),
    }.items(),
)
def test_lakes_and_broad_rivers_are_water(name: str, place: tuple[float, float]) -> None:
    shore = shore_map(None)[0][..., 0]
    row, column = texel_at(*place, shape=shore.shape)
    assert map_coordinates(shore, [[row], [column]], order=1, output=np.float32)[0] > 128.0, name


def test_leaves_are_bright_and_water_black_in_the_near_infrared(gl: moderngl.Context) -> None:
    seen = {}
    for name, place in {"forest": (0.0, 22.0), "sea": (-30.0, -110.0)}.items():
        sun = tilted_sun(place, 60.0, 0.0)
        image = looking_down(gl, place, sun, CLEAR)
        seen[name] = np.pi * image.mean(axis=(0, 1)) / SUN / np.cos(np.radians(60.0))
    assert seen["forest"][3] > 0.2
    assert seen["forest"][3] > 6.0 * seen["forest"][0]
    # The dark body alone: 0.0065 in green and foam of 0.06 %; the glint stands 60 deg away.
    assert 0.005 < seen["sea"][1] < 0.02
    assert seen["sea"][3] < 0.005
    assert seen["sea"][2] > 2.0 * seen["sea"][1]


def test_cities_shine_at_night_and_nothing_else_does(gl: moderngl.Context) -> None:
    night = -up_at(20.0, 10.0)
    clouds_or_not = {"atmosphere": "none"}
    sea = looking_down(gl, (10.0, -30.0), night, clouds_or_not)
    np.testing.assert_array_equal(sea, 0.0)
    milan = looking_down(gl, (45.46, 9.19), night, CLEAR, width=40.0)
    total = milan.sum(axis=2)
    # 10 to 200 nW cm-2 sr-1 is what satellites see of cities (Elvidge et al. 2017).
    assert 1e-4 < total.mean() < 2e-3
    day = looking_down(gl, (45.46, 9.19), -night, CLEAR, width=40.0)
    # Not lakes near by, which are as dark by day as lamps would be at night.
    assert (day.sum(axis=2) > 1e3 * total).all()


def test_towns_are_points_that_leave_the_map_its_light(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    """Of an even map most light comes from few pixels near by, and from afar all is even."""
    night, code = -up_at(20.0, 10.0), 128.0 / 255.0
    path = tmp_path / "night.png"
    # Codes up to 16 are taken for noise.
    Image.fromarray(np.full((90, 180), 144, dtype=np.uint8)).save(path)
    earth = {**CLEAR, "night_picture": str(path)}
    near = looking_down(gl, (23.0, 9.0), night, earth, pixels=320).sum(axis=2)
    expected = 2e-3 * (0.75 * code**2 + 0.25 * 5.18 * code**5)
    # 156 cells of 24 km have two fifths of the light, of variance 1.4: 4 %, and finer ones 1 %;
    # roads bend towns, which brings as much again.
    np.testing.assert_allclose(near.mean(), expected, rtol=0.2)
    brightest = np.sort(near.ravel())[::-1]
    assert brightest[: len(brightest) // 10].sum() > 0.4 * brightest.sum()
    far = looking_down(gl, (23.0, 9.0), night, earth, altitude=2e4, width=3200.0, pixels=32)
    np.testing.assert_allclose(far[12:20, 12:20].sum(axis=2), expected, rtol=0.1)


def test_the_weather_has_the_cover_that_was_asked_for_whatever_its_seed(
    gl: moderngl.Context,
) -> None:
    ground = ground_textures(gl, EarthMaps())
    noise = noise_texture(gl, 0)
    maps = []
    for cover, seed in ((0.6, 0), (0.3, 1), (0.75, 2), (0.6, 0)):
        codes = weather_codes(gl, Clouds(cover=cover, seed=seed), noise, ground, width=1024)
        area = np.sin((np.arange(512) + 0.5) * np.pi / 512)
        mean = np.average(codes[..., 0].mean(axis=1), weights=area) / 255.0
        # The shift is found to 6 / 2^12 on a map of half the resolution.
        assert mean == pytest.approx(cover, abs=0.005)
        maps.append(codes)
    np.testing.assert_array_equal(maps[0], maps[3])
    assert (maps[0] != maps[1])[..., 0].mean() > 0.5
    zonal = maps[0][..., 0].mean(axis=1) / 255.0
    degrees = 90.0 - (np.arange(zonal.size) + 0.5) * 180.0 / zonal.size

    def between(low: float, high: float) -> float:
        return float(zonal[(degrees > low) & (degrees < high)].mean())

    # Belts as in satellite means: tropics and storm tracks above, subtropics below the mean.
    assert between(45.0, 60.0) > 0.65
    assert between(-62.0, -48.0) > 0.75
    assert between(2.0, 10.0) > between(15.0, 27.0) + 0.15
    noise.release()
    for map_of_ground in ground:
        map_of_ground.release()


def test_the_mean_of_a_cloudy_scene_does_not_hang_on_distance(gl: moderngl.Context) -> None:
    """Broken cloud over the Congo, from where pixels resolve it and from where they do not."""
    place = (0.0, 22.0)
    earth = {"atmosphere": "none"}
    sun = tilted_sun(place, 40.0, 120.0)
    # Both look straight down: clouds have another reflectance at a slant.
    near = looking_down(gl, place, sun, earth, altitude=8_000.0, width=400.0, pixels=1024)
    far = looking_down(gl, place, sun, earth, altitude=36_000.0, width=400.0, pixels=64)
    blocks = near[..., 1].reshape(64, 16, 64, 16)
    within = blocks - blocks.mean(axis=(1, 3), keepdims=True)
    # Pixels of 0.4 km show what one of 6 km holds: without them it is below 0.1.
    assert within.std() > 0.25 * far[..., 1].std()
    # 40 by 40 puffs of 10 km, of contrast 0.4, leave 1 % to chance.
    np.testing.assert_allclose(near.mean(axis=(0, 1)), far.mean(axis=(0, 1)), rtol=0.01)


@pytest.mark.parametrize("degrees_below", [3.0, 9.0])
def test_no_slope_catches_the_sun_below_the_horizon_of_its_top(
    gl: moderngl.Context, degrees_below: float
) -> None:
    """Alps at twilight: from 2 km over the land around, the horizon dips by 1.54 deg, and
    refraction and half of the disc let the Sun set 0.84 deg later, at 2.4 deg. Skylight alone is
    even."""
    place = (46.4, 9.5)
    earth = {"clouds": {"cover": 0.0}, "airglow": False, "moonlight": False}
    sun = tilted_sun(place, 90.0 + degrees_below, 90.0)
    infrared = looking_down(gl, place, sun, earth, width=60.0)[..., 3]
    # The sky's light differs by 1.5 over half a degree; growth reflects 0.35, rock 0.2.
    assert infrared.max() < 2.5 * np.median(infrared)


@pytest.fixture
def square_cloud(tmp_path: Path) -> str:
    """A picture of one cloud: 100 km square over the Sahara."""
    picture = np.zeros((1800, 3600), dtype=np.uint8)
    row, column = (90 - 23) * 10, (180 + 9) * 10
    picture[row - 5 : row + 5, column - 5 : column + 5] = 255
    path = tmp_path / "cloud.png"
    Image.fromarray(picture).save(path)
    return str(path)


@pytest.mark.parametrize("azimuth", [90.0, 180.0, 315.0])
def test_a_cloud_throws_its_shadow_away_from_the_sun(
    gl: moderngl.Context, square_cloud: str, azimuth: float
) -> None:
    place = (23.0, 9.0)
    sun = tilted_sun(place, 60.0, azimuth)
    clouds = {"picture": square_cloud, "height_km": 20.0, "optical_thickness": 30.0}
    # A sphere, whose normal at 23 deg points to the camera.
    ball = {"shape": "sphere", "radius_km": RADIUS}
    clear = looking_down(gl, place, sun, {**CLEAR, **ball})[..., 0]
    seen = looking_down(gl, place, sun, {"clouds": clouds, **ball})[..., 0]
    change = seen - clear
    cloud, shadow = np.maximum(change, 0.0), np.maximum(-change, 0.0)
    assert seen.max() > 1.5 * clear.mean()
    # Rows count southwards, columns to the east; of the shadow shows what the cloud leaves free.
    y, x = np.mgrid[: seen.shape[0], : seen.shape[1]] - 47.5
    km = 300.0 / 96.0
    away = -np.array([np.sin(np.radians(azimuth)), -np.cos(np.radians(azimuth))])
    step_x, step_y = 20.0 * np.tan(np.radians(60.0)) * away

    def covered(dx: float, dy: float) -> Array:
        wide, high = 0.5 * 111.2 * np.cos(np.radians(23.0)), 0.5 * 111.2
        return (np.abs(km * x - dx) < wide) & (np.abs(km * y - dy) < high)

    expected = covered(step_x, step_y) & ~covered(0.0, 0.0)
    for axis in (x, y):
        assert abs(np.average(axis, weights=cloud)) < 2.0
        # The picture's edges are a pixel of 11 km wide, 3.5 of these pixels.
        middle = np.average(axis, weights=shadow)
        assert abs(middle - np.average(axis, weights=expected)) < 3.5


def test_foam_whitens_a_sea_by_the_wind(gl: moderngl.Context) -> None:
    place = (-20.0, -120.0)
    sun = tilted_sun(place, 85.0, 90.0)
    calm, storm = (
        looking_down(gl, place, sun, CLEAR | {"wind_m_s": wind}).mean(axis=(0, 1))
        for wind in (0.0, 15.0)
    )
    whiter = np.pi * (storm - calm) / SUN / np.cos(np.radians(85.0))
    # 3.9 % of it, of reflectance 0.22, half of that in N, covers water of 0.0008, 0.022 and 0.
    # The glint of such waves is grey.
    expected = 0.0393 * (np.array([0.2192, 0.198]) - 0.11)
    np.testing.assert_allclose(whiter[[0, 2]] - whiter[3], expected, rtol=0.02)


def test_a_wind_that_differs_from_place_to_place_shows_in_the_glint_and_as_foam(
    gl: moderngl.Context,
) -> None:
    place = (-20.0, -120.0)
    even, varying = CLEAR | {"wind_m_s": 7.0}, CLEAR
    seen = {}
    # Below the Sun near the zenith stands the glint's middle, 85 deg off it none.
    for name, sun in {
        "glint": tilted_sun(place, 5.0, 90.0),
        "off": tilted_sun(place, 85.0, 90.0),
    }.items():
        seen[name] = [looking_down(gl, place, sun, earth) for earth in (even, varying)]
    # Foam alone: 0.3 % of the sea at 7 m/s, four times as much at 10.5.
    foam = np.pi * (seen["off"][1] - seen["off"][0]) / SUN / np.cos(np.radians(85.0))
    assert np.abs(foam).max() < 3.0 * 0.0029 * 0.22
    ratio = (seen["glint"][1] / seen["glint"][0])[..., 3]
    # In its middle the glint falls with the slopes' variance, nine tenths of which are the
    # wind's: an rms of 0.2, and calms of half the wind.
    assert 0.03 < ratio.std() < 0.4
    assert 0.6 < ratio.mean() < 1.6
