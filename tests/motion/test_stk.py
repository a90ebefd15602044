"""STK's text files against the orbit and the turn that they were written from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.motion.files.motion_reader import read_path
from simgl.motion.samples import Path as SampledPath
from simgl.physics.ephemeris import itrf_from_icrf
from tests.motion.motion_files import (
    EPOCH,
    ORBIT,
    SECOND,
    STK_ATTITUDE,
    STK_HEAD,
    oem,
    sampled_attitude,
    stk_ephemeris,
    written,
)

HALF = EPOCH + 615 * SECOND


def test_an_orbit_comes_back(tmp_path: Path) -> None:
    """The file rounds to 1 um and 1 um/s; the curve adds nanometres at 60 s."""
    r, v = read_path(written(tmp_path, stk_ephemeris()), EPOCH)[0].state(HALF)
    np.testing.assert_allclose(r, ORBIT.state(HALF)[0], atol=5e-6)
    np.testing.assert_allclose(v, ORBIT.state(HALF)[1], atol=5e-6)


def test_distances_are_in_metres_unless_said(tmp_path: Path) -> None:
    rows = "".join(f"{60 * m} {7e6 + m} 0 0\n" for m in range(10))
    text = STK_HEAD.format(count=10).replace("DistanceUnit Kilometers\n", "")
    text = text.replace("PosVel", "Pos") + rows
    r, _ = read_path(written(tmp_path, text), EPOCH)[0].state(EPOCH + 90 * SECOND)
    np.testing.assert_allclose(r, [7e6 + 1.5, 0.0, 0.0], atol=1e-6)


@pytest.mark.parametrize(
    ("named", "ccsds"), [("J2000", "EME2000"), ("TEMEOfDate", "TEME"), ("Fixed", "ITRF")]
)
def test_frames_are_those_of_an_oem(tmp_path: Path, named: str, ccsds: str) -> None:
    stk = stk_ephemeris().replace("CoordinateSystem ICRF", f"CoordinateSystem {named}")
    message = oem().replace("= ICRF", f"= {ccsds}")
    # States of an inertial orbit in a turning frame make a rough curve; the samples are the same.
    r, v = read_path(written(tmp_path, stk, "a.e"), EPOCH, allowed_error=1e9)[0].state(EPOCH)
    expected = read_path(written(tmp_path, message, "a.oem"), EPOCH, allowed_error=1e9)[0]
    np.testing.assert_allclose(r, expected.state(EPOCH)[0], atol=1e-9)
    np.testing.assert_allclose(v, expected.state(EPOCH)[1], atol=1e-9)


def test_a_burn_between_segments_stays_sharp(tmp_path: Path) -> None:
    """A shared time belongs to the segment that begins; nothing is smoothed over it."""
    rows = [(60 * m, 7e6, 0.0) for m in range(6)] + [
        (300 + 60 * m, 7e6 + 600 * m, 10.0) for m in range(6)
    ]
    block = "BEGIN SegmentBoundaryTimes\n300\nEND SegmentBoundaryTimes\nEphemerisTimePosVel"
    text = STK_HEAD.format(count=12).replace("EphemerisTimePosVel", block)
    text = text.replace("Kilometers", "Meters")
    text += "".join(f"{t} {x} 0 0 {v} 0 0\n" for t, x, v in rows)
    path, _ = read_path(written(tmp_path, text), EPOCH)
    assert isinstance(path, SampledPath)
    assert len(path.segments) == 2
    np.testing.assert_allclose(path.state(EPOCH + 299 * SECOND)[0], [7e6, 0, 0], atol=1e-6)
    np.testing.assert_allclose(path.state(EPOCH + 300 * SECOND)[1], [10, 0, 0], atol=1e-9)
    np.testing.assert_allclose(path.state(EPOCH + 301 * SECOND)[0], [7e6 + 10, 0, 0], atol=1e-6)


def x_body(tmp_path: Path, text: str, seconds: int) -> np.ndarray:
    attitude = sampled_attitude(written(tmp_path, text))
    assert not attitude.in_lvlh
    return attitude.rotations.matrix(EPOCH + seconds * SECOND) @ [1.0, 0.0, 0.0]


FIRST = """\
AttitudeTimeQuatScalarFirst
0.0 1.0 0.0 0.0 0.0
60.0 0.8660254037844386 0.0 0.0 0.5
"""
RATES = """\
AttitudeTimeQuatAngVels
0.0 0.0 0.0 0.0 1.0 0 0 1
60.0 0.0 0.0 0.5 0.8660254037844386 0 0 1
"""
ANGLES = """\
Sequence 321
AttitudeTimeEulerAngles
0.0 0 0 0
60.0 60 0 0
"""
HEAD = STK_ATTITUDE[: STK_ATTITUDE.index("AttitudeTimeQ")]


@pytest.mark.parametrize("text", [STK_ATTITUDE, HEAD + FIRST, HEAD + RATES, HEAD + ANGLES])
def test_an_attitude_in_every_order(tmp_path: Path, text: str) -> None:
    """1 deg/s about z."""
    expected = [np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0]
    np.testing.assert_allclose(x_body(tmp_path, text, 30), expected, atol=1e-12)


def test_angles_turn_about_the_axes_as_they_move(tmp_path: Path) -> None:
    """313 without a sequence: x to y about z, then the pole about the new x, to ICRF's x."""
    text = HEAD + "AttitudeTimeEulerAngles\n0 90 90 0\n"
    R = sampled_attitude(written(tmp_path, text)).rotations.matrix(EPOCH)
    np.testing.assert_allclose(R @ [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], atol=1e-12)


def test_fixed_axes_turn_with_the_earth(tmp_path: Path) -> None:
    text = STK_ATTITUDE.replace("CoordinateAxes ICRF", "CoordinateAxes Fixed")
    expected = itrf_from_icrf(EPOCH).T @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(x_body(tmp_path, text, 0), expected, atol=1e-12)


def test_one_kind_for_the_other_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="holds attitudes; give it as attitude_file"):
        read_path(written(tmp_path, STK_ATTITUDE), EPOCH)
    with pytest.raises(ConfigError, match="holds an orbit; give it as trajectory"):
        sampled_attitude(written(tmp_path, stk_ephemeris()))
    with pytest.raises(ConfigError, match='is an STK file of one object; object = "a" requires'):
        read_path(written(tmp_path, stk_ephemeris()), EPOCH, name="a")
