"""Scenario files: the shipped examples load, units go to SI, and damage is named in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simgl.camera.detector import FixedPattern
from simgl.errors import AssetError, ConfigError, SimglError
from simgl.motion.mounts import BodyMount, OrbitingMount
from simgl.motion.orbits import KeplerianOrbit
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.physics.solar_disc import UNIFORM, astm_g173_light, limb_darkening
from simgl.physics.spectrum import black_body_light
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import EphemerisSun
from simgl.scene.state import SunInDirection
from tests.scenario.damages import BAD_FILES, BAD_VALUES
from tests.scenario.damages.damage import (
    EPOCH,
    LOOK,
    MODEL,
    ORBIT,
    PINHOLE,
    SEED,
    SHAPE,
    SUNWARD,
    VALID,
    Damage,
    written,
)

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))


def refusal(path: Path) -> SimglError:
    """The error of loading a file."""
    with pytest.raises(SimglError) as caught:
        load_scenario(path)
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize("damage", BAD_VALUES, ids=lambda d: d.name)
def test_a_damaged_file_is_refused_with_place_value_and_what_is_allowed(
    damage: Damage, tmp_path: Path
) -> None:
    path = written(tmp_path, damage.text())
    error = refusal(path)
    assert type(error) is ConfigError
    assert str(error) == damage.complaint(path)


@pytest.mark.parametrize("damage", BAD_FILES, ids=lambda d: d.name)
def test_a_file_that_names_a_missing_one_is_refused(damage: Damage, tmp_path: Path) -> None:
    path = written(tmp_path, damage.text())
    error = refusal(path)
    assert type(error) is AssetError
    assert str(error) == damage.complaint(path)


def test_a_misspelt_keypoint_is_answered_with_the_models_own(tmp_path: Path) -> None:
    path = written(tmp_path, VALID.replace(PINHOLE, 'on = "chaser"\nkeypoint = "docking_prt"'))
    expected = (
        f'{path} [camera.nav]: keypoint is not on "cubesat_12u": "docking_prt"; '
        'did you mean "docking_port"? (allowed: '
    )
    assert str(refusal(path)).startswith(expected)


def test_relative_places_in_a_circle_are_refused_when_the_file_is_read(tmp_path: Path) -> None:
    circle = "\n".join(
        f'[spacecraft.{name}]\nmodel = "cubesat_12u"\nrelative_to = "{other}"\n'
        "position_lvlh_m = [1.0, 0.0, 0.0]"
        for name, other in (("a", "b"), ("b", "c"), ("c", "a"))
    )
    path = written(tmp_path, f"{EPOCH}{circle}")
    expected = f"{path} [spacecraft.a]: relative_to runs in a circle: a -> b -> c -> a"
    assert str(refusal(path)) == expected


def test_a_syntax_error_names_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, VALID.replace(SEED, "seed = = 1"))
    line = VALID[: VALID.index(SEED)].count("\n") + 1
    expected = f"{path}: is not valid TOML: Invalid value (at line {line}, column 8): seed = = 1"
    assert str(refusal(path)) == expected


def test_a_number_of_too_many_digits_is_no_crash(tmp_path: Path) -> None:
    path = written(tmp_path, VALID.replace(SEED, "seed = 1" + "0" * 5000))
    assert str(refusal(path)).startswith(f"{path}: is not valid TOML: ")


def test_a_file_that_is_not_utf_8_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "latin.toml"
    path.write_bytes(b'name = "\xe9t\xe9"\n')
    assert str(refusal(path)) == f"{path}: is not UTF-8 text (byte 8)"


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    missing = tmp_path / "no.toml"
    assert str(refusal(missing)) == f"{missing}: cannot be read (No such file or directory)"
    assert str(refusal(tmp_path)) == f"{tmp_path}: cannot be read (Is a directory)"


def test_an_empty_file_asks_for_the_epoch(tmp_path: Path) -> None:
    path = written(tmp_path, "")
    expected = f'{path}: epoch is missing; write [epoch] utc = "2026-03-20T12:00:00"'
    assert str(refusal(path)) == expected


def test_a_table_built_in_a_program_is_checked_like_a_file() -> None:
    with pytest.raises(ConfigError) as caught:
        scenario_from_dict({"epoch": {"utc": "2026-03-20"}, "sun": {"visible": "no"}}, name="mine")
    assert str(caught.value) == 'mine [sun]: visible must be true or false, got "no"'
    assert (caught.value.where, caught.value.key) == ("mine [sun]", "visible")


def test_a_camera_that_meets_its_target_is_refused_with_the_files_name(tmp_path: Path) -> None:
    path = written(tmp_path, VALID.replace(PINHOLE, "position_icrf_m = [7.0e6, 0.0, 0.0]"))
    scenario = load_scenario(path)
    with pytest.raises(ConfigError) as caught:
        scenario.at(scenario.epoch_tai_ns)
    expected = (
        f'{path} [camera.nav]: look_at cannot look at "plate", whose origin is at the pinhole'
    )
    assert str(caught.value) == expected


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_every_example_loads_and_has_a_scene_at_its_epoch(path: Path) -> None:
    scenario = load_scenario(path)
    assert scenario.cameras
    state = scenario.at(scenario.epoch_tai_ns)
    assert set(state.cameras) == set(scenario.cameras)
    assert set(state.bodies) == set(scenario.models)


def test_the_approach_starts_200_m_behind_with_the_target_ahead() -> None:
    scenario = load_scenario(next(p for p in EXAMPLES if p.stem == "approach"))
    state = scenario.at(scenario.epoch_tai_ns)
    chaser, target = state.bodies["chaser"].pose, state.bodies["target"].pose
    line = target.position - chaser.position
    # Places of 7e6 m: 1e-9 m each.
    assert np.linalg.norm(line) == pytest.approx(200.0, abs=1e-8)
    along = target.velocity / np.linalg.norm(target.velocity)
    assert np.dot(line, along) == pytest.approx(200.0, abs=1e-8)


def test_units_of_the_file_become_si(tmp_path: Path) -> None:
    text = VALID.replace(
        LOOK,
        f"{LOOK}\nfocal_length_mm = 25.0\nf_number = 2.0\nexposure_time_s = 0.01\nbits = 10\n"
        "pixel_pitch_um = 5.0\nwidth_px = 640\nheight_px = 480\ngain_e_per_dn = 4.0\n"
        "pedestal_dn = 32\nfull_well_e = 9000.0\nread_noise_e = 3.0\ntransmission = 0.9\n"
        "quantum_efficiency = [0.1, 0.2, 0.3, 0.4]",
    )
    camera = load_scenario(written(tmp_path, text)).cameras["nav"]
    lens, detector = camera.lens, camera.detector
    assert (lens.focal_length, lens.f_number, camera.exposure_time) == (0.025, 2.0, 0.01)
    assert lens.transmission == (0.9, 0.9, 0.9, 0.9)
    assert (detector.width, detector.height, detector.bits) == (640, 480, 10)
    assert detector.pixel_pitch == pytest.approx(5e-6, rel=1e-15)
    assert (detector.full_well, detector.read_noise, detector.pedestal) == (9000.0, 3.0, 32.0)
    assert detector.gain_dn_per_e == 0.25
    assert detector.quantum_efficiency == (0.1, 0.2, 0.3, 0.4)


def test_units_of_the_detector_become_si(tmp_path: Path) -> None:
    text = VALID.replace(
        LOOK,
        f'{LOOK}\npreset = "ideal"\nserial = 7\nfill_factor = 0.5\nanalogue_gain = 4.0\n'
        "gain_e_per_dn = 2.0\ndark_current_e_s = 10.0\ntemperature_k = 293.15\nprnu = 0.01\n"
        "dead_pixels = 0.02\ndsnu_e = 3.0\nrow_pattern_e = 4.0\ncolumn_pattern_e = 5.0\n"
        "hot_pixels = 0.06\nhot_current_e_s = 7.0\nrow_noise_e = 8.0\nblooming = 0.9\n"
        'shutter = "rolling"\nrow_time_us = 20.0\n'
        "particles = { flux_cm2_s = 30.0, depth_um = 4.0, charge_e_um = 50.0 }",
    )
    detector = load_scenario(written(tmp_path, text)).cameras["nav"].detector
    assert (detector.serial, detector.fill_factor, detector.gain_dn_per_e) == (7, 0.5, 2.0)
    # 10 e- s-1 at 300 K are 5.640448 at 20 C.
    assert detector.dark_current == pytest.approx(5.640448, rel=1e-6)
    pattern = FixedPattern(
        prnu=0.01,
        dead_pixels=0.02,
        dsnu=3.0,
        rows=4.0,
        columns=5.0,
        hot_pixels=0.06,
        hot_current=7.0,
    )
    assert detector.pattern == pattern
    assert (detector.row_noise, detector.blooming) == (8.0, 0.9)
    assert detector.row_time == pytest.approx(20e-6, rel=1e-15)
    assert detector.particles is not None
    got = (detector.particles.flux, detector.particles.depth, detector.particles.charge)
    assert got == pytest.approx((30e4, 4e-6, 50e6), rel=1e-15)


def test_a_camera_has_the_pattern_of_its_name_unless_a_serial_number_says_otherwise(
    tmp_path: Path,
) -> None:
    camera = f"[camera.nav]\n{PINHOLE}\n{LOOK}\n"
    other = camera.replace("nav", "other")
    first, second = (
        load_scenario(written(tmp_path, VALID.replace(camera, text))).cameras
        for text in (camera + other, camera + "serial = 5\n" + other + "serial = 5\n")
    )
    assert first["nav"].detector.serial != first["other"].detector.serial
    assert second["nav"].detector.serial == second["other"].detector.serial == 5


def test_orbit_angles_and_heights_become_si(tmp_path: Path) -> None:
    orbit = (
        "orbit = { semi_major_axis_km = 7000.0, eccentricity = 0.01, inclination_deg = 90.0, "
        "raan_deg = 180.0, argument_of_perigee_deg = 45.0, true_anomaly_deg = -60.0 }"
    )
    scenario = load_scenario(written(tmp_path, VALID.replace(ORBIT, orbit)))
    law = scenario.motions["chaser"].trajectory
    assert isinstance(law, KeplerianOrbit)
    angles = (law.inclination, law.raan, law.argument_of_perigee, law.true_anomaly)
    np.testing.assert_allclose(angles, np.pi * np.array([1 / 2, 1, 1 / 4, -1 / 3]), rtol=1e-15)
    assert (law.semi_major_axis, law.eccentricity) == (7.0e6, 0.01)
    assert law.epoch_tai_ns == tai_ns_from_utc("2026-03-20T12:00:00")
    scenario = load_scenario(written(tmp_path, VALID))
    law = scenario.motions["chaser"].trajectory
    assert isinstance(law, KeplerianOrbit)
    # A circular orbit's height is counted from the equatorial radius.
    assert law.semi_major_axis == 6378137.0 + 400e3


def test_an_omitted_sun_is_the_real_one_and_a_direction_fixes_it(tmp_path: Path) -> None:
    real = load_scenario(written(tmp_path, VALID.replace(SUNWARD, ""))).sun
    assert isinstance(real, EphemerisSun)
    assert real.radius == 6.957e8
    text = VALID.replace(
        SUNWARD,
        "direction_icrf = [0.0, 0.0, 2.0]\nirradiance_w_m2 = 1367.0\ntemperature_k = 5777.0\n"
        "angular_diameter_deg = 0.526\nvisible = false",
    )
    fixed = load_scenario(written(tmp_path, text)).sun
    assert isinstance(fixed, SunInDirection)
    np.testing.assert_array_equal(fixed.direction_icrf, [0.0, 0.0, 1.0])
    assert np.degrees(fixed.angular_radius) == pytest.approx(0.263, rel=1e-12)
    assert fixed.light.irradiance[1] == pytest.approx(174.774, abs=5e-4)
    assert not fixed.visible


def test_the_earth_is_wgs84_unless_the_file_says_otherwise(tmp_path: Path) -> None:
    earth = load_scenario(written(tmp_path, VALID.replace(SHAPE, ""))).earth
    assert earth is not None
    assert earth.radii == (6378137.0, 6378137.0, 6356752.314245)
    assert earth.albedo is None
    text = VALID.replace(SHAPE, 'shape = "sphere"\nradius_km = 6371.0\nalbedo = 0.3')
    earth = load_scenario(written(tmp_path, text)).earth
    assert earth is not None
    assert earth.radii == (6.371e6,) * 3
    assert earth.albedo == (0.3,) * 4
    assert load_scenario(written(tmp_path, VALID)).earth is None


def test_a_camera_on_a_keypoint_stands_there(tmp_path: Path) -> None:
    text = VALID.replace(PINHOLE, 'on = "chaser"\nkeypoint = "camera_aperture"')
    mount = load_scenario(written(tmp_path, text)).mounts["nav"]
    assert isinstance(mount, BodyMount)
    np.testing.assert_array_equal(mount.position_body, [0.221, -0.085, -0.035])


def test_a_camera_about_a_body_takes_its_angles_in_degrees(tmp_path: Path) -> None:
    about = 'about = { target = "chaser", azimuth_deg = 90.0, elevation_deg = -30.0, range_m = 5 }'
    text = VALID.replace(f"{PINHOLE}\n{LOOK}", about)
    mount = load_scenario(written(tmp_path, text)).mounts["nav"]
    assert isinstance(mount, OrbitingMount)
    assert (mount.target, mount.range) == ("chaser", 5.0)
    np.testing.assert_allclose(
        [mount.azimuth, mount.elevation], [np.pi / 2, -np.pi / 6], rtol=1e-15
    )


def test_paths_start_at_the_folder_of_the_scenario(tmp_path: Path) -> None:
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    text = VALID.replace(MODEL, 'model = "models/tri.obj"\nunit_m = 0.001')
    model = load_scenario(written(tmp_path, text)).models["chaser"]
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    # One rounding to float32.
    np.testing.assert_allclose(model.mesh.positions, corners * 1e-3, rtol=1e-7)


def test_the_same_scenario_gives_the_same_scene_at_the_same_instant(tmp_path: Path) -> None:
    one, two = (load_scenario(written(tmp_path, VALID)) for _ in range(2))
    later = one.epoch_tai_ns + 10**12
    a, b = one.at(later).bodies["chaser"].pose, two.at(later).bodies["chaser"].pose
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.R_icrf_from_body, b.R_icrf_from_body)
    # The law's own epoch is the scenario's: asked for another one, it moves on.
    assert np.linalg.norm(one.at(one.epoch_tai_ns).bodies["chaser"].pose.position - a.position) > 1


def test_poses_that_a_simulation_sends_replace_the_files_laws(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, VALID))
    sent = scenario.poses(scenario.epoch_tai_ns)
    sent["chaser"] = replace(sent["chaser"], position=np.array([1.0, 2.0, 3.0]))
    state = scenario.with_poses(scenario.epoch_tai_ns, sent, {"nav": 0.25})
    np.testing.assert_array_equal(state.bodies["chaser"].pose.position, [1.0, 2.0, 3.0])
    assert state.cameras["nav"].camera.exposure_time == 0.25
    assert scenario.cameras["nav"].exposure_time == 0.0005


def test_numbers_and_arrays_of_numpy_serve_in_a_dictionary() -> None:
    data = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "earth": {"shape": "none"},
        "sun": {"direction_icrf": np.array([0.0, 0.0, 1.0]), "irradiance_w_m2": np.float32(1367.0)},
        "camera": {"cam": {"position_icrf_m": (0, np.float64(1.0), 2), "boresight": [1, 0, 0]}},
    }
    scenario = scenario_from_dict(data)
    position = scenario.at(scenario.epoch_tai_ns).cameras["cam"].position
    np.testing.assert_array_equal(position, [0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("table", "darkened"),
    [
        ({}, True),
        ({"angular_diameter_deg": 0.526}, False),
        ({"direction_icrf": [1.0, 0.0, 0.0]}, False),
        ({"limb_darkening": False}, False),
        ({"direction_icrf": [1.0, 0.0, 0.0], "limb_darkening": True}, True),
        ({"angular_diameter_deg": 0.526, "limb_darkening": True}, True),
    ],
)
def test_the_suns_disc_darkens_unless_it_is_given_by_hand(
    table: dict[str, object], darkened: bool
) -> None:
    scenario = scenario_from_dict({"epoch": {"utc": "2026-03-20T12:00:00"}, "sun": table})
    seen = scenario.at(scenario.epoch_tai_ns).sun.seen_from(np.array([7e6, 0.0, 0.0]))
    np.testing.assert_array_equal(seen.limb, limb_darkening() if darkened else UNIFORM)


def test_a_measured_spectrum_is_scaled_to_the_given_irradiance() -> None:
    table = {"spectrum": "astm_g173", "irradiance_w_m2": 1000.0}
    scenario = scenario_from_dict({"epoch": {"utc": "2026-03-20T12:00:00"}, "sun": table})
    assert isinstance(scenario.sun, EphemerisSun)
    light, expected = scenario.sun.light_at_1_au, astm_g173_light(1000.0)
    np.testing.assert_array_equal(light.irradiance, expected.irradiance)
    np.testing.assert_array_equal(light.photons_per_joule, expected.photons_per_joule)


@pytest.mark.parametrize(
    ("spectrum", "power"),
    [
        ({"power_w": [1.0, 2.0, 3.0, 4.0]}, [1.0, 2.0, 3.0, 4.0]),
        ({"power_w": 10.0, "band_shares": [0.1, 0.2, 0.3, 0.4]}, [1.0, 2.0, 3.0, 4.0]),
        (
            {"power_w": 10.0, "temperature_k": 3000.0},
            black_body_light(10.0, 3000.0).irradiance.tolist(),
        ),
    ],
)
def test_a_lamps_power_goes_to_the_bands(spectrum: dict[str, object], power: list[float]) -> None:
    craft = {"model": "cubesat_12u", "position_icrf_m": [7e6, 0.0, 0.0]}
    lamp = {"on": "a", "keypoint": "docking_port", "boresight": [0, 0, 2.0], "half_angle_deg": 30}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"a": craft},
            "lamp": {"spot": {**lamp, **spectrum}},
        }
    )
    (state,) = scenario.at(scenario.epoch_tai_ns).lamps
    np.testing.assert_allclose(state.lamp.power, power, rtol=1e-15)
    np.testing.assert_allclose(state.lamp.half_angle, np.pi / 6.0, rtol=1e-15)
    np.testing.assert_allclose(state.direction, [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(state.position, [7e6 + 0.176, 0.06, 0.0], atol=1e-8)


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (None, "must be a table of tables, got None"),
        ([1], "must be a table of tables, got "),
        ({1: {}}, "1 is not a table here"),
        ({"epoch": {"utc": "2026-03-20T12:00:00"}, "camera": {1: {2: 3}}}, "2 is not a key here"),
    ],
)
def test_what_is_no_table_is_told_as_such(data: Any, problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        scenario_from_dict(data)
