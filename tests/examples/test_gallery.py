"""The gallery's command leaves the pictures that its page shows."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.patience import run_to_end

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "gallery.md"


def gallery(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The example as a user starts it."""
    command = [sys.executable, "-m", "examples.gallery", *arguments]
    return run_to_end(command, cwd=ROOT, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("gallery")
    done = gallery("--out", str(out), "--shrink", "8")
    assert done.returncode == 0, done.stderr
    assert sorted(done.stdout.splitlines()) == sorted(str(path) for path in out.iterdir())
    return out


def light(folder: Path, name: str) -> float:
    """Mean of a picture in linear light."""
    return float(np.mean((np.asarray(Image.open(folder / f"{name}.jpg")) / 255.0) ** 2.2))


def test_the_command_makes_every_picture_of_the_page(folder: Path) -> None:
    shown = set(re.findall(r"\(pictures/([a-z_]+)\.jpg\)", PAGE.read_text()))
    assert shown == {path.stem for path in folder.iterdir()}
    for name in shown:
        there = ROOT / "docs" / "pictures" / f"{name}.jpg"
        assert 10_000 < there.stat().st_size < 250_000, name


def test_every_light_adds_to_the_picture(folder: Path) -> None:
    for camera in ("bay", "craft"):
        sun, earth, everything = (light(folder, f"{camera}_{k}") for k in ("sun", "earth", "all"))
        # JPEG's own error is a thousandth.
        assert 0.01 < sun < earth - 2e-3 < earth
        assert earth < everything - 2e-3 < 0.5
        assert light(folder, f"{camera}_lamp") > 0.002


def test_a_folder_that_cannot_be_written_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = gallery("--out", str(tmp_path / "file" / "out"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("gallery: ")
    assert "cannot be written" in done.stderr
