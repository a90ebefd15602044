"""A campaign's folder: the same bytes whoever takes the frames, killed or not."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from examples.campaign import overlay
from simgl.cli import main
from simgl.sequence.journal import rows_written
from tests.campaign.small import CAMPAIGN, DRAW, written
from tests.patience import limit, run_to_end, wait_until


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["simgl", "campaign", *map(str, arguments)])
    with pytest.raises(SystemExit) as done:
        main()
    return int(done.value.code or 0)


def command(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-m", "simgl", "campaign", *map(str, arguments)]


def contents(folder: Path) -> dict[str, str]:
    """Hash of every file but the database, whose pages may differ."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix != ".sqlite"
    }


def wait_for_rows(folder: Path, count: int, running: subprocess.Popen[bytes]) -> None:
    wait_until(lambda: rows_written(folder) >= count, f"{count} rows", 200.0, running)


def test_files_table_and_labels_hold_what_they_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    head = CAMPAIGN.replace("[draw]", 'write = ["dn16", "dn8", "view", "exr"]\n[draw]')
    path, out = written(tmp_path, DRAW, head.replace("frames = 12", "frames = 3")), tmp_path / "out"
    assert run(monkeypatch, path, "--out", out) == 0
    assert "3 frames" in capsys.readouterr().out
    with (out / "frames.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [row["frame"] for row in table] == ["0", "1", "2"]
    assert len({row["dn_sha256"] for row in table}) == 3
    for row in table:
        frame = int(row["frame"])
        full = np.asarray(Image.open(out / f"dn16/{frame:06d}.png")).astype(np.uint16)
        assert hashlib.sha256(full.tobytes()).hexdigest() == row["dn_sha256"]
        # Twelve bits: the eight leading ones.
        assert np.array_equal(np.asarray(Image.open(out / f"dn8/{frame:06d}.png")), full // 16)
        for name in (f"view/{frame:06d}.png", f"exr/{frame:06d}.exr"):
            assert (out / name).is_file()
        craft = json.loads((out / f"labels/{frame:06d}.json").read_text())["spacecraft"]
        (target,) = [one for one in craft if one["name"] == "target"]
        assert target["pixels"] == int(row["target_pixels"]) > 0
    poses = json.loads((out / "speed.json").read_text())
    assert [pose["filename"] for pose in poses] == [row["file"] for row in table]
    for pose, row in zip(poses, table, strict=True):
        assert np.linalg.norm(pose["r_Vo2To_vbs_true"]) == pytest.approx(float(row["range_m"]))
    camera = json.loads((out / "camera.json").read_text())
    assert camera["cameraMatrix"][0] == pytest.approx([400.0, 0.0, 40.0])
    overlay.main(out, 1, tmp_path / "overlay.png")
    drawn = np.asarray(Image.open(tmp_path / "overlay.png"))
    left, top, *_ = json.loads((out / "coco.json").read_text())["annotations"][1]["bbox"]
    assert tuple(drawn[top, left]) == (255, 208, 0)
    before = contents(out)
    assert run(monkeypatch, path, "--out", out) == 0
    assert "0 of them now" in capsys.readouterr().out
    assert contents(out) == before


def test_fewer_frames_are_the_first_ones_of_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for count in (2, 4):
        head = CAMPAIGN.replace("frames = 12", f"frames = {count}")
        assert run(monkeypatch, written(tmp_path, DRAW, head), "--out", tmp_path / str(count)) == 0
    few, many = contents(tmp_path / "2"), contents(tmp_path / "4")
    pictures = [name for name in few if name.startswith(("dn8", "labels"))]
    assert len(pictures) == 4
    assert all(many[name] == few[name] for name in pictures)


def test_a_lost_worker_and_a_killed_campaign_lose_nothing(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    import psutil

    path = written(tmp_path, DRAW, CAMPAIGN.replace("frames = 12", "frames = 40"))
    alone, crew = tmp_path / "alone", tmp_path / "crew"
    run_to_end(command(path, "--out", alone))
    # The whole campaign dies first, of one process, then, when two go on with it, one of these.
    started = subprocess.Popen(command(path, "--out", crew), stdout=subprocess.DEVNULL)
    wait_for_rows(crew, 5, started)
    os.kill(started.pid, signal.SIGKILL)
    started.wait()
    kept = rows_written(crew)
    assert 5 <= kept < 30
    together = command(path, "--out", crew, "--workers", "2")
    again = subprocess.Popen(together, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    wait_for_rows(crew, kept + 5, again)
    workers = [
        child
        for child in psutil.Process(again.pid).children(recursive=True)
        if "spawn_main" in " ".join(child.cmdline())
    ]
    assert len(workers) == 2
    os.kill(workers[0].pid, signal.SIGKILL)
    assert rows_written(crew) < 40
    _, errors = again.communicate(timeout=limit(240.0))
    assert again.returncode == 0, errors.decode()
    assert contents(crew) == contents(alone)
    assert rows_written(crew) == 40


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("frames = 12", "frames = 0", "frames must be"),
        ("frames = 12", "", "frames is missing"),
        ("seed = 5", "sed = 5", 'sed is not a key here; did you mean "seed"?'),
        ('"scene.toml"', '"other.toml"', "other.toml: cannot be read"),
        ("[draw]", 'camera = "far"\n[draw]', 'camera names none of the scenario: "far"'),
        ("[draw]", 'target = "x"\n[draw]', 'target names none of the scenario: "x"'),
        ("[draw]", 'target = "chaser"\n[draw]', 'camera is on the target, "chaser"'),
        ("[draw]", "write = []\n[draw]", "write must name at least one kind"),
        ("[draw]", 'write = ["gif"]\n[draw]', "write[0] must be one of"),
        ("[draw]", "[draw]\nazimuth_deg = 3.0", "azimuth_deg contradicts direction"),
        ("[draw]", "[draw]\nelevation_deg = 3.0", "elevation_deg requires azimuth_deg"),
        ("[draw]", "[draw]\nattitude_error_deg = 3.0", "attitude_error_deg contradicts attitude"),
        ("[draw]", "[draw]\noffset_x = 1.5", "offset_x must lie in -1..1, got 1.5"),
        ("[draw]", "[draw]\nf_number = { uniform = [3, 2] }", "f_number.uniform must give the lo"),
        ("[draw]", "[draw]\nf_number = { uniform = [0.1, 2] }", "must lie in 0.5..1000, got 0.1"),
        ("[draw]", "[draw]\noffset_x = { log_uniform = [0, 1] }", "must have positive limits"),
        ("[draw]", "[draw]\noffset_x = { normal = [0, -1] }", "must not have a negative deviation"),
        ("[draw]", "[draw]\noffset_x = { normal = [5, 1] }", "must have its mean in -1..1, got 5"),
        ("[draw]", "[draw]\noffset_x = {}", "needs exactly one of uniform, log_uniform, normal"),
        ("[draw]", "[draw]\noffset_x = { choice = [] }", "offset_x.choice must be"),
        ("[draw]", "[draw]\njoints_deg = { door = 3.0 }", "joints_deg.door"),
        ("[draw]", "[draw]\njoints_m = { rail = 3.0 }", "joints_m.rail"),
        ("[draw]", "[draw]\nlamp_power = { sun = 3.0 }", "lamp_power.sun names no lamp"),
        ("[draw]", "[draw]\nlamp_power = { spot = -3.0 }", "lamp_power.spot must lie in 0.."),
    ],
)
def test_bad_files_are_one_line(
    old: str,
    new: str,
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert old in CAMPAIGN
    path = written(tmp_path, DRAW, CAMPAIGN.replace(old, new))
    assert run(monkeypatch, path, "--out", tmp_path / "out") == 2
    line = capsys.readouterr().err.strip()
    assert complaint in line
    assert "\n" not in line
    assert not (tmp_path / "out").exists()


def test_contradictory_options_and_other_campaigns_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    head = CAMPAIGN.replace("frames = 12", "frames = 1")
    path, out = written(tmp_path, DRAW, head), tmp_path / "out"
    assert run(monkeypatch, path, "--out", out, "--workers", "2", "--scheduler", "tcp://x:1") == 2
    assert "--scheduler brings its own workers" in capsys.readouterr().err
    assert run(monkeypatch, path, "--out", out, "--scheduler", "nowhere") == 2
    assert "--scheduler is not a scheduler that answers: nowhere" in capsys.readouterr().err
    assert run(monkeypatch, path, "--out", out) == 0
    path.write_text(head.replace("seed = 5", "seed = 6") + DRAW)
    before = contents(out)
    capsys.readouterr()
    assert run(monkeypatch, path, "--out", out) == 2
    assert "holds another run: campaign has changed" in capsys.readouterr().err
    assert contents(out) == before
