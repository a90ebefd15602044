"""CCSDS messages of a single state: OPM (502.0-B, versions 1 to 3) and APM (504.0-B, 1 and 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.motion.files.aem import check_norm, frame_and_way, rotation_axes
from simgl.motion.files.ccsds_kvn import Segment, time_of
from simgl.motion.files.motion_record import AttitudeRecord, StateRecord, attitude_in_icrf, in_icrf
from simgl.motion.files.oem import check_centre
from simgl.motion.files.text_lines import shown
from simgl.motion.orbits import KeplerianOrbit, keplerian_orbit

OPM_KEY = "CCSDS_OPM_VERS"
APM_KEY = "CCSDS_APM_VERS"
_QUATERNION = ("Q1", "Q2", "Q3", "QC")
_ANGLES = ("ANGLE_1", "ANGLE_2", "ANGLE_3")


@dataclass(frozen=True, kw_only=True)
class NamedOrbit:
    """The orbit of one object."""

    name: str
    orbit: KeplerianOrbit


def read_opm(segments: list[Segment]) -> list[NamedOrbit]:
    """The two-body orbits through the states; ConfigError with the line for malformed ones.

    Refuses manoeuvres, which such an orbit cannot hold.
    """
    return [_orbit(segment) for segment in segments]


def _orbit(segment: Segment) -> NamedOrbit:
    check_centre(segment)
    if "MAN" in segment.blocks:
        problem = "plans a manoeuvre; a trajectory with manoeuvres goes into an OEM"
        segment.blocks["MAN"].start.fail("", problem)
    frame = segment.frame("REF_FRAME")
    if frame == "lvlh":
        segment.fail("REF_FRAME", "must be a frame about the Earth, got LVLH")
    tai_ns = _epoch(segment, segment)
    position = [segment.number(key, "km") for key in ("X", "Y", "Z")]
    velocity = [segment.number(f"{key}_DOT", "km/s") for key in ("X", "Y", "Z")]
    record = StateRecord(
        name=segment.word("OBJECT_NAME"),
        tai_ns=np.array([tai_ns]),
        positions=1e3 * np.array([position]),
        velocities=1e3 * np.array([velocity]),
        frame=frame,
        span_ns=(tai_ns, tai_ns),
    )
    state = in_icrf(record)
    assert state.velocities is not None
    try:
        orbit = keplerian_orbit(state.positions[0], state.velocities[0], tai_ns)
    except ValueError as error:
        segment.fail("X", str(error))
    return NamedOrbit(name=record.name, orbit=orbit)


def _epoch(segment: Segment, holder: Segment) -> int:
    """TAI nanoseconds of the state; version 1 of the APM in XML has the epoch in its block."""
    given = holder if "EPOCH" in holder.meta else segment
    text = given.word("EPOCH")
    return time_of(given.meta["EPOCH"][1], "EPOCH", text, segment.scale())


def read_apm(segments: list[Segment]) -> list[AttitudeRecord]:
    """Fixed attitudes in ICRF or LVLH axes, one sample each; ConfigError with the line for others.

    Of a quaternion and angles the quaternion counts. Refuses rates and manoeuvres.
    """
    return [_attitude(segment) for segment in segments]


def _attitude(segment: Segment) -> AttitudeRecord:
    for block in ("ANGVEL", "SPIN", "MAN"):
        if block in segment.blocks:
            problem = "describes a rotation; attitudes that turn go into an AEM"
            segment.blocks[block].start.fail(block, problem)
    # Version 1 has no blocks in key-value form, and frames with names of their own.
    holder = segment.blocks.get("QUAT", segment)
    by_angles = "Q1" not in holder.meta
    if by_angles:
        holder = segment.blocks.get("EULER", segment)
    for one in (segment, *segment.blocks.values()):
        for key in (key for key in one.meta if key.endswith(("_DOT", "_RATE", "ANGVEL_X"))):
            if one.number(key, one.word(key).rpartition("[")[2].rstrip("]")) != 0.0:
                one.fail(key, "must be 0; attitudes that turn go into an AEM")
    prefix = "EULER" if by_angles else "Q"
    version_1 = f"{prefix}_FRAME_A" in holder.meta
    key_a, key_b = (f"{prefix}_FRAME_{x}" if version_1 else f"REF_FRAME_{x}" for x in "AB")
    frame, onto_body = frame_and_way(holder, key_a, key_b, f"{prefix}_DIR")
    if frame == "itrf":
        key = key_a if holder.word(key_a).upper().startswith("ITRF") else key_b
        holder.fail(key, f"turns with the Earth ({shown(holder.word(key))}); that goes into an AEM")
    tai_ns = _epoch(segment, holder)
    turn = _from_angles(holder) if by_angles else _from_quaternion(holder)
    record = AttitudeRecord(
        name=segment.word("OBJECT_NAME"),
        tai_ns=np.array([tai_ns]),
        q_frame_from_body_xyzw=(turn if onto_body else turn.inv()).as_quat()[None],
        frame=frame,
    )
    return attitude_in_icrf(record)


def _from_quaternion(holder: Segment) -> Rotation:
    values = [holder.number(key, "1") for key in _QUATERNION]
    check_norm(holder.meta["Q1"][1], values)
    return Rotation.from_quat(values)


def _from_angles(holder: Segment) -> Rotation:
    axes = rotation_axes(holder)
    # Version 1 names the angles by axis in key-value form.
    keys = _ANGLES if "ANGLE_1" in holder.meta else [f"{axis}_ANGLE" for axis in axes]
    return Rotation.from_euler(axes, [holder.number(key, "deg") for key in keys], degrees=True)
