"""What the window shows, and what keys change of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.physics.frames import lvlh_from_icrf
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.viewer.orbit_camera import FIELD_OF_VIEW
from simgl.viewer.subject import fitted
from simgl.viewer.view_commands import (
    BY_KEY,
    HELP_OF_SCENARIOS,
    HELP_OF_WINDOW,
    chosen_state,
    title,
)
from simgl.viewer.view_settings import ViewSettings, opening_settings
from simgl.viewer.viewport import viewer_state, window_camera
from tests.viewer.harness import orbit_camera, press


def test_the_first_look_sees_the_lit_side_from_outside_the_whole_craft(
    scenario: Scenario, look: ViewSettings
) -> None:
    state, _ = viewer_state(scenario, look, (960, 640))
    ball, camera = state.bodies["ball"], state.cameras["viewer"]
    outwards = camera.position - ball.pose.position
    assert np.dot(outwards, state.sun.seen_from(ball.pose.position).direction_icrf) > 0.0
    half_angle = np.arcsin(2.0 / np.linalg.norm(outwards))
    assert 0.25 * FIELD_OF_VIEW < half_angle < 0.35 * FIELD_OF_VIEW
    # Not upside down: the zenith lies towards the top of the picture.
    R_lvlh_from_icrf = lvlh_from_icrf(ball.pose.position, ball.pose.velocity)
    assert (camera.R_camera_from_icrf @ R_lvlh_from_icrf.T @ [0.0, 0.0, -1.0])[1] < 0.0


def test_the_window_camera_has_forty_degrees_from_top_to_bottom() -> None:
    assert np.degrees(window_camera((960, 640)).fields_of_view[1]) == pytest.approx(40.0)


def test_keys_change_what_is_shown(scenario: Scenario, look: ViewSettings) -> None:
    assert press(look, scenario, "space").playing
    assert press(look, scenario, "space", "space") == look
    assert press(look, scenario, "up", "+", "=").exposure_value == pytest.approx(1.0)
    assert press(look, scenario, "down", "-").exposure_value == pytest.approx(-2.0 / 3.0)
    assert press(look, scenario, "right").tai_ns == look.tai_ns + 10 * 10**9
    assert press(look, scenario, "]", "left").tai_ns == look.tai_ns - 20 * 10**9
    assert press(look, scenario, "]", "[") == look
    assert press(look, scenario, *["]"] * 99).speed == 4096.0
    assert press(look, scenario, *["["] * 99).speed == 1.0 / 64.0


def test_exposure_needs_no_new_picture_but_time_and_angle_do(
    scenario: Scenario, look: ViewSettings
) -> None:
    assert look.same_image(press(look, scenario, "up", "space", "]"))
    assert not look.same_image(press(look, scenario, "right"))
    assert not look.same_image(replace(look, orbit=look.orbit.dragged(0.1, 0.0)))
    through = press(look, scenario, "c")
    assert not look.same_image(through)
    assert through.same_image(replace(through, orbit=look.orbit.dragged(0.1, 0.0)))


def test_c_looks_through_each_scenario_camera_and_comes_back(
    scenario: Scenario, look: ViewSettings
) -> None:
    assert press(look, scenario, "c").camera == "square"
    assert press(look, scenario, "c", "c") == look


def test_t_goes_round_the_spacecraft_at_the_same_apparent_size(
    scenario: Scenario, look: ViewSettings
) -> None:
    other = press(look, scenario, "t")
    assert other.target == "small"
    assert other.orbit.range / other.orbit.nearest == pytest.approx(
        look.orbit.range / look.orbit.nearest
    )
    back = press(other, scenario, "t")
    assert back.target == "ball"
    assert back.orbit.range == pytest.approx(look.orbit.range)


def test_a_scenario_camera_gets_its_exposure_and_gain_from_keys(
    scenario: Scenario, look: ViewSettings
) -> None:
    through = press(look, scenario, "c", "up", "up", "up", "b", "b", "b")
    state, name = viewer_state(scenario, through, (960, 640))
    camera, own = state.cameras[name].camera, scenario.cameras["square"]
    assert (camera.name, camera.detector.width) == ("square", 200)
    assert camera.exposure_time == pytest.approx(2.0 * own.exposure_time)
    assert camera.detector.gain_dn_per_e == pytest.approx(0.5 * own.detector.gain_dn_per_e)
    assert press(through, scenario, "x", "c") == look


def test_the_sun_moves_by_five_degrees_from_where_it_stands(
    scenario: Scenario, look: ViewSettings
) -> None:
    before = scenario.at(look.tai_ns).sun.seen_from(np.zeros(3)).direction_icrf
    east = press(look, scenario, "l")
    after = chosen_state(scenario, east).sun.seen_from(np.zeros(3)).direction_icrf
    # On the grid of 5 deg: at most half a step beside the step, in either angle.
    assert np.degrees(np.arccos(before @ after)) < 5.0 + 2.5 + 2.5
    assert east.sun_deg is not None
    assert np.allclose(np.mod(east.sun_deg, 5.0), 0.0)
    north = press(east, scenario, "i")
    further = chosen_state(scenario, north).sun.seen_from(np.zeros(3)).direction_icrf
    assert np.degrees(np.arccos(after @ further)) == pytest.approx(5.0, abs=1e-6)
    assert press(look, scenario, *["k"] * 99).sun_deg == (east.sun_deg[0] - 5.0, -90.0)


def test_a_picture_is_centred_in_the_window_without_stretching() -> None:
    assert fitted((200, 200), (960, 640)) == (160, 0, 640, 640)
    assert fitted((300, 100), (90, 90)) == (0, 30, 90, 30)
    assert fitted((960, 640), (960, 640)) == (0, 0, 960, 640)


def test_the_title_says_what_when_and_how(scenario: Scenario, look: ViewSettings) -> None:
    changed = replace(press(look, scenario, "up"), orbit=orbit_camera(0.0, np.pi / 6, 25.5))
    assert title(changed) == (
        "simgl | ball az 0 el 30 deg, 25.5 m | 2026-03-20T12:00:00 UTC | +0.3 EV | paused x1"
    )
    assert title(press(changed, scenario, "space", "c"), 24.6) == (
        "simgl | square | 2026-03-20T12:00:00 UTC | +0.3 EV | playing x1 | 25 fps"
    )


def test_help_names_every_key() -> None:
    named = " ".join(keys for keys, _ in (*HELP_OF_SCENARIOS, *HELP_OF_WINDOW)).split()
    for key in (*BY_KEY, "drag", "scroll", "s", "h", "o", "r", "q", "escape"):
        assert key in named or (key.isdecimal() and "1..9" in named), key
    assert len(named) == len(set(named))


def test_a_scenario_without_spacecraft_is_refused() -> None:
    empty = scenario_from_dict({"epoch": {"utc": "2026-03-20T12:00:00"}})
    with pytest.raises(ConfigError, match="spacecraft is missing; the viewer circles a"):
        opening_settings(empty, None)


def test_an_unknown_target_is_refused_with_a_suggestion(scenario: Scenario) -> None:
    with pytest.raises(ConfigError, match=r'--target "bal" is not in .*; did you mean "ball"\?'):
        opening_settings(scenario, "bal")
