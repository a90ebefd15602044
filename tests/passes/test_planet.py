"""The Earth: an exact ellipsoid in its place, turned the right way, with the right radiance."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.physics.eclipse import limb_angle
from simgl.physics.ephemeris import itrf_from_icrf, tai_ns_from_utc
from simgl.physics.regolith import MARS, geometric_albedo, reflectance
from tests.scenes import radiance, scene

GREEN = 174.7738123  # [W m-2]
SPHERE = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3}


@pytest.mark.parametrize("altitude_km", [400.0, 36_000.0])
@pytest.mark.parametrize("sun_zenith_deg", [0.0, 60.0, 85.0])
def test_a_lambertian_earth_at_nadir_has_radiance_rho_e_cos_over_pi(
    gl: moderngl.Context, altitude_km: float, sun_zenith_deg: float
) -> None:
    z = np.radians(sun_zenith_deg)
    scenario = scene(
        {},
        {
            "position_icrf_m": [(6371.0 + altitude_km) * 1e3, 0, 0],
            "boresight": [-1, 0, 0],
            "width_px": 33,
            "height_px": 33,
        },
        sun_direction=(float(np.cos(z)), float(np.sin(z)), 0.0),
        earth=SPHERE,
    )
    image = radiance(gl, scenario)
    expected = 0.3 / np.pi * GREEN * np.cos(z)
    # The ray to the middle pixel meets the ground within 1e-6 rad of nadir: tan(85 deg) x 1e-6.
    np.testing.assert_allclose(image[16, 16, 1], expected, rtol=2e-5)


def test_the_limb_of_the_wgs84_ellipsoid_lies_where_geometry_puts_it(gl: moderngl.Context) -> None:
    """Row of the horizon seen along the meridian, over the equator and over 45 deg latitude."""
    for latitude in (0.0, np.radians(45.0)):
        position = 7.0e6 * np.array([np.cos(latitude), 0.0, np.sin(latitude)])
        north = np.array([-np.sin(latitude), 0.0, np.cos(latitude)])
        epoch = tai_ns_from_utc("2026-03-20T12:00:00")
        R = itrf_from_icrf(epoch)
        radii = np.array([6378137.0, 6378137.0, 6356752.314245])
        angle = limb_angle(R @ position, R @ north, radii)
        nadir = -position / np.linalg.norm(position)
        along = north
        boresight = np.cos(angle) * nadir + np.sin(angle) * along
        scenario = scene(
            {},
            {
                "position_icrf_m": position.tolist(),
                "boresight": boresight.tolist(),
                "up": (-nadir).tolist(),
                "focal_length_mm": 50.0,
            },
            sun_direction=(float(np.cos(latitude)), 0.3, float(np.sin(latitude))),
            earth={"shape": "wgs84", "albedo": 0.3, "atmosphere": "none"},
        )
        column = radiance(gl, scenario)[:, 64, 1].astype(np.float64)
        # The boresight is the middle of the image; the limb must cross it there. Under the limb the
        # ground is lit; its radiance is read 3 pixels inside.
        covered = np.clip(column / column[70], 0.0, 1.0)[:70].sum()
        # float32 ray and discriminant: some 3 m of tangent height at 2,900 km is 1e-6 rad; a pixel
        # is 7.5e-5 rad.
        np.testing.assert_allclose(70 - covered, 64.0, atol=0.1)


def test_the_map_shows_the_sahara_and_the_pacific_where_they_are(gl: moderngl.Context) -> None:
    places = {"sahara": (23.0, 10.0), "pacific": (10.0, -140.0), "australia": (-25.0, 130.0)}
    seen = {}
    epoch = tai_ns_from_utc("2026-03-20T12:00:00")
    R_icrf_from_itrf = itrf_from_icrf(epoch).T
    for name, (latitude, longitude) in places.items():
        lat, lon = np.radians([latitude, longitude])
        up = R_icrf_from_itrf @ np.array(
            [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
        )
        scenario = scene(
            {},
            {"position_icrf_m": (6.8e6 * up).tolist(), "boresight": (-up).tolist()},
            sun_direction=tuple((up + 0.6 * R_icrf_from_itrf[:, 2]).tolist()),
            earth={"shape": "wgs84", "atmosphere": "none", "clouds": {"cover": 0.0}},
        )
        image = radiance(gl, scenario)
        # The Sun stands 31 deg from the zenith, out of the sea's mirror.
        irradiance = np.array([154.439, 174.774, 171.947, 313.358])
        seen[name] = np.pi * image[40:88, 40:88].mean(axis=(0, 1)) / irradiance
    red, green, blue, nir = seen["sahara"]
    assert red > 0.25
    assert red > green > blue
    assert seen["pacific"].max() < 0.06
    assert seen["pacific"][2] > seen["pacific"][0]
    assert seen["australia"][0] > 1.5 * seen["australia"][2]
    assert nir > red


def test_north_is_up_and_east_is_right(gl: moderngl.Context) -> None:
    """From above the Gulf of Guinea with north up: Africa lies to the north and east."""
    epoch = tai_ns_from_utc("2026-03-20T12:00:00")
    R = itrf_from_icrf(epoch).T
    up, north = R @ np.array([1.0, 0.0, 0.0]), R @ np.array([0.0, 0.0, 1.0])
    scenario = scene(
        {},
        {
            "position_icrf_m": (1.2e7 * up).tolist(),
            "boresight": (-up).tolist(),
            "up": north.tolist(),
            "focal_length_mm": 0.5,
        },
        # In the north-east, so that its glint falls on land.
        sun_direction=tuple((R @ np.array([1.0, 0.6, 0.6])).tolist()),
        earth={"shape": "wgs84", "atmosphere": "none", "clouds": {"cover": 0.0}},
    )
    red = radiance(gl, scenario)[..., 0]
    centre = red[54:74, 54:74].mean()
    north_side, south_side = red[30:50, 56:72].mean(), red[78:98, 56:72].mean()
    east_side, west_side = red[56:72, 78:90].mean(), red[56:72, 38:50].mean()
    assert north_side > 3.0 * south_side
    assert east_side > 3.0 * west_side
    assert centre < north_side


def test_the_night_side_is_dark_and_the_terminator_continuous(gl: moderngl.Context) -> None:
    scenario = scene(
        {},
        {
            "position_icrf_m": [2.0e7, 0, 0],
            "boresight": [-1, 0, 0],
            "up": [0, 0, 1],
            "focal_length_mm": 0.6,
            "width_px": 400,
            "height_px": 40,
        },
        sun_direction=(0.0, 1.0, 0.0),
        earth=SPHERE,
    )
    row = radiance(gl, scenario)[20, :, 1]
    right_is = np.argmax(row) > 200  # the lit side is where +y is
    lit = row if right_is else row[::-1]
    assert lit[:190].max() == 0.0
    # The Earth's radius is 54 pixels; towards the limb the cosine of the Sun's angle rises to 1.
    assert np.all(np.diff(lit[205:245]) > -1e-3)
    # E rho / pi = 16.7 over 54 pixels: a step at the terminator would stand out from 0.31 a pixel.
    assert np.abs(np.diff(lit[190:240])).max() < 0.35


def test_a_craft_behind_the_earth_is_not_seen(gl: moderngl.Context) -> None:
    ball = {"sphere": {"radius_m": 5e4, "material": {"reflectance": 1.0}}}
    for y, seen in ((0.0, False), (3.0e7, True)):
        scenario = scene(
            {"far": {"model": ball, "position_icrf_m": [-9e6, y, 0]}},
            {
                "position_icrf_m": [9e6, 0, 0],
                "look_at": "far",
                "focal_length_mm": 30.0,
            },
            sun_direction=(1.0, 1.0, 0.0),
            earth={**SPHERE, "albedo": 0.0},
        )
        assert (radiance(gl, scenario).max() > 0.0) == seen


@pytest.mark.parametrize("off_axis_deg", [0.0, 40.0, 62.0, 69.0, 80.0, 180.0])
def test_the_earth_at_the_edge_of_the_field_is_neither_lost_nor_invented(
    gl: moderngl.Context, off_axis_deg: float
) -> None:
    """At 400 km the Earth's limb stands 70.2 deg from nadir; the field's corners reach 1.5 deg."""
    a = np.radians(off_axis_deg)
    scenario = scene(
        {},
        {
            "position_icrf_m": [6.771e6, 0, 0],
            "boresight": [-np.cos(a), 0.0, np.sin(a)],
            "up": [0, 1, 0],
        },
        sun_direction=(1.0, 0.0, 1.0),
        earth=SPHERE,
        sun={"visible": False},
    )
    image = radiance(gl, scenario)[..., 1]
    seen = 70.2 - off_axis_deg > -1.5
    assert (image.max() > 0.0) == seen
    if off_axis_deg == 69.0:
        # The limb crosses the picture's middle half: 1.2 deg is 72 of 128 pixels off the middle.
        assert (image[64] > 0.0).sum() >= 126


@pytest.mark.parametrize("phase_deg", [0.0, 50.0, 110.0])
def test_a_globe_of_loose_grains_follows_its_law(gl: moderngl.Context, phase_deg: float) -> None:
    phase = np.radians(phase_deg)
    sun = (float(np.cos(phase)), float(np.sin(phase)), 0.0)
    distance = 5e7
    bare = scene(
        {},
        {
            "position_icrf_m": [distance, 0, 0],
            "boresight": [-1, 0, 0],
            "up": [0, 0, 1],
            "focal_length_mm": 1.6,
        },
        sun_direction=sun,
        earth=SPHERE,
    )
    assert bare.earth is not None
    ground = replace(bare, earth=replace(bare.earth, regolith=MARS))
    camera = bare.cameras["cam"]
    image = radiance(gl, ground)[..., 1]
    y, x = np.indices(image.shape)
    f, size = camera.focal_length_px, image.shape[0]
    # From the camera: x right is +y of ICRF, y down -z.
    d = np.stack([-np.ones(image.shape), (x + 0.5 - size / 2) / f, -(y + 0.5 - size / 2) / f], -1)
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    along = -distance * d[..., 0]
    root = along**2 - distance**2 + 6.371e6**2
    hit = root > 0.0
    n = ((along - np.sqrt(np.where(hit, root, 0.0)))[..., None] * d + [distance, 0, 0]) / 6.371e6
    mu, mu0, cos_phase = -(n * d).sum(-1), n @ sun, -(d @ sun)
    scale = 2.0 / 3.0 * 0.3 / geometric_albedo(MARS)
    expected = GREEN * scale * reflectance(MARS, mu0, mu, cos_phase)
    # Beside the limb, whose pixels are covered in part, and the terminator, where the Sun's disc
    # is cut; float32 geometry is good to 1e-5 there, and the law is steep at the surge.
    seen = hit & (mu > 0.25) & (mu0 > 0.05)
    assert seen.sum() > 400
    np.testing.assert_allclose(image[seen], expected[seen], rtol=1e-3)
