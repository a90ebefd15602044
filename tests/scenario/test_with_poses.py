"""Poses and a Sun that a simulation sends take the place of the scenario's own laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simgl import ConfigError, load_scenario, scenario_from_dict
from simgl.scene.state import SunAtPosition, SunInDirection

EXAMPLES = Path(__file__).parents[2] / "examples"


def arrays(value: Any, name: str = "") -> Iterator[tuple[str, bytes]]:
    """Every array and number of a state, by name."""
    if is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            yield from arrays(getattr(value, field.name), f"{name}.{field.name}")
    elif isinstance(value, Mapping):
        for key in value:
            yield from arrays(value[key], f"{name}.{key}")
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            yield from arrays(item, f"{name}[{index}]")
    elif isinstance(value, np.ndarray):
        yield name, value.tobytes()
    elif isinstance(value, int | float | str | None):
        yield name, repr(value).encode()


# A camera that keeps away from the Sun; drives that follow it; orbits about each other.
@pytest.mark.parametrize("name", ["pointing", "servicer", "approach"])
def test_what_the_scenario_has_anyway_may_be_sent_without_any_change(name: str) -> None:
    scenario = load_scenario(EXAMPLES / f"{name}.toml")
    tai_ns = scenario.epoch_tai_ns + 60_000_000_000
    state = scenario.at(tai_ns)
    sun = state.sun.position if isinstance(state.sun, SunAtPosition) else None
    sent = scenario.with_poses(tai_ns, scenario.poses(tai_ns), sun=sun)
    assert dict(arrays(sent)) == dict(arrays(state))


def test_a_law_relative_to_a_sent_spacecraft_follows_it() -> None:
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-06-21T12:00:00"},
            "spacecraft": {
                "lead": {
                    "model": "cubesat_12u",
                    "orbit": {"altitude_km": 500.0, "inclination_deg": 51.6},
                },
                "tail": {
                    "model": "cubesat_12u",
                    "relative_to": "lead",
                    "position_lvlh_m": [-30.0, 0.0, 0.0],
                },
            },
        }
    )
    tai_ns = scenario.epoch_tai_ns
    before = scenario.at(tai_ns).bodies
    lead = before["lead"].pose
    shift = np.array([0.0, 0.0, 1000.0])
    state = scenario.with_poses(tai_ns, {"lead": replace(lead, position=lead.position + shift)})
    np.testing.assert_array_equal(state.bodies["lead"].pose.position, lead.position + shift)
    # The LVLH axes turn by 1000 m over 6,878 km: 30 m of distance move by 4 mm beyond the shift.
    moved = state.bodies["tail"].pose.position - before["tail"].pose.position
    np.testing.assert_allclose(moved, shift, atol=5e-3)


@pytest.mark.parametrize(
    ("place", "axes"),
    [
        ({"position_icrf_m": [7.0e6, 0.0, 0.0]}, "icrf"),
        ({"relative_to": "lead", "position_lvlh_m": [-30.0, 0.0, 0.0]}, "lvlh"),
    ],
)
def test_a_place_with_a_velocity_is_left(place: dict[str, Any], axes: str) -> None:
    """2 m/s for 10 s; the LVLH frame moves along with its spacecraft."""
    moving = {**place, f"velocity_{axes}_m_s": [0.0, 2.0, 0.0]}
    lead = {"model": "cubesat_12u", "orbit": {"altitude_km": 500.0}}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-06-21T12:00:00"},
            "spacecraft": {
                "lead": lead,
                "still": {"model": "cubesat_12u", **place},
                "moving": {"model": "cubesat_12u", **moving},
            },
        }
    )
    for seconds in (0.0, 10.0):
        bodies = scenario.at(scenario.epoch_tai_ns + round(seconds * 1e9)).bodies
        way = bodies["moving"].pose.position - bodies["still"].pose.position
        # Differences of places of 7e6 m.
        assert np.linalg.norm(way) == pytest.approx(2.0 * seconds, abs=5e-9)


def test_a_sun_given_by_direction_takes_only_the_direction_of_a_sent_one() -> None:
    scenario = load_scenario(EXAMPLES / "bridge" / "box.toml")
    assert isinstance(scenario.sun, SunInDirection)
    sun = scenario.with_poses(scenario.epoch_tai_ns, {}, sun=np.array([0.0, -3e11, 4e11])).sun
    assert isinstance(sun, SunInDirection)
    np.testing.assert_allclose(sun.direction_icrf, [0.0, -0.6, 0.8], rtol=1e-15)
    assert sun.light is scenario.sun.light


def test_names_that_the_scenario_does_not_have_are_refused() -> None:
    scenario = load_scenario(EXAMPLES / "approach.toml")
    tai_ns = scenario.epoch_tai_ns
    target = scenario.poses(tai_ns)["target"]
    with pytest.raises(ConfigError, match='bodies has no "targt"; did you mean "target"'):
        scenario.with_poses(tai_ns, {"targt": target})
    with pytest.raises(ConfigError, match='joint_angles has no "targt"; did you mean "target"'):
        scenario.with_poses(tai_ns, {}, joint_angles={"targt": {"flap_left": 0.1}})
    with pytest.raises(ConfigError, match='exposure_times has no "navcm"; did you mean "navcam"'):
        scenario.with_poses(tai_ns, {}, {"navcm": 0.001})


@pytest.mark.parametrize(
    ("field", "value", "problem"),
    [
        ("position", np.array([7e6, np.nan, 0.0]), "must be finite"),
        ("position", [7e6, 0.0, 0.0], "must be an array of shape"),
        ("velocity", np.zeros(2), "must be an array of shape"),
        ("R_icrf_from_body", 1.001 * np.eye(3), "must be a rotation"),
        ("R_icrf_from_body", np.diag([1.0, 1.0, -1.0]), "must be a rotation"),
        ("R_icrf_from_body", np.eye(4), "must be an array of shape"),
    ],
)
def test_a_pose_that_cannot_be_is_refused_by_name(field: str, value: Any, problem: str) -> None:
    scenario = load_scenario(EXAMPLES / "approach.toml")
    pose = scenario.poses(scenario.epoch_tai_ns)["target"]
    with pytest.raises(ConfigError, match=rf"bodies\.target\.{field} {problem}"):
        scenario.with_poses(scenario.epoch_tai_ns, {"target": replace(pose, **{field: value})})


def test_a_rotation_in_single_precision_is_one() -> None:
    scenario = load_scenario(EXAMPLES / "approach.toml")
    pose = scenario.poses(scenario.epoch_tai_ns)["target"]
    single = replace(pose, R_icrf_from_body=pose.R_icrf_from_body.astype(np.float32))
    assert (
        scenario.with_poses(scenario.epoch_tai_ns, {"target": single}).bodies["target"].pose
        is single
    )
