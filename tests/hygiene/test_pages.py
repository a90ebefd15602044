"""What the pages show exists: links, files, commands with their options, code, frame times."""

from __future__ import annotations

import ast
import importlib.util
import json
import re
import shlex
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import msgspec
import pytest
import typer

from benchmarks.flight.__main__ import HEAD as FLIGHT_HEAD
from benchmarks.truth.page import Record
from benchmarks.truth.page import page as truth_page
from simgl.commands.application import app
from tests.hygiene.test_layers import LAYERS

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / "examples" / "README.md",
    ROOT / "shaders" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
RECORDS = ROOT / "benchmarks"


def for_pages(pages: list[Path]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("page", pages, ids=lambda p: str(p.relative_to(ROOT)))


every_page = for_pages(PAGES)


def blocks(page: Path) -> Iterator[tuple[str, str]]:
    """Language and text of the page's code blocks."""
    for match in re.finditer(r"^```(\w*)\n(.*?)^```", page.read_text(), re.M | re.S):
        yield match[1], match[2]


def command_lines(page: Path) -> Iterator[list[str]]:
    """Words of what the page says to type, in blocks and within lines."""
    for language, text in blocks(page):
        if language in ("", "sh"):
            for line in text.replace("\\\n", " ").splitlines():
                for part in re.sub(r"^\$ ", "", line).split(";"):
                    yield shlex.split(part, comments=True) if "'" not in part else []
    without = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    for match in re.finditer(r"`((?:\./run )?simgl [a-z][^`]*|python -m [^`]*)`", without):
        yield match[1].replace("\n", " ").split()


def headings(page: Path) -> set[str]:
    """Anchors of a page, as GitHub and MyST make them."""
    lines = re.findall(r"^#+ (.*)$", page.read_text(), re.M)
    return {re.sub(r"[^\w -]", "", line.lower()).strip().replace(" ", "-") for line in lines}


@every_page
def test_every_link_leads_somewhere(page: Path) -> None:
    for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", page.read_text()):
        if target.startswith("http"):
            continue
        there = (page.parent / target).resolve() if target else page
        assert there.exists(), target
        if anchor:
            assert anchor in headings(there), f"{target}#{anchor}"


@every_page
def test_every_file_that_is_named_exists(page: Path) -> None:
    folders = "simgl|bridge|shaders|models|tools|benchmarks|examples|tests|docs"
    named = re.findall(rf"`((?:{folders})/[\w./-]+\.\w+)`", page.read_text())
    assert not [name for name in named if "NAME" not in name and not (ROOT / name).exists()]


@every_page
def test_every_command_has_the_options_that_are_shown(page: Path) -> None:
    for words in command_lines(page):
        if words[:2] == ["./run", "simgl"]:
            words = words[1:]
        if words[:1] == ["simgl"]:
            _check_simgl(words[1:])
        elif words[:2] == ["python", "-m"] and len(words) > 2:
            assert importlib.util.find_spec(words[2]) is not None, words


@cache
def simgl_commands() -> dict[str, tuple[set[str], set[str]]]:
    """Options and those that must be given by command, "camera test" for one of a group."""
    found = {}
    apps = [("", app)]
    for entry in entry_points(group="simgl.commands"):
        further = typer.Typer()
        further.command()(entry.load())
        apps.append((entry.name, further))
    waiting: list[tuple[str, Any]] = [(name, typer.main.get_command(a)) for name, a in apps]
    while waiting:
        name, command = waiting.pop()
        inner = getattr(command, "commands", {})
        waiting += [(f"{name} {word}".strip(), c) for word, c in inner.items()]
        if not inner:
            options = {o for p in command.params for o in (*p.opts, *p.secondary_opts)}
            needed = {p.opts[0] for p in command.params if p.required and p.opts[0][:2] == "--"}
            found[name] = options, needed
    return found


def _check_simgl(words: list[str]) -> None:
    name = " ".join(words[:2]) if " ".join(words[:2]) in simgl_commands() else words[0]
    assert name in simgl_commands(), f"simgl has no command {name}: {words}"
    options, needed = simgl_commands()[name]
    # Naming an option is no line to type; naming a scenario is.
    if any(not w.startswith("--") for w in words[len(name.split()) :]):
        assert needed <= set(words), f"{words} lack {needed - set(words)}"
    # What follows a bare -- is another program's.
    for word in words[: words.index("--")] if "--" in words else words:
        if word.startswith("--"):
            assert word in options | {"--help"}, f"{name} has no {word}"
        elif word.startswith("examples/"):
            assert (ROOT / word).exists(), word


@every_page
def test_code_that_is_shown_can_be_read(page: Path) -> None:
    for language, text in blocks(page):
        if language == "python":
            ast.parse(text)
        elif language == "toml":
            tomllib.loads(text)


def test_the_architecture_page_lists_the_layers() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text()
    table = page[page.index("| layer |") : page.index("Three more rules")]
    listed: list[set[str]] = []
    for number, names in re.findall(r"^\| (\d*) ?\| (`[^|]*) \|", table, re.M):
        if number:
            assert int(number) == len(listed) + 1
            listed.append(set())
        listed[-1] |= {name.rstrip("/") for name in re.findall(r"`([^`]*)`", names)}
    # What begins a program or names the interface is no package of its own.
    expected = [set(layer) - {"", "__main__"} for layer in LAYERS]
    assert listed == [layer for layer in expected if layer]


def test_the_paths_of_a_pose_and_a_pixel_name_what_exists() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text()
    paths = page[page.index("## From a pose to a matrix") : page.index("## Where to add what")]
    named = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]*)`", paths))))
    folders = ("simgl", "bridge/simgl_bridge", "shaders")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.*")]
    source = [path.read_text() for path in files if path.suffix in (".py", ".glsl", ".frag")]
    exists = {word for text in source for word in re.findall(r"\w+", text)}
    exists |= {word for path in files for word in (path.stem, path.suffix[1:], path.parent.name)}
    assert named <= exists, named - exists


def test_the_tutorial_has_the_first_example_of_the_readme() -> None:
    first, *_ = (text for language, text in blocks(ROOT / "README.md") if language == "python")
    assert ("python", first) in list(blocks(ROOT / "docs" / "tutorial.md"))


def test_the_page_of_truth_tables_is_that_of_the_record() -> None:
    record = msgspec.json.decode((RECORDS / "truth" / "truth.json").read_bytes(), type=Record)
    assert (ROOT / "docs" / "truth.md").read_text() == truth_page(record)


def test_the_frame_times_of_the_readme_are_those_of_the_record() -> None:
    record = json.loads((RECORDS / "2026-11-28-goals-machine-h-4.json").read_text())
    plain = {
        (p["width"], p["height"]): p["seconds"] for p in record["peers"] if p["name"] == "pyrender"
    }
    rows = re.findall(
        r"^\| ([^|]*) \| (\d+) x (\d+) \| ([\d,]+) \| (\d+) ms \| (\d+) ms \| ([\d.]+|-) \|$",
        (ROOT / "README.md").read_text(),
        re.M,
    )
    names = "source_600 source_600 source_600 earth_1280 camera_1280 colour_1280"
    names += " docking_20m docking_3m arm_800 four_cameras bay_1280"
    for row, name in zip(rows, names.split(), strict=True):
        scene = next(
            s
            for s in record["scenes"]
            if s["name"] == name
            and s["through_bridge"] == ("bridge" in row[0])
            and s["step_s"] == (1.0 if "1 s apart" in row[0] else 0.1)
        )
        size = scene["width"], scene["height"]
        assert (int(row[1]), int(row[2])) == size
        assert int(row[3].replace(",", "")) == scene["triangles"]
        # Half of the last digit.
        assert float(row[4]) == pytest.approx(scene["frame_ms"]["p50"], abs=0.5), row
        assert float(row[5]) == pytest.approx(scene["frame_ms"]["p99"], abs=0.5), row
        assert (row[6] == "-") == (size not in plain)
        if row[6] != "-":
            frames = scene["frame_ms"]["p50"] / 1e3 / plain[size]
            assert float(row[6]) == pytest.approx(frames, abs=0.005), row
    met = sum(goal["ratio"] <= 1.0 for goal in record["goals"])
    assert f"{met} of {len(record['goals'])} lines are met" in (ROOT / "README.md").read_text()


def test_the_page_of_flight_data_is_that_of_the_record() -> None:
    record = msgspec.json.decode((RECORDS / "flight" / "flight.json").read_bytes(), type=Record)
    assert (ROOT / "docs" / "flight_truth.md").read_text() == truth_page(record, FLIGHT_HEAD)
