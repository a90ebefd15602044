"""Files of motion written by hand or from a known orbit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simgl.motion.files.motion_reader import read_attitude
from simgl.motion.orbits import KeplerianOrbit
from simgl.motion.trajectory import SampledAttitude
from simgl.physics.ephemeris import tai_ns_from_utc, utc_from_tai_ns

EPOCH_UTC = "2026-03-20T12:00:00"
EPOCH = tai_ns_from_utc(EPOCH_UTC)
SECOND = 1_000_000_000

ORBIT = KeplerianOrbit(
    semi_major_axis=6.78e6,
    eccentricity=0.001,
    inclination=0.9,
    raan=0.5,
    argument_of_perigee=0.3,
    true_anomaly=0.2,
    epoch_tai_ns=EPOCH,
)

_STATE_KEYS = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")

OEM_HEAD = """\
CCSDS_OEM_VERS = 2.0
COMMENT made by hand
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = TEST
"""
OEM_META = """\
META_START
OBJECT_NAME = TARGET
OBJECT_ID = 2026-001A
CENTER_NAME = EARTH
REF_FRAME = ICRF
TIME_SYSTEM = UTC
START_TIME = 2026-03-20T12:00:00
STOP_TIME = 2026-03-20T15:00:00
META_STOP
"""

AEM = """\
CCSDS_AEM_VERS = 1.0
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = TEST
META_START
OBJECT_NAME = TARGET
OBJECT_ID = 2026-001A
REF_FRAME_A = ICRF
REF_FRAME_B = SC_BODY_1
ATTITUDE_DIR = A2B
TIME_SYSTEM = UTC
START_TIME = 2026-03-20T12:00:00
STOP_TIME = 2026-03-20T12:02:00
ATTITUDE_TYPE = QUATERNION
QUATERNION_TYPE = LAST
META_STOP
DATA_START
2026-03-20T12:00:00 0.0 0.0 0.0 1.0
2026-03-20T12:01:00 0.0 0.0 0.5 0.8660254037844386
2026-03-20T12:02:00 0.0 0.0 0.8660254037844386 0.5
DATA_STOP
"""

OPM = """\
CCSDS_OPM_VERS = 3.0
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = TEST
COMMENT made by hand
OBJECT_NAME = TARGET
OBJECT_ID = 2026-001A
CENTER_NAME = EARTH
REF_FRAME = ICRF
TIME_SYSTEM = UTC
EPOCH = 2026-03-20T12:00:00
{state}MASS = 500.0 [kg]
"""

APM = """\
CCSDS_APM_VERS = 2.0
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = TEST
META_START
OBJECT_NAME = TARGET
OBJECT_ID = 2026-001A
TIME_SYSTEM = UTC
META_STOP
EPOCH = 2026-03-20T12:00:00
QUAT_START
REF_FRAME_A = ICRF
REF_FRAME_B = SC_BODY_1
Q1 = 0.0
Q2 = 0.0
Q3 = 0.5
QC = 0.8660254037844386
QUAT_STOP
"""

STK_ATTITUDE = """\
stk.v.12.0
BEGIN Attitude
NumberOfAttitudePoints 3
ScenarioEpoch 20 Mar 2026 12:00:00.000
CentralBody Earth
CoordinateAxes ICRF
InterpolationOrder 1
AttitudeTimeQuaternions
0.0 0.0 0.0 0.0 1.0
60.0 0.0 0.0 0.5 0.8660254037844386
120.0 0.0 0.0 0.8660254037844386 0.5
END Attitude
"""

STK_HEAD = """\
stk.v.12.0
# made by hand
BEGIN Ephemeris
NumberOfEphemerisPoints {count}
ScenarioEpoch 20 Mar 2026 12:00:00.000
InterpolationMethod Lagrange
CentralBody Earth
CoordinateSystem ICRF
DistanceUnit Kilometers
EphemerisTimePosVel
"""

# The International Space Station, from the description of the format in public use since 2008.
TLE = """\
ISS (ZARYA)
1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927
2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537
"""

TABLE = """\
utc,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s
2026-03-20T12:00:00,7000000,0,0,0,7546,0
2026-03-20T12:00:10,6999594,75458,0,-81,7545.6,0
2026-03-20T12:00:20,6998376,150908,0,-163,7544.2,0
"""


def oem_rows(step_s: float, count: int, start_s: float = 0.0) -> str:
    """States of ``ORBIT`` as data lines, to a micrometre."""
    rows = []
    for index in range(count):
        tai_ns = EPOCH + round((start_s + index * step_s) * SECOND)
        values = np.concatenate(ORBIT.state(tai_ns)) / 1e3
        rows.append(f"{utc_from_tai_ns(tai_ns)} " + " ".join(f"{v:.9f}" for v in values))
    return "\n".join(rows) + "\n"


def oem(step_s: float = 60.0, count: int = 30) -> str:
    """A message of one segment."""
    return OEM_HEAD + OEM_META + oem_rows(step_s, count)


def opm() -> str:
    """The state of ``ORBIT`` at its epoch, to a micrometre."""
    values = np.concatenate(ORBIT.state(EPOCH)) / 1e3
    units = ["[km]"] * 3 + ["[km/s]"] * 3
    rows = zip(_STATE_KEYS, values, units, strict=True)
    return OPM.format(state="".join(f"{key} = {value:.9f} {unit}\n" for key, value, unit in rows))


def stk_ephemeris(step_s: float = 60.0, count: int = 30) -> str:
    """States of ``ORBIT`` in STK's text form."""
    rows = []
    for index in range(count):
        values = np.concatenate(ORBIT.state(EPOCH + round(index * step_s * SECOND))) / 1e3
        rows.append(" ".join([f"{index * step_s:.6e}", *(f"{v:.9f}" for v in values)]))
    return STK_HEAD.format(count=count) + "\n".join(rows) + "\nEND Ephemeris\n"


def in_xml(kind: str, text: str) -> str:
    """An OEM or AEM (quaternions, scalar last) of key-value form as XML."""
    root = f'<{kind} id="CCSDS_{kind.upper()}_VERS" version="2.0">'
    parts = ['<?xml version="1.0" encoding="UTF-8"?>', root, "<header></header>", "<body>"]
    in_meta = False
    for line in text.splitlines():
        if line == "META_START":
            parts += ["<segment>", "<metadata>"]
            in_meta = True
        elif line == "META_STOP":
            parts += ["</metadata>", "<data>"]
            in_meta = False
        elif in_meta:
            key, _, value = line.partition(" = ")
            parts.append(f"<{key}>{value}</{key}>")
        elif line.startswith("2026"):
            parts.append(_record(kind, line.split()))
    return "\n".join([*parts, "</data>", "</segment>", "</body>", f"</{kind}>", ""])


def _record(kind: str, words: list[str]) -> str:
    time = f"<EPOCH>{words[0]}</EPOCH>"
    if kind == "aem":
        keys = ("Q1", "Q2", "Q3", "QC")
        values = "".join(f"<{k}>{v}</{k}>" for k, v in zip(keys, words[1:], strict=True))
        inner = f"<quaternionEphemeris>{time}<quaternion>{values}</quaternion>"
        return f"<attitudeState>{inner}</quaternionEphemeris></attitudeState>"
    units = ["km"] * 3 + ["km/s"] * 3
    rows = zip(_STATE_KEYS, units, words[1:], strict=True)
    values = "".join(f'<{k} units="{u}">{v}</{k}>' for k, u, v in rows)
    return f"<stateVector>{time}{values}</stateVector>"


def written(folder: Path, text: str, name: str = "motion.txt") -> Path:
    """A file of this text."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def sampled_attitude(file: Path) -> SampledAttitude:
    """The samples of an attitude file."""
    attitude = read_attitude(file, EPOCH)
    assert isinstance(attitude, SampledAttitude)
    return attitude
