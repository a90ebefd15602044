"""Key-value notation of CCSDS messages: a header, then segments of metadata and data.

Messages of a single state (OPM, APM) are one segment of keys, with blocks of further keys.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from simgl.errors import ConfigError, did_you_mean
from simgl.motion.files.motion_record import Frame
from simgl.motion.files.text_lines import Line, shown
from simgl.physics.times import SCALES, TimeScale, tai_ns_from_text

# Blocks inside a segment that are ignored.
_IGNORED = {"COVARIANCE_START": "COVARIANCE_STOP"}
_FRAMES: dict[str, Frame] = {
    "ICRF": "icrf",
    "GCRF": "icrf",
    "ICRF3": "icrf",
    "EME2000": "eme2000",
    "J2000": "eme2000",
    "ITRF": "itrf",
    "LVLH": "lvlh",
    "TEME": "teme",
}
_BLOCKS = {"META_START", "META_STOP", "DATA_START", "DATA_STOP", *_IGNORED}


@dataclass(frozen=True, kw_only=True)
class Segment:
    """start : where it begins; meta : key to value and its line; data : lines with content.

    blocks : of a single state, by the name before _START: QUAT, EULER, ANGVEL, MAN, ...
    """

    start: Line
    meta: Mapping[str, tuple[str, Line]]
    data: tuple[Line, ...]
    blocks: Mapping[str, Segment] = field(default_factory=dict)

    def word(self, key: str) -> str:
        """The value of a required key; ConfigError if it is missing."""
        if key not in self.meta:
            self.start.fail(key, "is missing in this segment")
        return self.meta[key][0]

    def optional(self, key: str) -> str | None:
        """The value of a key; None if it is missing."""
        return self.meta[key][0] if key in self.meta else None

    def fail(self, key: str, problem: str) -> None:
        """Raise ConfigError about a key's line."""
        self.meta[key][1].fail(key, problem)

    def number(self, key: str, unit: str) -> float:
        """A finite number with its unit in brackets or none; ConfigError for others."""
        text = self.word(key)
        line = self.meta[key][1]
        given = re.fullmatch(r"(.*?)\s*\[(.*)\]", text)
        if given and given[2] != unit:
            line.fail(key, f"must be in {unit}, got units {shown(given[2])}")
        return line.number_of(given[1] if given else text, key)

    def scale(self) -> TimeScale:
        """TIME_SYSTEM; ConfigError for an unsupported one."""
        given = self.word("TIME_SYSTEM").upper()
        for scale in SCALES:
            if given == scale:
                return scale
        line = self.meta["TIME_SYSTEM"][1]
        return line.fail("TIME_SYSTEM", f"is {shown(given)}; {did_you_mean(given, SCALES)}")

    def frame(self, key: str) -> Frame:
        """A reference frame; ConfigError for an unsupported one."""
        given = self.word(key).upper()
        # ITRF2000, ITRF-97 and others differ by centimetres.
        frame = "itrf" if given.startswith("ITRF") else _FRAMES.get(given)
        if frame is None:
            self.meta[key][1].fail(key, f"is {shown(given)}; {did_you_mean(given, _FRAMES)}")
        return frame

    def times(self, scale: TimeScale) -> list[int]:
        """TAI nanoseconds of the first word of each data line; ConfigError if not increasing."""
        if not self.data:
            self.start.fail("", "opens a segment without data")
        times: list[int] = []
        for line in self.data:
            times.append(time_of(line, "epoch", line.text.split()[0], scale))
            if len(times) > 1 and times[-1] <= times[-2]:
                line.fail("epoch", f"must be later than the one before, got {line.text.split()[0]}")
        return times


def time_of(line: Line, key: str, text: str, scale: TimeScale) -> int:
    """TAI nanoseconds of a text; ConfigError with the line for an invalid one."""
    try:
        return tai_ns_from_text(text, scale)
    except ValueError as error:
        return line.fail(key, str(error))


def single_state(lines: list[Line]) -> list[Segment]:
    """The one segment of a message of keys alone; ConfigError with the line for malformed ones."""
    groups: dict[str, dict[str, tuple[str, Line]]] = {"": {}}
    starts = {"": lines[0]}
    name, filled = "", [line for line in lines if line.text.strip()]
    for line in filled:
        text = line.text.strip()
        marker = re.fullmatch(r"([A-Z_]+)_(START|STOP)", text)
        if text.startswith("COMMENT"):
            continue
        if marker:
            name = "" if marker[2] == "STOP" or marker[1] == "META" else marker[1]
            groups.setdefault(name, {})
            starts.setdefault(name, line)
            continue
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            line.fail("", f"must be KEY = value, got {shown(text)}")
        if not value:
            line.fail(key, "has no value")
        # Manoeuvres repeat their keys; that there is one is all that counts.
        group = "MAN" if key.startswith("MAN_") else name
        starts.setdefault(group, line)
        keys = groups.setdefault(group, {})
        if key in keys and group != "MAN":
            line.fail(key, "is given twice in this message")
        keys[key] = value, line
    blocks = {
        block: Segment(start=starts[block], meta=keys, data=())
        for block, keys in groups.items()
        if block
    }
    return [Segment(start=starts[""], meta=groups[""], data=(), blocks=blocks)]


def segments(lines: list[Line], version_key: str) -> list[Segment]:
    """The segments of a message; ConfigError with the line for malformed ones."""
    start: Line | None = None
    meta: dict[str, tuple[str, Line]] = {}
    data: list[Line] = []
    result: list[Segment] = []
    in_meta, closing = False, None
    for line in lines:
        text = line.text.strip()
        if not text or text.startswith("COMMENT"):
            continue
        if closing is not None:
            closing = None if text == closing else closing
        elif text in _IGNORED:
            closing = _IGNORED[text]
        elif text == "META_START":
            if in_meta:
                line.fail("", "opens metadata inside metadata")
            if start is not None:
                result.append(Segment(start=start, meta=meta, data=tuple(data)))
            start, meta, data, in_meta = line, {}, [], True
        elif text == "META_STOP":
            if not in_meta:
                line.fail("", "closes metadata that was not opened")
            in_meta = False
        elif text in _BLOCKS:
            continue
        elif "=" in text and (in_meta or start is None):
            key, _, value = (part.strip() for part in text.partition("="))
            if not value:
                line.fail(key, "has no value")
            if in_meta:
                if key in meta:
                    line.fail(key, "is given twice in this segment")
                meta[key] = (value, line)
        elif in_meta or start is None:
            line.fail("", f"must be KEY = value, got {shown(text)}")
        else:
            data.append(line)
    if in_meta and start is not None:
        start.fail("", "opens metadata that META_STOP never closes")
    if start is None:
        problem = f"holds no segment (META_START) after {version_key}"
        raise ConfigError(str(lines[0].path) if lines else "", "", problem)
    result.append(Segment(start=start, meta=meta, data=tuple(data)))
    return result
