"""Attitude ephemeris messages: which way they turn, told by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.arrays import Array
from tests.motion.motion_files import AEM, EPOCH, SECOND, sampled_attitude, written


def about_z(angle_deg: float) -> Array:
    """R_icrf_from_body of a body turned by an angle about z: its x axis lies at that angle."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def matrix(folder: Path, text: str, when_s: float = 60.0) -> Array:
    rotations = sampled_attitude(written(folder, text)).rotations
    return rotations.matrix(EPOCH + round(when_s * SECOND))


def test_a_to_b_carries_the_axes_of_a_onto_b(tmp_path: Path) -> None:
    """60 deg about z after a minute: the body's x axis stands at +60 deg in ICRF."""
    np.testing.assert_allclose(matrix(tmp_path, AEM), about_z(60.0), atol=1e-12)
    np.testing.assert_allclose(matrix(tmp_path, AEM, 90.0), about_z(90.0), atol=1e-12)


def test_b_to_a_is_the_other_way(tmp_path: Path) -> None:
    text = AEM.replace("= A2B", "= B2A")
    np.testing.assert_allclose(matrix(tmp_path, text), about_z(-60.0), atol=1e-12)


def test_exchanged_frames_are_the_other_way(tmp_path: Path) -> None:
    text = AEM.replace("A = ICRF", "A = SC_BODY_1").replace("B = SC_BODY_1", "B = ICRF")
    np.testing.assert_allclose(matrix(tmp_path, text), about_z(-60.0), atol=1e-12)


def test_the_scalar_may_come_first(tmp_path: Path) -> None:
    text = AEM.replace("= LAST", "= FIRST")
    for line in [line for line in AEM.splitlines() if line.startswith("2026")]:
        time, x, y, z, w = line.split()
        text = text.replace(line, f"{time} {w} {x} {y} {z}")
    np.testing.assert_allclose(matrix(tmp_path, text), about_z(60.0), atol=1e-12)


def test_version_2_needs_neither_direction_nor_order(tmp_path: Path) -> None:
    text = AEM.replace("VERS = 1.0", "VERS = 2.0")
    for line in ("ATTITUDE_DIR = A2B\n", "QUATERNION_TYPE = LAST\n"):
        text = text.replace(line, "")
    np.testing.assert_allclose(matrix(tmp_path, text), about_z(60.0), atol=1e-12)


def test_angles_turn_about_the_axes_as_they_move(tmp_path: Path) -> None:
    """321 by 90, 90, 0: yaw takes x to y, then pitch about the new y takes x down to -z."""
    head = AEM[: AEM.index("2026-03-20T12:00:00 0.0")]
    head = head.replace("TYPE = QUATERNION\nQUATERNION_TYPE = LAST", "TYPE = EULER_ANGLE")
    head = head.replace("META_STOP", "EULER_ROT_SEQ = 321\nMETA_STOP")
    rows = "2026-03-20T12:00:00 90 90 0\n2026-03-20T12:01:00 90 90 0\nDATA_STOP\n"
    R = matrix(tmp_path, head + rows)
    np.testing.assert_allclose(R @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(R @ [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], atol=1e-12)


def test_lvlh_is_told_apart(tmp_path: Path) -> None:
    text = AEM.replace("A = ICRF", "A = LVLH")
    assert sampled_attitude(written(tmp_path, text)).in_lvlh
    assert not sampled_attitude(written(tmp_path, AEM)).in_lvlh


@pytest.mark.parametrize("frame", ["EME2000", "J2000"])
def test_eme2000_leaves_icrf_by_milliarcseconds(tmp_path: Path, frame: str) -> None:
    text = AEM.replace("A = ICRF", f"A = {frame}")
    off = np.abs(matrix(tmp_path, text) - about_z(60.0)).max()
    assert 1e-8 < off < 2e-7
