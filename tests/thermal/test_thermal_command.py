"""``simgl thermal`` and the thermal table of a model card."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image
from scipy.ndimage import binary_erosion
from typer.testing import CliRunner

from simgl import assets
from simgl.commands.application import app
from simgl.errors import ConfigError
from simgl.model_files.model_library import load_model
from simgl.physics.thermal_radiation import band_radiance
from simgl.thermal.body import thermal_body

SCENARIO = """
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "sphere"
radius_km = 6371.0
albedo = 0.3
[spacecraft.box]
model = { box = { size_m = [1.0, 1.0, 1.0], material = "white_paint" } }
orbit = { altitude_km = 500.0, inclination_deg = 51.6 }
[camera.ir]
about = { target = "box", azimuth_deg = 30.0, elevation_deg = 20.0, range_m = 10.0 }
width_px = 40
height_px = 30
focal_length_mm = 1.2
thermal = { detector = "bolometer_lwir" }
[camera.visible]
about = { target = "box", azimuth_deg = 30.0, range_m = 10.0 }
[thermal]
patches = 60
step_s = 20.0
"""


def card(folder: Path, thermal: str) -> Path:
    """A model card of the shipped wedge with a thermal table."""
    source = assets.models() / "wedge"
    text = (source / "model.toml").read_text()
    for file in source.glob("*.glb"):
        (folder / file.name).write_bytes(file.read_bytes())
    path = folder / "card.toml"
    path.write_text(text + thermal)
    return path


def test_a_run_writes_a_table_and_a_heat_map(tmp_path: Path) -> None:
    scenario = tmp_path / "box.toml"
    scenario.write_text(SCENARIO)
    out = tmp_path / "out"
    words = ["thermal", str(scenario), "--duration", "60", "--out", str(out)]
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0
    with (out / "box.thermal.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["seconds"] for row in rows] == ["0.000", "20.000", "40.000", "60.000"]
    assert "4 epochs, 60 patches" in result.output
    for row in rows:
        low, mean, high = (float(row[f"box.{k}_k"]) for k in ("min", "mean", "max"))
        assert 150.0 < low < mean < high < 350.0
    with Image.open(out / "box.thermal.png") as image:
        assert len(image.getcolors(1 << 20) or []) > 50


def test_a_camera_sees_it_in_the_infrared(tmp_path: Path) -> None:
    scenario = tmp_path / "box.toml"
    scenario.write_text(SCENARIO)
    words = ["thermal", str(scenario), "--duration", "30", "--camera"]
    words += ["ir", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0
    with OpenEXR.File(str(tmp_path / "ir.thermal.exr"), separate_channels=True) as file:
        header, channels = dict(file.header()), file.channels()
        kelvin = channels["temperature"].pixels.copy()
        radiance = channels["radiance"].pixels.copy()
    assert header["thermalState"] in result.output
    assert header["thermalHistory"] == "from the steady state"
    seen = kelvin > 0.0
    assert 0.05 < seen.mean() < 0.9
    # White paint emits 0.85 of a black body and reflects the Earth, which edges mix in.
    inside = binary_erosion(seen)
    share = radiance[inside] / band_radiance((7.5e-6, 13.5e-6), kelvin[inside])
    assert 0.75 < np.percentile(share, 10) < np.percentile(share, 90) < 1.2
    with Image.open(tmp_path / "ir.dn.png") as image:
        assert image.size == (40, 30)
    assert (tmp_path / "ir.map.brightness_temperature.png").exists()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--camera", "thermel"], "thermel"),
        (["--camera", "visible"], "sees visible light; a thermal one has [camera.visible.thermal]"),
        (["--step", "0"], "--step must lie in 0.01..3600 s, got 0"),
        (["--spacecraft", "bix"], 'box.toml; did you mean "box"?'),
    ],
)
def test_bad_options_give_one_line(tmp_path: Path, words: list[str], line: str) -> None:
    scenario = tmp_path / "box.toml"
    scenario.write_text(SCENARIO)
    words = ["thermal", str(scenario), "--duration", "60", "--out", str(tmp_path), *words]
    result = CliRunner().invoke(app, words)
    assert isinstance(result.exception, ConfigError)
    assert line in str(result.exception)


def test_a_model_card_heats_a_part(tmp_path: Path) -> None:
    plain = load_model("wedge")
    part = plain.parts[0]
    surface = "{ solar_absorptance = 0.3, infrared_emissivity = 0.7 }"
    heated = load_model(
        str(card(tmp_path, f'\n[thermal."{part}"]\npower_w = 40.0\nsurface = {surface}\n'))
    )
    body = thermal_body("wedge", heated, 40)
    assert body.power.sum() == 40.0
    assert body.emissivity == pytest.approx(0.7)
    # A structure behind a surface of 0.7 that radiates 40 W is warmer than space, the plain is not.
    cold = thermal_body("wedge", plain, 40)
    assert body.network.steady(body.power).min() > cold.network.steady(cold.power).max() + 50.0


def test_a_thermal_table_of_no_part_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"thermal\.wing names no part"):
        load_model(str(card(tmp_path, "\n[thermal.wing]\npower_w = 1.0\n")))
