"""Tab completion, as the shells ask for it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from simgl.commands.completion import bench_scenes, camera_presets, model_names, scenario_files
from tests.patience import run_to_end


@pytest.mark.parametrize(
    ("shell", "line", "offered"),
    [
        ("bash", "simgl rep", "replay"),
        ("bash", "simgl render --qu", "--quiet"),
        ("zsh", "simgl camera test mt9", "mt9m034"),
        ("fish", "simgl model check space", "space_rider"),
    ],
)
def test_a_shell_gets_what_a_word_may_become(
    shell: str, line: str, offered: str, tmp_path: Path
) -> None:
    asked = {
        "_SIMGL_COMPLETE": f"complete_{shell}",
        "_TYPER_COMPLETE_ARGS": line,
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    if shell == "bash":
        asked |= {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
    ended = run_to_end([sys.executable, "-m", "simgl"], env={**os.environ, **asked}, cwd=tmp_path)
    assert offered in ended.stdout
    assert not ended.stderr


def test_scenarios_are_files_and_the_folders_on_the_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "runs").mkdir()
    for name in ("runs/near.toml", "runs/notes.txt", "runs.toml", ".hidden.toml"):
        (tmp_path / name).write_text("")
    monkeypatch.chdir(tmp_path)
    assert scenario_files("") == ["runs/", "runs.toml"]
    assert scenario_files("runs/") == ["runs/near.toml"]
    assert scenario_files(f"{tmp_path}/runs.") == [f"{tmp_path}/runs.toml"]
    assert scenario_files("absent/") == []


def test_shipped_names_come_before_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "station.glb").write_text("")
    monkeypatch.chdir(tmp_path)
    assert model_names("s") == ["servicer", "space_rider", "station.glb"]
    assert "mt9m034" in camera_presets("mt")
    assert bench_scenes("source") == ["source_600"]
