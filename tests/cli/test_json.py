"""``--json``: one document on stdout with the keys of docs/command_line.md."""

from __future__ import annotations

import json
import re
import sys
from functools import partial
from pathlib import Path
from typing import Any

import moderngl
import pytest

from simgl import cli
from simgl.simulator import Simulator

PAGE = Path(__file__).parents[2] / "docs" / "command_line.md"


def documented(heading: str) -> set[str]:
    """The keys in the first column of a table below a heading."""
    _, _, rest = PAGE.read_text(encoding="utf-8").partition(f"### {heading}\n")
    table = rest.partition("\n#")[0]
    return {key for row in re.findall(r"^\| (`[^|]*)\|", table, re.M)
            for key in re.findall(r"`([^`]+)`", row)}  # fmt: skip


def keys(value: Any, prefix: str = "") -> set[str]:
    """All keys of a document; those inside a list or a table after the name of that."""
    if isinstance(value, list):
        return set().union(*(keys(item, prefix) for item in value))
    if not isinstance(value, dict):
        return set()
    return {f"{prefix}{name}" for name in value}.union(
        *(keys(item, f"{prefix}{name}.") for name, item in value.items())
    )


@pytest.fixture
def printed(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    """Runs a command here; returns the document that it printed and its exit status."""
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))

    def run(*arguments: object) -> tuple[Any, int]:
        monkeypatch.setattr(sys, "argv", ["simgl", *map(str, arguments), "--quiet"])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        assert not err
        assert isinstance(ended.value.code, int | None)
        return json.loads(out), ended.value.code or 0

    return run


def test_doctor(printed: Any) -> None:
    document, status = printed("doctor", "--json")
    assert status == 0
    assert document["renders_with"] in ("egl", "osmesa")
    usable = [entry for entry in document["backends"] if entry["usable"]]
    assert "OpenGL" not in usable[0]["opengl"]
    assert keys(document) <= documented("simgl doctor")
    missing, status = printed("doctor", "--device", 99, "--json")
    refused = missing["backends"][0]
    assert not refused["usable"]
    assert "device 99 does not exist" in refused["reason"]
    assert keys(document) | keys(missing) == documented("simgl doctor")


def test_model_check(printed: Any) -> None:
    document, status = printed("model", "check", "space_rider", "--json")
    assert status == 0
    assert document["triangles"] == sum(part["triangles"] for part in document["parts"])
    assert len(document["size_m"]) == 3
    jointed, _ = printed("model", "check", "iss_like", "--json")
    assert keys(document) | keys(jointed) == documented("simgl model check")


def test_exposure(printed: Any, scene: Path) -> None:
    document, status = printed("exposure", scene, "--camera", "nav", "--target", "block", "--json")
    assert status == 0
    assert 0.0 < document["advised_s"] <= document["max_unsaturated_s"]
    assert keys(document) == documented("simgl exposure")


def test_assess_of_one_epoch_a_trajectory_and_a_sweep(
    printed: Any, scene: Path, tmp_path: Path
) -> None:
    document, status = printed("assess", scene, "--json")
    assert status == 0
    assert document["range_m"] == pytest.approx(20.0)
    assert keys(document) == documented("simgl assess")
    span = ["--duration", 60, "--count", 2, "--out", tmp_path / "report"]
    required = tmp_path / "required.toml"
    required.write_text(scene.read_text() + "\n[requirements]\nmax_range_m = 30.0\n")
    trajectory, status = printed("assess", required, *span, "--json")
    assert status == 0
    assert len(trajectory["rows"]) == 2
    row = {key.removeprefix("rows.") for key in keys(trajectory) if key.startswith("rows.")}
    assert row == documented("simgl assess") - {"scenario", "camera", "target"}
    summary = {key for key in keys(trajectory) if not key.startswith(("rows.", "shares."))}
    assert summary == documented("simgl assess --out")
    axis = ["--sweep", "f_number=2,4", "--out", tmp_path / "sweep"]
    sweep, status = printed("assess", scene, *axis, "--json")
    assert status == 0
    assert [row["sweep_f_number"] for row in sweep["rows"]] == [2.0, 4.0]


def test_camera_test(printed: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from simgl.assess import emva1288

    quick = partial(emva1288.measure_camera, levels=12, repeats=2)
    monkeypatch.setattr(emva1288, "measure_camera", quick)
    document, _ = printed("camera", "test", "mt9m034", "--json")
    assert {q["name"] for q in document["quantities"]} >= {"gain K", "dark noise"}
    assert keys(document) == documented("simgl camera test")
    assert document["passed"] == all(quantity["passed"] for quantity in document["quantities"])


@pytest.mark.parametrize(
    "command",
    [
        ["exposure", "absent.toml", "--camera", "nav", "--target", "block"],
        ["assess", "absent.toml"],
        ["camera", "test", "absent"],
        ["model", "check", "absent"],
    ],
)
def test_errors_stay_one_line_on_stderr(
    command: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["simgl", *command, "--json"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    out, err = capsys.readouterr()
    assert ended.value.code == 2
    assert out == ""
    assert err.startswith("simgl: ")
    assert err.count("\n") == 1
