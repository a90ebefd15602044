"""The first script of the README."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.patience import run_to_end

ROOT = Path(__file__).parents[2]


def test_the_first_image_writes_an_exr(tmp_path: Path) -> None:
    script = ROOT / "examples" / "first_image.py"
    done = run_to_end([sys.executable, str(script)], cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out" / "first_image").glob("navcam*.exr"))
