"""Motion blur: snapshots swept along their ways, against images of many instants and by hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.frames import rotation_about
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from simgl.view.exposure_parts import moving_scene
from tests.scenes import lambert, scene
from tests.simulator.blurred_scenes import CAMERA, EXPOSURE, before, box, moving
from tests.simulator.moving_scenes import BOX, FOCAL, RANGE, Motion, electrons


def turning_camera(one: Scenario, axis: Array, angle: float, during_s: float = EXPOSURE) -> Motion:
    rest = one.at(one.epoch_tai_ns)
    look = rest.cameras["cam"]

    def at(tai_ns: int) -> SceneState:
        R = rotation_about(axis, angle * (tai_ns - one.epoch_tai_ns) * 1e-9 / during_s)
        turned = replace(look, R_camera_from_icrf=R @ look.R_camera_from_icrf)
        return replace(rest, tai_ns=tai_ns, cameras={"cam": turned})

    return at


def by_instants(simulator: Simulator, one: Scenario, during: Motion, count: int) -> Array:
    """Mean of images of the scene as it stands at so many instants of the exposure."""
    shares = (np.arange(count) + 0.5) / count - 0.5
    times = one.epoch_tai_ns + np.round(1e9 * EXPOSURE * shares).astype(int)
    images = [electrons(simulator, during(time), None) for time in times.tolist()]
    return np.asarray(np.mean(images, axis=0))


def drawn(gl: moderngl.Context, one: Scenario, during: Motion, count: int) -> tuple[Array, Array]:
    """The image, and that of so many instants."""
    with Simulator(one, gl) as simulator:
        image = electrons(simulator, during(one.epoch_tai_ns), during)
        return image, by_instants(simulator, one, during, count)


def profile(image: Array) -> tuple[float, float]:
    """Middle and variance of the box's right edge along x, over rows through its middle [px]."""
    rows = image[54:74].mean(axis=0)
    x = np.arange(len(rows)) + 0.5
    rise = -np.diff(rows)[len(rows) // 2 :]
    edge = x[len(rows) // 2 : -1] + 0.5
    middle = float(rise @ edge / rise.sum())
    return middle, float(rise @ (edge - middle) ** 2 / rise.sum())


@pytest.mark.parametrize("ways", [(0.7, 0.0), (1.5, 0.4), (3.0, 0.0), (8.0, 2.0), (60.0, 12.0)])
def test_an_edge_becomes_a_ramp_as_wide_as_its_motion(
    gl: moderngl.Context, ways: tuple[float, float]
) -> None:
    right, down = ways
    one = box(width_px=200)
    with Simulator(one, gl) as simulator:
        during = moving(one, right, down)
        still = electrons(simulator, during(one.epoch_tai_ns), None)
        image = electrons(simulator, during(one.epoch_tai_ns), during)
    assert image.sum() == pytest.approx(still.sum(), rel=1e-3)
    (middle, width), (still_middle, still_width) = profile(image), profile(still)
    assert middle == pytest.approx(still_middle, abs=0.02)
    # The front, 0.3 m nearer than the middle, moves farther by so much. Of two steps, places
    # between pixels add up to a quarter of a square pixel each.
    way = right / (1.0 - 0.3 / RANGE)
    assert width - still_width == pytest.approx(way**2 / 12.0, abs=0.01 if right < 8.9 else 0.3)
    if right > 30.0:
        inside = (np.abs(np.arange(100) + 0.5 - (middle - 100.0)) < 0.5 * right - 3.0).nonzero()[0]
        steps = -np.diff(image[54:74].mean(axis=0)[100:])[inside[:-1]]
        # Where parts of a long way meet between pixels, these get up to a tenth more or less.
        assert steps.std() < 0.04 * steps.mean()


@pytest.mark.parametrize(("right", "more"), [(0.0, 4.0), (20.0, 10.0)])
def test_what_accelerates_is_longest_where_it_is_slow(
    gl: moderngl.Context, right: float, more: float
) -> None:
    """The mean of 4 more t^2 over an exposure from -1/2 to 1/2 is a third of more."""
    one = box(width_px=200)
    with Simulator(one, gl) as simulator:
        during = moving(one, right, more=more)
        still = electrons(simulator, during(one.epoch_tai_ns), None)
        image = electrons(simulator, during(one.epoch_tai_ns), during)
    x = np.arange(200) + 0.5
    middles = [one @ x / one.sum(axis=1) for one in (image[54:74], still[54:74])]
    # As of edges that move evenly.
    assert np.mean(middles[0] - middles[1]) == pytest.approx(more / 3.0, abs=0.02)


@pytest.mark.parametrize(("right", "more"), [(0.0, 60.0), (60.0, 40.0), (90.0, 120.0)])
def test_long_ways_that_accelerate_show_every_instant(
    gl: moderngl.Context, right: float, more: float
) -> None:
    """They turn back on their way: its parts meet where they should, and none counts twice."""
    one = box(width_px=480)
    count = 160
    image, wanted = drawn(gl, one, moving(one, right, from_x=-0.5 * more, more=more), count)
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)
    x = np.arange(480) + 0.5
    middles = [one[54:74] @ x / one[54:74].sum(axis=1) for one in (image, wanted)]
    # Where it is slowest, as many instants leave a 24th of the way of one of them squared.
    assert np.mean(middles[0] - middles[1]) == pytest.approx(0.0, abs=0.02)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.003 * wanted.max()


def test_a_point_becomes_an_even_streak(gl: moderngl.Context) -> None:
    """A ball of 0.7 px along 24 px, off the axes of the image and the middles of pixels."""
    ball = {"sphere": {"radius_m": 0.01, "material": lambert(0.5)}}
    one = scene({"craft": {"model": ball, "position_icrf_m": [0, 0, 0]}}, CAMERA)
    with Simulator(one, gl) as simulator:
        during = moving(one, 24.0, 9.0, from_x=0.3)
        still = electrons(simulator, during(one.epoch_tai_ns), None)
        image = electrons(simulator, during(one.epoch_tai_ns), during)
    assert image.sum() == pytest.approx(still.sum(), rel=1e-3)
    columns = image.sum(axis=0)
    inside = columns[54:74]
    # Parts of the way meet between pixels.
    assert inside.std() < 0.04 * inside.mean()
    assert columns[:50].sum() + columns[78:].sum() < 1e-3 * columns.sum()
    # Lit from the camera, its light lies about its middle; a still image has it in one pixel.
    x = np.arange(128) + 0.5
    assert x @ columns / columns.sum() == pytest.approx(64.3, abs=0.02)
    rows = x @ image[:, 54:74] / inside
    line = 64.0 + (x[54:74] - 64.3) * 9.0 / 24.0
    assert np.mean(rows - line) == pytest.approx(0.0, abs=0.02)


def test_a_turn_about_the_boresight_sweeps_arcs(gl: moderngl.Context) -> None:
    """By 0.3 rad: the corners of the box, 59 px out, go 18 px."""
    one = box()
    image, wanted = drawn(gl, one, turning_camera(one, np.array([0.0, 0.0, 1.0]), 0.3), 24)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.01 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_what_comes_nearer_grows(gl: moderngl.Context) -> None:
    """By a tenth of its range: the light of a sphere around the camera grows by as much in the
    middle of the exposure as the mean of the squares says."""
    one = box()
    image, wanted = drawn(gl, one, moving(one, nearer=0.1), 16)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.005 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_what_is_out_of_the_image_comes_into_it(gl: moderngl.Context) -> None:
    """The box is just beyond the image in the middle of the exposure."""
    one = box()
    # It is 75 px wide, and its left edge 3 px beyond the image's right one.
    image, wanted = drawn(gl, one, moving(one, 30.0, from_x=64.0 + 37.5 + 3.0), 32)
    assert wanted[:, -5:].mean() > 0.0
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.005 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=5e-3)


def test_what_passes_before_another_hides_it_for_as_long_as_it_does(gl: moderngl.Context) -> None:
    """A dark box moves by 4 px before a bright one that stands still."""
    dark = {"box": {"size_m": [1.0, 0.5, 0.3], "material": lambert(0.05)}}
    one = before({}, {"craft": dark, "behind": BOX})
    image, wanted = drawn(gl, one, moving(one, 4.0), 12)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.004 * wanted.max()


def test_what_stands_still_before_what_moves_is_a_layer_of_its_own(gl: moderngl.Context) -> None:
    """A boom 20 m before the camera, and a box that goes 30 px behind it: one snapshot does."""
    boom = {"box": {"size_m": [0.1, 0.5, 0.1], "material": lambert(0.2)}}
    bodies = {
        "craft": {"model": BOX, "position_icrf_m": [0.0, 0.0, 0.0]},
        "boom": {"model": boom, "position_icrf_m": [0.1, 0.05, RANGE - 20.0]},
    }
    render = {"samples_per_pixel": 30}
    one = scene(bodies, CAMERA, render=render, sun_direction=(0.3, 0.2, 1.0))
    during = moving(one, 30.0)
    over_exposure = moving_scene(one.at(one.epoch_tai_ns), "cam", during)
    assert over_exposure is not None
    assert over_exposure.count == 1
    image, wanted = drawn(gl, one, during, 90)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.004 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_spacecraft_that_pass_each_other_are_layers(gl: moderngl.Context) -> None:
    """One goes 24 px before another that goes 8 px the other way: one snapshot of each does."""
    dark = {"box": {"size_m": [1.0, 0.5, 0.3], "material": lambert(0.1)}}
    bodies = {
        "craft": {"model": BOX, "position_icrf_m": [0.0, 0.0, 0.0]},
        "near": {"model": dark, "position_icrf_m": [0.3, 0.2, 10.0]},
    }
    render = {"samples_per_pixel": 30}
    one = scene(bodies, CAMERA, render=render, sun_direction=(0.9, 0.2, 0.6))
    right = one.at(one.epoch_tai_ns).cameras["cam"].R_camera_from_icrf[0]
    behind = moving(one, -8.0, 2.0)

    def during(tai_ns: int) -> SceneState:
        state = behind(tai_ns)
        share = (tai_ns - one.epoch_tai_ns) * 1e-9 / EXPOSURE
        near = state.bodies["near"]
        place = near.pose.position + 24.0 * share * (RANGE - 10.0) / FOCAL * right
        moved = replace(near, pose=replace(near.pose, position=place))
        return replace(state, bodies={**state.bodies, "near": moved})

    over_exposure = moving_scene(one.at(one.epoch_tai_ns), "cam", during)
    assert over_exposure is not None
    assert [(set(layer.names or ()), layer.count) for layer in over_exposure.layers] == [
        ({"craft"}, 1),
        ({"near"}, 1),
    ]
    image, wanted = drawn(gl, one, during, 72)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.004 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_no_more_snapshots_than_eight_steps_of_what_passes(gl: moderngl.Context) -> None:
    """A box that goes 40 px through another, which it cannot be a layer before."""
    dark = {"box": {"size_m": [1.0, 0.5, 0.3], "material": lambert(0.1)}}
    bodies = {
        "craft": {"model": dark, "position_icrf_m": [0.0, 0.0, 0.0]},
        "other": {"model": BOX, "position_icrf_m": [0.0, 0.0, 0.0]},
    }
    one = scene(bodies, CAMERA, render={"samples_per_pixel": 30}, sun_direction=(0.3, 0.2, 1.0))
    # Its dark ends come out of the other.
    during = moving(one, 40.0, from_x=40.0)
    over_exposure = moving_scene(one.at(one.epoch_tai_ns), "cam", during)
    assert over_exposure is not None
    assert (over_exposure.layers, over_exposure.count) == ((), 8)
    image, wanted = drawn(gl, one, during, 40)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.004 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


@pytest.mark.parametrize("distortion", [{"k1": -0.3, "p1": 0.01}, {"model": "fisheye", "k1": 0.02}])
def test_a_lens_bends_the_ways(gl: moderngl.Context, distortion: dict[str, object]) -> None:
    one = box(
        position_icrf_m=[0.7, 0.7, 4.9],
        focal_length_px=160.0,
        optics={"distortion": distortion},
    )
    # 12 px at 5 m.
    image, wanted = drawn(gl, one, moving(one, 12.0 * FOCAL / 160.0 * 5.0 / RANGE), 16)
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.01 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=2e-3)


def over_the_earth(**camera: object) -> Scenario:
    model = {"box": {"size_m": [2.2, 2.6, 0.6], "material": lambert(0.05)}}
    place = {"target": "craft", "azimuth_deg": 40, "elevation_deg": 30, "range_m": RANGE}
    size = {"width_px": 160, "height_px": 120, "exposure_time_s": EXPOSURE, "f_number": 16.0}
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:10:00"},
            "spacecraft": {
                "craft": {"model": model, "orbit": {"altitude_km": 400, "inclination_deg": 51.6}}
            },
            "camera": {"cam": {"about": place, "shutter": "global", **size, **camera}},
            "render": {"samples_per_pixel": 30},
        }
    )


@pytest.fixture(scope="module")
def above(module_gl: moderngl.Context) -> Iterator[Simulator]:
    with Simulator(over_the_earth(), module_gl) as simulator:
        yield simulator


def test_the_earth_is_seen_for_as_long_as_nothing_stands_before_it(above: Simulator) -> None:
    """A dark box that moves before it, and both as the camera turns: detail of single pixels is
    read between them."""
    one = over_the_earth()
    slew = turning_camera(one, np.array([0.2, -0.98, 0.0]), 8.0 / FOCAL)
    for during, tolerance in ((moving(one, 8.0), 0.002), (slew, 0.006)):
        image = electrons(above, during(one.epoch_tai_ns), during)
        wanted = by_instants(above, one, during, 12)
        assert wanted.min() < 0.1 * wanted.max()
        assert np.sqrt(np.mean(np.square(image - wanted))) < tolerance * wanted.max()
        assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_what_accelerates_before_the_earth_hides_it_for_as_long_as_it_does(
    above: Simulator,
) -> None:
    """A dark box, and then both as a turn of the camera accelerates: both are swept in parts."""
    one = over_the_earth()
    rest, axis = one.at(one.epoch_tai_ns), np.array([0.2, -0.98, 0.0])
    look = rest.cameras["cam"]

    def slew(tai_ns: int) -> SceneState:
        share = (tai_ns - one.epoch_tai_ns) * 1e-9 / EXPOSURE
        R = rotation_about(axis, (20.0 * share + 60.0 * share**2) / FOCAL)
        turned = replace(look, R_camera_from_icrf=R @ look.R_camera_from_icrf)
        return replace(rest, tai_ns=tai_ns, cameras={"cam": turned})

    for during, tolerance in ((moving(one, 20.0, more=15.0), 0.002), (slew, 0.01)):
        image = electrons(above, during(one.epoch_tai_ns), during)
        wanted = by_instants(above, one, during, 48)
        assert np.sqrt(np.mean(np.square(image - wanted))) < tolerance * wanted.max()
        assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


def test_rows_see_the_earth_at_their_own_time(above: Simulator) -> None:
    """A camera that turns by 30 px while its rows are read out."""
    row_time = 100e-6
    one = over_the_earth(shutter="rolling", row_time_us=1e6 * row_time, exposure_time_s=1e-4)
    axis = np.array([0.2, -0.98, 0.0])
    during = turning_camera(one, axis, 30.0 / FOCAL, 119 * row_time)
    rows = np.arange(5, 120, 19)
    image = electrons(above, during(one.epoch_tai_ns), during)[rows]
    times = one.epoch_tai_ns + np.round(1e9 * (rows - 59.5) * row_time).astype(int)
    stills = [electrons(above, during(time), None) for time in times.tolist()]
    wanted = np.array([still[row] for still, row in zip(stills, rows.tolist(), strict=True)])
    assert np.sqrt(np.mean(np.square(image - wanted))) < 0.01 * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=2e-3)
