"""Calendar times of files in several time scales, converted to TAI nanoseconds.

Scales: UTC, TAI, TT = TAI + 32.184 s, GPS = TAI - 19 s, and TDB, which differs from TT by at most
2 ms (SOFA's series dtdb).
"""

from __future__ import annotations

import json
import re
from datetime import date, timedelta
from typing import Literal

import erfa

from simgl.physics.ephemeris import FIRST_YEAR, LAST_YEAR, julian_date_tt, tai_ns_from_utc

TimeScale = Literal["UTC", "TAI", "TT", "TDB", "GPS"]
SCALES: tuple[TimeScale, ...] = ("UTC", "TAI", "TT", "TDB", "GPS")

_NS_PER_S = 1_000_000_000
_CLOCK = r"(\d{2}):(\d{2}):(\d{2})(?:\.(\d+))?"
_CALENDAR = re.compile(rf"(\d{{4}})-(\d{{2}})-(\d{{2}})[T ]{_CLOCK}Z?")
_DAY_OF_YEAR = re.compile(rf"(\d{{4}})-(\d{{3}})[T ]{_CLOCK}Z?")
_MONTH_NAME = re.compile(rf"(\d{{1,2}}) ([A-Z][a-z]{{2}}) (\d{{4}}) {_CLOCK}")
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
# Reading of the scale's clock minus TAI [ns]; for TDB without its periodic part.
_AHEAD_OF_TAI = {"TAI": 0, "TT": 32_184_000_000, "GPS": -19_000_000_000, "TDB": 32_184_000_000}


def tai_ns_from_text(text: str, scale: TimeScale) -> int:
    """TAI nanoseconds of a text.

    Forms: ``2026-03-20T12:00:00.5``, ``2026-079T12:00:00.5``, ``20 Mar 2026 12:00:00.5``.

    Raises ValueError for other texts, and for years outside 1972 to 2099.
    """
    got = f"got {json.dumps(text, ensure_ascii=False)}"
    year, month, day, clock = _fields(text.strip(), got)
    hour, minute, second, fraction = clock
    nanosecond = int((fraction or "0").ljust(9, "0")[:9])
    if scale == "UTC":
        seconds_text = f"{year:04d}-{month:02d}-{day:02d}T{hour}:{minute}:{second}"
        return tai_ns_from_utc(seconds_text) + nanosecond
    if not FIRST_YEAR <= year <= LAST_YEAR:
        raise ValueError(f"must lie in the years {FIRST_YEAR} to {LAST_YEAR}, {got}")
    try:
        days = date(year, month, day).toordinal() - date(1970, 1, 1).toordinal()
    except ValueError:
        raise ValueError(f"must be a real date and time, {got}") from None
    if not (int(hour) < 24 and int(minute) < 60 and int(second) < 60):
        raise ValueError(f"must be a real date and time, {got}")
    seconds = days * 86400 + int(hour) * 3600 + int(minute) * 60 + int(second)
    tai_ns: int = seconds * _NS_PER_S + nanosecond - _AHEAD_OF_TAI[scale]
    if scale == "TDB":
        # TDB - TT is evaluated at TT: it changes by less than 1e-9 of itself within 2 ms.
        tai_ns -= round(float(erfa.dtdb(*julian_date_tt(tai_ns), 0.0, 0.0, 0.0, 0.0)) * 1e9)
    return tai_ns


def _fields(text: str, got: str) -> tuple[int, int, int, tuple[str, str, str, str | None]]:
    if match := _CALENDAR.fullmatch(text):
        year, month, day = int(match[1]), int(match[2]), int(match[3])
        return year, month, day, (match[4], match[5], match[6], match[7])
    if match := _DAY_OF_YEAR.fullmatch(text):
        year, count = int(match[1]), int(match[2])
        when = date(max(year, 1), 1, 1) + timedelta(days=count - 1)
        if when.year != year:
            raise ValueError(f"must be a real date and time, {got}")
        month, day = when.month, when.day
        return year, month, day, (match[3], match[4], match[5], match[6])
    if (match := _MONTH_NAME.fullmatch(text)) and match[2] in _MONTHS:
        month = _MONTHS.index(match[2]) + 1
        return int(match[3]), month, int(match[1]), (match[4], match[5], match[6], match[7])
    form = '"2026-03-20T12:00:00", "2026-079T12:00:00" or "20 Mar 2026 12:00:00"'
    raise ValueError(f"must be a time such as {form}, {got}")
