"""Where things fall in the picture: area means, depth, and independence of the origin."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, Array32
from simgl.physics.frames import Pose
from simgl.scenario.scenario import Scenario
from simgl.scene.earth import Earth
from simgl.scene.state import (
    BodyState,
    CameraState,
    EarthState,
    SceneState,
    SunAtPosition,
    SunInDirection,
)
from simgl.simulator import Product, Simulator
from simgl.view.frame_view import frame_view
from tests.scenes import capture, lambert, radiance, scene

PLATE = {"plate": {"width_m": 1.0, "height_m": 0.8, "material": lambert(0.5)}}


def centroid(image: Array32) -> Array:
    """(2,) x and y in pixels."""
    weight = image.sum(axis=2, dtype=np.float64)
    y, x = np.mgrid[0 : weight.shape[0], 0 : weight.shape[1]] + 0.5
    return [(weight * x).sum(), (weight * y).sum()] / weight.sum()


@pytest.mark.parametrize("model", ["plate", "space_rider"])
def test_a_target_moved_by_a_tenth_of_a_pixel_moves_its_centroid_by_that(
    gl: moderngl.Context, model: str
) -> None:
    """Edges along rows and columns are the hardest case: samples of a row may cross together.

    The mean over four places across the motion, a quarter of a pixel apart: five samples a pixel
    leave each image noise of its own, which is half as large in their mean.
    """
    shape = PLATE if model == "plate" else model
    distance = 50.0 if model == "plate" else 300.0
    base = scene(
        {"target": {"model": shape, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, distance], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        sun_direction=(0.3, 0.2, 0.93),
    )
    pixel = distance / base.cameras["cam"].focal_length_px
    state = base.at(base.epoch_tai_ns)
    places = []
    with Simulator(base, gl) as simulator:
        for step in range(11):
            body = state.bodies["target"]
            along = []
            for across in 0.25 * np.arange(4):
                place = pixel * np.array([0.1 * step, across, 0.0])
                moved = replace(body.pose, position=place)
                shifted = replace(state, bodies={"target": BodyState(model=body.model, pose=moved)})
                frame = simulator.capture(shifted, "cam", {Product.RADIANCE}).radiance
                assert frame is not None
                along.append(centroid(frame.radiance))
            places.append(np.mean(along, axis=0))
    # Camera x is -(ICRF x): boresight -z, up +y gives right = -z cross y = +x.
    steps = np.diff(np.array(places)[:, 0])
    # A single image: 0.03 px. Half of that for the mean of four.
    np.testing.assert_allclose(steps, 0.1, atol=0.015)
    np.testing.assert_allclose(np.diff(np.array(places)[:, 1]), 0.0, atol=0.015)


def test_a_plate_covers_the_pixels_of_its_projected_area(gl: moderngl.Context) -> None:
    """Sum of the pixels = radiance x area in pixels, whatever the sub-pixel position."""
    for offset in (0.0, 0.0123, 0.0371):
        scenario = scene(
            {"p": {"model": PLATE, "position_icrf_m": [offset, 2 * offset, 0]}},
            {"position_icrf_m": [0, 0, 50], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        )
        image = radiance(gl, scenario)
        f = scenario.cameras["cam"].focal_length_px
        area = (1.0 * f / 50.0) * (0.8 * f / 50.0)
        covered = image[..., 0].sum(dtype=np.float64) / image[..., 0].max()
        # 250 edge pixels, each uncertain by a sample's share, add up at random: 0.02 px of a width.
        np.testing.assert_allclose(covered, area, rtol=2.0 * 0.02 / (0.8 * f / 50.0))


def _everything(scenario: Scenario, shift: Array, turn: Array) -> SceneState:
    """The scene with every place moved and every direction turned, Sun and Earth included."""
    state = scenario.at(scenario.epoch_tai_ns)
    sun, earth = state.sun, state.earth
    assert isinstance(sun, SunInDirection)
    assert earth is None
    bodies = {
        name: BodyState(
            model=body.model,
            pose=Pose(
                position=turn @ body.pose.position + shift,
                velocity=turn @ body.pose.velocity,
                R_icrf_from_body=turn @ body.pose.R_icrf_from_body,
            ),
        )
        for name, body in state.bodies.items()
    }
    cameras = {
        name: CameraState(
            camera=camera.camera,
            position=turn @ camera.position + shift,
            R_camera_from_icrf=camera.R_camera_from_icrf @ turn.T,
        )
        for name, camera in state.cameras.items()
    }
    # An Earth and a Sun at a finite distance go along.
    centre = np.array([0.0, 6.9e6, 0.0])
    return SceneState(
        tai_ns=state.tai_ns,
        sun=SunAtPosition(
            position=turn @ (1.496e11 * sun.direction_icrf) + shift,
            light_at_1_au=sun.light,
            radius=6.957e8,
        ),
        earth=EarthState(
            earth=Earth(albedo=(0.3, 0.3, 0.3, 0.3)),
            position=turn @ centre + shift,
            R_itrf_from_icrf=turn.T,
        ),
        moon=turn @ np.array([2.0e8, 3.0e8, 1.0e8]) + shift,
        bodies=bodies,
        cameras=cameras,
    )


@pytest.mark.parametrize(
    ("shift_km", "turn_deg"), [((7000.0, 0.0, 0.0), 0.0), ((-3000.0, 5000.0, 4000.0), 73.0)]
)
def test_shifting_and_turning_the_whole_scene_changes_no_pixel(
    gl: moderngl.Context, shift_km: tuple[float, float, float], turn_deg: float
) -> None:
    scenario = scene(
        {"target": {"model": "space_rider", "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [-60.0, 13.0, -21.0],
            "look_at": "target",
            "width_px": 200,
            "height_px": 200,
            "focal_length_mm": 8.0,
        },
        sun_direction=(-0.8, -0.3, -0.5),
    )
    turn = Rotation.from_rotvec(np.radians(turn_deg) * np.array([0.36, 0.48, 0.8])).as_matrix()
    images = []
    with Simulator(scenario, gl) as simulator:
        for state in (
            _everything(scenario, np.zeros(3), np.eye(3)),
            _everything(scenario, 1e3 * np.array(shift_km), turn),
        ):
            frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
            assert frame is not None
            images.append(frame.radiance.astype(np.float64))
    assert images[0].max() > 10.0
    np.testing.assert_allclose(images[1], images[0], rtol=1e-5, atol=1e-5)


def test_facets_one_millimetre_apart_stay_apart_at_100_m(gl: moderngl.Context) -> None:
    """A bright plate 1 mm in front of a dark one, beside something 0.3 m from the lens."""
    bright = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(0.9)}}
    dark = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(0.1)}}
    near = {"box": {"size_m": [0.02, 0.02, 0.02], "material": lambert(0.5)}}
    scenario = scene(
        {
            "dark": {"model": dark, "position_icrf_m": [0, 0, -0.001]},
            "bright": {"model": bright, "position_icrf_m": [0, 0, 0]},
            "near": {"model": near, "position_icrf_m": [0.012, 0, 99.7]},
            "far": {"model": bright, "position_icrf_m": [0, 0, -49_900]},
        },
        {"position_icrf_m": [0, 0, 100], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        sun_direction=(0.1, 0.0, 0.995),
    )
    exposure = capture(gl, scenario)
    assert exposure.radiance is not None
    assert exposure.truth is not None
    names = {exposure.truth.part_names[i] for i in np.unique(exposure.truth.part_id) if i}
    assert names == {"bright/bright", "near/near"}
    lit = exposure.radiance.radiance[..., 1]
    plate = exposure.truth.part_id == [
        i for i, n in exposure.truth.part_names.items() if n.startswith("bright")
    ]
    inner = plate & np.roll(plate, 1, 0) & np.roll(plate, -1, 0)
    inner &= np.roll(plate, 1, 1) & np.roll(plate, -1, 1)
    assert inner.sum() > 500
    # 0.9 / pi x 174.77 W m-2 x cosine, untouched by the plate behind.
    cosine = 0.995 / np.hypot(0.1, 0.995)
    np.testing.assert_allclose(lit[inner], 0.9 / np.pi * 174.7738 * cosine, rtol=1e-5)
    np.testing.assert_allclose(exposure.truth.depth[plate], 100.0, rtol=1e-6)


def test_something_at_half_a_metre_and_at_50_km_share_a_frame(gl: moderngl.Context) -> None:
    """A 200 m sphere 50 km away is 14 pixels wide; its flux is right beside a box at 0.3 m."""
    ball = {"sphere": {"radius_m": 100.0, "material": lambert(0.5)}}
    box = {"box": {"size_m": [0.002, 0.002, 0.002], "material": lambert(0.5)}}
    only = {"ball": {"model": ball, "position_icrf_m": [0, 0, -50_000]}}
    both = {**only, "box": {"model": box, "position_icrf_m": [0.004, 0.0, -0.3]}}
    camera = {"position_icrf_m": [0, 0, 0], "boresight": [0, 0, -1], "up": [0, 1, 0]}
    alone = radiance(gl, scene(only, camera))[..., 1]
    together = radiance(gl, scene(both, camera))[..., 1]
    np.testing.assert_allclose(together[:, :96], alone[:, :96], rtol=1e-6)
    assert together[64, 110] > 1.0
    assert np.count_nonzero(alone) > 100


def test_the_sun_in_the_frame_is_finite_and_has_its_radiance(gl: moderngl.Context) -> None:
    scenario = scene(
        {"ball": {"model": PLATE, "position_icrf_m": [0, 0, -30.0]}},
        {"position_icrf_m": [0, 0, 0], "boresight": [0, 0, 1], "up": [0, 1, 0]},
    )
    exposure = capture(gl, scenario)
    assert exposure.radiance is not None
    assert exposure.digital is not None
    assert exposure.electrons is not None
    image = exposure.radiance.radiance.astype(np.float64)
    assert np.all(np.isfinite(image))
    assert np.all(np.isfinite(exposure.electrons.electrons))
    # E / (pi sin^2 0.263 deg), per band; the sum over the disc's solid angle gives back E.
    solid_angle = np.pi * np.sin(np.radians(0.263)) ** 2
    np.testing.assert_allclose(image[64, 64, 1], 174.7738123 / solid_angle, rtol=1e-5)
    f = scenario.cameras["cam"].focal_length_px
    # The disc is 32 px wide; a linear ramp over its edge is good to 1e-3 of the area.
    np.testing.assert_allclose(image[..., 1].sum() / f**2, 174.7738123, rtol=2e-3)
    # Full well 24500 e- at 6.078 e- per DN over a pedestal of 64, with 4 e- of read noise.
    assert abs(int(exposure.digital.dn[64, 64]) - 4094) <= 4


def test_a_craft_beside_the_camera_costs_and_shows_nothing(gl: moderngl.Context) -> None:
    """A box across the camera's plane, out of its field: no tile is drawn for it."""
    box = {"box": {"size_m": [1.0, 1.0, 4.0], "material": lambert(0.5)}}
    scenario = scene(
        {"beside": {"model": box, "position_icrf_m": [1.2, 0.0, 0.0]}},
        {"position_icrf_m": [0, 0, 0], "boresight": [0, 0, -1], "up": [0, 1, 0]},
    )
    view = frame_view(scenario.at(scenario.epoch_tai_ns), "cam", sample_budget=1000)
    assert view.tiles == ()
    assert radiance(gl, scenario).max() == 0.0


def test_a_craft_that_reaches_past_the_camera_is_drawn_where_it_is_seen(
    gl: moderngl.Context,
) -> None:
    """A long beam from behind the camera runs towards the middle of the picture."""
    beam = {"box": {"size_m": [0.02, 0.02, 20.0], "material": lambert(0.5)}}
    scenario = scene(
        {"beam": {"model": beam, "position_icrf_m": [0.1, 0.0, -5.0]}},
        {"position_icrf_m": [0, 0, 0], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        sun_direction=(-0.8, 0.0, 0.6),
    )
    view = frame_view(scenario.at(scenario.epoch_tai_ns), "cam", sample_budget=1000)
    (tile,) = view.tiles
    # Its far end, 15 m away and 0.09 m to the right, stands 20.8 px off the middle.
    assert tile.x == 84
    assert tile.x + tile.width == 128
    image = radiance(gl, scenario)[..., 1]
    assert image[64, 120] > 1.0
    assert image[64, :80].max() == 0.0


@pytest.mark.parametrize("diameter_px", [0.1, 0.3, 1.0, 4.0])
def test_a_craft_of_a_fraction_of_a_pixel_has_the_right_flux(
    gl: moderngl.Context, diameter_px: float
) -> None:
    """A full Lambert sphere sends 2/3 rho E R^2 / d^2 to the camera, however small it looks."""
    ball = {"sphere": {"radius_m": 0.5, "material": lambert(0.5)}}
    scenario = scene(
        {"ball": {"model": ball, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 3466.67 / diameter_px], "boresight": [0.0021, 0.0013, -1]},
    )
    f = scenario.cameras["cam"].focal_length_px
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    expected = 2.0 / 3.0 * 0.5 * 174.7738123 * (0.5 / (3466.67 / diameter_px)) ** 2
    # At 0.1 px the ball holds some 100 samples: a few per cent; more from 0.3 px on.
    np.testing.assert_allclose(
        image.sum() / f**2, expected, rtol=0.03 if diameter_px < 0.2 else 0.01
    )


def test_more_samples_than_a_texture_holds_are_drawn_in_parts_without_seams(
    gl: moderngl.Context,
) -> None:
    """A raster of 22,000 x 5,200 samples, on a plate that fills the picture."""
    scenario = scene(
        {"target": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, 1],
            "boresight": [0, 0, -1],
            "up": [0, 1, 0],
            "width_px": 1400,
            "height_px": 2,
        },
        render={"samples_per_pixel": 256},
    )
    green = radiance(gl, scenario)[..., 1]
    # The float32 sum of 256 equal samples: 1e-6.
    np.testing.assert_allclose(green, green[1, 700], rtol=3e-6)
