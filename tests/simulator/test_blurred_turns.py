"""What turns within an exposure, against the mean of images of many instants of it."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.frames import rotation_about, unit
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from simgl.view.exposure_parts import moving_scene
from tests.scenes import Table, lambert, scene
from tests.simulator.blurred_scenes import CAMERA, EXPOSURE, before, moving
from tests.simulator.moving_scenes import BOX, FOCAL, RANGE, Motion, electrons

Axis = tuple[float, float, float]


def turning(one: Scenario, angle_deg: float, axis: Axis, *, camera: bool = False) -> Motion:
    """The craft, or the camera, turns by an angle while a row is exposed."""
    rest = one.at(one.epoch_tai_ns)
    body, look, about = rest.bodies["craft"], rest.cameras["cam"], unit(axis)

    def at(tai_ns: int) -> SceneState:
        share = (tai_ns - one.epoch_tai_ns) * 1e-9 / EXPOSURE
        R = rotation_about(about, np.radians(angle_deg) * share)
        if camera:
            turned = replace(look, R_camera_from_icrf=R @ look.R_camera_from_icrf)
            return replace(rest, tai_ns=tai_ns, cameras={"cam": turned})
        pose = replace(body.pose, R_icrf_from_body=R @ body.pose.R_icrf_from_body)
        bodies = {**rest.bodies, "craft": replace(body, pose=pose)}
        return replace(rest, tai_ns=tai_ns, bodies=bodies)

    return at


def instants(simulator: Simulator, one: Scenario, during: Motion, count: int) -> Array:
    """Mean of still images of so many instants of the exposure."""
    shares = (np.arange(count) + 0.5) / count - 0.5
    times = one.epoch_tai_ns + np.round(1e9 * EXPOSURE * shares).astype(int)
    return np.asarray(
        np.mean([electrons(simulator, during(time), None) for time in times.tolist()], axis=0)
    )


def drawn(gl: moderngl.Context, one: Scenario, during: Motion, count: int) -> tuple[Array, Array]:
    with Simulator(one, gl) as simulator:
        image = electrons(simulator, during(one.epoch_tai_ns), during)
        return image, instants(simulator, one, during, count)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def misplaced(image: Array, wanted: Array) -> float:
    """Of the middles of rows and columns that are full for most of the exposure, rms [px]."""
    errors = []
    for a, b in ((image, wanted), (image.T, wanted.T)):
        full = b.sum(axis=1) > 0.8 * b.sum(axis=1).max()
        x = np.arange(a.shape[1]) + 0.5
        errors.append(a[full] @ x / a[full].sum(axis=1) - b[full] @ x / b[full].sum(axis=1))
    return rms(np.concatenate(errors))


BORESIGHT, UPRIGHT, OBLIQUE = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.6, 0.5, 0.4)


@pytest.mark.parametrize(
    ("angle_deg", "axis"),
    [(10.0, BORESIGHT), (10.0, UPRIGHT), (10.0, OBLIQUE), (30.0, OBLIQUE), (360.0, OBLIQUE)],
)
def test_a_body_that_turns_is_where_it_is_on_average(
    gl: moderngl.Context, angle_deg: float, axis: Axis
) -> None:
    """Corners 59 px out; a depth of 20 px; faces come into view and go."""
    one = before({}, {"craft": BOX})
    image, wanted = drawn(gl, one, turning(one, angle_deg, axis), max(32, int(angle_deg)))
    assert misplaced(image, wanted) < 0.02
    # Edges along the motion get 0.2 px^2 wider in each further step of a way.
    assert rms(image - wanted) < 0.007 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_a_camera_that_rolls_sees_what_is_far_out_go_far(gl: moderngl.Context) -> None:
    """By 30 deg: the box's middle, 57 px from the image's, goes 30 px."""
    one = before({"width_px": 256, "height_px": 256}, {"craft": BOX})
    rest = one.at(one.epoch_tai_ns)
    aside = RANGE / FOCAL * 40.0 * (rest.cameras["cam"].R_camera_from_icrf[:2].sum(axis=0))
    rolls = turning(one, 30.0, BORESIGHT, camera=True)

    def during(tai_ns: int) -> SceneState:
        state = rolls(tai_ns)
        body = state.bodies["craft"]
        pose = replace(body.pose, position=body.pose.position + aside)
        return replace(state, bodies={"craft": replace(body, pose=pose)})

    image, wanted = drawn(gl, one, during, 64)
    assert misplaced(image, wanted) < 0.02
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def panel(roughness: float, angle_to_sun_deg: float) -> Scenario:
    metal = {"reflectance": [0.5] * 4, "roughness": roughness, "metallic": 1.0}
    model: Table = {"box": {"size_m": [2.2, 2.6, 0.05], "material": metal}}
    angle = np.radians(angle_to_sun_deg)
    return scene(
        {"craft": {"model": model, "position_icrf_m": [0, 0, 0]}},
        CAMERA,
        sun_direction=(float(np.sin(angle)), 0.0, float(np.cos(angle))),
    )


@pytest.mark.parametrize("roughness", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("angle_deg", [10.0, 30.0])
def test_a_panel_that_flashes_up_keeps_its_light(
    gl: moderngl.Context, roughness: float, angle_deg: float
) -> None:
    """A mirror of the Sun 2.5 deg off the middle of the turn: for 1 to 10 deg of it, where at the
    light of the middle it would have half as much too much."""
    one = panel(roughness, 5.0)
    image, wanted = drawn(gl, one, turning(one, angle_deg, UPRIGHT), 200)
    # Steps of a third of a lobe.
    assert image.sum() == pytest.approx(wanted.sum(), rel=0.01)


def test_a_panel_flashes_up_where_it_is_at_that_time(gl: moderngl.Context) -> None:
    """It turns by 20 deg and goes 40 px; 2.5 deg from the middle of the turn it is a mirror of the
    Sun, for about a degree, 2 px. Two snapshots do, each in four lights; in one light each, the
    flash would be in the middle of the second, 5 px off."""
    one = panel(0.1, 5.0)
    turns, goes = turning(one, 20.0, UPRIGHT), moving(one, 40.0)

    def during(tai_ns: int) -> SceneState:
        state = turns(tai_ns)
        body, place = state.bodies["craft"], goes(tai_ns).bodies["craft"].pose.position
        moved = replace(body, pose=replace(body.pose, position=place))
        return replace(state, bodies={"craft": moved})

    scene_of_it = moving_scene(one.at(one.epoch_tai_ns), "cam", during)
    assert scene_of_it is not None
    assert (scene_of_it.count, scene_of_it.light_parts) == (2, 4)
    image, wanted = drawn(gl, one, during, 200)
    x = np.arange(128) + 0.5
    middle, right = (seen.sum(axis=0) @ x / seen.sum() for seen in (image, wanted))
    assert abs(right - 64.0) > 4.0
    assert middle == pytest.approx(right, abs=0.5)
    assert image.sum() == pytest.approx(wanted.sum(), rel=0.01)


def test_shadows_that_turn_keep_their_light(gl: moderngl.Context) -> None:
    """A small box 2 m before a large one, lit from the side, turn together by 12 deg."""
    small = {"box": {"size_m": [0.6, 0.6, 0.3], "material": lambert(0.5)}}
    one = before({}, {"craft": small, "behind": BOX})
    rest = one.at(one.epoch_tai_ns)

    def during(tai_ns: int) -> SceneState:
        share = (tai_ns - one.epoch_tai_ns) * 1e-9 / EXPOSURE
        R = rotation_about(unit(UPRIGHT), np.radians(12.0) * share)
        bodies = {
            name: replace(
                body,
                pose=replace(
                    body.pose,
                    position=R @ body.pose.position,
                    R_icrf_from_body=R @ body.pose.R_icrf_from_body,
                ),
            )
            for name, body in rest.bodies.items()
        }
        return replace(rest, tai_ns=tai_ns, bodies=bodies)

    image, wanted = drawn(gl, one, during, 48)
    assert image.sum() == pytest.approx(wanted.sum(), rel=2e-3)
    assert rms(image - wanted) < 0.01 * wanted.max()


def test_rows_blur_what_turns_as_images_of_their_times_do(gl: moderngl.Context) -> None:
    """15 deg within the exposure, 4 deg from the first row to the last."""
    row_time = EXPOSURE * 4.0 / 15.0 / 127.0
    one = before({"shutter": "rolling", "row_time_us": 1e6 * row_time}, {"craft": BOX})
    during = turning(one, 15.0, OBLIQUE)
    x = np.arange(128) + 0.5
    errors = []
    with Simulator(one, gl) as simulator:
        image = electrons(simulator, during(one.epoch_tai_ns), during)
        for row in range(30, 100, 17):
            late = round(1e9 * (row - 63.5) * row_time)

            def at(tai_ns: int, late: int = late) -> SceneState:
                return replace(during(tai_ns + late), tai_ns=tai_ns)

            wanted = instants(simulator, one, at, 24)[row]
            errors.append(image[row] @ x / image[row].sum() - wanted @ x / wanted.sum())
            assert image[row].sum() == pytest.approx(wanted.sum(), rel=2e-3)
    # As of rows that are not blurred.
    assert rms(np.array(errors)) < 0.02


def test_a_small_body_that_turns_has_no_noise(gl: moderngl.Context) -> None:
    """10 px wide: it moves by less than a pixel, so that no sweep evens out the light of points of
    different times."""
    model: Table = {"box": {"size_m": [0.3, 0.3, 0.3], "material": lambert(0.5)}}
    one = before({}, {"craft": model})
    assert 0.3 / RANGE * FOCAL < 11.0
    image, wanted = drawn(gl, one, turning(one, 10.0, OBLIQUE), 32)
    assert rms(image - wanted) < 0.001 * wanted.max()
