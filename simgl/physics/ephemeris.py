"""Time scales, Sun, Moon and the Earth's rotation, from the SOFA routines in pyerfa.

Time inside simgl is an integer count of TAI nanoseconds since 1970-01-01T00:00:00 TAI (the scale of
POSIX CLOCK_TAI). Earth-orientation parameters (polar motion, UT1 - UTC) are zero, which displaces
the ground by up to about 30 m. After the last leap second known to pyerfa, TAI - UTC is constant.
"""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

import erfa
import numpy as np

from simgl.arrays import AnyArray, Array
from simgl.physics.constants import ASTRONOMICAL_UNIT

NANOSECONDS_PER_DAY = 86_400_000_000_000
_JD_1970 = 2440587.5
# Status of SOFA's routines.
_DUBIOUS_YEAR = 1
# UTC has had its present form since 1972; the Earth series used here ends in 2100 (SOFA epv00).
FIRST_YEAR, LAST_YEAR = 1972, 2099

_ISO = re.compile(r"(\d{4})-(\d{2})-(\d{2})(?:[T ](\d{2}):(\d{2})(?::(\d{2})(?:\.(\d{1,9}))?)?)?Z?")


@contextmanager
def _future_leap_seconds_accepted() -> Iterator[None]:
    """No warning of SOFA's for years beyond its leap-second table; the module says what holds."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", category=erfa.ErfaWarning)
        warnings.filterwarnings("ignore", message=".*dubious year.*")
        yield


def tai_ns_from_utc(utc: str) -> int:
    """TAI nanoseconds since 1970-01-01T00:00:00 TAI.

    utc : ISO 8601 text such as ``2026-03-20T12:00:00.5``

    Raises ValueError for text that is not a date, or a year outside 1972 to 2099.
    """
    match = _ISO.fullmatch(utc.strip())
    got = f"got {json.dumps(utc, ensure_ascii=False)}"
    if match is None:
        raise ValueError(f'must be a UTC time such as "2026-03-20T12:00:00", {got}')
    year, month, day, hour, minute, second = (int(g or 0) for g in match.groups()[:6])
    nanosecond = int((match[7] or "0").ljust(9, "0"))
    if not FIRST_YEAR <= year <= LAST_YEAR:
        raise ValueError(f"must lie in the years {FIRST_YEAR} to {LAST_YEAR}, {got}")
    with _future_leap_seconds_accepted():
        try:
            day_start = erfa.dtf2d("UTC", year, month, day, 0, 0, 0.0)
            erfa.dtf2d("UTC", year, month, day, hour, minute, float(second))
            tai = erfa.utctai(*day_start)
        except erfa.ErfaError as error:
            # pyerfa ends its text with SOFA's reason in quotes: ... yielded 1 of "bad day"
            reason = str(error).split('"')[-2]
            raise ValueError(f"must be a real date and time, {got} ({reason})") from None
        except erfa.ErfaWarning:
            problem = "that minute has no such second"
            raise ValueError(f"must be a real date and time, {got} ({problem})") from None
    midnight = round(float((tai[0] - _JD_1970) + tai[1]) * 86400.0)
    return ((midnight + hour * 3600 + minute * 60 + second) * 1_000_000_000) + nanosecond


def utc_from_tai_ns(tai_ns: int) -> str:
    """ISO 8601 UTC text, with as many decimals as it needs.

    tai_ns : TAI nanoseconds since 1970-01-01T00:00:00 TAI

    Raises ValueError for what is no integer: a float holds no nanoseconds of our years.
    """
    if not hasattr(tai_ns, "__index__"):
        raise ValueError(f"tai_ns must be an integer, got {tai_ns!r:.80}")
    tai_s, nanosecond = divmod(tai_ns, 1_000_000_000)
    with _future_leap_seconds_accepted():
        utc = erfa.taiutc(_JD_1970 + tai_s // 86400, (tai_s % 86400) / 86400.0)
        year, month, day, fields = erfa.d2dtf("UTC", 0, *utc)
    hour, minute, second = (int(fields[name]) for name in ("h", "m", "s"))
    fraction = f".{nanosecond:09d}".rstrip("0") if nanosecond else ""
    return f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}:{second:02d}{fraction}"


# A scene asks for its epoch several times.
@lru_cache(maxsize=16)
def julian_date_tt(tai_ns: int) -> tuple[float, float]:
    """Terrestrial Time as a two-part Julian date."""
    days, rest = divmod(tai_ns, NANOSECONDS_PER_DAY)
    tt: tuple[float, float] = erfa.taitt(_JD_1970 + days, rest / NANOSECONDS_PER_DAY)
    return tt


def utc_julian_date(tai_ns: int) -> tuple[float, float]:
    """UTC as SOFA's two-part quasi-Julian date, whose days contain leap seconds."""
    days, rest = divmod(tai_ns, NANOSECONDS_PER_DAY)
    return _by_sofa(erfa.ufunc.taiutc, _JD_1970 + days, rest / NANOSECONDS_PER_DAY)


def _by_sofa(routine: np.ufunc, *values: float) -> tuple[float, float]:
    """A two-part Julian date, also in years beyond SOFA's leap-second table.

    Without pyerfa's wrapper: it makes a warning of such years, and takes longer than the routine.
    """
    day, fraction, status = routine(*values)
    if status not in (0, _DUBIOUS_YEAR):
        raise erfa.ErfaError(f"{routine.__name__} has no result for {values}")
    return float(day), float(fraction)


def sun_position(tai_ns: int) -> Array:
    """(3,) geometric position of the Sun's centre in GCRF [m]; within 0.01 arcsec of DE421.

    From SOFA's epv00.
    """
    heliocentric, _ = earth_motion(tai_ns)
    return -heliocentric["p"] * ASTRONOMICAL_UNIT


@lru_cache(maxsize=16)
def earth_motion(tai_ns: int) -> tuple[AnyArray, AnyArray]:
    """The Earth's centre from the Sun and from the solar system's barycentre, ICRS axes: place "p"
    [au] and velocity "v" [au d-1], (3,) each, of SOFA's epv00."""
    heliocentric, barycentric = erfa.epv00(*julian_date_tt(tai_ns))
    return heliocentric, barycentric


def moon_position(tai_ns: int) -> Array:
    """(3,) position of the Moon's centre in GCRF [m]; within 10 arcsec (SOFA moon98)."""
    return erfa.moon98(*julian_date_tt(tai_ns))["p"] * ASTRONOMICAL_UNIT


def itrf_from_icrf(tai_ns: int) -> Array:
    """R_itrf_from_icrf by the IAU 2006/2000A precession-nutation, with UT1 = UTC."""
    tt = julian_date_tt(tai_ns)
    utc = utc_julian_date(tai_ns)
    ut1 = _by_sofa(erfa.ufunc.utcut1, *utc, 0.0)
    return erfa.c2t06a(*tt, *ut1, 0.0, 0.0)
