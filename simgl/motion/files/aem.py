"""CCSDS Attitude Ephemeris Messages (CCSDS 504.0-B, versions 1 and 2), their segments.

A message gives the rotation from frame A to frame B, which carries the axes of A onto those of B.
Its quaternion is that of the Hamilton matrix R_A_from_B; its Euler angles are intrinsic.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.errors import did_you_mean
from simgl.motion.files.ccsds_kvn import Segment
from simgl.motion.files.motion_record import AttitudeRecord, Frame
from simgl.motion.files.text_lines import Line, shown
from simgl.physics.frames import QUATERNION_NORM_TOLERANCE

VERSION_KEY = "CCSDS_AEM_VERS"
_BODY = ("SC_BODY", "SPACECRAFT", "BODY")
# Number of rates after the attitude, which are not used: between samples the rate is constant.
_TYPES = {
    "QUATERNION": 0,
    "QUATERNION/DERIVATIVE": 4,
    "QUATERNION/RATE": 3,
    "QUATERNION/ANGVEL": 3,
    "EULER_ANGLE": 0,
    "EULER_ANGLE/RATE": 3,
    "EULER_ANGLE/DERIVATIVE": 3,
    "EULER_ANGLE/ANGVEL": 3,
}


def read_aem(segments: list[Segment]) -> list[AttitudeRecord]:
    """All segments; ConfigError with the line for malformed ones."""
    return [_attitude_record(segment) for segment in segments]


def frame_and_way(
    segment: Segment, key_a: str, key_b: str, key_direction: str
) -> tuple[Frame, bool]:
    """The reference frame, and whether the rotation carries its axes onto those of the body.

    Raises ConfigError unless one of the two frames is the body and the other is supported.
    """
    body_is_b = _is_body(segment.word(key_b))
    if body_is_b == _is_body(segment.word(key_a)):
        problem = f"and {key_b} must be one reference frame and one SC_BODY"
        segment.fail(key_a, problem)
    frame = segment.frame(key_a if body_is_b else key_b)
    direction = (segment.optional(key_direction) or "A2B").upper()
    if direction not in ("A2B", "B2A"):
        segment.fail(key_direction, f"must be A2B or B2A, got {shown(direction)}")
    return frame, (direction == "A2B") == body_is_b


def _attitude_record(segment: Segment) -> AttitudeRecord:
    frame, onto_body = frame_and_way(segment, "REF_FRAME_A", "REF_FRAME_B", "ATTITUDE_DIR")
    times = np.array(segment.times(segment.scale()), dtype=np.int64)
    kind = segment.word("ATTITUDE_TYPE").upper().replace(" ", "_")
    if kind not in _TYPES:
        problem = f"is {shown(kind)}; {did_you_mean(kind, _TYPES)}"
        segment.fail("ATTITUDE_TYPE", problem)
    read = _quaternions if kind.startswith("QUATERNION") else _from_angles
    turns = Rotation.from_quat(read(segment, _TYPES[kind]))
    if not onto_body:
        turns = turns.inv()
    return AttitudeRecord(
        name=segment.word("OBJECT_NAME"),
        tai_ns=times,
        q_frame_from_body_xyzw=turns.as_quat(),
        frame=frame,
    )


def _is_body(frame: str) -> bool:
    return frame.upper().startswith(_BODY)


def _words(line: Line, count: int, rates: int) -> list[str]:
    """The words of the attitude: those after the epoch, without the rates that follow."""
    words = line.text.split()[1:]
    return words[:count] if len(words) == count + rates else words


def _quaternions(segment: Segment, rates: int) -> Array:
    order = (segment.optional("QUATERNION_TYPE") or "LAST").upper()
    if order not in ("FIRST", "LAST"):
        segment.fail("QUATERNION_TYPE", f"must be FIRST or LAST, got {shown(order)}")
    keys = ("QC", "Q1", "Q2", "Q3") if order == "FIRST" else ("Q1", "Q2", "Q3", "QC")
    rows = []
    for line in segment.data:
        row = line.numbers(_words(line, 4, rates), keys)
        check_norm(line, row)
        rows.append(row)
    values = np.array(rows)
    return np.roll(values, -1, axis=1) if order == "FIRST" else values


def check_norm(line: Line, quaternion: list[float]) -> None:
    """Raise ConfigError for a quaternion that is not of unit length."""
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        line.fail("", f"must be a unit quaternion, got norm {norm:.6g}")


def rotation_axes(segment: Segment) -> str:
    """EULER_ROT_SEQ as scipy's intrinsic axes; ConfigError for other than three axes."""
    sequence = segment.word("EULER_ROT_SEQ").upper()
    axes = sequence.translate(str.maketrans("123", "XYZ"))
    if len(axes) != 3 or set(axes) - set("XYZ") or axes[0] == axes[1] or axes[1] == axes[2]:
        segment.fail("EULER_ROT_SEQ", f"must be three axes such as 321, got {shown(sequence)}")
    return axes


def _from_angles(segment: Segment, rates: int) -> Array:
    axes = rotation_axes(segment)
    keys = ("ANGLE_1", "ANGLE_2", "ANGLE_3")
    rows = [line.numbers(_words(line, 3, rates), keys) for line in segment.data]
    return Rotation.from_euler(axes, np.array(rows), degrees=True).as_quat()
