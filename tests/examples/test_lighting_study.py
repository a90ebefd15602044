"""The lighting study's cases show what the study says of them, and the command leaves its page."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import moderngl
import pytest

from examples.lighting_study.cases import CASES, Case
from examples.lighting_study.page import agrees, readings
from examples.lighting_study.shot import Shot, smaller, take
from simgl import Simulator, load_scenario
from simgl.assess.report import write_report
from simgl.assess.target_background import TargetBackground
from simgl.assess.timeline import timeline
from simgl.assess.trajectory_assessment import assignment, moments, run
from simgl.assess.verdict import Verdict
from simgl.workers.executors import run_serial
from tests.patience import run_to_end

ROOT = Path(__file__).parents[2]
STUDY = ROOT / "examples" / "lighting_study"
PAGE = ROOT / "docs" / "lighting_study.md"
# Pictures smaller by this; those of bay and azimuths are twice as wide. The back of the craft alone
# needs more than some ten pixels for a median.
SHRINK = {"bay": 10, "azimuths": 8, "craft_alone": 3}


@pytest.fixture(scope="module", params=list(dict.fromkeys(case.file for case in CASES)))
def simulator(module_gl: moderngl.Context, request: pytest.FixtureRequest) -> Iterator[Simulator]:
    scenario = smaller(load_scenario(STUDY / f"{request.param}.toml"), SHRINK.get(request.param, 5))
    with Simulator(scenario, module_gl) as simulator:
        yield simulator


def shots(simulator: Simulator) -> list[tuple[Case, Shot]]:
    """The pictures of a scenario's cases."""
    name = simulator.scenario.name
    return [(case, take(simulator, case.camera)) for case in CASES if case.file == name]


# What the study shows: behind the craft, and whether the picture can be used.
SEEN = {
    "eclipse": (TargetBackground.MIXED, Verdict.TOO_DARK),
    "too_bright": (TargetBackground.EARTH, Verdict.GOOD),
    "craft_alone": (TargetBackground.SPACE, Verdict.GOOD),
    "over_earth": (TargetBackground.EARTH, Verdict.GOOD),
    "bay": (TargetBackground.NONE, Verdict.GOOD),
    "azimuth_20": (TargetBackground.SPACE, Verdict.GOOD),
    "azimuth_28": (TargetBackground.MIXED, Verdict.GOOD),
    "azimuth_90": (TargetBackground.EARTH, Verdict.GOOD),
}
DIFFERS = {
    ("craft_alone", "tail cone"),
    ("too_bright", "background around the spacecraft"),
}


def test_each_case_shows_what_the_study_says_or_what_the_page_admits(simulator: Simulator) -> None:
    for case, shot in shots(simulator):
        if case.name in SEEN:
            assert (shot.assessment.backdrop, shot.verdict) == SEEN[case.name], case.name
        found = readings(case, shot)
        for reading in found:
            differs = (case.name, reading.number.what) in DIFFERS
            word = agrees(reading, found)
            assert (word == "no") == differs, (case.name, reading)


def test_each_case_makes_a_report(simulator: Simulator, tmp_path: Path) -> None:
    scenario = simulator.scenario
    work = assignment(scenario, None, None, [scenario.epoch_tai_ns])
    rows = run(work, run_serial(work, simulator), tmp_path)
    write_report(tmp_path / "report.html", work, rows, timeline(moments(rows)), simulator)
    assert len(rows) == 1
    assert rows[0]["verdict"] == SEEN.get(scenario.name, SEEN["azimuth_20"])[1].value
    assert b"<h1>Light on space_rider, as " in (tmp_path / "report.html").read_bytes()


def test_the_page_shows_a_picture_of_each_case_and_they_are_small() -> None:
    shown = set(re.findall(r"\(pictures/(study_[a-z_0-9]+)\.jpg\)", PAGE.read_text()))
    assert shown == {f"study_{case.name}" for case in CASES}
    sizes = [(PAGE.parent / "pictures" / f"{name}.jpg").stat().st_size for name in shown]
    assert sum(sizes) < 2_000_000


def test_a_folder_that_cannot_be_written_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    command = [sys.executable, "-m", "examples.lighting_study", "--out", str(tmp_path / "file")]
    done = run_to_end(command, cwd=ROOT, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("lighting_study: ")
