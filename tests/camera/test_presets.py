"""Camera presets: the shipped ones are whole, damaged ones are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from simgl import assets
from simgl.camera.detector_tables import SpectralResponse
from simgl.camera.presets import load_preset, preset_path, shipped_presets
from simgl.errors import AssetError, ConfigError


@pytest.mark.parametrize("name", shipped_presets())
def test_every_shipped_preset_is_whole(name: str) -> None:
    path = preset_path(name)
    preset = load_preset(path)
    assert preset.source
    SpectralResponse(preset, path, 5772.0)
    # The converter spans the full well within its bits.
    assert preset.full_well_e / preset.gain_e_per_dn < 2**preset.bits


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("value = [0.45, ", "value = [", "qe.value needs one number for each qe.wavelength_nm"),
        ("[400, 450,", "[450, 400,", "qe.wavelength_nm must increase, over two points or more"),
        (
            "value = [0.45, ",
            "value = [1.45, ",
            "qe.value[0] must be a number >= 0.0, <= 1.0, got 1.45",
        ),
        ("[qe]", '[qe]\ncsv = "a.csv"', "qe needs exactly one of value, csv; got value and csv"),
        (
            "value = [0.45, ",
            'csv = "a.csv"  # [',
            "qe.wavelength_nm contradicts csv; give one of them",
        ),
        ("width_px = 1280\n", "", "width_px is missing"),
        ("bits = 12", "bits = 12\nbit = 1", 'bit is not a key here; did you mean "bits"?'),
    ],
)
def test_a_damaged_preset_is_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = (assets.data() / "cameras" / "mt9m034.toml").read_text()
    assert text.count(old) == 1
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as caught:
        SpectralResponse(load_preset(path), path, 5772.0)
    assert str(caught.value).startswith(f"{path}: {message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "nm,qe\n400,0.5\n500;0.6\n",
            'line 3 must be a wavelength in nm and a value, got "500;0.6"',
        ),
        ("400,0.5\n500,1.6\n", "qe.value must lie in 0..1, got 1.6"),
        ("400,0.5\n500,nan\n", "qe.value must lie in 0..1, got nan"),
        ("500,0.5\n400,0.6\n", "wavelength_nm must increase, over two points or more"),
        ("", "wavelength_nm must increase, over two points or more"),
        # Micrometres; angstroms; what is no wavelength.
        ("0.4,0.5\n1.1,0.6\n", "wavelength_nm must reach into 300 to 2500 nm, got 0.4 to 1.1"),
        ("4000,0.5\n9000,0.6\n", "wavelength_nm must reach into 300 to 2500 nm, got 4000 to 9000"),
        ("400,0.5\ninf,0.6\n", "wavelength_nm must reach into 300 to 2500 nm, got 400 to inf"),
        ("-400,0.5\n600,0.6\n", "wavelength_nm must reach into 300 to 2500 nm, got -400 to 600"),
    ],
)
def test_a_damaged_curve_file_is_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "qe.csv").write_text(text)
    with pytest.raises(ConfigError) as caught:
        SpectralResponse(load_preset(_with_curve_file(tmp_path)), tmp_path / "mine.toml", 5772.0)
    assert str(caught.value) == f"{tmp_path / 'qe.csv'}: {message}"


def test_a_missing_curve_file_is_told_with_the_key_that_names_it(tmp_path: Path) -> None:
    path = _with_curve_file(tmp_path)
    with pytest.raises(AssetError) as caught:
        SpectralResponse(load_preset(path), path, 5772.0)
    problem = "cannot be read (No such file or directory)"
    assert str(caught.value) == f"{path}: qe.csv: {tmp_path / 'qe.csv'}: {problem}"


def test_a_curve_file_says_the_same_as_lists(tmp_path: Path) -> None:
    shipped = preset_path("mt9m034")
    curve = load_preset(shipped).qe
    assert curve.wavelength_nm is not None
    assert curve.value is not None
    rows = [f"{nm}, {value}" for nm, value in zip(curve.wavelength_nm, curve.value, strict=True)]
    (tmp_path / "qe.csv").write_text("\n".join(["nm, electrons per photon", *rows, ""]))
    path = _with_curve_file(tmp_path)
    assert SpectralResponse(load_preset(path), path, 5772.0).plain() == (
        SpectralResponse(load_preset(shipped), shipped, 5772.0).plain()
    )


def _with_curve_file(folder: Path) -> Path:
    head, _, _ = preset_path("mt9m034").read_text().partition("[qe]")
    (folder / "mine.toml").write_text(f'{head}[qe]\ncsv = "qe.csv"\n')
    return folder / "mine.toml"


@pytest.mark.parametrize(
    ("name", "periods", "clock"), [("mt9m034", 1650, 74.25), ("mt9p031", 3492, 96.0)]
)
def test_a_row_takes_so_many_periods_of_the_pixel_clock(
    name: str, periods: int, clock: float
) -> None:
    """Clocks in MHz; of the MT9P031 2592 columns and a blanking of 900."""
    # Printed to five digits.
    assert load_preset(preset_path(name)).row_time_us == pytest.approx(periods / clock, rel=2e-5)
