"""Identifiers use the field's words: see docs/glossary.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# Word of an identifier -> what to call it instead.
INSTEAD = {
    "alone": "serial",
    "anew": "again, or name what is made",
    "apart": "separate",
    "aside": "excluded, or name what it is",
    "beside": "alongside, folder_of, executor, ...",
    "course": "timeline, trajectory",
    "craft": "spacecraft",
    "crew": "workers, executor",
    "dial": "connect",
    "escort": "run with server",
    "exchange": "interreflection",
    "exchanging": "interreflecting",
    "found": "name what was found",
    "heavens": "celestial",
    "hired": "workers",
    "keeper": "supervisor",
    "kept": "cached, cache, retained",
    "knock": "probe, ping",
    "laboratory": "emva1288, camera test",
    "lattice": "sample grid, direction grid",
    "least": "min",
    "most": "max",
    "own": "name whose it is",
    "picture": "image",
    "pictures": "images",
    "sow": "set seed",
    "studio": "render session",
    "talk": "client protocol",
    "there": "name what is there",
    "told": "reported, progress",
    "whole": "full, complete, integer",
}

# Keys of scenario files, and names of others, that keep working as they are.
ALLOWED = {
    "land_picture",
    "night_picture",
    "picture",
    "water_picture",
}


def words(identifier: str) -> list[str]:
    """The words of an identifier in snake case or camel case."""
    return [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", identifier)]


def identifiers(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """What a file names itself: functions, classes, arguments, variables, attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr, node.lineno


FILES = sorted(
    path
    for folder in ("simgl", "bridge", "tools", "examples", "benchmarks")
    for path in (ROOT / folder).rglob("*.py")
)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_identifiers_use_the_fields_words(path: Path) -> None:
    name = [(w, 1) for w in words(path.stem)]
    named = identifiers(ast.parse(path.read_text(encoding="utf-8")))
    used = name + [(w, line) for i, line in named if i not in ALLOWED for w in words(i)]
    wrong = sorted({f"{line}: {w} ({INSTEAD[w]})" for w, line in used if w in INSTEAD})
    assert not wrong, wrong


GLSL = sorted(p for p in (ROOT / "shaders").rglob("*") if p.suffix in (".glsl", ".frag", ".vert"))


@pytest.mark.parametrize("path", GLSL, ids=lambda p: str(p.relative_to(ROOT)))
def test_shaders_use_the_fields_words(path: Path) -> None:
    code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
    wrong = sorted({w for i in re.findall(r"[A-Za-z_]\w*", code) for w in words(i) if w in INSTEAD})
    assert not wrong, wrong
