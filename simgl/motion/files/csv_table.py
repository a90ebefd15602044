"""Tables of motion: comma-separated values with named columns, as simulations and STK write them.

Columns are found by their names, in any order and with any others beside them:

time        utc, tai, tt, gps (texts); tai_ns; time_s (from the scenario's epoch); STK: Time (UTCG),
            Time (EpSec)
place       x_m ... or x_km, with the frame in between: x_icrf_m, x_eme2000_km, x_itrf_m, x_lvlh_m;
            STK: x (km), Radial (km) with In-Track and Cross-Track
velocity    vx_m_s ... or vx_km_s, vx_lvlh_m_s; STK: vx (km/sec)
joints      joint_NAME_deg of hinges, joint_NAME_m of rails
attitude    qx qy qz qw, q_icrf_x ..., q_lvlh_x ... : frame from body, scalar last; STK: q1 q2 q3 q4
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.errors import ConfigError
from simgl.motion.files.aem import check_norm
from simgl.motion.files.ccsds_kvn import time_of
from simgl.motion.files.motion_record import FRAMES, AttitudeRecord, Frame, StateRecord
from simgl.motion.files.text_lines import Line, shown
from simgl.physics.times import TimeScale

_FRAME = "|".join(FRAMES)
_PLACE = re.compile(rf"([xyz])(?:_({_FRAME}))?[ _]\(?(m|km)\)?")
_VELOCITY = re.compile(rf"v_?([xyz])(?:_({_FRAME}))?[ _]\(?(k?m)[_/]s(?:ec)?\)?")
_ATTITUDE = re.compile(rf"q_?(?:({_FRAME})_)?([xyzw1234])")
# Radial up, in-track ahead, cross-track along the orbit normal, as LVLH axes and signs.
_TRACK = {"in-track": ("x", 1.0), "cross-track": ("y", -1.0), "radial": ("z", -1.0)}
_TRACK_NAME = re.compile(r"(radial|in-track|cross-track) (?:\()?(m|km)\)?")
_TRACK_RATE = re.compile(r"(radial|in-track|cross-track) rate \((k?m)/sec\)")
_TEXT_TIMES: dict[str, TimeScale] = {
    "utc": "UTC",
    "time (utcg)": "UTC",
    "tai": "TAI",
    "tt": "TT",
    "gps": "GPS",
}
_SECONDS = ("time_s", "time (epsec)", "time (sec)")
_JOINT = re.compile(r"joint_([A-Za-z0-9_-]+)_(deg|m)")
_AXES = "xyz"


@dataclass(frozen=True)
class _Column:
    """Where a value stands, and what turns it into SI."""

    index: int
    name: str
    factor: float
    frame: Frame | None


@dataclass(frozen=True)
class _Row:
    line: Line
    cells: list[str]

    def value(self, column: _Column) -> float:
        return column.factor * self.line.number_of(self.cells[column.index].strip(), column.name)


class Table:
    """A table's columns and rows.

    lines : of the file, the header first
    Raises ConfigError with the line for a row that does not fit, and for a table without time.
    """

    def __init__(self, lines: list[Line], epoch_tai_ns: int) -> None:
        self._epoch_tai_ns = epoch_tai_ns
        filled = [line for line in lines if line.text.strip() and not line.text.startswith("#")]
        if not filled:
            raise ConfigError(str(lines[0].path) if lines else "", "", "holds no table")
        self._header, *body = filled
        self._names = [name.strip() for name in next(csv.reader([self._header.text]))]
        twice = {name for name in self._names if name and self._names.count(name) > 1}
        if twice:
            self._header.fail("", f"names {shown(min(twice))} twice")
        self._rows = [self._row(line) for line in body]
        if not self._rows:
            self._header.fail("", "is followed by no row")
        self.tai_ns = self._times()

    def _row(self, line: Line) -> _Row:
        try:
            cells = next(csv.reader([line.text], strict=True))
        except csv.Error as error:
            line.fail("", f"is no row of a table: {error}")
        if len(cells) != len(self._names):
            line.fail("", f"must hold {len(self._names)} values, got {len(cells)}")
        return _Row(line, cells)

    def _missing(self, problem: str) -> NoReturn:
        listing = ", ".join(self._names)
        self._header.fail("", f"{problem} (columns: {listing})")

    def _times(self) -> IndexArray:
        names = [name.lower() for name in self._names]
        known = [*_TEXT_TIMES, *_SECONDS, "tai_ns"]
        found = [name for name in names if name in known]
        if len(found) != 1:
            what = f"names {' and '.join(found)}" if found else "names no time"
            self._missing(f"{what}; exactly one of {', '.join(known)} is needed")
        column, times = names.index(found[0]), []
        for row in self._rows:
            times.append(self._time(row, found[0], row.cells[column].strip()))
            if len(times) > 1 and times[-1] <= times[-2]:
                text = shown(row.cells[column].strip())
                row.line.fail(found[0], f"must be later than in the row before, got {text}")
        return np.array(times, dtype=np.int64)

    def _time(self, row: _Row, name: str, text: str) -> int:
        if name in _TEXT_TIMES:
            return time_of(row.line, name, text, _TEXT_TIMES[name])
        if name == "tai_ns":
            if not re.fullmatch(r"-?\d{1,19}", text):
                row.line.fail(name, f"must be a whole number, got {shown(text)}")
            return int(text)
        return self._epoch_tai_ns + round(row.line.number_of(text, name) * 1e9)

    def states(self, name: str) -> StateRecord:
        """The places, and velocities where the table has them."""
        places, rates = self._motion()
        if len(places) < 3:
            self._missing("names no place x, y, z with its unit")
        if rates and len(rates) < 3:
            self._missing("names only a part of a velocity")
        frame = self._frame([*places.values(), *rates.values()])
        return StateRecord(
            name=name,
            tai_ns=self.tai_ns,
            positions=self._values([places[axis] for axis in _AXES]),
            velocities=self._values([rates[axis] for axis in _AXES]) if rates else None,
            frame=frame,
            span_ns=(int(self.tai_ns[0]), int(self.tai_ns[-1])),
        )

    def _motion(self) -> tuple[dict[str, _Column], dict[str, _Column]]:
        places: dict[str, _Column] = {}
        rates: dict[str, _Column] = {}
        for index, name in enumerate(self._names):
            low = name.lower()
            for pattern, found in ((_PLACE, places), (_VELOCITY, rates)):
                if match := pattern.fullmatch(low):
                    factor = 1e3 if match[3] == "km" else 1.0
                    column = _Column(index, name, factor, _frame_of(match[2]))
                    self._put(found, match[1], column)
            for pattern, found in ((_TRACK_NAME, places), (_TRACK_RATE, rates)):
                if match := pattern.fullmatch(low):
                    axis, sign = _TRACK[match[1]]
                    factor = sign * (1e3 if match[2] == "km" else 1.0)
                    self._put(found, axis, _Column(index, name, factor, "lvlh"))
        return places, rates

    def _put(self, found: dict[str, _Column], axis: str, column: _Column) -> None:
        if axis in found:
            self._missing(f"names both {found[axis].name} and {column.name}")
        found[axis] = column

    def _frame(self, columns: list[_Column]) -> Frame:
        frames = {column.frame or "icrf" for column in columns}
        if len(frames) > 1:
            self._missing(f"mixes the frames {' and '.join(sorted(frames))}")
        return frames.pop()

    def attitudes(self, name: str) -> AttitudeRecord:
        """The attitudes."""
        found: dict[str, _Column] = {}
        for index, title in enumerate(self._names):
            if match := _ATTITUDE.fullmatch(title.lower()):
                axis = match[2].translate(str.maketrans("1234", "xyzw"))
                self._put(found, axis, _Column(index, title, 1.0, _frame_of(match[1])))
        if len(found) < 4:
            self._missing("names no attitude qx, qy, qz, qw")
        columns = [found[axis] for axis in "xyzw"]
        values = self._values(columns)
        for row, quaternion in zip(self._rows, values.tolist(), strict=True):
            check_norm(row.line, quaternion)
        return AttitudeRecord(
            name=name,
            tai_ns=self.tai_ns,
            q_frame_from_body_xyzw=values,
            frame=self._frame(columns),
        )

    def joint_angles(self) -> tuple[tuple[str, ...], Array, frozenset[str]]:
        """Names of the joints, (n, joints) angles [rad] or travels [m], and names of the latter."""
        found: dict[str, _Column] = {}
        slides = set()
        for index, title in enumerate(self._names):
            if match := _JOINT.fullmatch(title):
                name, unit = match[1], match[2]
                factor = 1.0 if unit == "m" else np.pi / 180.0
                self._put(found, name, _Column(index, title, factor, None))
                if unit == "m":
                    slides.add(name)
        if not found:
            self._missing("names no joint angle joint_NAME_deg or joint_NAME_m")
        return tuple(found), self._values(list(found.values())), frozenset(slides)

    def _values(self, columns: list[_Column]) -> Array:
        return np.array([[row.value(column) for column in columns] for row in self._rows])


def _frame_of(text: str | None) -> Frame | None:
    return next((frame for frame in FRAMES if frame == text), None)
