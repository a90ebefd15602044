"""SPEED+'s ``camera.json`` of a calibrated camera."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from simgl.camera.projections import Distortion, Fisheye
from simgl.campaign.label_formats import write_camera
from simgl.errors import ConfigError
from tests.camera.test_projections import lens_camera


def test_it_has_the_calibration(tmp_path: Path) -> None:
    cam = lens_camera(Distortion(k1=-0.2, p1=0.001, k3=0.01))
    write_camera(tmp_path / "camera.json", cam)
    written = json.loads((tmp_path / "camera.json").read_text())
    assert written["cameraMatrix"] == cam.intrinsics.tolist()
    assert (written["ccx"], written["ccy"]) == pytest.approx((331.3, 232.4))
    assert written["fy"] / written["ppy"] == pytest.approx(1.02 * 420.0)
    assert written["distCoeffs"] == [-0.2, 0.0, 0.001, 0.0, 0.01, 0.0, 0.0, 0.0]


def test_a_lens_that_it_cannot_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"^\[camera.cam\]: has fisheye, which files of SPEED\+"):
        write_camera(tmp_path / "camera.json", lens_camera(Fisheye()))
