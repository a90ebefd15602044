"""Motion blur and rolling shutters: a ball that crosses the picture while the shutter is open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.motion.joints import Joint
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from simgl.view.image_motion import spacecraft_motion
from tests.scenes import lambert, scene

BALL = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}
RANGE = 100.0
# 13 mm and 3.75 um: pixels per metre across the line of sight.
SCALE = 0.013 / 3.75e-6 / RANGE


def scenario(**camera: object) -> Scenario:
    return scene(
        {"ball": {"model": BALL, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, RANGE],
            "look_at": "ball",
            "up": [0.0, 1.0, 0.0],
            "shutter": "global",
            **camera,
        },
    )


def drifting(one: Scenario, velocity: float) -> Callable[[int], SceneState]:
    """The ball crosses the picture along the camera's x [px s-1], in its middle at the epoch."""
    rest = one.at(one.epoch_tai_ns)
    right = rest.cameras["cam"].R_camera_from_icrf[0]
    look = rest.cameras["cam"]

    def at(tai_ns: int) -> SceneState:
        seconds = (tai_ns - one.epoch_tai_ns) * 1e-9
        pose = replace(rest.bodies["ball"].pose, position=velocity / SCALE * seconds * right)
        body = replace(rest.bodies["ball"], pose=pose)
        return replace(rest, tai_ns=tai_ns, bodies={"ball": body}, cameras={"cam": look})

    return at


def electrons(
    gl: moderngl.Context, one: Scenario, during: Callable[[int], SceneState] | None
) -> Array:
    state = one.at(one.epoch_tai_ns)
    with Simulator(one, gl) as simulator:
        frame = simulator.capture(state, "cam", {Product.ELECTRONS}, during).electrons
    assert frame is not None
    return frame.electrons.astype(np.float64)


def test_what_stands_still_gives_the_same_bits(gl: moderngl.Context) -> None:
    one = scenario(shutter="rolling", exposure_time_s=0.01)
    np.testing.assert_array_equal(electrons(gl, one, one.at), electrons(gl, one, None))


def test_motion_blur_spreads_the_light_and_loses_none(gl: moderngl.Context) -> None:
    one = scenario(exposure_time_s=0.01)
    still = electrons(gl, one, None)
    blurred = electrons(gl, one, drifting(one, 600.0))
    assert blurred.sum() == pytest.approx(still.sum(), rel=1e-3)
    x = np.arange(128) + 0.5

    def moments(picture: Array) -> tuple[float, float]:
        share = picture.sum(axis=0) / picture.sum()
        return float(share @ x), float(share @ (x - share @ x) ** 2)

    (centre, width), (centre_still, width_still) = moments(blurred), moments(still)
    # The epoch is the middle of the exposure; coverage of the edge moves the centroid by 0.03 px.
    assert centre == pytest.approx(centre_still, abs=0.03)
    # A path of 6 px adds its variance of 3, as do the moments that stand for it.
    assert width - width_still == pytest.approx(3.0, rel=0.02)


@pytest.mark.parametrize(
    ("pixels", "exposure_ms"), [(0.4, 0.01), (2.0, 0.1), (8.0, 2.0), (40.0, 0.01), (100.0, 0.01)]
)
def test_each_row_sees_what_moves_at_its_own_time(
    gl: moderngl.Context, pixels: float, exposure_ms: float
) -> None:
    """Against images of the scene at the times of some rows."""
    row_time = 100e-6
    one = scenario(
        shutter="rolling", row_time_us=1e6 * row_time, exposure_time_s=1e-3 * exposure_ms
    )
    during = drifting(one, pixels / (127.0 * row_time))
    x = np.arange(128) + 0.5
    errors = []
    with Simulator(one, gl) as simulator:

        def electrons_of(state: SceneState, moving: bool) -> Array:
            at = during if moving else None
            frame = simulator.capture(state, "cam", {Product.ELECTRONS}, at).electrons
            assert frame is not None
            return frame.electrons.astype(np.float64)

        picture = electrons_of(during(one.epoch_tai_ns), moving=True)
        for row in range(36, 93, 8):
            time = one.epoch_tai_ns + round(1e9 * (row - 63.5) * row_time)
            still = electrons_of(during(time), moving=False)[row]
            seen = picture[row]
            errors.append(seen @ x / seen.sum() - still @ x / still.sum())
    # Single rows of 50 px with about 70 samples in a pixel: 0.01 px of either image's edges.
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


def test_noise_comes_once_after_the_sum(gl: moderngl.Context) -> None:
    """DN of a moving scene have the shot noise of their electrons, not of their parts."""
    quiet = {"read_noise_e": 0.0, "prnu": 0.0, "dsnu_e": 0.0, "dark_current_e_s": 0.0}
    one = scenario(exposure_time_s=0.001, f_number=16.0, bits=16, gain_e_per_dn=1.0, **quiet)
    state = one.at(one.epoch_tai_ns)
    with Simulator(one, gl) as simulator:
        products = {Product.DN, Product.ELECTRONS}
        taken = simulator.capture(state, "cam", products, drifting(one, 1000.0))
    assert taken.digital is not None
    assert taken.electrons is not None
    mean = taken.electrons.electrons.astype(np.float64)
    lit = mean > 100.0
    z = (taken.digital.dn - 64.0 - mean)[lit] / np.sqrt(mean[lit])
    assert lit.sum() > 2000
    assert abs(z.var() - 1.0) < 5.0 * np.sqrt(2.0 / lit.sum())


def test_the_motion_of_the_picture_is_bounded_from_above() -> None:
    one = scenario()
    first = drifting(one, 100.0)(one.epoch_tai_ns)
    second = drifting(one, 100.0)(one.epoch_tai_ns + 10**9)
    # 100 px of the centre, a little more where the ball's front is nearer.
    assert 100.0 <= spacecraft_motion(first, second, "cam") < 105.0
    # A camera that turns by 1 deg moves everything by f times the angle.
    c, s = np.cos(np.radians(1.0)), np.sin(np.radians(1.0))
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    camera = first.cameras["cam"]
    turned = replace(camera, R_camera_from_icrf=turn @ camera.R_camera_from_icrf)
    moved = spacecraft_motion(first, replace(first, cameras={"cam": turned}), "cam")
    assert 60.5 < moved < 64.0


def jointed(one: Scenario) -> Scenario:
    """The ball on a rail that a hinge carries; a quarter turn of that brings the rail along x."""
    hinge = Joint(
        name="hinge",
        parts=(),
        axis_body=np.array([0.0, 0.0, 1.0]),
        origin_body=np.zeros(3),
        limits=(-10.0, 10.0),
    )
    along = np.array([0.0, -1.0, 0.0])
    rail = replace(hinge, name="rail", parts=(0,), axis_body=along, parent=0, slides=True)
    models = {"ball": replace(one.models["ball"], joints=(hinge, rail))}
    return replace(one, models=models)


def test_what_a_rail_on_a_hinge_slides_blurs_as_what_drifts(gl: moderngl.Context) -> None:
    """6 px within the exposure; the sphere, turned a quarter, has its facets elsewhere."""
    one = scenario(exposure_time_s=0.01)
    on_rail = jointed(one)
    poses = one.poses(one.epoch_tai_ns)

    def sliding(tai_ns: int) -> SceneState:
        travel = 600.0 / SCALE * 1e-9 * (tai_ns - one.epoch_tai_ns)
        angles = {"ball": {"hinge": np.pi / 2.0, "rail": travel}}
        return on_rail.with_poses(one.epoch_tai_ns, poses, joint_angles=angles)

    by_joint = electrons(gl, on_rail, sliding)
    by_drift = electrons(gl, one, drifting(one, 600.0))
    still = electrons(gl, one, None)
    assert np.abs(by_joint - by_drift).sum() < 1e-3 * by_drift.sum()
    assert np.abs(still - by_drift).sum() > 0.01 * by_drift.sum()


def test_what_joints_move_is_seen_at_its_rows_time_as_what_drifts(gl: moderngl.Context) -> None:
    """30 px over the read-out of 13 ms; the sphere, turned a quarter, has its facets elsewhere."""
    one = scenario(shutter="rolling", row_time_us=100.0, exposure_time_s=1e-5)
    on_rail = jointed(one)
    poses = one.poses(one.epoch_tai_ns)

    def sliding(tai_ns: int) -> SceneState:
        travel = 2400.0 / SCALE * 1e-9 * (tai_ns - one.epoch_tai_ns)
        angles = {"ball": {"hinge": np.pi / 2.0, "rail": travel}}
        return on_rail.with_poses(one.epoch_tai_ns, poses, joint_angles=angles)

    by_joint = electrons(gl, on_rail, sliding)
    by_drift = electrons(gl, one, drifting(one, 2400.0))
    still = electrons(gl, one, None)
    assert np.abs(by_joint - by_drift).sum() < 1e-3 * by_drift.sum()
    assert np.abs(still - by_drift).sum() > 0.1 * by_drift.sum()


def test_the_motion_of_a_part_far_out_on_a_chain_is_bounded_from_above() -> None:
    """The ball's middle, 2 m out along the rail, comes round with it by 0.1 rad."""
    one = jointed(scenario())
    poses = one.poses(one.epoch_tai_ns)
    first, second = (
        one.with_poses(one.epoch_tai_ns, poses, joint_angles={"ball": angles})
        for angles in ({"hinge": 1.0, "rail": 2.0}, {"hinge": 1.1, "rail": 2.0})
    )
    moved = spacecraft_motion(first, second, "cam")
    # The farthest place of the ball goes along an arc of 0.1 rad with 3 m of radius.
    assert 0.3 * SCALE <= moved < 0.31 * SCALE / (1.0 - 3.0 / RANGE)
