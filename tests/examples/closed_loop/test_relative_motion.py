"""Motion of two spacecraft about the Earth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from examples.closed_loop.relative_motion import transition, velocity_to_reach
from examples.closed_loop.spacecraft import EARTH_J2, Orbit, gravity, relative_state
from simgl.arrays import Array
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS

RADIUS = WGS84_EQUATORIAL_RADIUS + 400e3
MEAN_MOTION = float(np.sqrt(EARTH_MU / RADIUS**3))


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
