"""One valid file of each further form of CCSDS messages, and of STK's, and how it is read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from simgl.motion.files.motion_reader import read_attitude, read_path
from simgl.physics.ephemeris import tai_ns_from_utc

_TAI_NS = tai_ns_from_utc("2026-03-20T12:00:00")

MOTION_FILES = {
    "orbit.xml": """\
<?xml version="1.0" encoding="UTF-8"?>
<oem id="CCSDS_OEM_VERS" version="2.0"><header><ORIGINATOR>TEST</ORIGINATOR></header><body>
<segment><metadata><OBJECT_NAME>TARGET</OBJECT_NAME><CENTER_NAME>EARTH</CENTER_NAME>
<REF_FRAME>EME2000</REF_FRAME><TIME_SYSTEM>UTC</TIME_SYSTEM></metadata><data>
<stateVector><EPOCH>2026-03-20T12:00:00</EPOCH><X units="km">7000.0</X><Y>0.0</Y><Z>0.0</Z>
<X_DOT units="km/s">0.0</X_DOT><Y_DOT>7.546</Y_DOT><Z_DOT>0.0</Z_DOT></stateVector>
<stateVector><EPOCH>2026-03-20T12:01:00</EPOCH><X units="km">6985.364</X><Y>452.454</Y><Z>0.0</Z>
<X_DOT units="km/s">-0.488</X_DOT><Y_DOT>7.53</Y_DOT><Z_DOT>0.0</Z_DOT></stateVector>
</data></segment></body></oem>
""",
    "state.opm": """\
CCSDS_OPM_VERS = 2.0
CREATION_DATE = 2026-01-01T00:00:00
OBJECT_NAME = TARGET
CENTER_NAME = EARTH
REF_FRAME = EME2000
TIME_SYSTEM = UTC
EPOCH = 2026-03-20T12:00:00
X = 7000.0 [km]
Y = 0.0 [km]
Z = 0.0 [km]
X_DOT = 0.0 [km/s]
Y_DOT = 7.546 [km/s]
Z_DOT = 0.0 [km/s]
""",
    "attitude.apm": """\
CCSDS_APM_VERS = 2.0
META_START
OBJECT_NAME = TARGET
TIME_SYSTEM = UTC
META_STOP
EPOCH = 2026-03-20T12:00:00
EULER_START
REF_FRAME_A = ICRF
REF_FRAME_B = SC_BODY_1
EULER_ROT_SEQ = 321
ANGLE_1 = 60 [deg]
ANGLE_2 = 0 [deg]
ANGLE_3 = 0 [deg]
EULER_STOP
""",
    "orbit.e": """\
stk.v.12.0
BEGIN Ephemeris
NumberOfEphemerisPoints 2
ScenarioEpoch 20 Mar 2026 12:00:00.000
CentralBody Earth
CoordinateSystem J2000
DistanceUnit Kilometers
BEGIN SegmentBoundaryTimes
60.0
END SegmentBoundaryTimes
EphemerisTimePosVel
0.0 7000.000 0.000 0.000 0.0 7.546 0.0
60.0 6985.364 452.454 0.000 -0.488 7.530 0.0
END Ephemeris
""",
    "attitude.a": """\
stk.v.12.0
BEGIN Attitude
ScenarioEpoch 20 Mar 2026 12:00:00.000
CoordinateAxes J2000
Sequence 313
AttitudeTimeEulerAngles
0.0 0.0 0.0 0.0
60.0 60.0 0.0 0.0
END Attitude
""",
}


def _path(name: str) -> Callable[[Path], object]:
    return lambda folder: read_path(folder / name, _TAI_NS)[0]


def _attitude(name: str) -> Callable[[Path], object]:
    return lambda folder: read_attitude(folder / name, _TAI_NS)


MOTION_READERS: dict[str, Callable[[Path], object]] = {
    **{name: _path(name) for name in ("orbit.xml", "state.opm", "orbit.e")},
    **{name: _attitude(name) for name in ("attitude.apm", "attitude.a")},
}
