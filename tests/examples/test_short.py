"""Each short example runs, on images of 120 x 120 pixels, and prints what its first line says."""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SHORT = ROOT / "examples" / "short"
FIRST = ROOT / "examples" / "first_image.py"
NUMBER = r"[-+]?\d+\.?\d*(?:e[-+]\d+)?"

# What a line of each prints, and how many there are at least.
PRINTS = {
    "bridge_client": (r"120 x 120, DN \d+ to \d+|state [0-9a-f]{32}", 2),
    "camera_self_test": (rf"[\w ,%-]+ given +{NUMBER}  found +{NUMBER}", 8),
    "eclipse_entry": (r"2026-03-20T1[23]:\d\d:[\d.]+  (eclipse|umbra)_(entry|exit)", 4),
    "exposure_sweep": (rf"EV +{NUMBER} +{NUMBER} us  saturated .*%  dark .*%  usable .*%", 5),
    "lidar": (rf"\d+ ranges about {NUMBER} m|error {NUMBER} m, two thirds within {NUMBER} m.*", 2),
    "light_along_orbit": (rf"2026-[\dT:-]+  sunlight +{NUMBER}%  phase +{NUMBER} deg", 10),
    "mesh_in_memory": (rf"\d+ pixels, mean radiance ({NUMBER} ){{4}}W/\(m2 sr\)", 1),
    "pointing": (rf"\w+ +Earth .*  Sun at +{NUMBER} deg", 5),
    "radiance": (rf"target/\w+ +({NUMBER} +){{4}}W/\(m2 sr\)", 8),
    "trajectories": (rf"\w+ +\+ ?\d+ min  \w+ at +{NUMBER} km  chaser at +{NUMBER} m", 8),
    "truth": (r"(box|pose|keypoint) .*", 12),
}


@pytest.fixture
def small_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder of a user, whose scenarios have few pixels."""
    for path in (ROOT / "examples").rglob("*"):
        if path.suffix in (".toml", ".tle", ".oem", ".aem", ".csv"):
            copy = tmp_path / path.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)
            if path.suffix == ".toml":
                fewer = re.sub(r"(width|height)_px = \d+", r"\1_px = 120", path.read_text())
                copy.write_text(fewer)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(name: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """The lines that a short example prints."""
    runpy.run_path(str(SHORT / f"{name}.py"), run_name="__main__")
    return capsys.readouterr().out.splitlines()


def test_every_short_example_is_tested_and_listed() -> None:
    names = {path.stem for path in SHORT.glob("*.py")} - {"__init__"}
    assert names == set(PRINTS)
    index = (ROOT / "examples" / "README.md").read_text()
    for name in names:
        assert f"short/{name}.py" in index


@pytest.mark.parametrize("name", sorted(PRINTS))
@pytest.mark.usefixtures("small_examples")
def test_it_prints_what_it_promises(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    pattern, least = PRINTS[name]
    lines = printed(name, capsys)
    assert len(lines) >= least
    for line in lines:
        assert re.fullmatch(pattern, line), line


@pytest.mark.usefixtures("small_examples")
def test_longer_exposures_saturate_more(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed("exposure_sweep", capsys)
    values = [float(line.split()[1]) for line in lines]
    full = [float(line.split("saturated")[1].split("%")[0]) for line in lines]
    assert values == sorted(values)
    assert full == sorted(full, reverse=True)
    assert full[0] > 10.0 > full[-1]


@pytest.mark.usefixtures("small_examples")
def test_the_umbra_lies_within_the_eclipse(capsys: pytest.CaptureFixture[str]) -> None:
    lines = sorted(printed("eclipse_entry", capsys))
    events = [line.split()[1] for line in lines]
    assert events == ["eclipse_entry", "umbra_entry", "umbra_exit", "eclipse_exit"]


def test_the_first_image_is_written_where_one_stands(
    small_examples: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (small_examples / "examples" / "first_image.py").write_text(FIRST.read_text())
    runpy.run_path("examples/first_image.py", run_name="__main__")
    for path in capsys.readouterr().out.split():
        assert (small_examples / path).stat().st_size > 0
