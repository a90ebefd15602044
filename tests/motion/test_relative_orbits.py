"""Free drift about another orbit, and the drift of an orbit about an oblate Earth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from simgl.arrays import Array
from simgl.motion.orbits import KeplerianOrbit, clohessy_wiltshire
from simgl.motion.trajectory import LvlhAttitude, Motion, RelativeOrbit, poses
from simgl.physics.frames import lvlh_angular_velocity, lvlh_from_icrf

MU = 3.986004418e14  # [m3 s-2]
J2, RADIUS = 1.0826266836e-3, 6378137.0
EPOCH = 1_774_008_037_000_000_000
SECOND = 1_000_000_000
LVLH = LvlhAttitude(R_lvlh_from_body=np.eye(3))


def circular() -> KeplerianOrbit:
    return KeplerianOrbit(
        semi_major_axis=6.778e6,
        eccentricity=0.0,
        inclination=0.9,
        raan=0.5,
        argument_of_perigee=0.0,
        true_anomaly=0.2,
        epoch_tai_ns=EPOCH,
    )


@pytest.mark.parametrize(
    ("place", "velocity"),
    [
        ([-200.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([-200.0, 30.0, 50.0], [0.05, -0.02, 0.1]),
        ([0.0, 0.0, -100.0], [0.0, 0.0, 0.0]),
    ],
)
def test_a_drift_is_that_of_two_orbits(place: list[float], velocity: list[float]) -> None:
    """Two bodies integrated as two; the linear equations lose d^2 / r in a radian of the orbit.

    d = 500 m at most, r = 6,778 km: 0.037 m times the radians gone, 3 times for the growth.
    """
    law, position = circular(), np.array(place)
    r, v = law.state(EPOCH)
    R_icrf_from_lvlh = lvlh_from_icrf(r, v).T
    offset = R_icrf_from_lvlh @ position
    start_r = r + offset
    turned = np.cross(lvlh_angular_velocity(r, v), offset)
    start_v = v + R_icrf_from_lvlh @ np.array(velocity) + turned

    def rate(_: float, state: Array) -> Array:
        distance = np.linalg.norm(state[:3])
        return np.concatenate([state[3:], -MU / distance**3 * state[:3]])

    start = np.concatenate([start_r, start_v])
    seconds = np.array([0.0, 600.0, 1800.0])
    truth = solve_ivp(rate, (0.0, 1800.0), start, t_eval=seconds, rtol=1e-12, atol=1e-9).y.T
    motions = {
        "target": Motion(trajectory=law, attitude=LVLH),
        "chaser": Motion(
            trajectory=RelativeOrbit(
                reference="target",
                position_lvlh=position,
                velocity_lvlh=np.array(velocity),
                epoch_tai_ns=EPOCH,
            ),
            attitude=LVLH,
        ),
    }
    motion = np.sqrt(MU / 6.778e6**3)
    for when, state in zip(seconds, truth, strict=True):
        pose = poses(motions, EPOCH + round(when * SECOND))["chaser"]
        allowed = 1e-6 + 3.0 * 0.037 * motion * when
        assert np.linalg.norm(pose.position - state[:3]) < allowed
        assert np.linalg.norm(pose.velocity - state[3:]) < 1e-8 + 3.0 * motion * allowed


def test_a_football_comes_back_after_a_revolution() -> None:
    """No drift where the along-track rate is minus twice the mean motion times the height."""
    n = 1.1e-3
    place, velocity = np.array([0.0, 10.0, -50.0]), np.array([-2.0 * n * 50.0, 0.0, 0.0])
    back, rate = clohessy_wiltshire(place, velocity, n, 2.0 * np.pi / n)
    np.testing.assert_allclose(back, place, atol=1e-9)
    np.testing.assert_allclose(rate, velocity, atol=1e-12)


def test_below_the_target_one_runs_ahead() -> None:
    """Lower orbits are faster: 6 pi times the height is gained in a revolution."""
    n, height = 1.1e-3, -50.0
    circular_rate = -1.5 * n * height
    place, _ = clohessy_wiltshire(
        np.array([0.0, 0.0, -height]), np.array([circular_rate, 0.0, 0.0]), n, 2.0 * np.pi / n
    )
    np.testing.assert_allclose(place, [-3.0 * np.pi * height, 0.0, 50.0], atol=1e-9)


def test_the_node_drifts_as_in_the_full_field_of_j2() -> None:
    """Integrated over a day with the force of J2 itself; osculating elements swing about the mean.

    The swing of the node within a revolution is 3/4 J2 (R/a)^2 |cos i| = 0.03 deg; the secular rate
    is of first order, the next one J2 times smaller (0.1 %).
    """
    law = circular()
    oblate = replace(law, oblate=True)

    def rate(_: float, state: Array) -> Array:
        x, y, z = state[:3]
        distance = np.linalg.norm(state[:3])
        common = 1.5 * J2 * MU * RADIUS**2 / distance**5
        lean = 5.0 * z**2 / distance**2
        bulge = common * np.array([x * (lean - 1.0), y * (lean - 1.0), z * (lean - 3.0)])
        return np.concatenate([state[3:], -MU / distance**3 * state[:3] + bulge])

    day = 86400.0
    start = np.concatenate(law.state(EPOCH))
    truth = solve_ivp(rate, (0.0, day), start, rtol=1e-9, atol=1e-3).y[:, -1]

    def node_deg(r: Array, v: Array) -> float:
        normal = np.cross(r, v)
        return float(np.degrees(np.arctan2(normal[0], -normal[1])))

    expected = node_deg(truth[:3], truth[3:])
    assert node_deg(*oblate.state(EPOCH + round(day * SECOND))) == pytest.approx(expected, abs=0.04)
    assert node_deg(*law.state(EPOCH + round(day * SECOND))) - expected > 4.0


def test_a_sun_synchronous_orbit_follows_the_sun() -> None:
    """786 km at 98.5 deg turns by 360 deg a year (the orbit of Sentinel-2)."""
    law = KeplerianOrbit(
        semi_major_axis=RADIUS + 786e3,
        eccentricity=0.0,
        inclination=np.radians(98.55),
        raan=0.0,
        argument_of_perigee=0.0,
        true_anomaly=0.0,
        epoch_tai_ns=EPOCH,
        oblate=True,
    )
    days = 30.0
    r, v = law.state(EPOCH + round(days * 86400.0 * SECOND))
    normal = np.cross(r, v)
    drift = np.degrees(np.arctan2(normal[0], -normal[1]))
    assert drift == pytest.approx(360.0 / 365.2422 * days, rel=0.01)


@pytest.mark.parametrize("oblate", [False, True])
def test_velocity_is_the_rate_of_the_place(oblate: bool) -> None:
    """Central differences over 0.2 s: a third of w^2 h^2 v = 3e-5 m/s, and rounding."""
    law = replace(circular(), eccentricity=0.02, oblate=oblate)
    for minutes in (0, 17, 700):
        tai_ns = EPOCH + minutes * 60 * SECOND
        ahead, behind = (law.state(tai_ns + side * SECOND // 10)[0] for side in (1, -1))
        np.testing.assert_allclose((ahead - behind) / 0.2, law.state(tai_ns)[1], atol=1e-4)
