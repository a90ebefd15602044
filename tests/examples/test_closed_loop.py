"""The closed-loop example: its parts obey their laws, and the loop arrives."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from examples.closed_loop.guidance import Glideslope
from examples.closed_loop.loop import Flight, Settings, fly
from examples.closed_loop.navigation import Estimate, after_push, predict, sighting, update
from examples.closed_loop.relative_motion import transition, velocity_to_reach
from examples.closed_loop.spacecraft import EARTH_J2, Orbit, gravity, relative_state
from examples.closed_loop.vision import (
    SPACE_RIDER_WING,
    Image,
    Pinhole,
    TipPattern,
    find_target,
    fit_tip,
    locate,
)
from simgl import Simulator, load_scenario
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS
from simgl.physics.frames import Pose
from simgl.scene.trajectory import RelativePosition

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "examples" / "approach.toml"
RADIUS = WGS84_EQUATORIAL_RADIUS + 400e3
MEAN_MOTION = float(np.sqrt(EARTH_MU / RADIUS**3))
CAMERA = Pinhole(width=600, height=600, focal_length=1000.0, cx=300.0, cy=300.0, pedestal_dn=64.0)


def two_body(orbit: Orbit, duration: float) -> Orbit:
    """An orbit carried on by a general integrator under the Earth's mass alone."""

    def rate(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], -EARTH_MU * y[:3] / np.linalg.norm(y[:3]) ** 3])

    start = np.concatenate([orbit.position, orbit.velocity])
    end = solve_ivp(rate, (0.0, duration), start, rtol=1e-12, atol=1e-6).y[:, -1]
    return Orbit(position=end[:3], velocity=end[3:])


def circular() -> Orbit:
    """A circular equatorial orbit at 400 km."""
    return Orbit(
        position=np.array([RADIUS, 0.0, 0.0]), velocity=np.array([0.0, RADIUS * MEAN_MOTION, 0.0])
    )


def beside(target: Orbit, relative: Array) -> Orbit:
    """The craft with a relative state (6,) in the target's LVLH frame."""
    R_icrf_from_lvlh = target.R_lvlh_from_icrf.T
    turning = R_icrf_from_lvlh @ np.array([0.0, -target.mean_motion, 0.0])
    offset = R_icrf_from_lvlh @ relative[:3]
    return Orbit(
        position=target.position + offset,
        velocity=target.velocity + R_icrf_from_lvlh @ relative[3:] + np.cross(turning, offset),
    )


@pytest.mark.parametrize("axis", range(6))
def test_clohessy_wiltshire_transition_agrees_with_two_body_orbits(axis: int) -> None:
    duration, size = 600.0, np.array([100.0, 100.0, 100.0, 0.1, 0.1, 0.1])
    start = np.zeros(6)
    start[axis] = size[axis]
    target = circular()
    chaser = beside(target, start)
    np.testing.assert_allclose(relative_state(chaser, target), start, atol=1e-8)
    ended = relative_state(two_body(chaser, duration), two_body(target, duration))
    # The linear equations leave out gravity terms of second order, at most 3 n^2 d^2 / r for a
    # distance d; the farthest of these starts drifts to d = 300 m. Integrated twice over t, with a
    # factor 2 for the growth of the free motion: 3 n^2 d^2 t^2 / r = 0.018 m; once for the rate.
    bound = 3.0 * MEAN_MOTION**2 * 300.0**2 / RADIUS * duration
    predicted = transition(MEAN_MOTION, duration) @ start
    np.testing.assert_allclose(ended[:3], predicted[:3], atol=bound * duration)
    np.testing.assert_allclose(ended[3:], predicted[3:], atol=2.0 * bound)


def test_a_hop_with_the_computed_velocity_ends_at_its_aim() -> None:
    start, aim = np.array([-150.0, 3.0, -2.0]), np.array([-138.0, 0.0, 0.0])
    velocity = velocity_to_reach(MEAN_MOTION, 30.0, start, aim)
    target = circular()
    chaser = beside(target, np.concatenate([start, velocity]))
    ended = relative_state(two_body(chaser, 30.0), two_body(target, 30.0))
    # As above with d = 150 m, t = 30 s: 3 n^2 d^2 t^2 / r = 1.2e-5 m.
    np.testing.assert_allclose(ended[:3], aim, atol=1.2e-5)


def test_gravity_is_the_gradient_of_its_potential() -> None:
    place = np.array([3.1e6, -4.2e6, 4.3e6])

    def potential(p: Array) -> float:
        r = float(np.linalg.norm(p))
        legendre = 0.5 * (3.0 * (p[2] / r) ** 2 - 1.0)
        bulge = EARTH_J2 * (WGS84_EQUATORIAL_RADIUS / r) ** 2 * legendre
        return float(EARTH_MU / r * (1.0 - bulge))

    # Central difference with h = 100 m: h^2 r^-4 mu = 2e-9, and rounding of 6e7 eps / h = 1e-10.
    h = 100.0
    slope = [(potential(place + h * e) - potential(place - h * e)) / (2.0 * h) for e in np.eye(3)]
    np.testing.assert_allclose(gravity(place), slope, atol=1e-8)


def test_one_step_of_truth_is_a_small_part_of_a_millimetre_from_a_fine_integration() -> None:
    orbit = circular()
    fine = orbit
    for _ in range(30):
        fine = fine.advanced(0.1)
    np.testing.assert_allclose(orbit.advanced(3.0).position, fine.position, atol=1e-6)


def covered(begin: float, end: float, count: int) -> Array:
    """(count,) share of each pixel that an interval covers."""
    pixels = np.arange(count, dtype=np.float64)
    overlap = np.minimum(end, pixels + 1.0) - np.maximum(begin, pixels)
    return np.asarray(np.clip(overlap, 0.0, 1.0))


def rectangle(left: float, top: float, width: float, height: float, signal: float = 900.0) -> Image:
    """A bright rectangle on a dark sky with a noise of 1 DN, exact to a part of a pixel."""
    rng = np.random.default_rng(5)
    light = np.outer(covered(top, top + height, 600), covered(left, left + width, 600))
    return np.round(64.0 + signal * light + rng.standard_normal((600, 600))).astype(np.uint16)


PLAIN = TipPattern(span=10.0, bars=(), cells=((0.0, 5.0),), length=1.6)


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.25, 0.4, 0.5, 0.65, 0.8, 0.95])
def test_both_tips_follow_the_target_by_parts_of_a_pixel(shift: float) -> None:
    found = find_target(rectangle(200.0 + shift, 310.0 - shift, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    assert found.left_tip is not None
    assert found.right_tip is not None
    # Noise of 1 DN over 11 rows and 900 DN signal is 4e-4 px; the fit's grid is 0.01 px and the
    # threshold costs nothing: 0.05 px leaves room for rounding to whole DN.
    assert found.left_tip == pytest.approx((200.0 + shift, 315.5 - shift), abs=0.05)
    assert found.right_tip == pytest.approx((260.0 + shift, 315.5 - shift), abs=0.05)


@pytest.mark.parametrize("scale", [5.3, 11.0, 53.0])
@pytest.mark.parametrize("tip", [3.2, 3.5, 3.9])
def test_a_bright_frame_does_not_move_the_fitted_tip(scale: float, tip: float) -> None:
    def strips(pieces: tuple[tuple[float, float], ...]) -> Array:
        count = int(3 + 1.6 * scale)
        total = np.zeros(count)
        for begin, end in pieces:
            total += covered(tip + begin * scale, tip + end * scale, count)
        return total

    profile = 800.0 * strips(SPACE_RIDER_WING.bars) + 120.0 * strips(SPACE_RIDER_WING.cells)
    # No noise: the fit's grid of 0.01 px.
    assert fit_tip(profile, 3.0, scale, SPACE_RIDER_WING) == pytest.approx(tip, abs=0.0101)


def test_an_empty_image_has_no_target() -> None:
    assert find_target(rectangle(0.0, 0.0, 0.0, 0.0), CAMERA, PLAIN) is None


def test_the_largest_region_is_the_target() -> None:
    sky = rectangle(300.0, 300.0, 50.0, 10.0).astype(np.int64)
    sky += rectangle(100.0, 100.0, 5.0, 5.0, signal=3000.0) - 64
    found = find_target(sky.clip(0).astype(np.uint16), CAMERA, PLAIN)
    assert found is not None
    assert found.box == (300, 300, 350, 310)


def test_a_target_that_shadow_cuts_in_pieces_is_one_target() -> None:
    sky = rectangle(200.0, 300.0, 40.0, 20.0).astype(np.int64)
    sky += rectangle(245.0, 300.0, 30.0, 20.0) - 64
    sky += rectangle(210.0, 285.0, 10.0, 10.0) - 64
    sky += rectangle(280.0, 305.0, 2.0, 2.0, signal=3000.0) - 64  # a star
    found = find_target(sky.clip(0).astype(np.uint16), CAMERA, PLAIN)
    assert found is not None
    assert found.box == (200, 285, 275, 320)


def test_a_target_cut_by_the_border_has_no_tips_and_no_place() -> None:
    found = find_target(rectangle(-5.0, 300.0, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    assert found.left_tip is None
    assert found.right_tip is None
    assert locate(found, CAMERA, np.eye(3), (np.zeros(3), np.ones(3))) is None


def test_two_rays_give_the_position_that_they_come_from() -> None:
    camera_lvlh = np.array([-40.0, 0.7, -1.1])
    tips = np.array([0.0, -5.0, 2.6]), np.array([0.0, 5.0, 2.6])
    R_lvlh_from_camera = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    left, right = (CAMERA.project(R_lvlh_from_camera.T @ (tip - camera_lvlh)) for tip in tips)
    found = find_target(rectangle(200.0, 300.0, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    seen = replace(found, left_tip=left, right_tip=right)
    position = locate(seen, CAMERA, R_lvlh_from_camera, tips)
    assert position is not None
    np.testing.assert_allclose(position, camera_lvlh, atol=1e-9)
    # A tip 20 px too high fits no position.
    wrong = replace(seen, left_tip=(left[0], left[1] - 20.0))
    assert locate(wrong, CAMERA, R_lvlh_from_camera, tips) is None


def estimate_at(position: Array, sigma: float) -> Estimate:
    """A resting estimate with the same error along each axis, and 0.01 m/s."""
    return Estimate(
        mean=np.concatenate([position, np.zeros(3)]),
        covariance=np.diag([sigma**2] * 3 + [1e-4] * 3),
    )


def sighted_at(position: Array) -> Array:
    """sqrt of the diagonal of the covariance of a sighting."""
    seen = sighting(position, tip_error=3e-4, span=10.0, drawing_error=0.0)
    return np.sqrt(np.diag(seen.covariance))


def test_range_error_grows_with_the_square_and_lateral_error_with_the_range() -> None:
    near, far = sighted_at(np.array([-20.0, 0.0, 0.0])), sighted_at(np.array([-200.0, 0.0, 0.0]))
    np.testing.assert_allclose(far / near, [100.0, 10.0, 10.0], rtol=1e-12)
    np.testing.assert_allclose(near, [np.sqrt(2.0) * 3e-4 * 40.0, 6e-3, 6e-3], rtol=1e-12)


def test_the_filter_rejects_an_outlier_and_takes_a_good_sighting() -> None:
    there = np.array([-50.0, 0.0, 0.0])
    before = estimate_at(there, sigma=0.2)

    def seen_from(position: Array) -> tuple[Estimate, bool]:
        return update(before, sighting(position, tip_error=3e-4, span=10.0, drawing_error=0.0))

    after, accepted = seen_from(there + np.array([0.3, 0.0, 0.1]))
    assert accepted
    assert np.all(after.position_sigma < before.position_sigma)
    # 5 m is 22 standard deviations of the innovation, hypot(0.2, 0.11) = 0.23 m.
    after, accepted = seen_from(there + np.array([5.0, 0.0, 0.0]))
    assert not accepted
    assert after is before


def test_a_sighting_with_the_same_error_as_the_estimate_meets_it_half_way() -> None:
    there = np.array([-50.0, 0.0, 0.0])
    beside_it = there + np.array([0.0, 0.02, 0.0])
    seen = sighting(beside_it, tip_error=3e-4, span=10.0, drawing_error=0.0)
    after, _ = update(estimate_at(there, sigma=3e-4 * 50.0), seen)
    # The sighting lies 0.02 / 50 rad off the axis, which mixes range error into the mean at 1e-4.
    np.testing.assert_allclose(after.mean[1], 0.01, rtol=1e-2)


def test_prediction_follows_the_transition_and_only_grows_in_error() -> None:
    before = estimate_at(np.array([-50.0, 1.0, 2.0]), sigma=0.2)
    after = predict(before, MEAN_MOTION, 3.0)
    np.testing.assert_allclose(after.mean, transition(MEAN_MOTION, 3.0) @ before.mean)
    assert np.all(after.position_sigma > before.position_sigma)
    pushed = after_push(after, np.array([0.3, 0.0, 0.0]))
    np.testing.assert_allclose(pushed.mean - after.mean, [0, 0, 0, 0.3, 0, 0], atol=1e-12)
    assert np.all(np.diag(pushed.covariance - after.covariance)[3:] == pytest.approx(0.006**2))


def test_the_glideslope_bounds_its_speed_and_stops_at_the_hold_point() -> None:
    plan = Glideslope(hold=20.0, top_speed=0.4, hop=30.0)
    np.testing.assert_allclose(plan.waypoint(np.array([-200.0, 4.0, 1.0])), [-188.0, 0.0, 0.0])
    np.testing.assert_allclose(plan.waypoint(np.array([-20.0, 0.0, 0.0])), [-20.0, 0.0, 0.0])
    at_rest = np.array([-20.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # V-bar: a place of rest
    np.testing.assert_array_equal(plan.push(at_rest, MEAN_MOTION), np.zeros(3))


@pytest.fixture(scope="module")
def flight() -> Flight:
    """The loop from 60 m, with shorter hops; images by a simulator in this process."""
    scenario = load_scenario(SCENARIO)
    chaser = scenario.motions["chaser"]
    assert isinstance(chaser.trajectory, RelativePosition)
    nearer = replace(chaser.trajectory, position_lvlh=np.array([-60.0, 0.5, -0.5]))
    near = replace(
        scenario, motions={**scenario.motions, "chaser": replace(chaser, trajectory=nearer)}
    )
    navcam = near.cameras["navcam"]
    camera = Pinhole(
        width=navcam.detector.width,
        height=navcam.detector.height,
        focal_length=navcam.focal_length_px,
        cx=float(navcam.intrinsics[0, 2]),
        cy=float(navcam.intrinsics[1, 2]),
        pedestal_dn=navcam.detector.pedestal,
    )
    with Simulator(near) as simulator:

        def take_image(tai_ns: int, bodies: dict[str, Pose]) -> Image:
            digital = simulator.capture(near.with_poses(tai_ns, bodies), "navcam").digital
            assert digital is not None
            return digital.dn

        plan = Glideslope(time_constant=40.0, hop=15.0)
        return fly(near, camera, take_image, Settings(frames=90, seed=11, plan=plan))


def test_the_chaser_arrives_and_stays_at_the_hold_point(flight: Flight) -> None:
    assert flight.miss[0] > 39.0
    assert flight.arrived
    assert flight.miss[-1] < 0.5


def test_the_estimate_lies_within_what_the_filter_claims(flight: Flight) -> None:
    for frame in flight.frames[-20:]:
        error = np.abs(frame.estimated[:3] - frame.true[:3])
        assert np.all(error < 4.0 * frame.position_sigma)
    assert all(frame.accepted for frame in flight.frames)


def test_the_first_sighting_corrects_the_range_from_the_ground(flight: Flight) -> None:
    # 0.3 px on each tip, 60^2 / (10 m 1067 px) metres per pixel: 0.14 m, where the ground knew 6 m.
    first = flight.frames[0]
    assert first.range_sigma < 0.2
    assert abs(first.estimated_range - first.true_range) < 4.0 * first.range_sigma


def demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The example as a user starts it."""
    command = [sys.executable, "-m", "examples.closed_loop", *arguments]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )


def test_two_processes_leave_pictures_plot_table_and_summary(tmp_path: Path) -> None:
    done = demo("--out", str(tmp_path), "--frames", "12", "--seed", "4")
    assert done.returncode == 0, done.stderr
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "approach.csv",
        "approach_plot.png",
        "approach_strip.png",
        "approach_summary.json",
    }
    summary = json.loads((tmp_path / "approach_summary.json").read_text())
    assert summary["frames"] == 12
    assert summary["frames_per_second"] > 0.0
    assert not summary["arrived"]
    assert len((tmp_path / "approach.csv").read_text().splitlines()) == 13
    assert "is still on its way" in done.stdout


def test_a_folder_that_cannot_be_written_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = demo("--out", str(tmp_path / "file" / "out"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("closed_loop: ")
    assert "cannot be written" in done.stderr


def test_the_first_image_writes_an_exr(tmp_path: Path) -> None:
    script = ROOT / "examples" / "first_image.py"
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out" / "first_image").glob("navcam*.exr"))
