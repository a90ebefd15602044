"""Light and places of stars, against measured spectra and SOFA's own astrometry."""

from __future__ import annotations

import erfa
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.ephemeris import julian_date_tt, tai_ns_from_utc
from simgl.physics.starlight import (
    MILLIARCSECOND,
    aberrated,
    band_irradiance,
    directions,
    earth_from_barycentre,
    years_since_catalogue,
)

ARCSECOND = 1e3 * MILLIARCSECOND
EPOCH = tai_ns_from_utc("2026-11-21T20:00:00")
# Name: right ascension, declination [rad] at J1991.25, motion east and north [mas yr-1], parallax
# [mas]: hip2.dat. 61 Cygni A moves 5.3 arcsec a year; alpha Centauri B is nearest.
STARS = {
    "61 Cyg A": (5.5276638884, 0.6761666472, 4168.31, 3269.20, 286.82),
    "alpha Cen A": (3.8383352142, -1.0617735850, -3679.25, 473.67, 754.81),
    "Sirius": (1.7678185359, -0.2916993748, -546.01, -1223.07, 379.21),
    "Polaris": (0.6622851337, 1.5579531082, 44.48, -11.85, 7.54),
}


def catalogued(name: str) -> tuple[Array, Array, Array]:
    """Direction, motion and parallax of one star, as the functions take them."""
    a, d, east, north, parallax = STARS[name]
    u = np.array([np.cos(d) * np.cos(a), np.cos(d) * np.sin(a), np.sin(d)])
    to_east = np.array([-np.sin(a), np.cos(a), 0.0])
    to_north = np.cross(u, to_east)
    motion = MILLIARCSECOND * (east * to_east + north * to_north)
    return u[None], motion[None], np.array([MILLIARCSECOND * parallax])


def apart(a: Array, b: Array) -> float:
    """Angle [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


@pytest.mark.parametrize("name", STARS)
def test_the_apparent_place_from_orbit_is_that_of_sofa(name: str) -> None:
    """Proper motion over 35 years, parallax, aberration by Earth and spacecraft, all at once."""
    place, velocity = np.array([0.0, 6.8e6, 0.0]), np.array([-4.0e3, 0.0, 6.5e3])
    earth_place, earth_velocity = earth_from_barycentre(EPOCH)
    years = years_since_catalogue(EPOCH)
    seen = directions(*catalogued(name), years, earth_place + place)
    ours = aberrated(seen, earth_velocity + velocity)[0]

    a, d, east, north, parallax = STARS[name]
    # SOFA counts proper motion in right ascension itself, and from J2000.
    at_j2000 = erfa.starpm(
        a, d, MILLIARCSECOND * east / np.cos(d), MILLIARCSECOND * north, parallax * 1e-3, 0.0,
        2448349.0625, 0.0, 2451545.0, 0.0,
    )  # fmt: skip
    tt = julian_date_tt(EPOCH)
    heliocentric, barycentric = erfa.epv00(*tt)
    pv = np.zeros((), dtype=erfa.dt_pv)
    pv["p"], pv["v"] = place, velocity
    observer = erfa.apcs(*tt, pv, barycentric, heliocentric["p"])
    theirs = erfa.s2c(*erfa.atciq(*at_j2000, observer))
    # SOFA also bends light at the Sun: 0.004 arcsec at 90 deg, 0.02 at 25 deg and more from it.
    assert apart(ours, theirs) < 0.02 * ARCSECOND
    # Without any one of the three the difference would show.
    assert apart(catalogued(name)[0][0], theirs) > 4.0 * ARCSECOND


def test_aberration_is_that_of_sofa_to_the_last_digits() -> None:
    rng = np.random.default_rng(3)
    u = rng.normal(size=(50, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    # A tenth of light's speed, so that every power of v / c counts.
    beta = np.array([0.06, -0.07, 0.04])
    inverse_gamma = float(np.sqrt(1.0 - beta @ beta))
    # The third argument is the distance of the Sun, whose pull on the light must not count here.
    theirs = erfa.ab(u, beta, 1e12, inverse_gamma)
    np.testing.assert_allclose(aberrated(u, beta * 299792458.0), theirs, atol=2e-15)


def test_stars_crowd_towards_the_apex_of_the_motion() -> None:
    velocity = np.array([30e3, 0.0, 0.0])
    seen = aberrated(np.array([[0.0, 1.0, 0.0]]), velocity)[0]
    # 30 km/s is 20.6 arcsec.
    np.testing.assert_allclose(np.arctan2(seen[0], seen[1]) / ARCSECOND, 20.64, atol=0.01)


# Band sums of measured spectra of CALSPEC [W m-2], R, G, B, N: alpha_lyr_stis_011 and
# sun_reference_stis_001 by the rectangle rule on 0.05 nm from the copies in pyphot 2.1.
VEGA = (2.1443e-9, 3.6304e-9, 6.2230e-9, 3.0771e-9)
SUN = (159.468, 185.405, 187.233, 308.615)


def one(v: float, b_v: float, v_i: float) -> Array:
    """(4,) irradiance of a single star."""
    return band_irradiance(np.array([v]), np.array([b_v]), np.array([v_i]))[0]


def test_vega_and_the_sun_have_the_light_of_their_measured_spectra() -> None:
    # Tied to the mean of the two; they lie up to 2 % apart from it.
    np.testing.assert_allclose(one(0.03, 0.0, 0.0), VEGA, rtol=0.025)
    np.testing.assert_allclose(one(-26.76, 0.653, 0.702), SUN, rtol=0.025)


def test_sirius_outshines_vega_by_its_magnitude() -> None:
    ratio = one(-1.46, 0.0, -0.02) / one(0.03, 0.0, 0.0)
    np.testing.assert_allclose(ratio, 10.0 ** (0.4 * 1.49), rtol=0.03)


def test_betelgeuse_is_red_and_its_red_band_holds_its_measured_light() -> None:
    """R (Cousins) of Betelgeuse is -0.58 for V 0.50 (V-R 1.08 for its V-I); R 0 is 2.177e-2."""
    light = one(0.50, 1.85, 2.32)
    expected = 2.177e-2 * 10.0 ** (0.4 * 0.58) * 100e-9
    # The band and the filter differ, and TiO cuts both: 15 %.
    np.testing.assert_allclose(light[0], expected, rtol=0.15)
    assert light[3] > 3.0 * light[0] > 3.0 * light[1] > 6.0 * light[2]


def test_five_magnitudes_are_a_factor_of_a_hundred() -> None:
    np.testing.assert_allclose(one(0.0, 0.4, 0.5), 100.0 * one(5.0, 0.4, 0.5), rtol=1e-12)
