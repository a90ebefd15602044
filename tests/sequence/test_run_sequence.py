"""A sequence that is broken off goes on: nothing twice, nothing lost, the same bytes."""

from __future__ import annotations

import csv
import hashlib
import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from simgl.cli import main
from tests.patience import run_to_end, wait_until

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "none"
[spacecraft.target]
model.box = { size_m = [1.0, 2.0, 3.0], material = "white_paint" }
orbit = { altitude_km = 400.0 }
[camera.near]
about = { target = "target", azimuth_deg = 20.0, range_m = 30.0 }
width_px = 61
height_px = 48
[camera.far]
about = { target = "target", azimuth_deg = 90.0, range_m = 60.0 }
width_px = 40
height_px = 30
[render]
seed = 3
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def sequence(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> None:
    monkeypatch.setattr(sys, "argv", ["simgl", "sequence", *map(str, arguments)])
    with pytest.raises(SystemExit) as done:
        main()
    assert not done.value.code


def refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str | Path
) -> str:
    monkeypatch.setattr(sys, "argv", ["simgl", "sequence", *map(str, arguments)])
    with pytest.raises(SystemExit) as done:
        main()
    assert done.value.code == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line
    return line


def contents(folder: Path) -> dict[str, str]:
    """Hash of every file but the database, whose pages may differ."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix != ".sqlite"
    }


def test_files_and_table_hold_what_they_say(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    sequence(monkeypatch, scene, "--out", out, "--duration", "100", "--count", "3",
             "--write", "dn,view,exr,mp4")  # fmt: skip
    with (out / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["frame"], row["camera"]) for row in rows] == [
        (str(frame), camera) for frame in range(3) for camera in ("far", "near")
    ]
    assert [row["utc"] for row in rows[::2]] == [
        "2026-03-20T12:00:00", "2026-03-20T12:00:50", "2026-03-20T12:01:40",
    ]  # fmt: skip
    for row in rows:
        stem = out / row["camera"] / f"{int(row['frame']):06d}"
        dn = np.asarray(Image.open(f"{stem}.dn.png"))
        assert hashlib.sha256(dn.astype(np.uint16).tobytes()).hexdigest() == row["dn_sha256"]
        for suffix in ("view.png", "radiance.exr"):
            assert Path(f"{stem}.{suffix}").is_file()
    with sqlite3.connect(out / "frames.sqlite") as database:
        assert database.execute("SELECT count(*) FROM frames").fetchone() == (6,)
    with av.open(str(out / "near.mp4")) as video:
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert len(frames) == 3
    # An odd column is left out.
    assert frames[0].shape == (48, 60, 3)
    shown = np.asarray(Image.open(out / "near" / "000001.view.png"))[:, :60]
    assert np.abs(frames[1].astype(float) - shown).mean() < 4.0


def test_a_second_run_takes_nothing_and_changes_nothing(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    options = ("--out", out, "--duration", "60", "--step", "30")
    sequence(monkeypatch, scene, *options)
    assert "6 frames" in capsys.readouterr().out
    before = {p: p.stat().st_mtime_ns for p in out.rglob("*.png")}
    sequence(monkeypatch, scene, *options)
    assert "0 of them now" in capsys.readouterr().out
    assert {p: p.stat().st_mtime_ns for p in out.rglob("*.png")} == before


def test_a_killed_run_goes_on_to_the_same_bytes(scene: Path, tmp_path: Path) -> None:
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    options = ["--duration", "5000", "--count", "30", "--camera", "near"]

    def command(out: Path) -> list[str]:
        return [sys.executable, "-m", "simgl", "sequence", str(scene), "--out", str(out), *options]

    run_to_end(command(whole))
    started = subprocess.Popen(command(broken), stdout=subprocess.DEVNULL)
    wait_until(lambda: len([*broken.glob("near/*.view.png")]) >= 5, "5 images", 120.0, started)
    os.kill(started.pid, signal.SIGKILL)
    started.wait()
    with sqlite3.connect(broken / "frames.sqlite") as database:
        (rows,) = database.execute("SELECT count(*) FROM frames").fetchone()
    assert 4 <= rows < 30
    kept = {p: p.stat().st_mtime_ns for p in sorted(broken.glob("near/[0-9]*.png"))[: 2 * rows]}
    run_to_end(command(broken))
    assert {p: p.stat().st_mtime_ns for p in kept} == kept
    for name, digest in contents(whole).items():
        assert contents(broken)[name] == digest, name


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--duration", "60"], "needs exactly one of --step, --count, --random, --event; got none"),
        (["--duration", "60", "--step", "5", "--count", "3"], "got --step and --count"),
        (["--count", "3"], "needs exactly one of --to, --duration; got none of them"),
        (
            ["--to", "2026-03-20", "--duration", "5", "--count", "3"],
            "needs exactly one of --to, --duration; got --to and --duration",
        ),
        (
            ["--to", "2026-03-19T00:00:00", "--count", "3"],
            "--to must not be earlier than the start",
        ),
        (["--to", "noon", "--count", "3"], "--to must be a UTC time such as"),
        (["--duration", "60", "--count", "0"], "--count must lie in 1..1000000, got 0"),
        (["--duration", "60", "--step", "0"], "--step must be at least 1e-6 s, got 0"),
        (["--duration", "60", "--step", "1e300"], "--step must be at most 4.1e+09 s, got 1e+300"),
        (["--duration", "60", "--step", "nan"], "--step must be finite, got nan"),
        (["--duration", "inf", "--count", "3"], "--duration must be finite, got inf"),
        (
            ["--duration", "1e300", "--count", "3"],
            "--duration must lie in 0..4.1e+09 s, got 1e+300",
        ),
        (["--duration", "-5", "--count", "3"], "--duration must lie in 0..4.1e+09 s, got -5"),
        (["--duration", "60", "--event", "umbra_entry", "--search-step", "1e300"], "--search-step"),
        (["--duration", "60", "--count", "2", "--camera", "wide"], '--camera "wide" is not in'),
        (["--duration", "60", "--count", "2", "--write", "dn,gif"], '--write has no "gif"'),
        (["--duration", "60", "--event", "umbra_entry"], "--event begins nowhere in the span"),
        (
            ["--duration", "60", "--event", "umbra_entry", "--target", "x"],
            '--target "x" is not in the scenario; allowed: target',
        ),
    ],
)
def test_bad_options_are_one_line(
    scene: Path,
    tmp_path: Path,
    options: list[str],
    complaint: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    line = refused(monkeypatch, capsys, scene, "--out", tmp_path / "out", *options)
    assert complaint in line
    assert not (tmp_path / "out").exists()


def test_a_folder_of_another_sequence_is_refused_and_kept(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    options = ("--camera", "far", "--duration", "60")
    sequence(monkeypatch, scene, "--out", out, *options, "--count", "2")
    before = contents(out)
    capsys.readouterr()
    line = refused(monkeypatch, capsys, scene, "--out", out, *options, "--count", "3")
    assert "holds another run: frames was 2, now 3; take another folder" in line
    scene.write_text(SCENE.replace("seed = 3", "seed = 4"))
    line = refused(monkeypatch, capsys, scene, "--out", out, *options, "--count", "2")
    assert "holds another run: scenario has changed" in line
    assert contents(out) == before
