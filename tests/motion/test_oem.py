"""Orbit ephemeris messages against the orbit that they were written from."""

from __future__ import annotations

import re
from pathlib import Path

import erfa
import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.motion.files.motion_reader import read_path
from simgl.physics.ephemeris import itrf_from_icrf
from tests.motion.motion_files import (
    EPOCH,
    OEM_HEAD,
    OEM_META,
    ORBIT,
    SECOND,
    oem,
    oem_rows,
    written,
)

HALF = EPOCH + 615 * SECOND


def test_an_orbit_comes_back(tmp_path: Path) -> None:
    """The file rounds to 1 um and 1 um/s; the curve adds nanometres at 60 s."""
    path, in_lvlh = read_path(written(tmp_path, oem()), EPOCH)
    assert not in_lvlh
    r, v = path.state(HALF)
    np.testing.assert_allclose(r, ORBIT.state(HALF)[0], atol=5e-6)
    np.testing.assert_allclose(v, ORBIT.state(HALF)[1], atol=5e-6)


def test_eme2000_is_turned_by_the_frame_bias(tmp_path: Path) -> None:
    """IERS Conventions 2003, ch. 5: -16.6 and -6.8 mas of the pole, -14.6 of the node."""
    text = oem().replace("REF_FRAME = ICRF", "REF_FRAME = EME2000")
    r, _ = read_path(written(tmp_path, text), EPOCH)[0].state(HALF)
    offset = r - ORBIT.state(HALF)[0]
    xi, eta, node = (erfa.DMAS2R * mas for mas in (-16.6170, -6.8192, -14.6))
    # ICRF axes to mean equator: small turns; the way back has the other sign.
    x, y, z = ORBIT.state(HALF)[0]
    expected = np.array([-node * y + xi * z, node * x + eta * z, -xi * x - eta * y])
    np.testing.assert_allclose(offset, expected, atol=1e-3)
    assert np.linalg.norm(offset) > 0.2


def test_itrf_is_turned_with_the_earth(tmp_path: Path) -> None:
    """A place at rest on the Earth moves with it: w x r, 465 m/s at the equator."""
    rows = "".join(f"2026-03-20T12:{m:02d}:00 6378.137 0 0 0 0 0\n" for m in range(10))
    text = OEM_HEAD + OEM_META.replace("= ICRF", "= ITRF2014") + rows
    path, _ = read_path(written(tmp_path, text), EPOCH)
    r, v = path.state(EPOCH + 270 * SECOND)
    turn = itrf_from_icrf(EPOCH + 270 * SECOND)
    np.testing.assert_allclose(turn @ r, [6378137.0, 0.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(turn @ v, [0.0, 465.1011, 0.0], atol=2e-3)


@pytest.mark.parametrize(("scale", "later_s"), [("TAI", -37.0), ("TT", -69.184), ("GPS", -18.0)])
def test_the_time_system_counts(tmp_path: Path, scale: str, later_s: float) -> None:
    text = oem().replace("TIME_SYSTEM = UTC", f"TIME_SYSTEM = {scale}")
    path, _ = read_path(written(tmp_path, text), EPOCH)
    r, _ = path.state(HALF)
    expected = ORBIT.state(HALF - round(later_s * SECOND))[0]
    np.testing.assert_allclose(r, expected, atol=5e-6)


def test_segments_accelerations_and_covariances_are_read_past(tmp_path: Path) -> None:
    rows = "".join(f"{line} 0 0 0\n" for line in oem_rows(60.0, 11).splitlines())
    covariance = "COVARIANCE_START\nEPOCH = 2026-03-20T12:00:00\n1.0\n0 1\nCOVARIANCE_STOP\n"
    second = OEM_META.replace("12:00:00", "12:10:00") + oem_rows(60.0, 11, start_s=600.0)
    text = OEM_HEAD + OEM_META + rows + covariance + "\n" + second
    path, _ = read_path(written(tmp_path, text), EPOCH)
    for when in (30.0, 600.0, 900.0, 1200.0):
        tai_ns = EPOCH + round(when * SECOND)
        np.testing.assert_allclose(path.state(tai_ns)[0], ORBIT.state(tai_ns)[0], atol=1e-5)


def test_the_useable_span_bounds_the_answer_not_the_curve(tmp_path: Path) -> None:
    span = "USEABLE_START_TIME = 2026-03-20T12:05:30\nUSEABLE_STOP_TIME = 2026-03-20T12:20:30\n"
    text = oem().replace("STOP_TIME = 2026-03-20T15", span + "STOP_TIME = 2026-03-20T15")
    path, _ = read_path(written(tmp_path, text), EPOCH)
    tai_ns = EPOCH + 330 * SECOND
    np.testing.assert_allclose(path.state(tai_ns)[0], ORBIT.state(tai_ns)[0], atol=5e-6)
    expected = "covers 2026-03-20T12:05:30 to 2026-03-20T12:20:30, not 2026-03-20T12:05:29"
    with pytest.raises(ConfigError, match=expected):
        path.state(EPOCH + 329 * SECOND)


def test_one_of_several_objects_is_named(tmp_path: Path) -> None:
    other = OEM_META.replace("= TARGET", "= CHASER") + oem_rows(60.0, 11, start_s=5.0)
    file = written(tmp_path, oem() + other)
    with pytest.raises(ConfigError, match=re.escape("name one by object (TARGET, CHASER)")):
        read_path(file, EPOCH)
    tai_ns = EPOCH + 100 * SECOND
    chaser, _ = read_path(file, EPOCH, name="CHASER")
    np.testing.assert_allclose(chaser.state(tai_ns)[0], ORBIT.state(tai_ns)[0], atol=5e-6)
    with pytest.raises(ConfigError, match='did you mean "CHASER"'):
        read_path(file, EPOCH, name="CHASE")


def test_samples_too_far_apart_are_refused_with_the_error(tmp_path: Path) -> None:
    file = written(tmp_path, oem(step_s=600.0, count=10))
    with pytest.raises(
        ConfigError, match=r"may be off by [0-9.e+]+ m \(interpolation_error_m allows"
    ):
        read_path(file, EPOCH)
    path, _ = read_path(file, EPOCH, allowed_error=1e4)
    miss = np.linalg.norm(path.state(HALF)[0] - ORBIT.state(HALF)[0])
    assert miss < 1e4
