"""Guidance, exposure and attitude control."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from examples.closed_loop.attitude import Attitude, turned
from examples.closed_loop.exposure import ExposureControl, Light
from examples.closed_loop.guidance import Leg, Plan
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS

RADIUS = WGS84_EQUATORIAL_RADIUS + 400e3
MEAN_MOTION = float(np.sqrt(EARTH_MU / RADIUS**3))


def test_a_leg_bounds_its_speed_and_ends_at_its_aim() -> None:
    leg = Leg(distance=1.6, top_speed=0.4, time_constant=75.0, hop=30.0)
    np.testing.assert_allclose(leg.next(np.array([-180.0, 0.0, 0.0])), [-168.0, 0.0, 0.0])
    np.testing.assert_array_equal(leg.next(np.zeros(3)), np.zeros(3))
    at_rest = np.array([-20.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # V-bar: a place of rest
    push = Plan().push(leg, at_rest, at_rest[:3], MEAN_MOTION)
    np.testing.assert_array_equal(push, np.zeros(3))


CONTROL = ExposureControl()


def test_exposure_goes_to_its_goal_by_the_light_that_its_own_image_had() -> None:
    now, used = Light(exposure=1e-4, lamp=False), Light(exposure=5e-5, lamp=False)
    # An image of an older exposure at twice the goal: half of that exposure.
    assert CONTROL.after(now, used, 1.1 / 1.2).exposure == pytest.approx(5e-5 * 0.6, rel=1e-9)
    assert CONTROL.after(now, used, 1.0).exposure == pytest.approx(5e-5 / 4.0)
    assert CONTROL.after(now, used, 0.001).exposure == pytest.approx(5e-5 * 4.0)


def test_the_lamp_goes_on_in_the_dark_and_off_when_the_sun_is_back() -> None:
    light = Light(exposure=3e-5, lamp=False)
    seen = []
    for _ in range(4):
        light = CONTROL.after(light, light, 0.0)
        seen.append(light.lamp)
    # 0.12, 0.48, 1.92 ms: sunlight never asks for the third.
    assert seen == [False, False, True, True]
    # By lamplight at the nearest, 1 ms, it stays on; an older image from before says nothing.
    assert CONTROL.after(
        Light(exposure=1e-3, lamp=True), Light(exposure=1e-3, lamp=True), 0.55
    ).lamp
    before = CONTROL.after(light, replace(light, lamp=False), 0.0)
    assert before is light
    bright = Light(exposure=4e-4, lamp=True)
    assert not CONTROL.after(bright, bright, 1.0).lamp


def test_wheels_turn_the_chaser_to_where_it_should_look_and_keep_the_momentum() -> None:
    rng = np.random.default_rng(2)
    start_at = Attitude(R_icrf_from_body=np.eye(3), rate=np.zeros(3), wheels=np.zeros(3))
    wanted = Rotation.from_rotvec([0.1, -0.2, 0.15]).as_matrix()
    end = turned(start_at, wanted, np.zeros(3), 60.0, rng)
    off = Rotation.from_matrix(wanted.T @ end.R_icrf_from_body).magnitude()
    # The star tracker's noise of 0.005 deg passes through a law of 0.25 rad/s: below its own size.
    assert off < 4.0 * np.radians(0.005)
    # Nothing outside pushed: on the way the wheels hold the opposite of the body's momentum. Steps
    # of 0.25 s at 0.05 rad/s leave 0.25 * 0.05 = 1 % of it.
    inertia = np.array([0.26, 0.28, 0.31])
    midway = turned(start_at, wanted, np.zeros(3), 4.0, rng)
    body = np.linalg.norm(inertia * midway.rate)
    assert body > 0.005
    assert np.linalg.norm(inertia * midway.rate + midway.wheels) < 0.02 * body
