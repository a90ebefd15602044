"""Damaged files of motion: one clear line each, naming file and place, whatever the damage."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from simgl.errors import AssetError, ConfigError, SimglError
from simgl.motion.files.motion_reader import read_attitude, read_path
from tests.motion.motion_files import (
    AEM,
    APM,
    EPOCH,
    STK_ATTITUDE,
    TABLE,
    TLE,
    in_xml,
    oem,
    opm,
    stk_ephemeris,
    written,
)

Reader = Callable[[Path], object]


def path_of(file: Path) -> object:
    return read_path(file, EPOCH, allowed_error=1e9)


def attitude_of(file: Path) -> object:
    return read_attitude(file, EPOCH)


OEM = oem(60.0, 4)
GOOD: dict[str, tuple[str, Reader]] = {
    "oem": (OEM, path_of),
    "aem": (AEM, attitude_of),
    "tle": (TLE, path_of),
    "table": (TABLE, path_of),
    "oem in XML": (in_xml("oem", OEM), path_of),
    "aem in XML": (in_xml("aem", AEM), attitude_of),
    "opm": (opm(), path_of),
    "apm": (APM, attitude_of),
    "stk ephemeris": (stk_ephemeris(60.0, 4), path_of),
    "stk attitude": (STK_ATTITUDE, attitude_of),
}

# File, passage, what stands there instead, and the complaint after the file's name.
BY_HAND = [
    ("oem", "= EARTH", "= MARS", ' line 8: CENTER_NAME must be EARTH, got "MARS"'),
    ("oem", "= ICRF", "= TOD", ' line 9: REF_FRAME is "TOD"; allowed: EME2000, GCRF, ICRF, '),
    ("oem", "= UTC", "= UT1", ' line 10: TIME_SYSTEM is "UT1"; did you mean "UTC"?'),
    ("oem", "CENTER_NAME = EARTH\n", "", " line 5: CENTER_NAME is missing in this segment"),
    ("oem", "TIME_SYSTEM = UTC\n", "", " line 5: TIME_SYSTEM is missing in this segment"),
    ("oem", "META_STOP\n", "", " line 13: must be KEY = value, got "),
    ("oem", "META_START\n", "", " line 12: closes metadata that was not opened"),
    ("oem", "OBJECT_ID", "META_START\nOBJECT_ID", " line 7: opens metadata inside metadata"),
    ("oem", "= EARTH", "=", " line 8: CENTER_NAME has no value"),
    ("oem", "OBJECT_ID", "OBJECT_NAME", " line 7: OBJECT_NAME is given twice in this segment"),
    ("oem", "12:01:00", "11:01:00", " line 15: epoch must be later than the one before, got "),
    ("oem", "12:01:00", "12:61:00", " line 15: epoch must be a real date and time, got "),
    ("oem", "2026-03-20T12:01:00", "soon", " line 15: epoch must be a time such as "),
    ("aem", "= A2B", "= C2D", ' line 9: ATTITUDE_DIR must be A2B or B2A, got "C2D"'),
    ("aem", "= LAST", "= MIDDLE", ' line 14: QUATERNION_TYPE must be FIRST or LAST, got "MIDDLE"'),
    (
        "aem",
        "= QUATERNION\n",
        "= SPIN\n",
        ' line 13: ATTITUDE_TYPE is "SPIN"; allowed: EULER',
    ),
    ("aem", "B = SC_BODY_1", "B = EME2000", " line 7: REF_FRAME_A and REF_FRAME_B must be one ref"),
    (
        "aem",
        "0.0 0.0 0.0 1.0",
        "0.0 0.0 0.0 2.0",
        " line 17: must be a unit quaternion, got ",
    ),
    ("aem", "0.0 0.0 0.0 1.0", "0.0 0.0 1.0", " line 17: must hold Q1 Q2 Q3 QC, got 3 values"),
    ("tle", "0  2927", "0  2928", ' line 2: has the checksum "8"; its digits give 7'),
    ("tle", "2 25544  51", "2 25545  51", ' line 3: has the checksum "7"; its digits give 8'),
    ("tle", "15.72125391563537", "15.7212539156353", " line 3: must have 69 characters, got 68"),
    ("table", "x_m", "x_ft", " line 1: names no place x, y, z with its unit (columns: "),
    ("table", "vx_m_s", "speed", " line 1: names only a part of a velocity (columns: "),
    ("table", "utc", "when", " line 1: names no time; exactly one of "),
    ("table", "y_m", "x_m", ' line 1: names "x_m" twice'),
    ("table", "y_m", "x_km", " line 1: names both x_m and x_km (columns: "),
    ("table", "z_m", "z_itrf_m", " line 1: mixes the frames icrf and itrf (columns: "),
    ("table", "75458", "fast", ' line 3: y_m must be a number, got "fast"'),
    ("table", "75458", "nan", ' line 3: y_m must be finite, got "nan"'),
    ("table", "75458", "1,2", " line 3: must hold 7 values, got 8"),
    ("table", "12:00:10", "12:00:00", " line 3: utc must be later than in the row before, got "),
    ("table", "2026-03-20T12:00:20", "", " line 4: utc must be a time such as "),
    ("oem in XML", "EARTH", "MARS", ' line 9: CENTER_NAME must be EARTH, got "MARS"'),
    ("oem in XML", ">ICRF", ">TOD", ' line 10: REF_FRAME is "TOD"; allowed: EME2000, GCRF, '),
    ("oem in XML", 'units="km"', 'units="m"', ' line 16: X must be in km, got units "m"'),
    ("oem in XML", "<Y ", "<W ", " line 16: is not well-formed XML: mismatched tag"),
    ("oem in XML", "EPOCH>", "TIME>", " line 16: is not well-formed XML: mismatched tag"),
    ("oem in XML", "12:01:00<", "12:00:00<", " line 17: epoch must be later than the one before"),
    ("oem in XML", "<oem ", "<!DOCTYPE x><oem ", " line 2: <!DOCTYPE> is not allowed in a CCSDS"),
    ("oem in XML", "<body>", "<body/><body>", " line 2: <oem> must hold one <body>, got 2"),
    ("aem in XML", "<QC>1.0</QC>", "", " line 19: QC is missing in this <attitudeState>"),
    ("aem in XML", "<QC>1.0</QC>", "<QC>2.0</QC>", " line 19: must be a unit quaternion, got "),
    ("aem in XML", "<QC>1.0</QC>", "<QC/>", " line 19: QC has no value"),
    ("opm", "= EARTH", "= MOON", ' line 7: CENTER_NAME must be EARTH, got "MOON"'),
    ("opm", "[km]", "[m]", ' line 11: X must be in km, got units "m"'),
    ("opm", "X_DOT =", "X_DOTS =", " line 1: X_DOT is missing in this segment"),
    ("opm", "MASS", "MAN_DURATION", " line 17: plans a manoeuvre; a trajectory with manoeuvres "),
    ("opm", "= UTC", "= UT1", ' line 9: TIME_SYSTEM is "UT1"; did you mean "UTC"?'),
    ("apm", "A = ICRF", "A = SC_BODY", " line 11: REF_FRAME_A and REF_FRAME_B must be one ref"),
    ("apm", "A = ICRF", "A = ITRF", ' line 11: REF_FRAME_A turns with the Earth ("ITRF"); that '),
    ("apm", "Q3 = 0.5", "Q3 = 0.9", " line 13: must be a unit quaternion, got norm "),
    ("apm", "QUAT_STOP", "QUAT_STOP\nANGVEL_START", " line 18: ANGVEL describes a rotation; "),
    ("stk ephemeris", "ICRF", "B1950", ' line 8: CoordinateSystem is "B1950"; allowed: FIXED, '),
    ("stk ephemeris", "CoordinateSystem ICRF\n", "", " line 3: CoordinateSystem is missing in "),
    ("stk ephemeris", "Kilometers", "Feet", " line 9: DistanceUnit must be Meters or Kilometers"),
    ("stk ephemeris", "Earth", "Moon", ' line 7: CentralBody must be Earth, got "Moon"'),
    ("stk ephemeris", "TimePosVel", "TimePosFoo", " line 10: holds EphemerisTimePosFoo, which is "),
    (
        "stk ephemeris",
        "Interpolation",
        "Extrapolation",
        " line 6: ExtrapolationMethod is not a key",
    ),
    ("stk ephemeris", "\n1.200000e+02", "\n2.000000e+01", " line 13: time must be later than the"),
    ("stk ephemeris", "\n1.200000e+02", "\n", " line 13: must hold time x y z vx vy vz, got 6"),
    ("stk ephemeris", "BEGIN Ephemeris", "BEGIN Sensor", " line 3: must be BEGIN Ephemeris or BEG"),
    (
        "stk attitude",
        "TimeQuaternions",
        "TimeYPRAngles",
        " line 8: holds AttitudeTimeYPRAngles, w",
    ),
    ("stk attitude", "0.0 1.0", "0.0 2.0", " line 9: must be a unit quaternion, got norm 2"),
    ("stk attitude", "\n60.0", "\n6e30", " line 10: time must lie within +-4.1e+09 s, got 6e+30"),
    ("stk attitude", "\n60.0", "\n0.0", " line 10: time must be later than the one before, got 0"),
    ("stk attitude", "Earth", "Earth\nTimeFormat UTCG", " line 6: TimeFormat must be EpSec, got "),
]


@pytest.mark.parametrize(("kind", "old", "new", "complaint"), BY_HAND)
def test_the_line_says_what_is_wrong(
    tmp_path: Path, kind: str, old: str, new: str, complaint: str
) -> None:
    text, read = GOOD[kind]
    assert old in text
    file = written(tmp_path, text.replace(old, new, 1))
    with pytest.raises(ConfigError, match=re.escape(f"{file}{complaint}")) as caught:
        read(file)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", ": is empty; it must be a CCSDS OEM"),
        (b"\n\n", ": is empty; it must be"),
        (b"\xff\xfe\x00", ": is not UTF-8 text (byte 0)"),
        (b"a\x00b", ": is not text (byte 1 is zero)"),
        (b"<oem></oem>", " line 1: <oem> must hold one <body>, got 0"),
        (b"hello world", " line 1: is not the start of a CCSDS OEM"),
        (b"utc,x_m,y_m,z_m\n", " line 1: is followed by no row"),
        (b"utc;x_m;y_m;z_m\n", " line 1: has semicolons between its columns; a table needs commas"),
        (b"utc\tx_m\ty_m\tz_m\n", " line 1: has tabs between its columns; a table needs commas"),
        (b"0,1.5,-2e3,0\n", ' line 1: must name the columns, got "0,1.5,-2e3,0"'),
        (b"CCSDS_OEM_VERS = 2.0\n", ": holds no segment (META_START) after CCSDS_OEM_VERS"),
        (b"# only a remark\n", " line 1: is not the start of"),
    ],
)
def test_what_is_no_file_of_motion(tmp_path: Path, content: bytes, complaint: str) -> None:
    file = tmp_path / "motion.txt"
    file.write_bytes(content)
    with pytest.raises(ConfigError, match=re.escape(f"{file}{complaint}")):
        path_of(file)


def test_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    for file in (tmp_path / "none.oem", tmp_path):
        with pytest.raises(AssetError, match=re.escape(f"{file}: cannot be read")):
            path_of(file)


def test_one_kind_for_the_other_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="give it as attitude_file"):
        path_of(written(tmp_path, AEM))
    with pytest.raises(ConfigError, match="give it as trajectory"):
        attitude_of(written(tmp_path, TLE))


def damaged(text: str, rng: np.random.Generator) -> str:
    """A line lost, doubled, cut or exchanged, or some characters of the file."""
    lines = text.splitlines()
    kind, index = rng.integers(6), int(rng.integers(len(lines)))
    if kind == 0:
        del lines[index]
    elif kind == 1:
        lines.insert(index, lines[index])
    elif kind == 2:
        lines[index] = lines[index][: int(rng.integers(len(lines[index]) + 1))]
    elif kind == 3:
        other = int(rng.integers(len(lines)))
        lines[index], lines[other] = lines[other], lines[index]
    else:
        characters = list("\n".join(lines))
        for _ in range(int(rng.integers(1, 4))):
            characters[int(rng.integers(len(characters)))] = chr(int(rng.integers(32, 127)))
        return "".join(characters)
    return "\n".join(lines)


def complaint_of(read: Reader, file: Path) -> str | None:
    try:
        read(file)
    except SimglError as error:
        return str(error)
    return None


@pytest.mark.parametrize("kind", GOOD)
def test_two_hundred_chance_damages_are_read_or_refused_in_one_line(
    tmp_path: Path, kind: str
) -> None:
    """Some do no harm (a comment, a digit); none may escape as another exception."""
    text, read = GOOD[kind]
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(200):
        file = written(tmp_path, damaged(text, rng))
        complaint = complaint_of(read, file)
        if complaint is not None:
            refused += 1
            assert complaint.startswith(str(file))
            assert "\n" not in complaint
    # Of a table with 7 columns and 4 lines hardly any damage passes; of a message's header many do.
    assert refused > 50
