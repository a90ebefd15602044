"""Promises of the simulator: pictures are functions of the state, simulators do not disturb."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import ALL_PRODUCTS, Product, Simulator
from tests.scenes import lambert, scene

BALL = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}


def scenario(**camera: float) -> Scenario:
    return scene(
        {"ball": {"model": BALL, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, -90, 9], "look_at": "ball", **camera},
    )


def test_a_picture_depends_on_the_state_alone(gl: moderngl.Context) -> None:
    """Whatever was drawn in between, the same state gives the same bits."""
    one = scene(
        {"craft": {"model": "space_rider", "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [-60, 13, -21], "look_at": "craft"},
        sun_direction=(-0.8, -0.3, -0.5),
    )
    state = one.at(one.epoch_tai_ns)
    moved = replace(state.bodies["craft"].pose, position=np.array([1.0, 2.0, 3.0]))
    other = replace(state, bodies={"craft": replace(state.bodies["craft"], pose=moved)})
    with Simulator(one, gl) as simulator:
        first = simulator.capture(state, "cam", ALL_PRODUCTS)
        between = simulator.capture(other, "cam", ALL_PRODUCTS)
        again = simulator.capture(state, "cam", ALL_PRODUCTS)
    assert first.digital is not None
    assert between.digital is not None
    assert again.digital is not None
    assert first.radiance is not None
    assert again.radiance is not None
    assert first.radiance.radiance.tobytes() == again.radiance.radiance.tobytes()
    assert first.digital.dn.tobytes() == again.digital.dn.tobytes()
    assert between.digital.dn.tobytes() != again.digital.dn.tobytes()


def test_stars_behind_a_craft_do_not_keep_the_earth_that_was_there_before(
    gl: moderngl.Context,
) -> None:
    """First towards the Earth, then away from it: the same as away from it at once."""
    data = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "spacecraft": {"ball": {"model": BALL, "orbit": {"altitude_km": 400.0}}},
        "camera": {
            name: {
                "about": {"target": "ball", "azimuth_deg": azimuth, "range_m": 90.0},
                "width_px": 96,
                "height_px": 64,
            }
            for name, azimuth in (("down", 90.0), ("up", -90.0))
        },
    }
    one = scenario_from_dict(data)
    state = one.at(one.epoch_tai_ns)
    pictures = []
    for names in (("up",), ("down", "up")):
        with Simulator(one, gl) as simulator:
            for name in names:
                radiance = simulator.capture(state, name, {Product.RADIANCE}).radiance
        assert radiance is not None
        pictures.append(radiance.radiance)
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_two_simulators_in_one_process_do_not_disturb_each_other() -> None:
    narrow, wide = scenario(), scenario(focal_length_mm=4.0)
    with Simulator(narrow) as a:
        alone = a.capture(narrow.at(0), "cam").digital
        with Simulator(wide) as b:
            other = b.capture(wide.at(0), "cam").digital
            mixed = a.capture(narrow.at(0), "cam").digital
        after = a.capture(narrow.at(0), "cam").digital
    assert alone is not None
    assert other is not None
    assert mixed is not None
    assert after is not None
    np.testing.assert_array_equal(mixed.dn, alone.dn)
    np.testing.assert_array_equal(after.dn, alone.dn)
    assert (other.dn > 100).sum() < (alone.dn > 100).sum() / 4


def test_an_unknown_camera_is_refused(gl: moderngl.Context) -> None:
    one = scenario()
    with (
        Simulator(one, gl) as simulator,
        pytest.raises(ConfigError, match='camera "cma" is not in the scenario; did you mean "cam"'),
    ):
        simulator.capture(one.at(0), "cma")
