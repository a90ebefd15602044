"""CCSDS Attitude Ephemeris Messages in key-value form (CCSDS 504.0-B, versions 1 and 2).

A message gives the rotation from frame A to frame B, which carries the axes of A onto those of B.
Its quaternion is that of the Hamilton matrix R_A_from_B; its Euler angles are intrinsic.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.errors import did_you_mean
from simgl.motion.files.ccsds_kvn import Segment, segments
from simgl.motion.files.motion_record import AttitudeRecord
from simgl.motion.files.text_lines import Line, shown
from simgl.physics.frames import QUATERNION_NORM_TOLERANCE

VERSION_KEY = "CCSDS_AEM_VERS"
_BODY = ("SC_BODY", "SPACECRAFT", "BODY")
_TYPES = ("QUATERNION", "EULER_ANGLE")


def read_aem(lines: list[Line]) -> list[AttitudeRecord]:
    """All segments; ConfigError with the line for malformed ones."""
    return [_attitude_record(segment) for segment in segments(lines, VERSION_KEY)]


def _attitude_record(segment: Segment) -> AttitudeRecord:
    body_is_b = _is_body(segment.word("REF_FRAME_B"))
    if body_is_b == _is_body(segment.word("REF_FRAME_A")):
        problem = "and REF_FRAME_B must be one reference frame and one SC_BODY"
        segment.fail("REF_FRAME_A", problem)
    frame = segment.frame("REF_FRAME_A" if body_is_b else "REF_FRAME_B")
    times = np.array(segment.times(segment.scale()), dtype=np.int64)
    kind = segment.word("ATTITUDE_TYPE").upper().replace(" ", "_")
    if kind not in _TYPES:
        problem = f"is {shown(kind)}; {did_you_mean(kind, _TYPES)}"
        segment.fail("ATTITUDE_TYPE", problem)
    q_a_from_b = _quaternions(segment) if kind == "QUATERNION" else _from_angles(segment)
    turns = Rotation.from_quat(q_a_from_b)
    direction = (segment.optional("ATTITUDE_DIR") or "A2B").upper()
    if direction not in ("A2B", "B2A"):
        segment.fail("ATTITUDE_DIR", f"must be A2B or B2A, got {shown(direction)}")
    if (direction == "A2B") != body_is_b:
        turns = turns.inv()
    return AttitudeRecord(
        name=segment.word("OBJECT_NAME"),
        tai_ns=times,
        q_frame_from_body_xyzw=turns.as_quat(),
        frame=frame,
    )


def _is_body(frame: str) -> bool:
    return frame.upper().startswith(_BODY)


def _quaternions(segment: Segment) -> Array:
    order = (segment.optional("QUATERNION_TYPE") or "LAST").upper()
    if order not in ("FIRST", "LAST"):
        segment.fail("QUATERNION_TYPE", f"must be FIRST or LAST, got {shown(order)}")
    keys = ("QC", "Q1", "Q2", "Q3") if order == "FIRST" else ("Q1", "Q2", "Q3", "QC")
    rows = []
    for line in segment.data:
        row = line.numbers(line.text.split()[1:], keys)
        check_norm(line, row)
        rows.append(row)
    values = np.array(rows)
    return np.roll(values, -1, axis=1) if order == "FIRST" else values


def check_norm(line: Line, quaternion: list[float]) -> None:
    """Raise ConfigError for a quaternion that is not of unit length."""
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        line.fail("", f"must be a unit quaternion, got norm {norm:.6g}")


def _from_angles(segment: Segment) -> Array:
    sequence = segment.word("EULER_ROT_SEQ").upper()
    axes = sequence.translate(str.maketrans("123", "XYZ"))
    if len(axes) != 3 or set(axes) - set("XYZ") or axes[0] == axes[1] or axes[1] == axes[2]:
        segment.fail("EULER_ROT_SEQ", f"must be three axes such as 321, got {shown(sequence)}")
    keys = ("ANGLE_1", "ANGLE_2", "ANGLE_3")
    rows = [line.numbers(line.text.split()[1:], keys) for line in segment.data]
    return Rotation.from_euler(axes, np.array(rows), degrees=True).as_quat()
