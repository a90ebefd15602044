"""STK's text files: ephemerides (.e) and attitudes (.a).

Keywords, then a block of rows whose first number is the time in seconds from ScenarioEpoch (UTC).
Whatever could change the numbers and is not read is refused by its keyword.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.errors import did_you_mean
from simgl.motion.files.aem import check_norm
from simgl.motion.files.ccsds_kvn import time_of
from simgl.motion.files.motion_record import AttitudeRecord, Frame, StateRecord
from simgl.motion.files.text_lines import Line, shown

VERSION_KEY = "stk.v."
_FRAMES: dict[str, Frame] = {
    "ICRF": "icrf",
    "J2000": "eme2000",
    "FIXED": "itrf",
    "TEMEOFDATE": "teme",
}
_SECTIONS = {
    "EphemerisTimePos": ("x", "y", "z"),
    "EphemerisTimePosVel": ("x", "y", "z", "vx", "vy", "vz"),
    "EphemerisTimePosVelAcc": ("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"),
}
_ATTITUDE_SECTIONS = {
    "AttitudeTimeQuaternions": ("q1", "q2", "q3", "q4"),
    "AttitudeTimeQuatScalarFirst": ("q4", "q1", "q2", "q3"),
    "AttitudeTimeQuatAngVels": ("q1", "q2", "q3", "q4", "wx", "wy", "wz"),
    "AttitudeTimeEulerAngles": ("rotA", "rotB", "rotC"),
}
_UNITS = {"METERS": 1.0, "METER": 1.0, "M": 1.0, "KILOMETERS": 1e3, "KILOMETER": 1e3, "KM": 1e3}
# Keywords that change nothing that is read here.
_IGNORED = (
    "MessageLevel",
    "InterpolationMethod",
    "InterpolationOrder",
    "InterpolationSamplesM1",
    "BlockingFactor",
    "AttitudeDeviations",
)
_READ = (
    "ScenarioEpoch",
    "CentralBody",
    "CoordinateSystem",
    "CoordinateAxes",
    "DistanceUnit",
    "TimeFormat",
    "Sequence",
    "NumberOfEphemerisPoints",
    "NumberOfAttitudePoints",
)
# The years 1972 to 2099, from anywhere in them [s].
_MAX_SECONDS = 4.1e9
_EULER_SEQUENCES = tuple(a + b + c for a, b, c in product("123", repeat=3) if a != b != c)


@dataclass(frozen=True)
class _StkFile:
    """keywords : lower-case name to value and line; rows : of the section, numbers with lines.

    boundaries : seconds from the epoch at which a new segment begins
    """

    begin: Line
    keywords: Mapping[str, tuple[str, Line]]
    section: str
    rows: list[tuple[Line, list[float]]]
    boundaries: list[float]

    def optional(self, key: str) -> tuple[str, Line] | None:
        return self.keywords.get(key.lower())

    def frame(self, key: str) -> Frame:
        """The reference frame; its defaults differ between files and versions, so it is needed."""
        given = self.optional(key)
        if given is None:
            self.begin.fail(key, f"is missing in this block; {did_you_mean('', _FRAMES)}")
        frame = _FRAMES.get(given[0].upper())
        if frame is None:
            given[1].fail(key, f"is {shown(given[0])}; {did_you_mean(given[0].upper(), _FRAMES)}")
        return frame

    def epoch(self) -> int:
        """ScenarioEpoch; ConfigError for other bodies and other times than seconds from it."""
        for key, allowed in (("CentralBody", "Earth"), ("TimeFormat", "EpSec")):
            given = self.optional(key)
            if given is not None and given[0].lower() != allowed.lower():
                given[1].fail(key, f"must be {allowed}, got {shown(given[0])}")
        given = self.optional("ScenarioEpoch")
        if given is None:
            self.begin.fail("ScenarioEpoch", "is missing in this block")
        return time_of(given[1], "ScenarioEpoch", given[0], "UTC")


def read_ephemeris(lines: list[Line], name: str) -> list[StateRecord]:
    """The segments of a .e file; ConfigError with the line for malformed ones."""
    file = _read(lines, "Ephemeris", _SECTIONS)
    epoch, frame = file.epoch(), file.frame("CoordinateSystem")
    unit = file.optional("DistanceUnit") or ("Meters", file.begin)
    if unit[0].upper() not in _UNITS:
        unit[1].fail("DistanceUnit", f"must be Meters or Kilometers, got {shown(unit[0])}")
    values = np.array([row for _, row in file.rows])
    for (line, row), before in zip(file.rows[1:], values[:-1, 0], strict=True):
        # The end of a segment and the start of the next share a time.
        if row[0] < before or (row[0] == before and row[0] not in file.boundaries):
            line.fail("time", f"must be later than the one before, got {row[0]:g}")
    starts = np.flatnonzero(np.isin(values[:, 0], file.boundaries))
    inner = {int(i) for i in starts if i + 1 == len(values) or values[i + 1, 0] != values[i, 0]}
    cuts = sorted({0, *inner, len(values)})
    scale = _UNITS[unit[0].upper()]
    result = []
    for first, end in pairwise(cuts):
        piece = values[first:end]
        times = epoch + np.round(piece[:, 0] * 1e9).astype(np.int64)
        result.append(
            StateRecord(
                name=name,
                tai_ns=times,
                positions=scale * piece[:, 1:4],
                velocities=scale * piece[:, 4:7] if piece.shape[1] > 4 else None,
                frame=frame,
                span_ns=(int(times[0]), int(times[-1])),
            )
        )
    return result


def read_attitude(lines: list[Line], name: str) -> AttitudeRecord:
    """The attitude of a .a file; ConfigError with the line for malformed ones.

    Rotations carry the reference axes onto those of the body; angles turn about the axes as they
    move. Rates are left out.
    """
    file = _read(lines, "Attitude", _ATTITUDE_SECTIONS)
    epoch, frame = file.epoch(), file.frame("CoordinateAxes")
    values = np.array([row for _, row in file.rows])
    for (line, row), before in zip(file.rows[1:], values[:-1, 0], strict=True):
        if row[0] <= before:
            line.fail("time", f"must be later than the one before, got {row[0]:g}")
    return AttitudeRecord(
        name=name,
        tai_ns=epoch + np.round(values[:, 0] * 1e9).astype(np.int64),
        q_frame_from_body_xyzw=_quaternions(file, values),
        frame=frame,
    )


def _quaternions(file: _StkFile, values: Array) -> Array:
    if file.section == "AttitudeTimeEulerAngles":
        sequence, line = file.optional("Sequence") or ("313", file.begin)
        if sequence not in _EULER_SEQUENCES:
            allowed = ", ".join(_EULER_SEQUENCES)
            line.fail("Sequence", f"must be one of {allowed}; got {shown(sequence)}")
        axes = sequence.translate(str.maketrans("123", "XYZ"))
        return Rotation.from_euler(axes, values[:, 1:4], degrees=True).as_quat()
    for line, row in file.rows:
        check_norm(line, row[1:5])
    scalar_first = file.section == "AttitudeTimeQuatScalarFirst"
    return np.roll(values[:, 1:5], -1, axis=1) if scalar_first else values[:, 1:5]


def _read(lines: list[Line], block: str, sections: Mapping[str, tuple[str, ...]]) -> _StkFile:
    """The keywords and rows of a file whose first line is the version."""
    sections_by_name = {name.lower(): name for name in sections}
    begin: Line | None = None
    keywords: dict[str, tuple[str, Line]] = {}
    section, rows, boundaries, in_boundaries = "", [], [], False
    filled = [x for x in lines if x.text.strip() and not x.text.lstrip().startswith("#")]
    for line in filled[1:]:
        word, _, value = re.sub(r"\s+", " ", line.text.strip()).partition(" ")
        key = word.lower()
        if begin is None:
            if (key, value.lower()) != ("begin", block.lower()):
                line.fail("", f"must be BEGIN {block}, got {shown(line.text.strip())}")
            begin = line
        elif key == "begin" and value.lower() == "segmentboundarytimes":
            in_boundaries = True
        elif key == "end" and value.lower() == "segmentboundarytimes":
            in_boundaries = False
        elif in_boundaries:
            boundaries.append(line.number_of(word, "SegmentBoundaryTimes"))
        elif key == "end":
            break
        elif section:
            row = line.numbers(line.text.split(), ("time", *sections[section]))
            if abs(row[0]) > _MAX_SECONDS:
                line.fail("time", f"must lie within +-{_MAX_SECONDS:g} s, got {row[0]:g}")
            rows.append((line, row))
        elif key in sections_by_name:
            section = sections_by_name[key]
        elif key.startswith((f"{block.lower()}time", f"{block.lower()}ll")):
            line.fail("", f"holds {word}, which is not read; {did_you_mean(word, sections)}")
        else:
            _add(keywords, line, word, value)
    if begin is None:
        filled[0].fail("", f"is followed by no BEGIN {block}")
    if not rows:
        begin.fail("", f"opens a block without rows of {', '.join(sections)}")
    return _StkFile(begin, keywords, section, rows, boundaries)


def _add(keywords: dict[str, tuple[str, Line]], line: Line, word: str, value: str) -> None:
    if word.lower() in keywords:
        line.fail(word, "is given twice")
    allowed = {name.lower() for name in (*_READ, *_IGNORED)}
    if word.lower() not in allowed:
        listing = did_you_mean(word, (*_READ, *_IGNORED))
        line.fail(word, f"is not a keyword that is read here; {listing}")
    if not value:
        line.fail(word, "has no value")
    keywords[word.lower()] = value, line


def kind_of(lines: list[Line]) -> str:
    """What the first block holds: "stk_ephemeris" or "stk_attitude"."""
    filled = [line for line in lines if line.text.strip()]
    for line in filled[1:]:
        words = line.text.lower().split()
        if words[0] == "begin":
            if words[1:] in (["ephemeris"], ["attitude"]):
                return f"stk_{words[1]}"
            got = shown(line.text.strip())
            line.fail("", f"must be BEGIN Ephemeris or BEGIN Attitude, got {got}")
    return filled[0].fail("", "is followed by no BEGIN Ephemeris or BEGIN Attitude")
