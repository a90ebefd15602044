"""Epochs of a sequence: where they lie, and where events begin, by geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.physics.frames import lvlh_from_icrf
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.sequence.epoch_options import Event
from simgl.sequence.epochs import at_random, event_epochs, limb_behind, regular, spread

SECOND = 1_000_000_000
START = tai_ns_from_utc("2026-03-20T12:00:00")
ALTITUDE = 400e3
AXIS = WGS84_EQUATORIAL_RADIUS + ALTITUDE
MOTION = np.sqrt(EARTH_MU / AXIS**3)  # [rad s-1]


def orbiter() -> Scenario:
    """An equatorial orbit about a sphere without air, the Sun on the x axis, small and fixed.

    The craft starts on the far side of the Earth from nothing: at the x axis, under the Sun.
    """
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {"direction_icrf": [1.0, 0.0, 0.0], "angular_diameter_deg": 0.01},
            "earth": {"shape": "sphere", "radius_km": 6378.137},
            "spacecraft": {
                "target": {
                    "model": {"sphere": {"radius_m": 1.0, "material": "white_paint"}},
                    "orbit": {"altitude_km": 400.0},
                },
                "chaser": {
                    "model": {"sphere": {"radius_m": 0.1, "material": "white_paint"}},
                    "relative_to": "target",
                    "position_lvlh_m": [-100.0, 0.0, 0.0],
                },
            },
            "camera": {
                "ahead": {
                    "on": "chaser",
                    "position_body_m": [0.2, 0.0, 0.0],
                    "boresight": [1.0, 0.0, 0.0],
                    "up": [0.0, 0.0, -1.0],
                    "width_px": 100,
                    "height_px": 100,
                    "focal_length_mm": 2.0,
                }
            },
        }
    )


def found_s(kind: Event, step_s: int = 20) -> list[float]:
    """Seconds after the start, over one revolution."""
    stop = START + round(2.0 * np.pi / MOTION * SECOND)
    epochs = event_epochs(orbiter(), kind, "ahead", "target", START, stop, step_s * SECOND)
    return [(epoch - START) / SECOND for epoch in epochs]


@pytest.mark.parametrize(
    ("kind", "side"),
    [
        (Event.ECLIPSE_ENTRY, -1.0),
        (Event.UMBRA_ENTRY, -1.0),
        (Event.UMBRA_EXIT, 1.0),
        (Event.ECLIPSE_EXIT, 1.0),
    ],
)
def test_eclipse_begins_and_ends_at_the_edge_of_the_shadow(kind: Event, side: float) -> None:
    """A cylinder of the Earth's radius, behind the Earth: sin(angle past the limb) = R / a.

    The penumbra is 0.01 deg wide in the Sun's angle; here that is 0.01 deg of orbit angle over
    cos of the dip (20 deg), 0.2 s.
    """
    half_angle = np.arcsin(WGS84_EQUATORIAL_RADIUS / AXIS)
    expected = (np.pi + side * half_angle) / MOTION
    assert found_s(kind) == pytest.approx([expected], abs=0.2)


def test_the_sun_comes_into_view_at_the_edge_of_the_picture() -> None:
    """The camera looks along the velocity, 90 deg ahead of the place: it turns towards the Sun.

    100 pixels of 3.75 um at 2 mm: 5.36 deg to either side, and the disc's radius.
    """
    half_field = np.arctan(50 * 3.75e-6 / 2e-3)
    expected = (1.5 * np.pi - half_field - np.radians(0.005)) / MOTION
    # The camera is 100 m behind the target, 0.013 s.
    assert found_s(Event.SUN_IN_VIEW) == pytest.approx([expected], abs=0.02)


def test_the_limb_comes_behind_a_target_where_its_dip_says() -> None:
    """Level ahead is 19.8 deg above the limb; seen from so much above, it is behind."""
    assert found_s(Event.LIMB_BEHIND_TARGET) == []
    dip = np.arccos(WGS84_EQUATORIAL_RADIUS / AXIS)
    state = orbiter().at(START)
    target = state.bodies["target"].pose
    nearby = state.cameras["ahead"]
    R_lvlh_from_icrf = lvlh_from_icrf(target.position, target.velocity)
    for above_deg, expected in ((-0.7, False), (-0.5, True), (0.5, True), (0.7, False)):
        angle = dip + np.radians(above_deg)
        back = 100.0 * R_lvlh_from_icrf.T @ np.array([-np.cos(angle), 0.0, -np.sin(angle)])
        camera = replace(nearby, position=target.position + back)
        # 1 m at 100 m is 0.573 deg.
        assert limb_behind(state, camera, "target") is expected


def test_spans_are_divided_as_asked() -> None:
    assert regular(0, 10, 3) == [0, 3, 6, 9]
    assert regular(0, 9, 3) == [0, 3, 6, 9]
    assert spread(0, 9, 4) == [0, 3, 6, 9]
    assert spread(5, 9, 1) == [5]
    with pytest.raises(ConfigError, match="at most 1000000"):
        regular(0, 10**9, 1)


def test_random_epochs_are_uniform_sorted_and_seeded() -> None:
    """Mean of 4,000 uniform values: 1/2 within 4 standard errors of 1 / sqrt(12 n)."""
    drawn = at_random(0, 10**9, 4000, seed=3)
    assert drawn == sorted(drawn)
    assert drawn == at_random(0, 10**9, 4000, seed=3)
    assert drawn != at_random(0, 10**9, 4000, seed=4)
    assert np.mean(drawn) / 1e9 == pytest.approx(0.5, abs=4.0 / np.sqrt(12 * 4000))
    assert min(drawn) >= 0
    assert max(drawn) <= 10**9
