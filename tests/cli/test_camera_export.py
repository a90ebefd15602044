"""``simgl camera export``: the calibration of a scenario's camera, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from simgl.camera.calibration import read_calibration
from simgl.commands.application import app
from simgl.errors import ConfigError

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[camera.nav]
position_icrf_m = [7.0e6, 0, 0]
boresight = [1, 0, 0]
width_px = 640
height_px = 480
focal_length_px = [500.0, 502.0]
principal_point_px = [322.5, 240.5]
optics = { distortion = { k1 = -0.2, p1 = 0.001 } }
"""


@pytest.mark.parametrize("form", ["opencv", "kalibr", "ros"])
def test_a_calibration_is_written(form: str, tmp_path: Path) -> None:
    scene, out = tmp_path / "scene.toml", tmp_path / "out" / "nav.yaml"
    scene.write_text(SCENE)
    command = ["camera", "export", str(scene), "--camera", "nav", "--out", str(out)]
    result = CliRunner().invoke(app, [*command, "--format", form], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    its = read_calibration(out)
    assert its.principal_point == (322.5, 240.5)
    assert its.focal_length == pytest.approx((500.0, 502.0))
    # OpenCV counts from the centre of the first pixel.
    assert "322.0" in out.read_text()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--camera", "nav", "--format", "matlab"], "--format must be one of opencv, kalibr, ros,"),
        (["--camera", "nab"], '--camera "nab" is not in'),
    ],
)
def test_what_does_not_exist_is_refused(options: list[str], message: str, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    command = ["camera", "export", str(scene), "--out", str(tmp_path / "a.yaml"), *options]
    with pytest.raises(ConfigError, match=message):
        CliRunner().invoke(app, command, catch_exceptions=False)
    assert not (tmp_path / "a.yaml").exists()
