"""Contents of a motion file, independent of its format, and their conversion to ICRF."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
    """States of one object.

    name : of the object, "" if the file gives none
    tai_ns : (n,) increasing
    positions : (n, 3) [m]
    velocities : (n, 3) [m s-1], or None
    frame : of both; "lvlh" is that of a spacecraft which the file does not name
    span_ns : first and last instant for which the file is valid
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

    q_frame_from_body_xyzw : (n, 4) unit quaternions
    """

    name: str
    tai_ns: IndexArray
    q_frame_from_body_xyzw: Array
    frame: Frame


def R_icrf_from_eme2000() -> Array:
    """The frame bias between the mean equator and equinox of J2000 and ICRF, 23 milliarcseconds."""
    bias, _, _ = erfa.bp00(2451545.0, 0.0)
    return bias.T


def in_icrf(record: StateRecord) -> StateRecord:
    """The record in ICRF axes; a record in LVLH stays as it is."""
    if record.frame in ("icrf", "lvlh"):
        return record
    positions, velocities = record.positions, record.velocities
    if record.frame == "eme2000":
        R = R_icrf_from_eme2000()
        positions = positions @ R.T
        velocities = None if velocities is None else velocities @ R.T
    else:
        rotations = np.stack([itrf_from_icrf(int(t)).T for t in record.tai_ns])
        if velocities is not None:
            spin = np.array([0.0, 0.0, EARTH_ROTATION_RATE])
            velocities = np.einsum("nij,nj->ni", rotations, velocities + np.cross(spin, positions))
        positions = np.einsum("nij,nj->ni", rotations, positions)
    return replace(record, positions=positions, velocities=velocities, frame="icrf")


def attitude_in_icrf(record: AttitudeRecord) -> AttitudeRecord:
    """The record relative to ICRF; a record relative to LVLH stays as it is."""
    if record.frame in ("icrf", "lvlh"):
        return record
    matrices = (
        R_icrf_from_eme2000()
        if record.frame == "eme2000"
        else np.stack([itrf_from_icrf(int(t)).T for t in record.tai_ns])
    )
    rotation = Rotation.from_matrix(matrices) * Rotation.from_quat(record.q_frame_from_body_xyzw)
    return replace(record, q_frame_from_body_xyzw=rotation.as_quat(), frame="icrf")
