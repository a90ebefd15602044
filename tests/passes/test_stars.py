"""Stars in the picture: where they belong, with the light they have."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.assess.visible_stars import stars_in_view
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.camera.projections import Distortion
from simgl.simulator import Simulator
from simgl.view.background import background, sky_view
from tests.passes.skies import (
    direction_of_pixel,
    lone_stars,
    picture,
    received,
    sky_scene,
    taken,
    towards,
    turned,
)

E = 1e-8  # [W m-2]


# Columns and rows in the middle of a picture of 128 x 96, and in its corners.
PLACES = [(64.5, 48.5), (64.0, 48.0), (64.13, 47.91), (64.77, 48.251), (3.2, 90.4), (125.0, 2.6)]


@pytest.mark.parametrize("focal_length_mm", [0.3, 13.0, 300.0])
def test_a_star_keeps_its_light_and_its_place_wherever_in_a_pixel_it_stands(
    gl: moderngl.Context, focal_length_mm: float
) -> None:
    """At 0.3 mm the corner of the picture lies 45 deg off the boresight."""
    scenario = sky_scene({"boresight": [0, 1, 0], "focal_length_mm": focal_length_mm})
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"]
    d = camera.camera.detector
    xs, ys = np.arange(d.width) + 0.5, np.arange(d.height) + 0.5
    tangent2 = ((xs - d.width / 2) ** 2 + (ys[:, None] - d.height / 2) ** 2) / (
        camera.camera.focal_length_px**2
    )
    with Simulator(scenario, gl) as simulator:
        for x, y in PLACES:
            star = direction_of_pixel(camera.camera, camera.R_camera_from_icrf, x, y)
            image = taken(simulator, lone_stars(state, [star], E))
            # Of the wide field a pixel is 0.7 deg: its solid angle by cos^3 at its centre errs by
            # 1e-4.
            np.testing.assert_allclose(received(image, camera.camera), E, rtol=1e-4)
            # The share of the light in each pixel is its radiance without cos^3.
            share = image[..., 1] * (1.0 + tangent2) ** -1.5
            share /= share.sum()
            # float32 pixel coordinates: 1e-5 of a pixel.
            np.testing.assert_allclose((share * xs).sum(), x, atol=1e-4)
            np.testing.assert_allclose((share * ys[:, None]).sum(), y, atol=1e-4)
            # A second moment of 1/4 pixel^2, so that a drifting star does not twinkle under a lens.
            np.testing.assert_allclose((share * (xs - x) ** 2).sum(), 0.25, atol=1e-3)


def test_a_star_just_outside_the_picture_still_reaches_in(gl: moderngl.Context) -> None:
    scenario = sky_scene({"boresight": [0, 1, 0]})
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"]
    for x, inside in ((-0.25, 0.28125), (-1.0, 0.0), (128.5, 0.125)):
        star = direction_of_pixel(camera.camera, camera.R_camera_from_icrf, x, 40.5)
        image = picture(gl, scenario, lone_stars(state, [star], E))
        # The wing past the edge by the spline: (1.5 - t)^2 / 2 of the pixel t away, here in x only.
        np.testing.assert_allclose(received(image, camera.camera)[0], inside * E, atol=2e-4 * E)


def test_stars_add_up(gl: moderngl.Context) -> None:
    scenario = sky_scene({"boresight": [0, 1, 0]})
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"]
    place = direction_of_pixel(camera.camera, camera.R_camera_from_icrf, 50.3, 50.8)
    image = picture(gl, scenario, lone_stars(state, [place] * 3, E))
    np.testing.assert_allclose(received(image, camera.camera), 3.0 * E, rtol=1e-5)


def test_orion_stands_upright_with_betelgeuse_to_the_east(gl: moderngl.Context) -> None:
    """North up, east is left on the sky seen from inside."""
    scenario = sky_scene(
        {"boresight": towards(83.8, -1.0).tolist(), "focal_length_mm": 1.0},
        sky={"faintest_star_mag": 3.0},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    place = {star.hip: star.pixel for star in stars_in_view(state, "cam")}
    betelgeuse, bellatrix, rigel, saiph = (place[hip] for hip in (27989, 25336, 24436, 27366))
    alnitak, alnilam, mintaka = (place[hip] for hip in (26727, 26311, 25930))
    assert betelgeuse[0] < bellatrix[0]
    assert saiph[0] < rigel[0]
    assert betelgeuse[1] < alnitak[1] < saiph[1]
    assert alnitak[0] < alnilam[0] < mintaka[0]
    image = picture(gl, scenario)
    for pixel in (betelgeuse, bellatrix, rigel, saiph):
        x, y = int(pixel[0]), int(pixel[1])
        assert image[y, x, 1] == image[y - 1 : y + 2, x - 1 : x + 2, 1].max()
    red = image[int(betelgeuse[1]), int(betelgeuse[0])]
    blue = image[int(rigel[1]), int(rigel[0])]
    assert red[0] > 3.0 * red[2]
    assert blue[2] > 1.5 * blue[0]


def test_the_picture_holds_the_light_of_the_listed_stars(gl: moderngl.Context) -> None:
    scenario = sky_scene({"boresight": towards(83.8, -1.0).tolist(), "focal_length_mm": 1.0})
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"].camera
    listed = stars_in_view(state, "cam")
    assert len(listed) > 300
    assert [s.magnitude for s in listed] == sorted(s.magnitude for s in listed)
    expected = np.sum([s.irradiance for s in listed], axis=0)
    # Stars within 1.5 pixels of the frame lose or lend a wing: some 2 % of the picture.
    assert state.stars is not None
    alone = replace(state, stars=replace(state.stars, diffuse=False))
    np.testing.assert_allclose(received(picture(gl, scenario, alone), camera), expected, rtol=0.02)


def test_a_limit_of_magnitude_leaves_the_fainter_ones_out() -> None:
    look = {"boresight": towards(83.8, -1.0).tolist(), "focal_length_mm": 1.0}
    scenario = sky_scene(look, sky={"faintest_star_mag": 3.0})
    listed = stars_in_view(scenario.at(scenario.epoch_tai_ns), "cam")
    assert 8 <= len(listed) <= 25
    assert max(star.magnitude for star in listed) <= 3.0


def test_stars_are_there_unless_the_sun_is_fixed_by_hand(gl: moderngl.Context) -> None:
    look = {"boresight": towards(83.8, -1.0).tolist(), "focal_length_mm": 1.0}
    assert picture(gl, sky_scene(look)).max() > 0.0
    assert picture(gl, sky_scene(look, sky={"stars": False})).max() == 0.0
    by_hand = {"direction_icrf": [-1.0, 0.0, 0.0]}
    assert picture(gl, sky_scene(look, sun=by_hand)).max() == 0.0
    assert picture(gl, sky_scene(look, sun=by_hand, sky={"stars": True})).max() > 0.0


def test_aberration_moves_a_star_by_the_velocity_of_the_spacecraft(gl: moderngl.Context) -> None:
    """A camera on an orbit sees stars ahead drawn together by 7.7 km/s: 5.3 arcsec."""
    tables = {
        "spacecraft": {
            "ship": {"model": {"sphere": {"radius_m": 0.1, "material": {"reflectance": 0.5}}},
                     "orbit": {"altitude_km": 400.0}},
        },
    }  # fmt: skip
    moving = sky_scene(
        {"on": "ship", "position_body_m": [0, 0, -1], "boresight": [0, 0, -1],
         "position_icrf_m": None, "focal_length_mm": 100.0, "up": [1, 0, 0]}, **tables,
    )  # fmt: skip
    state = moving.at(moving.epoch_tai_ns)
    camera = state.cameras["cam"]
    speed = np.linalg.norm(camera.velocity)
    np.testing.assert_allclose(speed, 7668.6, atol=1.0)
    star = camera.R_camera_from_icrf[2]
    image = picture(gl, moving, lone_stars(state, [star], E))[..., 1]
    rows = (image.sum(axis=1) * (np.arange(96) + 0.5)).sum() / image.sum()
    # Upwards in the picture, where the velocity points.
    shift = (48.0 - rows) / camera.camera.focal_length_px
    np.testing.assert_allclose(shift, speed / 299792458.0, rtol=2e-3)


def orbiting(boresight: list[float]) -> dict[str, object]:
    """A camera at 400 km over a sphere."""
    return {"position_icrf_m": [6.771e6, 0, 0], "boresight": boresight, "up": [1, 0, 0]}


SPHERE = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.0}


def test_the_earth_hides_stars_to_the_pixel(gl: moderngl.Context) -> None:
    """A column of stars across the limb, one every 4 pixels, over a black Earth."""
    limb = np.arcsin(6371.0 / 6771.0)
    boresight = [-np.cos(limb), np.sin(limb), 0.0]
    scenario = sky_scene(orbiting(boresight), earth=SPHERE)
    state = scenario.at(scenario.epoch_tai_ns)
    camera = state.cameras["cam"]
    rows = np.arange(8, 90, 4) + 0.5
    stars = [
        direction_of_pixel(camera.camera, camera.R_camera_from_icrf, 64.5, float(y)) for y in rows
    ]
    state = lone_stars(state, stars, E)
    image = picture(gl, scenario, state)
    # The limb runs through the middle of the picture, row 48; a star's light reaches 1.5 pixels.
    for y, seen in zip(rows, stars_in_view(state, "cam"), strict=True):
        band = image[int(y) - 1 : int(y) + 2, 60:69, 1]
        share = band.sum() / camera.camera.focal_length_px**2 / E
        assert (seen.hidden_by == "earth") == (y > 48.0)
        if y < 46.0:
            np.testing.assert_allclose(share, 1.0, rtol=1e-3)
        elif y > 50.0:
            assert share == 0.0
    np.testing.assert_array_equal(image[50:], 0.0)


def test_the_sun_and_the_moon_hide_stars(gl: moderngl.Context) -> None:
    scenario = sky_scene({"boresight": [0, 1, 0], "focal_length_mm": 20.0})
    state = scenario.at(scenario.epoch_tai_ns)
    moon = state.moon
    assert moon is not None
    sun = state.sun.seen_from(np.zeros(3)).direction_icrf
    for name, place in (("moon", moon / np.linalg.norm(moon)), ("sun", sun)):
        looking = turned(state, place, np.array([0.0, 0.0, 1.0]))
        camera = looking.cameras["cam"]
        # Radii of 0.26 deg are 24 pixels.
        behind, beside = (
            direction_of_pixel(camera.camera, camera.R_camera_from_icrf, 64.5 + dx, 48.5)
            for dx in (5.0, 40.0)
        )
        starry = lone_stars(looking, [behind, beside], 1.0)
        assert [s.hidden_by for s in stars_in_view(starry, "cam")] == [name, None]
        bare = picture(gl, scenario, lone_stars(looking, [beside], 1.0))
        np.testing.assert_array_equal(picture(gl, scenario, starry), bare)


def test_the_sky_that_lights_a_spacecraft_holds_the_mean_of_its_stars() -> None:
    ball = {"sphere": {"radius_m": 1.0, "material": {"reflectance": 0.5}}}
    scenario = sky_scene(
        {"position_icrf_m": [7.1e6, 0, 0], "boresight": [0, 1, 0]},
        spacecraft={"ball": {"model": ball, "position_icrf_m": [7.0e6, 0, 0]}},
        earth={"shape": "wgs84"},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    assert background(state, state.cameras["cam"]).celestial is not None
    sky = sky_view(state, "ball", state.bodies["ball"])
    assert sky is not None
    for face in sky.faces:
        assert face.celestial is not None
        assert face.celestial.stars is None
        assert state.stars is not None
        np.testing.assert_array_equal(
            face.celestial.radiance, state.stars.mean_radiance(state.bands)
        )
    dark = sky_view(replace(state, stars=None), "ball", state.bodies["ball"])
    assert dark is not None
    assert all(face.celestial is None for face in dark.faces)


def test_a_camera_that_sees_nothing_but_the_earth_draws_no_heavens() -> None:
    scenario = sky_scene(
        {"position_icrf_m": [6.8e6, 0, 0], "boresight": [-1, 0, 0]}, earth={"shape": "wgs84"}
    )
    state = scenario.at(scenario.epoch_tai_ns)
    assert background(state, state.cameras["cam"]).celestial is None


@pytest.mark.parametrize(
    "distortion", [{"k1": -0.28, "k2": 0.07, "p1": 0.0015, "p2": -0.001}, {"k1": 0.12}]
)
def test_a_star_keeps_its_light_and_its_place_wherever_a_distorting_lens_shows_it(
    gl: moderngl.Context, distortion: dict[str, float]
) -> None:
    camera = {
        "width_px": 160,
        "height_px": 120,
        "pixel_pitch_um": 10.0,
        "focal_length_mm": 1.2,
        "boresight": [0, 1, 0],
        "optics": {"distortion": distortion},
    }
    scenario = sky_scene(camera)
    state = scenario.at(scenario.epoch_tai_ns)
    seat = state.cameras["cam"]
    lens, f = seat.camera, seat.camera.focal_length_px
    assert isinstance(lens.lens.distortion, Distortion)
    (seen,) = pinhole_fields(lens)
    solid_angle = seen.solid_angle / (f * f)
    columns, rows = np.meshgrid([10, 45, 80, 115, 149], [10, 60, 109])
    corners = np.stack([columns.ravel(), rows.ravel()], axis=-1)
    shifts = np.random.default_rng(3).uniform(0.0, 1.0, (8, len(corners), 2))
    errors = []
    with Simulator(scenario, gl) as simulator:
        for shift in shifts:
            tangent = (corners + shift - [80.0, 60.0]) / f
            ray = np.ones((len(corners), 3))
            ray[:, :2] = lens.lens.distortion.undistorted(tangent)
            ray /= np.linalg.norm(ray, axis=1, keepdims=True)
            stars = lone_stars(state, list(ray @ seat.R_camera_from_icrf), 1.0)
            light = taken(simulator, stars)[..., 0] * solid_angle
            for x, y, place in zip(*corners.T, corners + shift, strict=True):
                near = light[y - 5 : y + 6, x - 5 : x + 6]
                # Solid angles at the middles of pixels stand for all of them: 2e-4.
                assert near.sum() == pytest.approx(1.0, abs=1e-3), (x, y)
                across, down = near.sum(axis=0), near.sum(axis=1)
                steps = np.arange(-5, 6) + 0.5
                middle = np.array([across @ (x + steps), down @ (y + steps)]) / near.sum()
                errors.append(middle - place)
    # Displacements of up to 0.03 px are taken off; they change by a tenth over themselves.
    off = np.linalg.norm(errors, axis=1)
    assert off.max() < 0.005


@pytest.mark.parametrize(
    "lens",
    [
        {"distortion": {"k1": -0.28, "k2": 0.07}},
        {"distortion": {"k1": 0.12}},
        {"distortion": {"model": "fisheye", "k1": -0.02}},
    ],
)
def test_stars_are_listed_where_a_distorting_lens_shows_them(lens: dict[str, object]) -> None:
    """All that its image holds, also those that a pinhole would not show."""
    camera = {"focal_length_mm": 1.0, "boresight": towards(83.8, -1.0).tolist(), "optics": lens}
    scenario = sky_scene(camera, sky={"faintest_star_mag": 4.0})
    state = scenario.at(scenario.epoch_tai_ns)
    seat = state.cameras["cam"]
    d = seat.camera.detector
    listed = {star.hip: star for star in stars_in_view(state, "cam") if star.hip is not None}
    for star in listed.values():
        place = seat.camera.project(seat.R_camera_from_icrf @ star.direction_icrf)
        np.testing.assert_allclose(star.pixel, place, atol=1e-9)
    # A catalogue's own directions are up to an arc minute off, 0.1 px here: inside by a pixel.
    assert state.stars is not None
    catalogue = state.stars.catalogue
    places = seat.camera.project(catalogue.direction @ seat.R_camera_from_icrf.T)
    inside = np.all((places > 1.0) & (places < np.array([d.width, d.height]) - 1.0), axis=1)
    assert set(catalogue.hip[inside].tolist()) <= set(listed)
