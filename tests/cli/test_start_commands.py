"""A project to begin with, and copies of the shipped examples: they overwrite nothing.

The tutorial runs the project (tests/docs/test_tutorial.py).
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from simgl import load_scenario
from simgl.commands.application import run
from simgl.errors import OutputError
from simgl.shipped_examples import copy_example, new_project, shipped_examples

ROOT = Path(__file__).parents[2]
START = ROOT / "examples" / "start"
OPTIONAL = re.compile(r"^# (?=\[|\w+ = )", re.M)


def simgl(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Exit status of a command in this process."""
    monkeypatch.setattr(sys, "argv", ["simgl", *arguments])
    with pytest.raises(SystemExit) as end:
        run()
    assert isinstance(end.value.code, int)
    return end.value.code


def test_a_project_has_its_three_files_and_says_how_to_run_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert simgl(monkeypatch, "new", "my first") == 0
    names = ["camera.toml", "loop.py", "scenario.toml"]
    assert sorted(path.name for path in Path("my first").iterdir()) == names
    assert capsys.readouterr().out.splitlines() == [
        *(f"my first/{name}" for name in names),
        "",
        "simgl render 'my first/scenario.toml' --out 'out/my first'",
        "python 'my first/loop.py'",
    ]


@pytest.mark.parametrize("name", ["", ".", "..", "/", "taken", "taken/in", "a\nb", "a" * 300])
def test_a_bad_name_gives_one_line_and_no_file(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("mine")
    assert simgl(monkeypatch, "new", name) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"simgl: .+\n", said.err)
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
    assert Path("taken").read_text() == "mine"


def test_a_project_that_is_there_stays_as_it_is(tmp_path: Path) -> None:
    project = tmp_path / "first"
    new_project(project)
    (project / "camera.toml").write_text("mine")
    before = {path: path.read_bytes() for path in project.iterdir()}
    with pytest.raises(OutputError, match="is there already; nothing was written"):
        new_project(project)
    assert {path: path.read_bytes() for path in project.iterdir()} == before


@pytest.mark.parametrize("name", ["scenario.toml", "camera.toml"])
def test_every_key_of_a_project_has_a_comment(name: str) -> None:
    lines = (START / name).read_text().splitlines()
    keys = [line for line in lines if re.match(r"(# )?\w+ = ", line)]
    assert len(keys) > 15
    # Of a model the reader knows more after the first one.
    without = [line for line in keys if "#" not in line[2:]]
    assert without == (['model = "cubesat_12u"'] if name == "scenario.toml" else [])


def test_optional_keys_may_be_taken_in(tmp_path: Path) -> None:
    # What only a mesh file has, and what needs colour filters.
    needs_more = r"unit|up_axis|mosaic"
    for path in START.glob("*.toml"):
        text = "\n".join(
            line
            for line in OPTIONAL.sub("", path.read_text()).splitlines()
            if not re.match(rf"({needs_more}) = ", line)
        )
        (tmp_path / path.name).write_text(text)
    scenario = load_scenario(tmp_path / "scenario.toml")
    assert scenario.cameras["navcam"].detector.pattern.hot_pixels == 0.0001


def test_every_example_has_a_name_a_title_and_the_files_that_it_reads(tmp_path: Path) -> None:
    examples = shipped_examples()
    assert {"approach", "short/radiance", "trajectories/files", "closed_loop"} <= set(examples)
    for name, example in examples.items():
        assert 10 < len(example.title) < 200, name
        folder = tmp_path / name
        copied = copy_example(name, folder)
        assert {p.relative_to(folder / "examples") for p in copied} == set(example.files)
    files = {file.as_posix() for file in examples["short/trajectories"].files}
    assert "trajectories/chaser_ric.csv" in files
    for name in ("trajectories/files", "trajectories/tle", "bridge/box"):
        load_scenario(tmp_path / name / "examples" / f"{name}.toml")


def test_every_example_that_the_list_of_examples_names_is_shipped_or_makes_pages() -> None:
    listed = {path for path, *_ in re.findall(r"`([\w/]+)\.(toml|py)`", README.read_text())}
    shipped = set(shipped_examples())
    pages = {"gallery", "lighting_study", "orbit_film", "thermal_film"}
    for name in listed - shipped:
        assert name.split("/")[0] in pages, name


README = ROOT / "examples" / "README.md"


def test_a_copied_example_runs_from_its_folder(tmp_path: Path) -> None:
    copy_example("short/light_along_orbit", tmp_path)
    command = [sys.executable, *shipped_examples()["short/light_along_orbit"].command.split()[1:]]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "sunlight" in done.stdout


def test_a_copy_keeps_what_is_equal_and_is_refused_by_what_is_not(tmp_path: Path) -> None:
    (approach,) = copy_example("approach", tmp_path)
    copy_example("short/radiance", tmp_path)
    approach.write_text("mine")
    with pytest.raises(OutputError, match=r"approach\.toml: is there already with other content"):
        copy_example("short/truth", tmp_path)
    assert approach.read_text() == "mine"
    assert not (tmp_path / "examples" / "short" / "truth.py").exists()


def test_an_unknown_example_gives_one_line_with_the_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert simgl(monkeypatch, "example", "short/radianse") == 2
    said = capsys.readouterr().err
    assert said.startswith(
        'simgl: command line: NAME "short/radianse" is not shipped; did you mean'
    )
    assert said.count("\n") == 1


def test_examples_are_listed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert simgl(monkeypatch, "example") == 0
    said = capsys.readouterr().out
    for name in shipped_examples():
        assert name in said
