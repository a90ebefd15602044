"""The benchmark: its report has the promised form, and its scenes are what they say."""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import moderngl
import numpy as np
import pytest

from benchmarks.gpu.__main__ import SCENES as ON_A_GPU
from simgl.arrays import Image8
from simgl.bench.earth_tables import earth_tables
from simgl.bench.frame_times import WARM_UP, FrameLoop, epochs_of
from simgl.bench.scenes import SETS, bench_scenes, scene_files, set_of_scenes
from simgl.errors import ConfigError
from simgl.passes.background.cloud_map import weather_map
from simgl.scenario.loader import load_scenario
from simgl.scene.earth import Clouds, Earth
from simgl.scene.noise_projection import chart
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from tests.patience import run_to_end


def test_the_json_report_has_the_promised_form(tmp_path: Path) -> None:
    """Of the scene that costs least, with the page beside it."""
    out, page = tmp_path / "bench.json", tmp_path / "page" / "index.html"
    command = [sys.executable, "-m", "simgl", "bench", "--scene", "stars_600", "--frames", "5"]
    command += ["--step", "0.1", "--seconds", "1"]
    run_to_end([*command, "--json", str(out), "--report", str(page.parent)])
    report = json.loads(out.read_text())
    assert set(report) == {
        "machine", "renderer", "version", "scenes", "tables", "start_up", "peers", "absent_peers",
        "failed", "f", "f_spread", "goals"
    }  # fmt: skip
    assert report["failed"] == {}
    assert report["f"] is None
    assert [goal["name"] for goal in report["goals"]][:1] == ["start to first DN, warm caches"]
    assert report["tables"] == []
    for scene in report["scenes"]:
        assert scene["name"] == "stars_600"
        assert (scene["width"], scene["height"]) == (600, 600)
        assert (scene["frames"], scene["captures"], scene["step_s"]) == (5, 1, 0.1)
        times = scene["frame_ms"]
        assert 0.0 < times["p50"] <= times["p95"] <= times["p99"] <= times["worst"]
        assert times["p50"] / 5.0 <= times["mean"] <= times["worst"]
        assert len(scene["round_p50_ms"]) == 3
    here, there = report["scenes"]
    assert (here["through_bridge"], there["through_bridge"]) == (False, True)
    assert {"celestial", "exposure", "detector", "read"} <= set(here["passes_ms"])
    # The passes are what a frame consists of, besides some milliseconds of Python.
    assert sum(here["passes_ms"].values()) < 3.0 * here["frame_ms"]["p99"]
    # Python and OpenGL alone take 50 MB; the process began before its first frame.
    assert 50.0 < here["memory_mb"]["steady"] <= here["memory_mb"]["peak"] < 4000.0
    assert here["first_frame_s"] > here["frame_ms"]["p50"] / 1e3
    assert "<h2>Frames</h2>" in page.read_text()


def test_the_tables_of_the_earth_have_their_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Air is made; weather and noise, which take longer, may come from the cache."""

    def weather(ctx: moderngl.Context, clouds: Clouds, _: object, ground: Any) -> Image8:
        return weather_map(ctx, clouds, Earth().maps, ground)[0]

    monkeypatch.setattr("simgl.bench.earth_tables.weather_codes", weather)
    monkeypatch.setattr("simgl.bench.earth_tables.make_chart", chart)
    made = {table.name: table for table in earth_tables()}
    # 10 tables of air: 256 x 128, six of 96 x 32, two of those by 24 looks; 16 bytes a texel.
    assert made["air, all views"].bytes == 16 * (256 * 128 + 96 * 32 * (6 + 2 * 24))
    assert made["weather"].bytes == 4096 * 2048 * 4 * 4 // 3
    assert made["air, all views"].seconds > 0.1
    # With their mipmaps 78 MB of land, 156 of form, 175 of shores, 11 of lamps.
    assert made["maps"].bytes == pytest.approx(419.4e6, abs=0.1e6)
    assert sum(table.bytes for table in made.values()) < 500e6


def test_the_source_case_is_what_it_says() -> None:
    scenario = load_scenario(scene_files()["source_600"])
    state = scenario.at(scenario.epoch_tai_ns)
    camera, target = state.cameras["observer"], state.bodies["space_rider"]
    distance = ((camera.position - target.pose.position) ** 2).sum() ** 0.5
    assert distance == pytest.approx(200.0, rel=1e-9)
    assert camera.camera.detector.width == camera.camera.detector.height == 600


def test_the_reference_scene_has_a_hundred_thousand_triangles_and_everything_else() -> None:
    scenario = load_scenario(scene_files()["reference_1280"])
    camera = scenario.cameras["observer"]
    triangles = sum(len(model.mesh.triangles) for model in scenario.models.values())
    assert triangles == pytest.approx(100_000, rel=0.02)
    assert (camera.detector.width, camera.detector.height) == (1280, 960)
    assert scenario.earth is not None
    assert scenario.earth.air is not None
    assert scenario.earth.clouds is not None
    assert scenario.stars is not None
    assert scenario.inter_reflection


def test_the_arm_moves_at_a_degree_a_second() -> None:
    scenario = load_scenario(scene_files()["arm_800"])
    laws, joints = scenario.joints["servicer"], scenario.models["servicer"].joints
    sunward = np.array([1.0, 0.0, 0.0])

    def shoulder(seconds: float) -> float:
        tai_ns = scenario.epoch_tai_ns + round(seconds * 1e9)
        return float(np.degrees(laws.angles(joints, tai_ns, sunward, {})["arm_shoulder"]))

    # The longest run of the command's default: 65 frames 1 s apart.
    for seconds in (0.0, 12.3, 29.0, 64.0):
        assert abs(shoulder(seconds + 0.1) - shoulder(seconds)) == pytest.approx(0.1, rel=1e-6)


def test_docking_ranges_are_from_the_board() -> None:
    for name, distance in (("docking_20m", 20.0), ("docking_3m", 3.0)):
        scenario = load_scenario(scene_files()[name])
        state = scenario.at(scenario.epoch_tai_ns)
        between = state.cameras["navcam"].position - state.bodies["board"].pose.position
        # The board is 3 cm deep, and its origin is not the middle of its markers.
        assert np.linalg.norm(between) == pytest.approx(distance, abs=0.2)


def test_each_state_of_the_four_cameras_is_captured_by_all_or_in_turn() -> None:
    scenes, names = bench_scenes(), ["a", "b", "c", "d"]
    assert list(scenes["four_cameras"].cameras(names, 5)) == names
    assert [list(scenes["one_of_four"].cameras(names, i)) for i in (0, 3, 5)] == [
        ["a"],
        ["d"],
        ["b"],
    ]
    assert list(scenes["source_600"].cameras(names, 5)) == ["a"]


def test_sets_hold_shipped_scenes() -> None:
    assert {t.scene for s in SETS.values() for t in s.scenes} <= set(bench_scenes())


def test_the_gpu_benchmark_fills_the_caches_of_all_its_scenes() -> None:
    assert {timed.scene for timed in SETS["gpu"].scenes} == set(ON_A_GPU)


def test_a_step_holds_for_every_scene_of_a_set() -> None:
    goals = SETS["goals"]
    steps = goals.with_step(0.5).scenes
    assert {timed.step_s for timed in steps} == {0.5}
    assert {timed.scene for timed in steps} == {timed.scene for timed in goals.scenes}


def test_an_unknown_scene_is_refused() -> None:
    with pytest.raises(ConfigError, match=r'names no scene: "source"; did you mean "source_600"'):
        set_of_scenes(["source"])


def test_no_epoch_is_captured_twice_for_a_second_capture_would_find_its_work_done() -> None:
    scenario = load_scenario(bench_scenes()["stars_600"].path)
    captured: list[int] = []
    timer = SimpleNamespace(enabled=False, seconds={})

    def captures(state: SceneState, _: Mapping[str, Collection[Product]]) -> None:
        captured.append(state.tai_ns)
        timer.seconds["stars"] = 0.5

    epochs = epochs_of(scenario, 7, 0.1)
    simulator = cast(Simulator, SimpleNamespace(scenario=scenario, timer=timer, captures=captures))
    loop = FrameLoop(simulator, lambda names, _: names, epochs, limit_s=100.0)
    assert loop.capture_next() == 1
    loop.warm_up()
    assert len(captured) == WARM_UP
    assert len(loop.frame_seconds(4)) == 4
    assert loop.pass_seconds(3) == {"stars": [0.5] * 3}
    assert captured == epochs
