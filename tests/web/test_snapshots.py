"""The newest snapshot replaces the last one, and of commands of a kind only the last counts."""

from __future__ import annotations

from typing import Any

import pytest

from simgl.errors import ConfigError
from simgl.web.snapshots import NewestSnapshot, Snapshot
from simgl.web.web_settings import WebSettings, changed, chosen_state
from tests.web.small_scene import box_scenario


def test_what_nobody_took_is_replaced() -> None:
    newest = NewestSnapshot(box_scenario())
    news = []
    newest.on_news(lambda: news.append(True))
    state = newest.scenario.at(0)
    first, last = (Snapshot(state=state, images={}) for _ in range(2))
    newest.publish(first)
    newest.publish(last)
    assert newest.newest() == (2, last)
    assert len(news) == 2


def test_nothing_is_wanted_until_a_viewer_took_the_last() -> None:
    newest = NewestSnapshot(box_scenario())
    assert not newest.wait_until_wanted(0.0)
    newest.watch("viewer", "nav", "dn")
    assert newest.wait_until_wanted(0.0)
    newest.publish(Snapshot(state=newest.scenario.at(0), images={}))
    assert not newest.wait_until_wanted(0.0)
    newest.newest()
    assert newest.wait_until_wanted(0.0)
    newest.forget("viewer")
    assert not newest.wait_until_wanted(0.0)


def test_commands_of_a_kind_do_not_queue() -> None:
    newest = NewestSnapshot(box_scenario())
    for second in range(1000):
        newest.command("time", {"time_s": second})
        newest.command(f"nonsense {second}", {})
    commands, _ = newest.take_commands(0.0)
    assert commands[0] == ("time", {"time_s": 999})
    assert len(commands) == 32
    assert newest.take_commands(0.0) == ([], False)


def test_settings_change_what_is_drawn() -> None:
    scenario, settings = box_scenario(), WebSettings()
    chosen: dict[str, dict[str, Any]] = {
        "time": {"time_s": 60},
        "exposure nav": {"camera": "nav", "exposure_time_s": 0.25},
        "sun": {"right_ascension_deg": 90.0, "declination_deg": 0.0},
    }
    for kind, values in chosen.items():
        settings = changed(settings, scenario, kind, values)
    state = chosen_state(scenario, settings)
    assert state.tai_ns == scenario.epoch_tai_ns + 60 * 10**9
    assert state.cameras["nav"].camera.exposure_time == 0.25
    towards = state.sun.seen_from(state.bodies["box"].pose.position).direction_icrf
    assert towards == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    as_scenario = changed(settings, scenario, "sun", {"as_scenario": True})
    assert as_scenario.sun is None


@pytest.mark.parametrize(
    ("kind", "values", "reason"),
    [
        ("time", {}, "time_s must lie in"),
        ("time", {"time_s": float("nan")}, "time_s must lie in"),
        ("time", {"time_s": True}, "time_s must lie in"),
        ("speed", {"speed": "fast"}, "speed must lie in -1000..1000, got 'fast'"),
        ("exposure", {"camera": "nav", "exposure_time_s": 0.0}, "exposure_time_s must lie in"),
        ("exposure", {"camera": ["nav"]}, "camera must be one of nav"),
        ("sun", {"right_ascension_deg": 0.0}, "declination_deg must lie in -90..90, got None"),
        ("delete", {}, "delete is not a command; there are time, play"),
    ],
)
def test_an_impossible_command_is_named(kind: str, values: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        changed(WebSettings(), box_scenario(), kind, values)
