"""Child process that reads SPICE kernels: one request on stdin, one answer on stdout.

SPICE keeps its kernels in one pool for each process and is not safe in threads. Here the pool holds
one meta-kernel and ends with the process, so that nothing passes from one scenario to another, nor
to or from a program that uses SPICE itself. Imports nothing of simgl: it starts in 0.3 s.
"""

from __future__ import annotations

import io
import json
import math
import sys
from fractions import Fraction
from typing import Any, NoReturn

import numpy as np
import spiceypy

# TAI nanoseconds, since 1970, of the epoch J2000 read on TAI's clock; TT - TAI.
_J2000_NS = 946_728_000_000_000_000
_TT_TAI_NS = 32_184_000_000
_EARTH = 399
# Ends of coverage are approached to this distance, the resolution of SPICE's seconds in 2100.
_INWARD_NS = 1_000
_CK_CLASS = 3


def fail(problem: str) -> NoReturn:
    """End with the reason on stdout."""
    sys.stdout.write(json.dumps({"problem": " ".join(problem.split())}))
    sys.exit(3)


class Clock:
    """TAI and SPICE's ephemeris time, by the constants of the leap-second kernel (DELTET)."""

    def __init__(self) -> None:
        if not spiceypy.expool("DELTET/K"):
            fail("names no leap-second kernel (LSK), which times need")
        self._k, self._eb = (float(spiceypy.gdpool(f"DELTET/{n}", 0, 1)[0]) for n in ("K", "EB"))
        self._m = [float(m) for m in spiceypy.gdpool("DELTET/M", 0, 2)]

    def _ahead_of_tt_ns(self, tt: float) -> int:
        anomaly = self._m[0] + self._m[1] * tt
        return round(1e9 * self._k * math.sin(anomaly + self._eb * math.sin(anomaly)))

    def seconds(self, tai_ns: int) -> tuple[float, float]:
        """Ephemeris time as a double [s], and what is missing to the exact time [s].

        A double of today's times steps by 1e-7 s, a millimetre in a low orbit.
        """
        tt_ns = tai_ns - _J2000_NS + _TT_TAI_NS
        exact_ns = tt_ns + self._ahead_of_tt_ns(tt_ns * 1e-9)
        rounded = exact_ns / 1_000_000_000
        return rounded, float(exact_ns - Fraction(rounded) * 1_000_000_000) * 1e-9

    def tai_ns(self, seconds: float) -> int:
        """TAI nanoseconds of ephemeris time."""
        exact_ns = round(Fraction(seconds) * 1_000_000_000)
        return exact_ns - self._ahead_of_tt_ns(seconds) - _TT_TAI_NS + _J2000_NS


def kernels(kind: str) -> list[str]:
    """The loaded files of a kind."""
    return [spiceypy.kdata(i, kind)[0] for i in range(spiceypy.ktotal(kind))]


def windows(cover: Any, clock: Clock) -> list[tuple[int, int]]:
    """The intervals of a coverage window, as TAI nanoseconds just inside."""
    ends = [spiceypy.wnfetd(cover, i) for i in range(spiceypy.wncard(cover))]
    return [(clock.tai_ns(a) + _INWARD_NS, clock.tai_ns(b) - _INWARD_NS) for a, b in ends]


def body_windows(body: int, clock: Clock) -> list[tuple[int, int]]:
    """When the kernels hold states of a body."""
    files = kernels("SPK")
    listed = sorted({int(i) for file in files for i in spiceypy.spkobj(file)})
    if body not in listed:
        names = ", ".join(map(str, listed)) or "no SPK is named"
        fail(f"holds no states of naif_id {body}; allowed: {names}")
    cover = spiceypy.utils.support_types.SPICEDOUBLE_CELL(20_000)
    for file in files:
        if body in {int(i) for i in spiceypy.spkobj(file)}:
            spiceypy.spkcov(file, body, cover)
    return windows(cover, clock)


def frame_windows(frame: str, clock: Clock) -> list[tuple[int, int]] | None:
    """When the kernels orient a frame; None for one without coverage of its own."""
    code = spiceypy.namfrm(frame)
    if code == 0:
        fail(f'knows no frame "{frame}"; a frame kernel (FK) or a PCK must define it')
    _, kind, number = spiceypy.frinfo(code)[:3]
    if kind != _CK_CLASS:
        return None
    cover = spiceypy.utils.support_types.SPICEDOUBLE_CELL(20_000)
    for file in kernels("CK"):
        if number in {int(i) for i in spiceypy.ckobj(file)}:
            spiceypy.ckcov(file, number, False, "INTERVAL", 0.0, "TDB", cover)
    if spiceypy.wncard(cover) == 0:
        fail(f'holds no attitudes of frame "{frame}" (CK {number}) in its C-kernels')
    return windows(cover, clock)


def times_of(first: int, last: int, step: int) -> list[int]:
    """From the first to the last instant, in steps, both included."""
    return [*range(first, last, step), last]


def state_row(request: dict[str, Any], clock: Clock, tai_ns: int) -> list[float]:
    """Position [m] and velocity [m s-1] in ICRF from the Earth's centre."""
    seconds, rest = clock.seconds(tai_ns)
    state, _ = spiceypy.spkgeo(request["body"], seconds, "J2000", _EARTH)
    r, v = 1e3 * np.asarray(state[:3]), 1e3 * np.asarray(state[3:])
    return [*(r + rest * v), *v]


def attitude_row(request: dict[str, Any], clock: Clock, tai_ns: int) -> list[float]:
    """The nine numbers of R_icrf_from_frame, row by row."""
    seconds, _ = clock.seconds(tai_ns)
    return list(np.asarray(spiceypy.pxform(request["frame"], "J2000", seconds)).ravel())


def answer(request: dict[str, Any]) -> None:
    """Write windows, times and rows; ``first_ns`` to ``last_ns`` in steps of ``step_ns``."""
    spiceypy.furnsh(request["meta_kernel"])
    clock = Clock()
    attitudes = request["frame"] is not None
    span = (int(request["first_ns"]), int(request["last_ns"]))
    covered = (
        frame_windows(request["frame"], clock)
        if attitudes
        else body_windows(int(request["body"]), clock)
    )
    inside = [span] if covered is None else [(max(a, span[0]), min(b, span[1])) for a, b in covered]
    inside = [(a, b) for a, b in inside if a < b]
    times = [times_of(a, b, int(request["step_ns"])) for a, b in inside]
    row = attitude_row if attitudes else state_row
    rows = []
    for when in (t for one in times for t in one):
        try:
            rows.append(row(request, clock, when))
        except spiceypy.exceptions.SpiceyError as error:
            fail(f"gives nothing at {{{when}}}: {error.short}: {error.long}")
    output = io.BytesIO()
    np.savez(
        output,
        covered=np.array(covered or [span], dtype=np.int64).reshape(-1, 2),
        counts=np.array([len(one) for one in times], dtype=np.int64),
        times=np.array([t for one in times for t in one], dtype=np.int64),
        rows=np.array(rows, dtype=np.float64).reshape(-1, 9 if attitudes else 6),
    )
    sys.stdout.buffer.write(output.getvalue())


if __name__ == "__main__":
    try:
        answer(json.load(sys.stdin))
    except spiceypy.exceptions.SpiceyError as failure:
        fail(f"cannot be loaded: {failure.short}: {failure.long}")
