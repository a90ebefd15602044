"""Motion tables: comma-separated values with named columns, as simulations and STK write them.

Columns are identified by name, in any order; other columns are ignored:

time        utc, tai, tt, tdb, gps (texts); tai_ns; time_s (from the scenario's epoch);
            STK: Time (UTCG), Time (EpSec)
position    x_m ... or x_km, with an optional frame: x_icrf_m, x_eme2000_km, x_itrf_m, x_lvlh_m;
            STK: x (km), Radial (km) with In-Track and Cross-Track
velocity    vx_m_s ... or vx_km_s, vx_lvlh_m_s; STK: vx (km/sec)
joints      joint_NAME_deg of hinges, joint_NAME_m of rails
attitude    qx qy qz qw, q_icrf_x ..., q_lvlh_x ... : frame from body; STK: q1 q2 q3 q4; scalar
            first: q0 q1 q2 q3; or yaw_deg pitch_deg roll_deg, yaw_lvlh_deg ...: 3-2-1
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, IndexArray
from simgl.errors import ConfigError
from simgl.motion.files.aem import check_norm
from simgl.motion.files.ccsds_kvn import time_of
from simgl.motion.files.motion_record import FRAMES, AttitudeRecord, Frame, StateRecord
from simgl.motion.files.text_lines import Line, shown
from simgl.physics.times import TimeScale

_FRAME = "|".join(FRAMES)
_POSITION = re.compile(rf"([xyz])(?:_({_FRAME}))?[ _]\(?(m|km)\)?")
_VELOCITY = re.compile(rf"v_?([xyz])(?:_({_FRAME}))?[ _]\(?(k?m)[_/]s(?:ec)?\)?")
_ATTITUDE = re.compile(rf"q_?(?:({_FRAME})_)?([xyzw01234])")
_ANGLE = re.compile(rf"(yaw|pitch|roll)(?:_({_FRAME}))?_deg")
# Radial up, in-track ahead, cross-track along the orbit normal, as LVLH axes and signs.
_TRACK = {"in-track": ("x", 1.0), "cross-track": ("y", -1.0), "radial": ("z", -1.0)}
_TRACK_POSITION = re.compile(r"(radial|in-track|cross-track) ()(?:\()?(m|km)\)?")
_TRACK_VELOCITY = re.compile(r"(radial|in-track|cross-track) rate ()\((k?m)/sec\)")
_TEXT_TIMES: dict[str, TimeScale] = {
    "utc": "UTC",
    "time (utcg)": "UTC",
    "tai": "TAI",
    "tt": "TT",
    "tdb": "TDB",
    "gps": "GPS",
}
_SECONDS = ("time_s", "time (epsec)", "time (sec)")
_JOINT = re.compile(r"joint_([A-Za-z0-9_-]+)_(deg|m)")
_AXES = "xyz"
_NUMBER = re.compile(r"[-+.\deE]*")


@dataclass(frozen=True)
class _Column:
    """Index and name of a column, and the factor to SI."""

    index: int
    name: str
    factor: float = 1.0
    frame: Frame = "icrf"


class Table:
    """A motion table.

    lines : of the file, the header first
    epoch_tai_ns : origin of times in seconds

    tai_ns : (n,) times of the rows

    Raises ConfigError with the line for malformed rows, and for a table without time.
    """

    def __init__(self, lines: list[Line], epoch_tai_ns: int) -> None:
        self._epoch_tai_ns = epoch_tai_ns
        filled = [line for line in lines if line.text.strip() and not line.text.startswith("#")]
        if not filled:
            raise ConfigError(str(lines[0].path) if lines else "", "", "holds no table")
        self._header, *body = filled
        self._names = [name.strip() for name in next(csv.reader([self._header.text]))]
        if all(map(_NUMBER.fullmatch, self._names)):
            self._header.fail("", f"must name the columns, got {shown(self._header.text)}")
        twice = {name for name in self._names if name and self._names.count(name) > 1}
        if twice:
            self._header.fail("", f"names {shown(min(twice))} twice")
        self._rows = [(line, self._cells(line)) for line in body]
        if not self._rows:
            self._header.fail("", "is followed by no row")
        self.tai_ns = self._times()

    def _cells(self, line: Line) -> list[str]:
        try:
            cells = next(csv.reader([line.text], strict=True))
        except csv.Error as error:
            line.fail("", f"is not a row of a table: {error}")
        if len(cells) != len(self._names):
            line.fail("", f"must hold {len(self._names)} values, got {len(cells)}")
        return [cell.strip() for cell in cells]

    def _missing(self, problem: str) -> NoReturn:
        listing = ", ".join(self._names)
        self._header.fail("", f"{problem} (columns: {listing})")

    def _times(self) -> IndexArray:
        names = [name.lower() for name in self._names]
        known = [*_TEXT_TIMES, *_SECONDS, "tai_ns"]
        given = [name for name in names if name in known]
        if len(given) != 1:
            what = f"names {' and '.join(given)}" if given else "names no time"
            self._missing(f"{what}; exactly one of {', '.join(known)} is needed")
        column, times = names.index(given[0]), []
        for line, cells in self._rows:
            times.append(self._time(line, given[0], cells[column]))
            if len(times) > 1 and times[-1] <= times[-2]:
                text = shown(cells[column])
                line.fail(given[0], f"must be later than in the row before, got {text}")
        return np.array(times, dtype=np.int64)

    def _time(self, line: Line, name: str, text: str) -> int:
        if name in _TEXT_TIMES:
            return time_of(line, name, text, _TEXT_TIMES[name])
        if name == "tai_ns":
            if not re.fullmatch(r"-?\d{1,19}", text):
                line.fail(name, f"must be a whole number, got {shown(text)}")
            return int(text)
        return self._epoch_tai_ns + round(line.number_of(text, name) * 1e9)

    def states(self, name: str) -> StateRecord:
        """Positions, and velocities if the table has them; ConfigError without positions."""
        positions = self._vector(_POSITION, _TRACK_POSITION)
        velocities = self._vector(_VELOCITY, _TRACK_VELOCITY)
        if len(positions) < 3:
            self._missing("names no place x, y, z with its unit")
        if velocities and len(velocities) < 3:
            self._missing("names only a part of a velocity")
        frame = self._frame([*positions.values(), *velocities.values()])
        return StateRecord(
            name=name,
            tai_ns=self.tai_ns,
            positions=self._values([positions[axis] for axis in _AXES]),
            velocities=self._values([velocities[a] for a in _AXES]) if velocities else None,
            frame=frame,
            span_ns=(int(self.tai_ns[0]), int(self.tai_ns[-1])),
        )

    def _vector(
        self, cartesian: re.Pattern[str], along_track: re.Pattern[str]
    ) -> dict[str, _Column]:
        """Columns of a vector by axis."""
        columns: dict[str, _Column] = {}
        for index, name in enumerate(self._names):
            for pattern in (cartesian, along_track):
                if match := pattern.fullmatch(name.lower()):
                    axis, sign = _TRACK.get(match[1], (match[1], 1.0))
                    frame = "lvlh" if match[1] in _TRACK else _frame_of(match[2])
                    factor = sign * (1e3 if match[3] == "km" else 1.0)
                    self._add(columns, axis, _Column(index, name, factor, frame))
        return columns

    def _add(self, columns: dict[str, _Column], key: str, column: _Column) -> None:
        if key in columns:
            self._missing(f"names both {columns[key].name} and {column.name}")
        columns[key] = column

    def _frame(self, columns: list[_Column]) -> Frame:
        frames = {column.frame for column in columns}
        if len(frames) > 1:
            self._missing(f"mixes the frames {' and '.join(sorted(frames))}")
        return frames.pop()

    def attitudes(self, name: str) -> AttitudeRecord:
        """Attitudes; ConfigError if the table has none, or other than unit quaternions."""
        columns: dict[str, _Column] = {}
        angles: dict[str, _Column] = {}
        for index, title in enumerate(self._names):
            if match := _ATTITUDE.fullmatch(title.lower()):
                # Of five, 0 and 4 would both be the scalar.
                axis = match[2].translate(str.maketrans("01234", "wxyzw"))
                self._add(columns, axis, _Column(index, title, frame=_frame_of(match[1])))
            if match := _ANGLE.fullmatch(title.lower()):
                self._add(angles, match[1], _Column(index, title, frame=_frame_of(match[2])))
        if columns and angles:
            self._missing("names both a quaternion and yaw, pitch, roll")
        if len(columns) < 4 and len(angles) < 3:
            self._missing("names no attitude qx, qy, qz, qw or yaw_deg, pitch_deg, roll_deg")
        return AttitudeRecord(
            name=name,
            tai_ns=self.tai_ns,
            q_frame_from_body_xyzw=self._quaternions(columns) if columns else self._turns(angles),
            frame=self._frame(list((columns or angles).values())),
        )

    def _quaternions(self, columns: dict[str, _Column]) -> Array:
        values = self._values([columns[axis] for axis in "xyzw"])
        for (line, _), quaternion in zip(self._rows, values.tolist(), strict=True):
            check_norm(line, quaternion)
        return values

    def _turns(self, columns: dict[str, _Column]) -> Array:
        """Yaw about z, then pitch about the new y, then roll about the new x carry the axes."""
        values = self._values([columns[name] for name in ("yaw", "pitch", "roll")])
        return Rotation.from_euler("ZYX", values, degrees=True).as_quat()

    def joint_angles(self) -> tuple[tuple[str, ...], Array, frozenset[str]]:
        """Joint names, (n, joints) angles [rad] or travels [m], and the names of the rails."""
        columns: dict[str, _Column] = {}
        rails = set()
        for index, title in enumerate(self._names):
            if match := _JOINT.fullmatch(title):
                name, unit = match[1], match[2]
                factor = 1.0 if unit == "m" else np.pi / 180.0
                self._add(columns, name, _Column(index, title, factor))
                if unit == "m":
                    rails.add(name)
        if not columns:
            self._missing("names no joint angle joint_NAME_deg or joint_NAME_m")
        return tuple(columns), self._values(list(columns.values())), frozenset(rails)

    def _values(self, columns: list[_Column]) -> Array:
        return np.array(
            [
                [c.factor * line.number_of(cells[c.index], c.name) for c in columns]
                for line, cells in self._rows
            ]
        )


def _frame_of(text: str | None) -> Frame:
    return next((frame for frame in FRAMES if frame == text), "icrf")
