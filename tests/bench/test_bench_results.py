"""What follows from the benchmark's numbers: goals, comparisons, the page, failures."""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

from simgl.bench import goals
from simgl.bench.bench_page import write_bench_page
from simgl.bench.bench_tables import all_tables, factor_text
from simgl.bench.child_process import ChildError, seconds_of
from simgl.bench.comparison import compare, different_machine, slower_than
from simgl.bench.frame_times import frame_statistics, round_medians_ms
from simgl.bench.peers import run_peers
from simgl.bench.peers.run_peers import image_difference, time_peers
from simgl.bench.results import (
    ImageDifference,
    Memory,
    PeerResult,
    Results,
    SceneResult,
    StartUp,
    read_results,
)
from simgl.commands.command_line import say_rich
from simgl.errors import ConfigError
from simgl.progress import silent

RECORDS = Path(__file__).parents[2] / "benchmarks"
LLVMPIPE = "llvmpipe (LLVM 15.0.6, 256 bits), 4.5"


def scene(
    name: str = "source_600",
    *,
    p50: float = 100.0,
    rounds: tuple[float, ...] = (100.0, 101.0, 99.0),
    bridge: bool = False,
    **passes: float,
) -> SceneResult:
    """Frames 0.1 s apart around a median [ms]; passes that vary as the frames do."""
    return SceneResult(
        name=name,
        width=600,
        height=600,
        triangles=12,
        frames=60,
        step_s=0.1,
        frame_ms=frame_statistics([1e-3 * p50] * 99 + [2e-3 * p50]),
        through_bridge=bridge,
        passes_ms=passes,
        round_p50_ms=list(rounds),
        round_passes_ms={name: [ms * r / rounds[0] for r in rounds] for name, ms in passes.items()},
        first_frame_s=2.5,
        memory_mb=Memory(peak=300.0, steady=250.0),
    )


def peer(name: str, seconds: float) -> PeerResult:
    return PeerResult(name=name, version="1", width=600, height=600, frames=1, seconds=seconds)


def results(*scenes: SceneResult, renderer: str = LLVMPIPE, **more: object) -> Results:
    base = Results(machine="a", renderer=renderer, version="0", scenes=list(scenes), tables=[])
    return msgspec.structs.replace(base, **more)


def by_name(lines: list[goals.Goal], start: str) -> goals.Goal:
    return next(goal for goal in lines if goal.name.startswith(start))


def test_percentiles_of_a_hundred_frames() -> None:
    times = frame_statistics([0.001 * i for i in range(1, 102)])
    assert (times.p50, times.p95, times.p99, times.worst, times.mean) == (51, 96, 100, 101, 51)
    assert times.steadiness == pytest.approx(100 / 51)


def test_rounds_are_consecutive_thirds() -> None:
    assert round_medians_ms([0.001] * 4 + [0.002] * 4 + [0.004] * 4) == [1.0, 2.0, 4.0]
    assert round_medians_ms([0.003]) == [3.0]


def test_a_goal_holds_times_the_machines_factor() -> None:
    """f = 0.15 / 0.06 = 2.5: 45 ms become 112.5; 180 ms are 1.6 of that."""
    lines = goals.all_goals(results(scene("earth_1280", p50=180.0), peers=[peer("pyrender", 0.15)]))
    line = by_name(lines, "earth_1280")
    assert line.allowed == pytest.approx(112.5)
    assert line.value == 180.0
    assert line.ratio == pytest.approx(1.6)
    assert line.met is False


def test_the_factor_is_the_median_of_processes_before_and_after_the_scenes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """0.05 and 0.07 s before, 0.054, 0.069 and 0.06 after: f = 0.06 / 0.06, 0.83 to 1.17."""
    seconds = {600: iter([0.05, 0.07, 0.054, 0.069, 0.06]), 1280: iter([0.12])}

    def result(_: str, one: run_peers.Peer, size: tuple[int, int], __: Path) -> PeerResult:
        found = peer(one.name, next(seconds[size[0]]))
        return msgspec.structs.replace(found, width=size[0], height=size[1])

    monkeypatch.setattr(run_peers, "seconds_of", lambda *_: 1.0)
    monkeypatch.setattr(run_peers, "PEERS", run_peers.PEERS[:1])
    monkeypatch.setattr(run_peers, "_result", result)
    before = run_peers.time_before_scenes("python", silent)
    assert before == [0.05, 0.07]
    peers, absent = time_peers("python", silent, before)
    assert absent == {}
    given = results(scene("earth_1280", p50=46.0), peers=peers)
    assert goals.machine_factor(given) == pytest.approx(1.0)
    assert goals.factor_spread(given) == pytest.approx((0.05 / 0.06, 0.07 / 0.06))
    assert factor_text(given) == "f = 1.00 (0.83 to 1.17 by process)"
    # Met is by f alone: 46 ms of 45.
    assert by_name(goals.all_goals(given), "earth_1280").met is False
    # The larger image says nothing of f.
    assert [one.process_seconds for one in peers] == [[0.05, 0.07, 0.054, 0.069, 0.06], []]


def test_without_pyrender_times_have_no_verdict_but_ratios_have() -> None:
    lines = goals.all_goals(
        results(scene(), scene("four_cameras", p50=250.0), scene("one_of_four", p50=100.0))
    )
    assert by_name(lines, "earth_1280").met is None
    four = by_name(lines, "four_cameras over")
    assert (four.value, four.met) == (2.5, True)


def test_more_is_better_for_the_path_tracer() -> None:
    """45 s over 100 ms is 450 times; 500 are the goal."""
    line = by_name(goals.all_goals(results(scene(), peers=[peer("cycles", 45.0)])), "Cycles")
    assert line.value == pytest.approx(450.0)
    assert line.ratio == pytest.approx(500 / 450)


def test_docking_takes_the_slower_range_and_needs_both() -> None:
    one = results(scene("docking_20m", p50=70.0))
    assert by_name(goals.all_goals(one), "docking_20m and _3m, larger").value is None
    both = results(scene("docking_20m", p50=70.0), scene("docking_3m", p50=90.0))
    assert by_name(goals.all_goals(both), "docking_20m and _3m, larger").value == 90.0
    assert by_name(goals.all_goals(both), "docking_20m and _3m, worst").value == 180.0


def test_a_gpu_has_goals_of_its_own() -> None:
    lines = goals.all_goals(results(scene("reference_1280", p50=4.0), renderer="NVIDIA H100"))
    assert by_name(lines, "everything").met is True
    assert len(lines) == 3


def test_a_slower_scene_is_marked_beyond_the_noise_of_both_runs() -> None:
    """Both spreads are 101/99: 4.1 % together, below the floor of 5 %."""
    before = results(scene(p50=100.0, surface=50.0, shadow=10.0))
    now = results(scene(p50=112.0, surface=60.0, shadow=10.2))
    frame, surface, shadow = compare(now, before)
    assert frame.noise == pytest.approx(0.05)
    assert (frame.slower, surface.slower, shadow.slower) == (True, True, False)
    assert surface.ratio == pytest.approx(1.2)
    assert slower_than(compare(now, before), 10.0) == [frame]
    assert slower_than(compare(now, before), 15.0) == []


def test_a_noisy_machine_hides_a_slower_scene() -> None:
    """Rounds from 90 to 110 in one run: 22 % and 2 % are 25 % together."""
    before = results(scene(p50=100.0, rounds=(90.0, 100.0, 110.0)))
    (frame,) = compare(results(scene(p50=120.0)), before)
    assert frame.noise == pytest.approx(110 / 90 * 101 / 99 - 1.0)
    assert not frame.slower
    assert slower_than([frame], 10.0) == []


def test_only_equal_frames_are_compared() -> None:
    before = results(scene(), scene("earth_1280"))
    now = results(
        msgspec.structs.replace(scene(), step_s=1.0),
        msgspec.structs.replace(scene("earth_1280"), width=1280),
        scene(bridge=True),
    )
    assert compare(now, before) == []


def test_results_of_an_earlier_version_can_be_compared() -> None:
    record = read_results(RECORDS / "2026-11-22-llvmpipe-2-cores.json")
    changes = compare(record, record)
    assert {change.ratio for change in changes} == {1.0}
    # They have no rounds.
    assert {change.noise for change in changes} == {0.1}
    assert different_machine(record, record) == ""
    assert "Intel" in different_machine(results(), record)


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.json"
    path.write_text('{"scenes": 3}')
    with pytest.raises(ConfigError, match=r"other\.json: results of simgl bench"):
        read_results(path)


def test_json_reads_back(tmp_path: Path) -> None:
    given = results(scene(surface=3.0), peers=[peer("pyrender", 0.1)], start_up=StartUp(warm=2.0))
    path = tmp_path / "bench.json"
    path.write_bytes(goals.results_document(given))
    assert read_results(path) == given


def test_images_differ_by_nothing_but_their_scale() -> None:
    image = np.random.default_rng(7).uniform(0.1, 2.0, (40, 40))
    image[:, :10] = 0.0
    assert image_difference(3.0 * image, image) == ImageDifference(rms=0.0, correlation=1.0)
    other = image_difference(image[:, ::-1], image)
    assert other.rms > 0.2
    assert abs(other.correlation) < 0.5


def test_absent_renderers_are_named_with_their_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """An interpreter that has nothing: this one, which cannot find a module of that name."""
    monkeypatch.setattr("simgl.bench.peers.run_peers.seconds_of", _only_the_scene)
    measured, absent = time_peers("python-of-peers", silent)
    assert measured == []
    assert absent == {
        name: f"python-of-peers -m pip install {package}"
        for name, package in {"pyrender": "pyrender", "mitsuba": "mitsuba", "cycles": "bpy"}.items()
    }


def _only_the_scene(command: list[str], limit_s: float) -> float:
    assert limit_s > 0.0
    if "-m" in command:
        return 1.0
    raise ChildError("ended with status 1: no such module")


def test_a_child_that_fails_says_why() -> None:
    code = "import sys; sys.exit('one' + chr(10) + 'two')"
    with pytest.raises(ChildError, match=r"ended with status 1: one / two"):
        seconds_of([sys.executable, "-c", code], 60.0)
    with pytest.raises(ChildError, match="was ended by SIGKILL"):
        seconds_of([sys.executable, "-c", "import os; os.kill(os.getpid(), 9)"], 60.0)
    with pytest.raises(ChildError, match="did not end within 0 s"):
        seconds_of([sys.executable, "-c", "import time; time.sleep(60)"], 0.3)
    with pytest.raises(ChildError, match="No such file"):
        seconds_of(["/nowhere/python"], 60.0)


def test_what_a_child_said_does_not_tell_where_simgl_lies() -> None:
    code = "import simgl.cli; raise SystemExit(simgl.cli.__file__)"
    with pytest.raises(ChildError) as raised:
        seconds_of([sys.executable, "-c", code], 60.0)
    assert str(raised.value) == "ended with status 1: simgl/cli.py"


def test_page_and_tables_show_what_was_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = results(
        scene(surface=60.0, shadow=20.0),
        scene(bridge=True),
        peers=[peer("pyrender", 0.15)],
        absent_peers={"cycles": "python -m pip install bpy"},
        failed={"bay_1280": "was ended by SIGSEGV"},
        start_up=StartUp(help=0.4, warm=5.0),
    )
    lines, changes = goals.all_goals(given), compare(given, given)
    path = write_bench_page(tmp_path / "index.html", given, lines, changes, "b before, a now")
    page = path.read_text()
    say_rich(*all_tables(given, lines, changes, "b before, a now"))
    text = capsys.readouterr().out
    for shown in (page, text):
        assert "SIGSEGV" in shown
        assert "pip install bpy" in shown
        assert "2.50" in shown  # f
        assert "b before, a now" in shown
    assert page.count("data:image/svg+xml;base64,") == 3
    # Whatever is wider than a phone scrolls by itself.
    assert page.count('<div class="wide">') == 4 + 3
    assert "<script" not in page
