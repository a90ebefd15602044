"""Scenario files whose spacecraft move along files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from simgl.errors import AssetError, ConfigError, SimglError
from simgl.physics.frames import lvlh_from_icrf
from simgl.scenario.loader import load_scenario, scenario_from_dict
from tests.motion.motion_files import AEM, APM, EPOCH, ORBIT, SECOND, oem, opm

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[spacecraft.target]
model.sphere = { radius_m = 1.0, material = "white_paint" }
trajectory = "target.oem"
attitude_file = "target.aem"
[spacecraft.chaser]
model.sphere = { radius_m = 1.0, material = "white_paint" }
relative_to = "target"
trajectory = { file = "chaser.csv", longest_gap_s = 100.0 }
"""
CHASER = "time_s,x_lvlh_m,y_lvlh_m,z_lvlh_m\n" + "".join(f"{t},{t - 200},3,4\n" for t in range(9))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "target.oem").write_text(oem())
    (tmp_path / "target.aem").write_text(AEM)
    (tmp_path / "chaser.csv").write_text(CHASER)
    return tmp_path


def scene(folder: Path, text: str = SCENE) -> Path:
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_bodies_follow_their_files(folder: Path) -> None:
    scenario = load_scenario(scene(folder))
    tai_ns = EPOCH + 4 * SECOND
    bodies = scenario.poses(tai_ns)
    target, chaser = bodies["target"], bodies["chaser"]
    r, v = ORBIT.state(tai_ns)
    np.testing.assert_allclose(target.position, r, atol=1e-5)
    np.testing.assert_allclose(target.velocity, v, atol=1e-5)
    # 60 deg about z in a minute.
    turn = np.radians(4.0)
    np.testing.assert_allclose(target.R_icrf_from_body[:2, 0], [np.cos(turn), np.sin(turn)])
    place = lvlh_from_icrf(r, v) @ (chaser.position - target.position)
    np.testing.assert_allclose(place, [-196.0, 3.0, 4.0], atol=1e-5)


def test_a_state_and_an_attitude_are_enough(folder: Path) -> None:
    """60 deg about z, now and later."""
    (folder / "target.oem").write_text(opm())
    (folder / "target.aem").write_text(APM)
    target = load_scenario(scene(folder)).poses(EPOCH + 4 * SECOND)["target"]
    np.testing.assert_allclose(target.position, ORBIT.state(EPOCH + 4 * SECOND)[0], atol=1e-5)
    np.testing.assert_allclose(target.R_icrf_from_body[:2, 0], [0.5, np.sqrt(0.75)])


CHASER_LINE = 'trajectory = { file = "chaser.csv", longest_gap_s = 100.0 }'


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            'relative_to = "target"\n',
            "",
            " [spacecraft.chaser]: relative_to is missing: the places",
        ),
        (
            'trajectory = "target.oem"\n',
            'trajectory = "target.oem"\nrelative_to = "chaser"\n',
            " [spacecraft.target]: relative_to is allowed only for positions in LVLH axes; "
            "those of the file",
        ),
        (
            'trajectory = "target.oem"\n',
            'trajectory = "target.oem"\norbit = { altitude_km = 400.0 }\n',
            " [spacecraft.target]: orbit contradicts trajectory; give one of them",
        ),
        (
            CHASER_LINE,
            CHASER_LINE + "\nvelocity_lvlh_m_s = [0.0, 0.0, 0.0]",
            " [spacecraft.chaser]: velocity_lvlh_m_s requires relative_to, got trajectory",
        ),
        (
            'trajectory = "target.oem"',
            "position_icrf_m = [7.0e6, 0.0, 0.0]\ndrift = true",
            " [spacecraft.target]: drift requires relative_to",
        ),
        (
            'attitude_file = "target.aem"',
            'attitude_file = "target.aem"\nattitude = "icrf"',
            " [spacecraft.target]: attitude_file contradicts attitude; give one of them",
        ),
        (
            "longest_gap_s = 100.0",
            "longest_gap_s = 0.0",
            " [spacecraft.chaser]: trajectory.longest_gap_s must be",
        ),
        (
            'attitude_file = "target.aem"',
            'attitude_file = { file = "target.aem", interpolation_error_m = 2.0 }',
            " [spacecraft.target]: attitude_file.interpolation_error_m is allowed only for "
            "positions",
        ),
        (
            'trajectory = "target.oem"',
            'orbit = { altitude_km = 400.0 }\njoint_file = { file = "j.csv", object = "a" }',
            " [spacecraft.target]: joint_file.object is allowed only for files of several objects",
        ),
    ],
)
def test_contradictions_are_one_line(folder: Path, old: str, new: str, complaint: str) -> None:
    assert SCENE.count(old) == 1
    path = scene(folder, SCENE.replace(old, new))
    with pytest.raises(ConfigError, match=re.escape(f"{path}{complaint}")):
        load_scenario(path)


def test_an_object_of_a_table_is_refused(folder: Path) -> None:
    path = scene(folder, SCENE.replace("longest_gap_s = 100.0", 'object = "chaser"'))
    with pytest.raises(ConfigError, match="is a table of one object; object = "):
        load_scenario(path)


@pytest.mark.parametrize("key", ["longest_gap_s", "interpolation_error_m"])
def test_two_line_elements_have_no_samples(key: str) -> None:
    station = Path(__file__).parents[2] / "examples" / "trajectories" / "station.tle"
    table = {"file": str(station), key: 10.0}
    data = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "spacecraft": {"station": {"model": "cubesat_12u", "trajectory": table}},
    }
    with pytest.raises(ConfigError, match=f"have no samples; {key} requires"):
        scenario_from_dict(data)


@pytest.mark.parametrize("key", ["trajectory", "attitude_file"])
def test_a_missing_file_names_table_and_key(folder: Path, key: str) -> None:
    name = {"trajectory": "target.oem", "attitude_file": "target.aem"}[key]
    (folder / name).unlink()
    path = scene(folder)
    expected = f"{path} [spacecraft.target]: {key}: {folder / name}: cannot be read"
    with pytest.raises(AssetError, match=re.escape(expected)):
        load_scenario(path)


HINGED = """\
[epoch]
utc = "2026-03-20T12:00:00"
[spacecraft.rider]
model = "space_rider"
orbit = { altitude_km = 400.0 }
joints_deg = { bay_door_left = -90.0 }
joint_file = "flaps.csv"
sun_tracking = ["panel_wing_left"]
"""
FLAPS = "time_s,joint_body_flap_left_deg,joint_body_flap_right_deg\n0,0,-10\n60,20,10\n"


def test_joints_follow_numbers_a_file_and_the_sun(folder: Path) -> None:
    (folder / "flaps.csv").write_text(FLAPS)
    scenario = load_scenario(scene(folder, HINGED))
    state = scenario.at(EPOCH + 15 * SECOND)
    body = state.bodies["rider"]
    angles = dict(zip((j.name for j in body.model.joints), body.model.angles, strict=True))
    assert np.degrees(angles["bay_door_left"]) == pytest.approx(-90.0)
    assert np.degrees(angles["body_flap_left"]) == pytest.approx(5.0)
    assert np.degrees(angles["body_flap_right"]) == pytest.approx(-5.0)
    assert angles["bay_door_right"] == 0.0
    sun = body.pose.R_icrf_from_body.T @ state.sun.seen_from(body.pose.position).direction_icrf
    angle = angles["panel_wing_left"]
    face = np.array([-np.sin(angle), 0.0, -np.cos(angle)])
    assert np.dot(face, sun) == pytest.approx(np.hypot(sun[0], sun[2]), abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            "bay_door_left = ",
            "bay_door = ",
            'joints_deg.bay_door "bay_door" is not a joint of',
        ),
        (
            "= -90.0 }",
            "= -120.0 }",
            'joints_deg.bay_door_left must turn "bay_door_left" within -110..40 deg, got -120',
        ),
        (
            '["panel_wing_left"]',
            '["body_flap_left"]',
            'sun_tracking cannot turn "body_flap_left"',
        ),
        (
            "bay_door_left = -90.0",
            "body_flap_left = 1.0",
            'joints_deg and the other keys move "body_flap_left" twice',
        ),
        ("flaps.csv", "none.csv", "joint_file: "),
        ("flaps.csv", "target.oem", "is not a table of joint angles"),
        ("flaps.csv", "chaser.csv", "names no joint angle joint_NAME_deg"),
    ],
)
def test_bad_joints_are_one_line(folder: Path, old: str, new: str, complaint: str) -> None:
    (folder / "flaps.csv").write_text(FLAPS)
    assert HINGED.count(old) == 1
    with pytest.raises(SimglError, match=re.escape(complaint)) as caught:
        load_scenario(scene(folder, HINGED.replace(old, new)))
    assert "\n" not in str(caught.value)


def test_an_epoch_outside_the_file_names_scenario_and_span(folder: Path) -> None:
    scenario = load_scenario(scene(folder))
    with pytest.raises(ConfigError, match=r"chaser\.csv.*covers 2026-03-20T12:00:00 to") as caught:
        scenario.at(EPOCH + 60 * SECOND)
    assert "\n" not in str(caught.value)
