"""CCSDS Orbit Ephemeris Messages (CCSDS 502.0-B, versions 1 to 3), their segments."""

from __future__ import annotations

import numpy as np

from simgl.motion.files.ccsds_kvn import Segment, time_of
from simgl.motion.files.motion_record import StateRecord
from simgl.motion.files.text_lines import shown

VERSION_KEY = "CCSDS_OEM_VERS"
_COLUMNS = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")


def read_oem(segments: list[Segment]) -> list[StateRecord]:
    """All segments; ConfigError with the line for malformed ones.

    Files give km and km/s; accelerations are ignored. USEABLE_START_TIME and USEABLE_STOP_TIME
    limit the span.
    """
    return [_state_record(segment) for segment in segments]


def check_centre(segment: Segment) -> None:
    """Raise ConfigError for states about another body than the Earth."""
    centre = segment.word("CENTER_NAME").upper()
    if centre != "EARTH":
        segment.fail("CENTER_NAME", f"must be EARTH, got {shown(centre)}")


def _state_record(segment: Segment) -> StateRecord:
    check_centre(segment)
    frame, scale = segment.frame("REF_FRAME"), segment.scale()
    times = np.array(segment.times(scale), dtype=np.int64)
    rows = []
    for line in segment.data:
        words = line.text.split()[1:]
        rows.append(line.numbers(words[:6] if len(words) == 9 else words, _COLUMNS))
    values = 1e3 * np.array(rows)
    ends = [int(times[0]), int(times[-1])]
    for end, key in enumerate(("USEABLE_START_TIME", "USEABLE_STOP_TIME")):
        text = segment.optional(key)
        if text is not None:
            limit = time_of(segment.meta[key][1], key, text, scale)
            ends[end] = max(ends[end], limit) if end == 0 else min(ends[end], limit)
    if ends[0] > ends[1]:
        segment.start.fail("", "opens a segment without data in its useable span")
    return StateRecord(
        name=segment.word("OBJECT_NAME"),
        tai_ns=times,
        positions=values[:, :3],
        velocities=values[:, 3:],
        frame=frame,
        span_ns=(ends[0], ends[1]),
    )
