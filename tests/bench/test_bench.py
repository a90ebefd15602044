"""The benchmark: its report has the promised form, and its scenes are what they say."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from simgl.bench import earth_tables, run, scene_files
from simgl.errors import ConfigError
from simgl.scenario.loader import load_scenario
from tests.patience import run_to_end


def test_the_json_report_has_the_promised_form(tmp_path: Path) -> None:
    out = tmp_path / "bench.json"
    command = [sys.executable, "-m", "simgl", "bench", "--scene", "source_600", "--frames", "5"]
    command += ["--step", "0.1"]
    run_to_end([*command, "--json", str(out)])
    report = json.loads(out.read_text())
    assert set(report) == {"machine", "renderer", "version", "scenes", "tables"}
    assert report["tables"] == []
    for scene in report["scenes"]:
        assert scene["name"] == "source_600"
        assert (scene["width"], scene["height"]) == (600, 600)
        assert scene["triangles"] > 50_000
        assert scene["frames"] == 5
        assert scene["step_s"] == 0.1
        times = scene["frame_ms"]
        assert 0.0 < times["p50"] <= times["p95"] <= times["p99"] <= times["worst"]
        assert times["p50"] / 5.0 <= times["mean"] <= times["worst"]
    here, there = report["scenes"]
    assert (here["through_bridge"], there["through_bridge"]) == (False, True)
    passes = {"probe", "interreflection", "lamp_shadow"} | {
        "air",
        "planet",
        "shadow",
        "geometry",
        "surface",
        "resolve",
        "exposure",
        "detector",
        "read",
    }
    assert set(here["passes_ms"]) == passes
    # The passes are what a frame consists of, besides some milliseconds of Python.
    assert sum(here["passes_ms"].values()) < 3.0 * here["frame_ms"]["p99"]


def test_the_tables_of_the_earth_have_their_size() -> None:
    made = {table.name: table for table in earth_tables()}
    # 10 tables of air: 256 x 128, six of 96 x 32, two of those by 24 looks; 16 bytes a texel.
    assert made["air, all views"].bytes == 16 * (256 * 128 + 96 * 32 * (6 + 2 * 24))
    assert made["weather"].bytes == 4096 * 2048 * 4 * 4 // 3
    assert made["air, all views"].seconds > 0.1
    assert sum(table.bytes for table in made.values()) < 200e6


def test_the_source_case_is_what_it_says() -> None:
    scenario = load_scenario(scene_files()["source_600"])
    state = scenario.at(scenario.epoch_tai_ns)
    camera, target = state.cameras["observer"], state.bodies["space_rider"]
    distance = ((camera.position - target.pose.position) ** 2).sum() ** 0.5
    assert distance == pytest.approx(200.0, rel=1e-9)
    assert camera.camera.detector.width == camera.camera.detector.height == 600


def test_an_unknown_scene_is_refused() -> None:
    with pytest.raises(ConfigError, match=r'names no scene: "source"; did you mean "source_600"'):
        run(scenes=["source"], frames=5)
