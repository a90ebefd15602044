"""Two-body motion against its conservation laws and an independent integration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from simgl.arrays import Array
from simgl.motion.orbits import KeplerianOrbit

MU = 3.986004418e14  # [m3 s-2]
EPOCH = 1_774_008_037_000_000_000

quick = settings(deadline=None, database=None, max_examples=60)


def orbit(
    a: float = 7.0e6,
    e: float = 0.0,
    inclination: float = 0.9,
    raan: float = 0.5,
    perigee: float = 0.3,
    anomaly: float = 0.2,
) -> KeplerianOrbit:
    return KeplerianOrbit(
        semi_major_axis=a,
        eccentricity=e,
        inclination=inclination,
        raan=raan,
        argument_of_perigee=perigee,
        true_anomaly=anomaly,
        epoch_tai_ns=EPOCH,
    )


orbits = st.builds(
    orbit,
    a=st.floats(6.5e6, 5.0e7),
    e=st.floats(0.0, 0.97),
    inclination=st.floats(0.0, np.pi),
    raan=st.floats(0.0, 2.0 * np.pi),
    perigee=st.floats(0.0, 2.0 * np.pi),
    anomaly=st.floats(-np.pi, np.pi),
)
waits = st.integers(-(10**14), 10**14)  # [ns] a day to either side


@quick
@given(orbits, waits)
def test_energy_is_that_of_the_semi_major_axis(law: KeplerianOrbit, wait: int) -> None:
    r, v = law.state(EPOCH + wait)
    energy = 0.5 * np.dot(v, v) - MU / np.linalg.norm(r)
    # At perigee of e = 0.97 the two terms are 65 times their difference.
    assert abs(energy / (-MU / (2.0 * law.semi_major_axis)) - 1.0) < 1e-12


@quick
@given(orbits, waits)
def test_angular_momentum_keeps_its_size_and_stands_on_the_plane(
    law: KeplerianOrbit, wait: int
) -> None:
    r, v = law.state(EPOCH + wait)
    size = np.sqrt(MU * law.semi_major_axis * (1.0 - law.eccentricity**2))
    si, ci = np.sin(law.inclination), np.cos(law.inclination)
    normal = np.array([np.sin(law.raan) * si, -np.cos(law.raan) * si, ci])
    np.testing.assert_allclose(np.cross(r, v) / size, normal, rtol=0.0, atol=1e-11)


@quick
@given(orbits)
def test_at_its_epoch_the_orbit_is_at_its_true_anomaly(law: KeplerianOrbit) -> None:
    r, v = law.state(EPOCH)
    e, nu = law.eccentricity, law.true_anomaly
    distance = law.semi_major_axis * (1.0 - e * e) / (1.0 + e * np.cos(nu))
    assert abs(np.linalg.norm(r) / distance - 1.0) < 1e-11
    # Radial speed sqrt(mu / p) e sin(nu) tells the outward from the homeward half.
    speed = np.sqrt(MU / (law.semi_major_axis * (1.0 - e * e))) * e * np.sin(nu)
    # A rounding of 1e-16 in the mean anomaly is 1e-11 in the place near perigee of e = 0.97.
    assert abs(np.dot(r, v) / np.linalg.norm(r) - speed) < 1e-6


@quick
@given(orbits)
def test_after_one_period_the_orbit_is_back(law: KeplerianOrbit) -> None:
    period = 2.0 * np.pi * np.sqrt(law.semi_major_axis**3 / MU)
    r, v = law.state(EPOCH)
    again, _ = law.state(EPOCH + round(period * 1e9))
    # The nanosecond that the epoch is rounded to, and 1e-15 of the time of a day.
    assert np.linalg.norm(again - r) < np.linalg.norm(v) * 1e-8 + 1e-8


@pytest.mark.parametrize("eccentricity", [0.0, 0.1, 0.7])
def test_the_orbit_is_what_newtons_law_integrates_to(eccentricity: float) -> None:
    law = orbit(a=2.5e7 if eccentricity > 0.5 else 7.0e6, e=eccentricity)
    start = np.concatenate(law.state(EPOCH))
    seconds = 9000.0

    def fall(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], -MU * y[:3] / np.linalg.norm(y[:3]) ** 3])

    # Local errors of 1e-12 a step over some 100 steps, carried forward along the track: 1e-9 of the
    # orbit's size.
    end = solve_ivp(fall, (0.0, seconds), start, method="DOP853", rtol=1e-12, atol=1e-6).y[:, -1]
    r, v = law.state(EPOCH + round(seconds * 1e9))
    assert np.linalg.norm(r - end[:3]) < 1e-9 * law.semi_major_axis
    assert np.linalg.norm(v - end[3:]) < 1e-9 * np.linalg.norm(start[3:])


def test_a_circular_equatorial_orbit_goes_round_at_sqrt_mu_over_a() -> None:
    law = orbit(a=7.0e6, e=0.0, inclination=0.0, raan=0.0, perigee=0.0, anomaly=0.0)
    quarter = round(0.5e9 * np.pi * np.sqrt(7.0e6**3 / MU))
    speed = np.sqrt(MU / 7.0e6)
    r, v = law.state(EPOCH)
    np.testing.assert_allclose(r, [7.0e6, 0.0, 0.0], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(v, [0.0, speed, 0.0], rtol=0.0, atol=1e-11)
    r, v = law.state(EPOCH + quarter)
    # Half a nanosecond of 7.5 km/s is 4e-6 m.
    np.testing.assert_allclose(r, [0.0, 7.0e6, 0.0], rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(v, [-speed, 0.0, 0.0], rtol=0.0, atol=1e-8)


def test_inclination_lifts_the_orbit_at_the_ascending_node() -> None:
    law = orbit(inclination=0.9, raan=0.5, perigee=0.0, anomaly=0.0)
    r, v = law.state(EPOCH)
    np.testing.assert_allclose(r / 7.0e6, [np.cos(0.5), np.sin(0.5), 0.0], rtol=0.0, atol=1e-15)
    assert abs(v[2] / np.linalg.norm(v) - np.sin(0.9)) < 1e-15
