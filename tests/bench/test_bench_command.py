"""``simgl bench`` around what it measures: files, comparison, exit status. Nothing is measured."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from simgl.bench.goals import results_document
from simgl.bench.results import Results
from simgl.commands.bench_command import bench
from simgl.commands.completion import bench_sets
from simgl.errors import ConfigError
from tests.bench.test_bench_results import results, scene

DEFAULTS: dict[str, Any] = {
    "json": None,
    "report": None,
    "of_set": None,
    "scene": None,
    "frames": 5,
    "seconds": 1.0,
    "step": None,
    "baseline": None,
    "fail_slower": None,
    "peers_python": sys.executable,
}


def bench_with(monkeypatch: pytest.MonkeyPatch, measured: list[Results], **options: Any) -> int:
    """Exit status of the command with results in place of measurements."""

    def run(*_: object, **__: object) -> Iterator[Results]:
        yield from measured

    monkeypatch.setattr("simgl.bench.run_bench.run", run)
    try:
        bench(**DEFAULTS | options)
    except typer.Exit as ended:
        return ended.exit_code
    return 0


def written(path: Path, content: Results) -> Path:
    path.write_bytes(results_document(content))
    return path


def test_a_slower_scene_ends_with_status_1_if_that_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A scene is 20 % slower; the rounds of both runs explain 5 %."""
    before = written(tmp_path / "before.json", results(scene(p50=100.0)))
    now = [results(scene(p50=120.0))]
    assert bench_with(monkeypatch, now, baseline=before) == 0
    assert bench_with(monkeypatch, now, baseline=before, fail_slower=25.0) == 0
    assert bench_with(monkeypatch, now, baseline=before, fail_slower=10.0) == 1
    assert "slower" in capsys.readouterr().out


def test_a_scene_that_could_not_be_measured_ends_with_status_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    failed = results(scene(), failed={"bay_1280": "was ended by SIGSEGV"})
    assert bench_with(monkeypatch, [failed]) == 1
    assert "was ended by SIGSEGV" in capsys.readouterr().out


def test_results_are_in_the_file_before_the_next_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bench.json"
    first, second = results(scene()), results(scene(), scene("earth_1280"))

    def scenes() -> list[str]:
        return [result["name"] for result in json.loads(path.read_text())["scenes"]]

    def run(*_: object, **__: object) -> Iterator[Results]:
        yield first
        assert scenes() == ["source_600"]
        yield second

    monkeypatch.setattr("simgl.bench.run_bench.run", run)
    bench(**DEFAULTS | {"json": path})
    assert scenes() == ["source_600", "earth_1280"]


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"scene": ["source_600"], "of_set": "gpu"}, "--scene and --set exclude each other"),
        ({"fail_slower": 10.0}, "--fail-slower needs --baseline"),
        ({"of_set": "goal"}, 'names no set: "goal"; did you mean "goals"'),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, Any], problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        bench(**DEFAULTS | options)


def test_sets_are_completed() -> None:
    assert bench_sets("g") == ["goals", "gpu"]
