"""Small promises of the source: names, docstrings, sizes, and who may speak to the terminal."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import simgl
from tests.hygiene.source import PACKAGE, imports, modules, shipped_modules

LONGEST = 450  # lines

# Commands, servers and the window talk to the person who started them; everything else returns or
# raises.
SPEAKERS = {
    "simgl.cli_progress", "simgl.commands.application", "simgl.commands.command_line",
    "simgl.viewer.window_session", "simgl_bridge.server", "simgl_bridge.serving",
    "simgl_bridge.web_process",
}  # fmt: skip

# Modules whose import needs a display or starts the program.
_NOT_IMPORTED = {"simgl.__main__"}


def public_definitions(
    body: list[ast.stmt], prefix: str = ""
) -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    """Public functions, classes and methods with their dotted names."""
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield f"{prefix}{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from public_definitions(node.body, f"{prefix}{node.name}.")


def test_all_of_simgl_is_sorted_and_is_what_can_be_imported() -> None:
    assert simgl.__all__ == sorted(simgl.__all__)
    init = next(m for m in modules() if m.name == "simgl")
    named = {i.rpartition(".")[2] for i in imports(init) if i.startswith("simgl.")}
    assert set(simgl.__all__) == named | {"__version__"}
    for name in simgl.__all__:
        assert hasattr(simgl, name)


def test_a_modules_all_is_sorted_and_real() -> None:
    for module in shipped_modules():
        if "__all__" not in module.text or module.name in _NOT_IMPORTED:
            continue
        loaded = import_module(module.name)
        assert list(loaded.__all__) == sorted(loaded.__all__), module.name
        missing = [name for name in loaded.__all__ if not hasattr(loaded, name)]
        assert not missing, f"{module.name}.__all__"


def test_every_module_says_what_it_is() -> None:
    for module in shipped_modules():
        docstring = ast.get_docstring(module.tree)
        assert docstring, module.name
        first = docstring.splitlines()[0]
        assert first.endswith((".", "``.")), f"{module.name}: {first}"


def test_every_public_function_and_class_says_what_it_does() -> None:
    silent = [
        f"{module.name}: {name}"
        for module in shipped_modules()
        for name, node in public_definitions(module.tree.body)
        if not ast.get_docstring(node)
    ]
    assert not silent


def test_no_module_is_longer_than_a_few_pages() -> None:
    lengths = {m.name: m.text.count("\n") for m in shipped_modules()}
    assert not {name: lines for name, lines in lengths.items() if lines > LONGEST}


def test_only_what_a_person_started_prints() -> None:
    calls = [
        f"{module.name}:{node.lineno}"
        for module in shipped_modules()
        if module.name not in SPEAKERS
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "print"
    ]
    assert not calls


def test_no_except_is_bare_or_passes_in_silence() -> None:
    for module in shipped_modules():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ExceptHandler):
                place = f"{module.name}:{node.lineno}"
                assert node.type is not None, f"{place}: says no exception"
                quiet = all(isinstance(s, ast.Pass) for s in node.body)
                assert not quiet, f"{place}: passes over {ast.unparse(node.type)}"


def test_noise_never_takes_its_seed_from_the_clock() -> None:
    # Counter-based noise in shaders, a generator given as an argument elsewhere.
    unseeded = re.compile(r"default_rng\(\s*\)|np\.random\.(?!Generator|default_rng)")
    assert not [m.name for m in shipped_modules() if unseeded.search(m.text)]


@pytest.mark.parametrize("folder", ["shaders", "models"])
def test_data_folders_hold_no_python(folder: str) -> None:
    # The wheel's builder refuses an editable install otherwise.
    assert not list((PACKAGE.parent / folder).rglob("*.py"))


def test_no_left_over_marks() -> None:
    marks = re.compile(r"\b(TODO|FIXME|XXX|HACK)\b")
    root = PACKAGE.parent
    files: list[Path] = [m.path for m in shipped_modules()]
    files += [p for p in (root / "shaders").rglob("*") if p.is_file()]
    assert not [str(p.relative_to(root)) for p in files if marks.search(p.read_text("utf-8"))]


@pytest.mark.parametrize("name", ["leo.py", "opnav.py"])
def test_scripts_for_basilisks_own_python_need_no_simgl(name: str) -> None:
    text = (PACKAGE.parent / "benchmarks" / "basilisk" / name).read_text(encoding="utf-8")
    assert not re.search(r"^\s*(from|import) (simgl|tests)\b", text, re.M)
