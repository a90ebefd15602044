"""``simgl assess`` over a trajectory: a report in one file, and a table that says the same."""

from __future__ import annotations

import csv
import html
import math
import re
import sys
from pathlib import Path

import pytest

from simgl.cli import main

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
albedo = 0.3
atmosphere = "none"
[spacecraft.target]
model.box = { size_m = [1.0, 2.0, 3.0], material = { reflectance = 0.5 } }
orbit = { altitude_km = 400.0 }
[camera.near]
about = { target = "target", azimuth_deg = 20.0, range_m = 30.0 }
width_px = 64
height_px = 48
focal_length_mm = 2.0
exposure_time_s = 0.0002
[assess]
min_target_pixels = 10
"""


def assess(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["simgl", "assess", *map(str, arguments)])
    with pytest.raises(SystemExit) as done:
        main()
    return int(done.value.code or 0)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_an_orbit_has_its_night_and_its_day(
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The equinox Sun stands over the start: 36 of 92 min of an equatorial orbit are eclipse."""
    out = tmp_path / "out"
    options = ("--duration", "5553", "--count", "24", "--out", out)
    assert assess(monkeypatch, scene, *options) == 0
    with (out / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 24
    eclipsed = [row for row in rows if float(row["sunlight"]) < 0.01]
    assert len(eclipsed) == pytest.approx(24 * 36.0 / 92.6, abs=1.5)
    assert all(row["verdict"] == "too dark" for row in eclipsed)
    assert any(row["verdict"] == "good" for row in rows)
    page = html.unescape((out / "report.html").read_text())
    # Two plots over time, ground track, sketch, and the images of three epochs.
    assert page.count("data:image/svg+xml;base64,") >= 7
    # Nothing is fetched from elsewhere.
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "Earth's shadow" in page
    # A strip each for verdicts and backgrounds, whose cells take up all epochs.
    for strip in re.findall(r'<div class="strip"[^>]*>(.*?)</div></div>', page):
        assert sum(map(int, re.findall(r"flex:(\d+);", strip))) == 24
    assert page.count('<div class="strip"') == 2
    assert float(rows[0]["exitance_w_m2"]) == pytest.approx(
        math.pi * sum(float(rows[0][f"radiance_{band}_w_m2_sr"]) for band in "rgbn"), rel=1e-6
    )
    capsys.readouterr()
    before = (out / "frames.csv").read_bytes()
    assert assess(monkeypatch, scene, *options) == 0
    assert (out / "frames.csv").read_bytes() == before


def test_names_from_files_are_escaped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, out = tmp_path / 'a<i>&"b.toml', tmp_path / "out"
    scenario.write_text(SCENE)
    assert assess(monkeypatch, scenario, "--duration", "60", "--count", "2", "--out", out) == 0
    capsys.readouterr()
    page = (out / "report.html").read_text()
    assert "<i>" not in page
    assert "<title>a&lt;i&gt;&amp;&#34;b: light on target</title>" in page
    assert "a&lt;i&gt;&amp;&#34;b.toml</td></tr>" in page


def test_one_epoch_says_its_verdict(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert assess(monkeypatch, scene, "--at", "2026-03-20T12:46:00") == 0
    text = capsys.readouterr().out
    assert re.search(r"verdict +too dark: 100 % in the noise", text)
    assert re.search(r"sunlight on target +0.0 %", text)


@pytest.mark.parametrize(
    ("old", "new", "options", "complaint"),
    [
        (
            "min_target_pixels = 10",
            "min_target_pixel = 10",
            [],
            "[assess]: min_target_pixel is not a key here",
        ),
        (
            "min_target_pixels = 10",
            'target = "x"',
            [],
            '[assess]: target names none of this file: "x"',
        ),
        ("min_target_pixels = 10", "max_dark_share = 2.0", [], "[assess]: max_dark_share must be"),
        ("", "", ["--camera", "far"], '--camera "far" is not in'),
        ("", "", ["--target", "far"], '--target "far" is not in'),
        ("", "", ["--at", "2026-03-20", "--out", "x"], "--at is one epoch; --out is for a"),
        ("", "", ["--out", "x"], "needs exactly one of --to, --duration; got none of them"),
    ],
)
def test_bad_input_is_one_line(
    scene: Path,
    old: str,
    new: str,
    options: list[str],
    complaint: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(scene.parent)
    scene.write_text(SCENE.replace(old, new) if old else SCENE)
    if "--out" in options and "--at" not in options:
        options = [*options, "--count", "2"]
    assert assess(monkeypatch, scene, *options) == 2
    line = capsys.readouterr().err.strip()
    assert complaint in line
    assert "\n" not in line
    assert not (scene.parent / "x").exists()
