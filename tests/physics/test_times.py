"""Calendar texts in five scales, against the offsets that define them."""

from __future__ import annotations

import erfa
import numpy as np
import pytest

from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.physics.times import TimeScale, tai_ns_from_text

NOON = "2026-03-20T12:00:00"
SECOND = 1_000_000_000


@pytest.mark.parametrize(
    ("scale", "ahead_of_utc_s"), [("UTC", 0.0), ("TAI", 37.0), ("TT", 69.184), ("GPS", 18.0)]
)
def test_a_scale_is_ahead_of_utc_by_its_definition(scale: TimeScale, ahead_of_utc_s: float) -> None:
    """TAI - UTC = 37 s since 2017; TT = TAI + 32.184 s; GPS = TAI - 19 s."""
    ahead = tai_ns_from_utc(NOON) - tai_ns_from_text(NOON, scale)
    assert ahead == round(ahead_of_utc_s * SECOND)


def test_tdb_follows_its_series() -> None:
    tt = tai_ns_from_text(NOON, "TT")
    days = tt / SECOND / 86400.0 + 2440587.5 + 32.184 / 86400.0
    series_s = float(erfa.dtdb(days, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert abs(series_s) < 0.002
    # A day is resolved to 40 microseconds here, over which the series moves by 1e-14 s.
    assert (tt - tai_ns_from_text(NOON, "TDB")) / SECOND == pytest.approx(series_s, abs=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "2026-03-20T12:00:00",
        "2026-079T12:00:00",
        "20 Mar 2026 12:00:00.000",
        "2026-03-20 12:00:00Z",
    ],
)
def test_the_forms_of_one_instant_agree(text: str) -> None:
    for scale in ("UTC", "TAI"):
        assert tai_ns_from_text(text, scale) == tai_ns_from_text(NOON, scale)


def test_a_leap_year_has_a_day_366_and_others_do_not() -> None:
    last = tai_ns_from_text("2024-366T00:00:00", "TAI")
    assert last == tai_ns_from_text("2024-12-31T00:00:00", "TAI")
    with pytest.raises(ValueError, match="real date"):
        tai_ns_from_text("2026-366T00:00:00", "TAI")


def test_fractions_reach_the_nanosecond() -> None:
    fraction = tai_ns_from_text("2026-03-20T12:00:00.123456789", "GPS")
    assert fraction - tai_ns_from_text(NOON, "GPS") == 123_456_789


def test_the_leap_second_exists_in_utc_alone() -> None:
    before = tai_ns_from_text("2016-12-31T23:59:59", "UTC")
    assert tai_ns_from_text("2016-12-31T23:59:60", "UTC") == before + SECOND
    with pytest.raises(ValueError, match="real date"):
        tai_ns_from_text("2016-12-31T23:59:60", "TAI")


@pytest.mark.parametrize(
    "text",
    ["", "noon", "2026-03-20", "2026-13-01T00:00:00", "31 Foo 2026 00:00:00", "1 Mar 26 0:0:0"],
)
@pytest.mark.parametrize("scale", ["UTC", "TT"])
def test_what_is_no_time_is_refused_with_the_text(text: str, scale: TimeScale) -> None:
    with pytest.raises(ValueError, match=r"got \"") as caught:
        tai_ns_from_text(text, scale)
    assert text in str(caught.value)


def test_a_day_is_a_day_in_every_scale_but_utc() -> None:
    steps = [
        tai_ns_from_text("2017-01-01T00:00:00", s) - tai_ns_from_text("2016-12-31T00:00:00", s)
        for s in ("TAI", "TT", "GPS", "UTC")
    ]
    assert np.array_equal(np.array(steps) / SECOND, [86400.0, 86400.0, 86400.0, 86401.0])
