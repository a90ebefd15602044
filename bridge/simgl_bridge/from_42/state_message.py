"""One message of 42's text socket: a time, and lines ``name = [numbers]``.

Format: functions WriteToSocket of 42 (github.com/ericstoneking/42, Source/AutoCode/TxRxIPC.c) and
the comments of its Include/42types.h. Attitude ``qn`` is of body 0 in N, scalar last, so that its
direction cosines turn N into body components; the same four numbers are the Hamilton quaternion
that turns body into N components. N of an orbit about the Earth has axes of J2000, which lie
within 0.2 microradian of the ICRF's. ``PosR`` is the centre of mass relative to the reference
orbit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, timedelta

from simgl.errors import BridgeError
from simgl.physics.ephemeris import tai_ns_from_utc

# Ends of a message: of 42 since 2022, and of older ones.
ENDS = (b"[ENDMSG]", b"[EOF]")

_TIME = re.compile(r"TIME (\d{4})-(\d{3})-(\d{2}):(\d{2}):(\d{2}\.\d+)")
_VALUE = re.compile(r"([A-Za-z]\w*(?:\[\d+\])?(?:\.\w+(?:\[\d+\])?)*) = (\[[^\]]*\]|\S+)")


@dataclass(frozen=True)
class StateMessage:
    """What 42 sent of one epoch.

    tai_ns : the epoch
    values : name such as "SC[0].qn" to its numbers, SI units
    """

    tai_ns: int
    values: Mapping[str, tuple[float, ...]]

    def numbers(self, name: str, count: int) -> tuple[float, ...]:
        """The numbers of a name; raises BridgeError where 42 does not send them."""
        numbers = self.values.get(name)
        if numbers is None:
            raise BridgeError(f'42 does not send {name}: add the prefix "{name}" to Inp_IPC.txt')
        if len(numbers) != count:
            raise BridgeError(f"42: {name} must have {count} numbers, got {len(numbers)}")
        return numbers


def parse_state(message: bytes) -> StateMessage:
    """The state in a message without its end; raises BridgeError for a line that is neither."""
    tai_ns: int | None = None
    values: dict[str, tuple[float, ...]] = {}
    for line in message.decode("ascii", errors="replace").splitlines():
        text = line.strip()
        if text.startswith("TIME"):
            tai_ns = _time(text)
        elif text:
            name, numbers = _value(text)
            values[name] = numbers
    if tai_ns is None:
        raise BridgeError("42: a message without a TIME line")
    return StateMessage(tai_ns, values)


def _time(line: str) -> int:
    match = _TIME.fullmatch(line)
    if match is None:
        raise BridgeError(f'42: must be "TIME year-day-hour:minute:second", got {line[:80]!r}')
    year, day, hour, minute = (int(field) for field in match.groups()[:4])
    try:
        calendar_date = date(year, 1, 1) + timedelta(days=day - 1)
        tai_ns = tai_ns_from_utc(f"{calendar_date}T{hour:02d}:{minute:02d}:00")
    except (ValueError, OverflowError) as error:
        raise BridgeError(f"42: {line}: {error}") from None
    # Added, since rounding makes 42 write 60.000000000 for the second before a minute.
    second, fraction = match[5].split(".")
    return tai_ns + int(second) * 1_000_000_000 + int(fraction[:9].ljust(9, "0"))


def _value(line: str) -> tuple[str, tuple[float, ...]]:
    match = _VALUE.fullmatch(line)
    try:
        if match is None:
            raise ValueError
        return match[1], tuple(float(number) for number in match[2].strip("[]").split())
    except ValueError:
        raise BridgeError(f'42: must be "name = [numbers]", got {line[:80]!r}') from None
