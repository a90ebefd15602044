"""What a file of motion holds, whatever its format, and the turn of its frame to ICRF."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import erfa
import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, IndexArray
from simgl.physics.constants import EARTH_ROTATION_RATE
from simgl.physics.ephemeris import itrf_from_icrf

Frame = Literal["icrf", "eme2000", "itrf", "lvlh"]
FRAMES: tuple[Frame, ...] = ("icrf", "eme2000", "itrf", "lvlh")


@dataclass(frozen=True, kw_only=True, eq=False)
class StateRecord:
    """Places of one object.

    name : of the object, "" where the file gives none
    tai_ns : (n,) increasing
    positions : (n, 3) [m]
    velocities : (n, 3) [m s-1], or None
    frame : of both; "lvlh" is about a spacecraft that the file does not know
    span_ns : first and last instant that the file answers for [TAI ns]
    """

    name: str
    tai_ns: IndexArray
    positions: Array
    velocities: Array | None
    frame: Frame
    span_ns: tuple[int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class AttitudeRecord:
    """Attitudes of one object.

    q_frame_from_body_xyzw : (n, 4) of length one
    """

    name: str
    tai_ns: IndexArray
    q_frame_from_body_xyzw: Array
    frame: Frame


def R_icrf_from_eme2000() -> Array:
    """The frame bias between the mean equator and equinox of J2000 and ICRF, 23 milliarcseconds."""
    bias, _, _ = erfa.bp00(2451545.0, 0.0)
    return np.asarray(bias.T)


def in_icrf(record: StateRecord) -> StateRecord:
    """The same places in ICRF axes; LVLH stays."""
    if record.frame in ("icrf", "lvlh"):
        return record
    velocities = record.velocities
    if record.frame == "eme2000":
        R = R_icrf_from_eme2000()
        positions = record.positions @ R.T
        velocities = None if velocities is None else velocities @ R.T
    else:
        turns = np.stack([itrf_from_icrf(int(t)).T for t in record.tai_ns])
        if velocities is not None:
            spin = np.array([0.0, 0.0, EARTH_ROTATION_RATE])
            moved = velocities + np.cross(spin, record.positions)
            velocities = np.einsum("nij,nj->ni", turns, moved)
        positions = np.einsum("nij,nj->ni", turns, record.positions)
    return StateRecord(
        name=record.name,
        tai_ns=record.tai_ns,
        positions=positions,
        velocities=velocities,
        frame="icrf",
        span_ns=record.span_ns,
    )


def attitude_in_icrf(record: AttitudeRecord) -> AttitudeRecord:
    """The same attitudes against ICRF; against LVLH they stay."""
    if record.frame in ("icrf", "lvlh"):
        return record
    if record.frame == "eme2000":
        turn = Rotation.from_matrix(R_icrf_from_eme2000())
    else:
        turn = Rotation.from_matrix(np.stack([itrf_from_icrf(int(t)).T for t in record.tai_ns]))
    turned = turn * Rotation.from_quat(record.q_frame_from_body_xyzw)
    return AttitudeRecord(
        name=record.name,
        tai_ns=record.tai_ns,
        q_frame_from_body_xyzw=turned.as_quat(),
        frame="icrf",
    )
