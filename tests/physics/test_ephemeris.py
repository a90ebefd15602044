"""Time scales, Sun, Moon and the Earth's rotation against numbers from elsewhere."""

from __future__ import annotations

import re
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.physics.ephemeris import (
    itrf_from_icrf,
    julian_date_tt,
    moon_position,
    sun_position,
    tai_ns_from_utc,
    utc_from_tai_ns,
)
from tests.authorities.de421 import DE421, Places

SECOND = 1_000_000_000  # [ns]
ARCSECOND = np.pi / (180.0 * 3600.0)  # [rad]
FIRST, LAST = "1972-01-01T00:00:00", "2099-12-31T23:59:59.999999999"
EPOCHS = [case.utc for case in DE421]

instants = st.integers(tai_ns_from_utc(FIRST), tai_ns_from_utc(LAST))
quick = settings(deadline=None, database=None, max_examples=200)


def unix_ns(utc: str) -> int:
    """POSIX nanoseconds, which leave leap seconds out."""
    return round(datetime.fromisoformat(utc).replace(tzinfo=UTC).timestamp() * 1e6) * 1000


def angle(a: Array, b: Array) -> float:
    """Between two vectors [rad], exact for small angles."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


# TAI - UTC from the IERS table of leap seconds.
@pytest.mark.parametrize(
    ("utc", "tai_minus_utc"),
    [
        ("1972-01-01T00:00:00", 10),
        ("1980-01-06T00:00:00", 19),
        ("1999-12-31T12:34:56", 32),
        ("2016-12-31T23:59:59", 36),
        ("2017-01-01T00:00:00", 37),
        ("2026-03-20T12:00:00", 37),
        ("2099-12-31T23:59:59", 37),
    ],
)
def test_tai_leads_utc_by_the_leap_seconds(utc: str, tai_minus_utc: int) -> None:
    assert tai_ns_from_utc(utc) - unix_ns(utc) == tai_minus_utc * SECOND


def test_a_leap_second_exists_and_comes_back() -> None:
    within = tai_ns_from_utc("2016-12-31T23:59:60.5")
    assert within == unix_ns("2016-12-31T23:59:59") + (36 + 1) * SECOND + SECOND // 2
    assert utc_from_tai_ns(within) == "2016-12-31T23:59:60.5"


def test_time_runs_on_evenly_across_a_leap_second() -> None:
    steps = [
        "2016-12-31T23:59:59",
        "2016-12-31T23:59:59.5",
        "2016-12-31T23:59:60",
        "2016-12-31T23:59:60.5",
        "2017-01-01T00:00:00",
        "2017-01-01T00:00:00.5",
    ]
    tai = [tai_ns_from_utc(utc) for utc in steps]
    assert np.diff(tai).tolist() == [SECOND // 2] * 5
    assert [utc_from_tai_ns(t) for t in tai] == steps


@quick
@given(instants)
def test_tai_to_utc_and_back_keeps_every_nanosecond(tai_ns: int) -> None:
    assert tai_ns_from_utc(utc_from_tai_ns(tai_ns)) == tai_ns


@quick
@given(
    st.datetimes(datetime(1972, 1, 1), datetime(2099, 12, 31)),
    st.integers(0, 999_999_999),
)
def test_utc_to_tai_and_back_keeps_every_text(moment: datetime, nanosecond: int) -> None:
    fraction = f".{nanosecond:09d}".rstrip("0") if nanosecond else ""
    utc = moment.strftime("%Y-%m-%dT%H:%M:%S") + fraction
    assert utc_from_tai_ns(tai_ns_from_utc(utc)) == utc


@pytest.mark.parametrize(
    "utc",
    [
        "2026-03-20 12:00:00",
        "2026-03-20T12:00:00Z",
        "2026-03-20T12:00",
        " 2026-03-20T12:00:00.000 ",
    ],
)
def test_the_usual_spellings_of_an_instant_mean_the_same(utc: str) -> None:
    assert tai_ns_from_utc(utc) == tai_ns_from_utc("2026-03-20T12:00:00")


@pytest.mark.parametrize(
    ("utc", "message"),
    [
        ("yesterday", 'must be a UTC time such as "2026-03-20T12:00:00", got "yesterday"'),
        ("", 'must be a UTC time such as "2026-03-20T12:00:00", got ""'),
        (
            "2026-03-20T12:00:00+02:00",
            'must be a UTC time such as "2026-03-20T12:00:00", got "2026-03-20T12:00:00+02:00"',
        ),
        ("20\n26", 'must be a UTC time such as "2026-03-20T12:00:00", got "20\\n26"'),
        ("1971-12-31", 'must lie in the years 1972 to 2099, got "1971-12-31"'),
        ("2100-01-01", 'must lie in the years 1972 to 2099, got "2100-01-01"'),
        ("2026-02-29", 'must be a real date and time, got "2026-02-29" (bad day)'),
        ("2026-13-01", 'must be a real date and time, got "2026-13-01" (bad month)'),
        ("2026-01-01T24:00", 'must be a real date and time, got "2026-01-01T24:00" (bad hour)'),
        ("2026-01-01T00:60", 'must be a real date and time, got "2026-01-01T00:60" (bad minute)'),
        (
            "2026-03-20T12:00:60",
            'must be a real date and time, got "2026-03-20T12:00:60" '
            "(that minute has no such second)",
        ),
        (
            "2015-12-31T23:59:60",  # an end of December without a leap second
            'must be a real date and time, got "2015-12-31T23:59:60" '
            "(that minute has no such second)",
        ),
        (
            "2016-12-31T23:59:61",  # one with a leap second, but not two
            'must be a real date and time, got "2016-12-31T23:59:61" '
            "(that minute has no such second)",
        ),
    ],
)
def test_an_impossible_instant_is_refused_in_plain_words(utc: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        tai_ns_from_utc(utc)


def test_terrestrial_time_leads_tai_by_32_184_seconds() -> None:
    # 1977-01-01T00:00:00 TAI is the instant that defines TT: 1977-01-01T00:00:32.184 TT.
    days, rest = julian_date_tt((datetime(1977, 1, 1) - datetime(1970, 1, 1)).days * 86400 * SECOND)
    # One double of a Julian date resolves 4e-5 s; the second part carries what is below a day.
    assert abs((days - 2443144.5 + rest) * 86400.0 - 32.184) < 1e-6


@pytest.mark.parametrize("place", DE421, ids=EPOCHS)
def test_the_sun_stands_where_de421_puts_it(place: Places) -> None:
    ours = sun_position(tai_ns_from_utc(place.utc))
    theirs = np.array(place.sun) * 1e3
    assert angle(ours, theirs) < 0.01 * ARCSECOND
    # SOFA epv00 states 11.2 km as its largest error of the heliocentric Earth.
    assert abs(np.linalg.norm(ours) - np.linalg.norm(theirs)) < 11.2e3


@pytest.mark.parametrize("place", DE421, ids=EPOCHS)
def test_the_moon_stands_where_de421_puts_it(place: Places) -> None:
    ours = moon_position(tai_ns_from_utc(place.utc))
    theirs = np.array(place.moon) * 1e3
    assert angle(ours, theirs) < 10.0 * ARCSECOND
    # SOFA moon98 states 11 km as the largest error of the distance against ELP.
    assert abs(np.linalg.norm(ours) - np.linalg.norm(theirs)) < 11.0e3


@settings(deadline=None, database=None, max_examples=30)
@given(instants)
def test_the_earth_turns_without_stretching(tai_ns: int) -> None:
    R_itrf_from_icrf = itrf_from_icrf(tai_ns)
    # Products of four rotations: some 1e-16 each.
    np.testing.assert_allclose(
        R_itrf_from_icrf @ R_itrf_from_icrf.T, np.eye(3), rtol=0.0, atol=1e-14
    )
    assert np.linalg.det(R_itrf_from_icrf) > 0.0


def _turn(angle: float, axis: int) -> Array:
    """R_new_from_old of axes turned by an angle [rad] about the axis 0 x, 1 y, 2 z."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, s, -s, c
    return R


def _itrf_from_icrf_by_the_older_theory(utc: str) -> Array:
    """Lieske 1977 precession, the four largest terms of nutation, and IAU 1982 sidereal time."""
    days = unix_ns(utc) / (86400.0 * SECOND) + 2440587.5 - 2451545.0  # UT1 taken as UTC
    t = days / 36525.0
    zeta = (2306.2181 * t + 0.30188 * t**2 + 0.017998 * t**3) * ARCSECOND
    z = (2306.2181 * t + 1.09468 * t**2 + 0.018203 * t**3) * ARCSECOND
    theta = (2004.3109 * t - 0.42665 * t**2 - 0.041833 * t**3) * ARCSECOND
    precession = _turn(-z, 2) @ _turn(theta, 1) @ _turn(-zeta, 2)
    obliquity = (84381.448 - 46.8150 * t) * ARCSECOND
    node = np.radians(125.04452 - 1934.136261 * t)
    sun = np.radians(280.4665 + 36000.7698 * t)
    moon = np.radians(218.3165 + 481267.8813 * t)
    longitude = ARCSECOND * (
        -17.20 * np.sin(node)
        - 1.32 * np.sin(2 * sun)
        - 0.23 * np.sin(2 * moon)
        + 0.21 * np.sin(2 * node)
    )
    tilt = ARCSECOND * (
        9.20 * np.cos(node)
        + 0.57 * np.cos(2 * sun)
        + 0.10 * np.cos(2 * moon)
        - 0.09 * np.cos(2 * node)
    )
    nutation = _turn(-obliquity - tilt, 0) @ _turn(-longitude, 2) @ _turn(obliquity, 0)
    seconds = 67310.54841 + (876600 * 3600 + 8640184.812866) * t + 0.093104 * t**2 - 6.2e-6 * t**3
    sidereal = np.radians(seconds / 240.0) + longitude * np.cos(obliquity)
    return _turn(sidereal, 2) @ nutation @ precession


@pytest.mark.parametrize("utc", EPOCHS)
def test_the_earth_has_turned_as_far_as_the_older_theory_says(utc: str) -> None:
    difference = itrf_from_icrf(tai_ns_from_utc(utc)) @ _itrf_from_icrf_by_the_older_theory(utc).T
    rotation = 0.5 * np.array(
        [
            difference[2, 1] - difference[1, 2],
            difference[0, 2] - difference[2, 0],
            difference[1, 0] - difference[0, 1],
        ]
    )
    # The terms of nutation left out reach 0.15 + 0.07 + 0.05 + ... < 0.5 arcsec together, and the
    # older rate of precession is 0.3 arcsec a century too fast.
    assert np.linalg.norm(rotation) < 0.6 * ARCSECOND


def test_the_earth_rotation_angle_grows_by_its_definition() -> None:
    # ERA = 2 pi (0.7790572732640 + 1.00273781191135448 Tu), IAU 2000; over a short time precession
    # and nutation add at most 0.3 arcsec a day to it.
    start, seconds = tai_ns_from_utc("2026-03-20T12:00:00"), 3600
    turned = itrf_from_icrf(start + seconds * SECOND) @ itrf_from_icrf(start).T
    angle = np.arctan2(turned[0, 1], turned[0, 0])
    expected = 2.0 * np.pi * 1.00273781191135448 * seconds / 86400.0
    assert abs(angle - expected) < 0.3 / 24.0 * ARCSECOND


def test_the_earth_turns_once_in_a_stellar_day() -> None:
    start = tai_ns_from_utc("2026-03-20T12:00:00")
    stellar_day = round(86400.0 / 1.00273781191135448 * 1e9)  # [ns]
    turned = itrf_from_icrf(start + stellar_day) @ itrf_from_icrf(start).T
    assert angle(turned @ np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])) < np.radians(1e-4)
    # A solar day is 236.556 s too long for that: 0.98565 deg past a full turn.
    turned = itrf_from_icrf(start + 86400 * SECOND) @ itrf_from_icrf(start).T
    past = np.degrees(np.arctan2(turned[0, 1], turned[0, 0]))
    assert abs(past - 0.985647) < 1e-4


def _sun_longitude_by_the_almanac(utc: str) -> float:
    """East longitude of the subsolar point [deg], from the equation of time.

    Low-precision Sun of the Astronomical Almanac, good to 0.01 deg.
    """
    days = unix_ns(utc) / (86400.0 * SECOND) + 2440587.5 - 2451545.0
    mean = 280.460 + 0.9856474 * days
    g = np.radians(357.528 + 0.9856003 * days)
    ecliptic = np.radians(mean + 1.915 * np.sin(g) + 0.020 * np.sin(2 * g))
    obliquity = np.radians(23.439 - 4e-7 * days)
    right_ascension = np.degrees(np.arctan2(np.cos(obliquity) * np.sin(ecliptic), np.cos(ecliptic)))
    equation_of_time = (mean - right_ascension + 180.0) % 360.0 - 180.0  # [deg]
    hour = (days + 0.5) % 1.0 * 24.0
    return float(((12.0 - hour) * 15.0 - equation_of_time + 180.0) % 360.0 - 180.0)


@pytest.mark.parametrize("utc", EPOCHS)
def test_the_sun_stands_over_the_longitude_that_the_equation_of_time_gives(utc: str) -> None:
    tai_ns = tai_ns_from_utc(utc)
    x, y, _ = itrf_from_icrf(tai_ns) @ sun_position(tai_ns)
    difference = np.degrees(np.arctan2(y, x)) - _sun_longitude_by_the_almanac(utc)
    # 0.01 deg of the almanac's formula, and 0.006 deg of aberration that it includes.
    assert abs((difference + 180.0) % 360.0 - 180.0) < 0.016


def test_at_noon_in_greenwich_before_the_equinox_the_sun_is_seven_minutes_late() -> None:
    # 20 March: the sundial is 7.4 min slow, and 4 min are a degree.
    tai_ns = tai_ns_from_utc("2026-03-20T12:00:00")
    x, y, z = itrf_from_icrf(tai_ns) @ sun_position(tai_ns)
    assert abs(np.degrees(np.arctan2(y, x)) - 1.85) < 0.1
    # The equinox itself is on the same day at 14:46 UTC; declination grows 0.395 deg a day.
    declination = np.degrees(np.arctan2(z, np.hypot(x, y)))
    assert abs(declination + 0.395 * (14.0 + 46.0 / 60.0 - 12.0) / 24.0) < 0.01
