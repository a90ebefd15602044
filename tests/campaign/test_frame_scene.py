"""The scene of a frame holds what was drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.campaign.campaign_file import Campaign, load_campaign
from simgl.campaign.frame_scene import FrameScene, frame_scene
from simgl.campaign.frame_task import CampaignJob
from simgl.errors import ConfigError
from simgl.motion.mounts import BodyMount, camera_pose
from simgl.motion.pointing import Pointing
from simgl.simulator import Simulator
from tests.campaign.small import DRAW, small_campaign


def line(scene: FrameScene) -> tuple[Array, Array]:
    """From the target to the camera and to the Sun, in ICRF axes."""
    target = scene.state.bodies["target"].pose.position
    return (
        scene.state.cameras["nav"].position - target,
        scene.state.sun.seen_from(target).direction_icrf,
    )


def scenes(campaign: Campaign) -> list[FrameScene]:
    return [frame_scene(campaign, frame) for frame in range(campaign.frames)]


def test_range_phase_angle_and_place_in_the_picture_are_kept(tmp_path: Path) -> None:
    draw = "range_m = 4.0\nphase_angle_deg = 60.0\noffset_x = 0.5\noffset_y = -0.25\n"
    campaign = small_campaign(tmp_path, draw + "roll_deg = { uniform = [0.0, 360.0] }")
    for scene in scenes(campaign):
        out, sun = line(scene)
        assert np.linalg.norm(out) == pytest.approx(4.0)
        assert np.degrees(np.arccos(out @ sun / 4.0)) == pytest.approx(60.0)
        camera = scene.state.cameras["nav"]
        seen = camera.camera.project(camera.R_camera_from_icrf @ -out)
        # Half of 40 to the right of the middle of 80 x 60, a quarter of 30 up.
        assert seen == pytest.approx([60.0, 22.5])


def test_azimuth_is_that_of_a_camera_about_the_target(tmp_path: Path) -> None:
    campaign = small_campaign(tmp_path, "range_m = 4.0\nazimuth_deg = 90.0")
    scene = frame_scene(campaign, 0)
    out, _ = line(scene)
    target = scene.state.bodies["target"].pose.position
    # Above the target.
    assert out == pytest.approx(4.0 * target / np.linalg.norm(target), abs=1e-6)


def test_the_craft_that_carries_the_camera_comes_along(tmp_path: Path) -> None:
    for scene in scenes(small_campaign(tmp_path)):
        state, camera = scene.state, scene.state.cameras["nav"]
        mount = BodyMount(
            spacecraft="chaser",
            position_body=np.array([0.15, 0.0, 0.0]),
            pointing=Pointing(
                towards=np.array([1.0, 0.0, 0.0]), axes="body", up=np.array([0.0, 0.0, -1.0])
            ),
        )
        poses = {name: body.pose for name, body in state.bodies.items()}
        position, R = camera_pose("nav", mount, poses)
        assert position == pytest.approx(camera.position, abs=1e-8)
        assert np.abs(R - camera.R_camera_from_icrf).max() < 1e-12
        # And so does its lamp, 3 cm behind the pinhole.
        behind = camera.position - 0.03 * camera.R_camera_from_icrf[2]
        assert state.lamps[0].position == pytest.approx(behind, abs=1e-8)


def test_what_is_not_drawn_is_as_in_the_scenario(tmp_path: Path) -> None:
    campaign = small_campaign(tmp_path, "exposure_time_s = 0.002\nlamp_power = { spot = 0.5 }")
    scene = frame_scene(campaign, 3)
    usual = campaign.scenario.at(campaign.scenario.epoch_tai_ns)
    ours, theirs = scene.state.cameras["nav"], usual.cameras["nav"]
    assert np.array_equal(ours.position, theirs.position)
    assert np.array_equal(ours.R_camera_from_icrf, theirs.R_camera_from_icrf)
    assert ours.camera.exposure_time == 0.002
    assert scene.state.lamps[0].lamp.power == pytest.approx(0.5 * usual.lamps[0].lamp.power)


def test_seeds_of_noise_differ_from_frame_to_frame(tmp_path: Path) -> None:
    campaign = small_campaign(tmp_path)
    assert len({scene.seed for scene in scenes(campaign)}) == campaign.frames


def test_no_camera_is_inside_a_spacecraft(tmp_path: Path) -> None:
    """The wedge reaches out to 0.74 m: of places 0.1 to 1.2 m away many lie in it."""
    draw = 'range_m = { uniform = [0.1, 1.2] }\ndirection = "sphere"'
    campaign = small_campaign(tmp_path, draw)
    for scene in scenes(campaign):
        camera = scene.state.cameras["nav"]
        assert not scene.state.bodies["target"].encloses(camera.position)
    with pytest.raises(ConfigError, match=r"draw gives no possible scene for frame 0 in 1000"):
        frame_scene(small_campaign(tmp_path, "range_m = 0.001"), 0)


def test_what_moves_while_the_shutter_is_open_moves_by_its_rates(tmp_path: Path) -> None:
    still = small_campaign(tmp_path)
    rates = "target_rate_deg_s = 30.0\ncamera_rate_deg_s = 2.0\nrelative_speed_m_s = 0.5\n"
    moving = small_campaign(tmp_path, DRAW + rates)
    axes = []
    for frame in range(4):
        assert frame_scene(still, frame).during is None
        scene = frame_scene(moving, frame)
        middle, during = scene.state, scene.during
        assert during is not None
        # Mid-exposure is what it would be without rates: they change no other draw.
        other = frame_scene(still, frame).state
        camera = middle.cameras["nav"]
        assert np.array_equal(camera.position, other.cameras["nav"].position)
        seconds = 0.04
        later = during(middle.tai_ns + round(seconds * 1e9))
        here, there = middle.bodies["target"].pose, later.bodies["target"].pose
        turn = Rotation.from_matrix(here.R_icrf_from_body.T @ there.R_icrf_from_body)
        assert np.degrees(turn.magnitude()) == pytest.approx(30.0 * seconds)
        axes.append(turn.as_rotvec() / turn.magnitude())
        assert there.position - here.position == pytest.approx(seconds * here.velocity, abs=1e-6)
        after = later.cameras["nav"]
        turned = Rotation.from_matrix(after.R_camera_from_icrf @ camera.R_camera_from_icrf.T)
        assert np.degrees(turned.magnitude()) == pytest.approx(2.0 * seconds)
        past = after.position - there.position - (camera.position - here.position)
        assert np.linalg.norm(past) == pytest.approx(0.5 * seconds, rel=1e-6)
        # The craft behind the camera, and its lamp, are rigid with it.
        for state, seen in ((middle, camera), (later, after)):
            behind = seen.position - 0.03 * seen.R_camera_from_icrf[2]
            assert state.lamps[0].position == pytest.approx(behind, abs=1e-7)
    assert np.linalg.matrix_rank(np.array(axes)) == 3


def test_a_turning_target_is_blurred_and_its_labels_are_of_mid_exposure(tmp_path: Path) -> None:
    draw = "range_m = 6.0\nexposure_time_s = 0.002\n"
    exposures = {}
    with Simulator(small_campaign(tmp_path).scenario) as simulator:
        for rate in (0.0, 3000.0):
            campaign = small_campaign(tmp_path, f"{draw}target_rate_deg_s = {rate}\n")
            exposures[rate] = CampaignJob(campaign=campaign).render(simulator, 0)
    still, blurred = exposures.values()
    assert still.files["labels/000000.json"] == blurred.files["labels/000000.json"]
    assert still.row["dn_sha256"] != blurred.row["dn_sha256"]


def test_the_example_draws_what_it_says() -> None:
    campaign = load_campaign(Path(__file__).parents[2] / "examples" / "campaign" / "approach.toml")
    assert campaign.frames == 200
    for frame in range(3):
        state = frame_scene(campaign, frame).state
        target, camera = state.bodies["target"].pose.position, state.cameras["navcam"]
        assert 15.0 <= np.linalg.norm(camera.position - target) <= 150.0
