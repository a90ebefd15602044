"""Contents of a motion file, independent of its format, and their conversion to ICRF."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import erfa
import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array, IndexArray
from simgl.motion.orbits import icrf_from_teme
from simgl.physics.constants import EARTH_ROTATION_RATE
from simgl.physics.ephemeris import itrf_from_icrf

Frame = Literal["icrf", "eme2000", "teme", "itrf", "lvlh"]
FRAMES: tuple[Frame, ...] = ("icrf", "eme2000", "teme", "itrf", "lvlh")


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
    rotations = _rotations(record.frame, record.tai_ns)
    if velocities is not None:
        if record.frame == "itrf":
            velocities = velocities + np.cross([0.0, 0.0, EARTH_ROTATION_RATE], positions)
        # TEME turns by 1e-11 rad/s, which adds 0.1 mm/s in a low orbit and is neglected.
        velocities = np.einsum("nij,nj->ni", rotations, velocities)
    positions = np.einsum("nij,nj->ni", rotations, positions)
    return replace(record, positions=positions, velocities=velocities, frame="icrf")


def attitude_in_icrf(record: AttitudeRecord) -> AttitudeRecord:
    """The record relative to ICRF; a record relative to LVLH stays as it is."""
    if record.frame in ("icrf", "lvlh"):
        return record
    turns = Rotation.from_matrix(_rotations(record.frame, record.tai_ns))
    rotation = turns * Rotation.from_quat(record.q_frame_from_body_xyzw)
    return replace(record, q_frame_from_body_xyzw=rotation.as_quat(), frame="icrf")


def _rotations(frame: Frame, tai_ns: IndexArray) -> Array:
    """(n, 3, 3) R_icrf_from_frame of EME2000, TEME or ITRF at each time."""
    if frame == "eme2000":
        return np.broadcast_to(R_icrf_from_eme2000(), (len(tai_ns), 3, 3))
    if frame == "teme":
        return np.stack([icrf_from_teme(int(t)) for t in tai_ns])
    return np.stack([itrf_from_icrf(int(t)).T for t in tai_ns])
