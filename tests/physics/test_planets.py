"""Planets stand where and shine as the almanacs say."""

from __future__ import annotations

import erfa
import numpy as np
import pytest

from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.physics.ephemeris import julian_date_tt, tai_ns_from_utc
from simgl.physics.frames import angle_between
from simgl.physics.planets import Planet, planets

ARCMINUTE = np.radians(1.0 / 60.0)


def planet(name: str, utc: str) -> Planet:
    return next(one for one in planets(tai_ns_from_utc(utc)) if one.name == name)


@pytest.mark.parametrize(
    ("name", "utc", "magnitude", "tolerance"),
    [
        # Greatest brilliancy; the opposition nearest in 70 years; almanac's values to 0.05.
        ("venus", "2020-04-28T00:00:00", -4.7, 0.1),
        ("jupiter", "2022-09-26T20:00:00", -2.94, 0.03),
        # Mars at opposition, without its rotation and season.
        ("mars", "2020-10-13T23:00:00", -2.62, 0.1),
    ],
)
def test_magnitudes_are_the_almanacs(
    name: str, utc: str, magnitude: float, tolerance: float
) -> None:
    assert abs(planet(name, utc).magnitude - magnitude) < tolerance


def test_jupiter_and_saturn_meet_as_they_did_in_2020() -> None:
    """6.1 arcmin apart on 21 December 2020 at 18:20 UTC; each errs by about 1 arcmin."""
    jupiter, saturn = (planet(n, "2020-12-21T18:20:00") for n in ("jupiter", "saturn"))
    apart = angle_between(jupiter.position, saturn.position)
    assert abs(apart - 6.1 * ARCMINUTE) < 2.0 * ARCMINUTE


def test_venus_crosses_the_sun_when_it_did() -> None:
    """Least distance of 9.2 arcmin from the Sun's centre on 6 June 2012 at 01:30 UTC."""
    utc = "2012-06-06T01:30:00"
    earth = erfa.epv00(*julian_date_tt(tai_ns_from_utc(utc)))[0]["p"]
    venus = planet("venus", utc)
    # 5 arcsec from the Sun are 13 from the Earth here; light from Venus is 144 s old.
    apart = angle_between(venus.position, -earth)
    assert abs(apart - 9.24 * ARCMINUTE) < 0.5 * ARCMINUTE


def test_jupiter_is_as_far_as_at_its_closest_of_2022() -> None:
    distance = float(np.linalg.norm(planet("jupiter", "2022-09-26T02:00:00").position))
    assert abs(distance / ASTRONOMICAL_UNIT - 3.9526) < 1e-3


def test_mars_is_the_reddest_and_venus_outshines_all() -> None:
    seen = planets(tai_ns_from_utc("2020-04-28T00:00:00"))
    redness = {one.name: one.irradiance[0] / one.irradiance[2] for one in seen}
    assert max(redness, key=redness.__getitem__) == "mars"
    assert min(seen, key=lambda one: one.magnitude).name == "venus"
