"""The public interface: documented, with examples that run, and quick to import."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path

import numpy as np
import pytest
import simgl_bridge

import simgl
from tests.patience import run_to_end

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "python.md"
NAMES = [name for name in simgl.__all__ if name != "__version__"]

# Public besides ``simgl`` and ``simgl_bridge``: the page names them, or they hold types of arrays.
PUBLIC_MODULES = {
    "simgl.arrays",
    "simgl.camera.detector",
    "simgl.camera.lens",
    "simgl.images",
    "simgl.scene.state",
}
# What the larger examples use besides: they show how the parts work together.
LARGER_EXAMPLES_USE = {
    "simgl.assess.target_background",
    "simgl.camera.camera_equation",
    "simgl.cli_progress",
    "simgl.errors",
    "simgl.figures.false_colour",
    "simgl.figures.style",
    "simgl.figures.html_page",
    "simgl.motion.mounts",
    "simgl.motion.trajectory",
    "simgl.output",
    "simgl.physics.constants",
    "simgl.physics.ephemeris",
    "simgl.physics.frames",
    "simgl.progress",
    "simgl.ros2.dds_node",
    "simgl.ros2.ros_messages",
    "simgl.ros2.run_messages",
    "simgl.sequence.event_stream",
    "simgl.video",
    "simgl_bridge.message_parts",
}


def run(examples: doctest.DocTest) -> None:
    """Run the examples of one docstring or page; fail with what they printed."""
    printed: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    runner.run(examples, out=printed.append)
    assert runner.failures == 0, "".join(printed)


def test_every_public_name_resolves() -> None:
    assert set(simgl.__all__) <= set(dir(simgl))
    for name in simgl.__all__:
        assert getattr(simgl, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'Simulatr'"):
        getattr(simgl, "Simulatr")  # noqa: B009 - a name that does not exist


def test_type_checkers_see_the_names_that_load_at_run_time() -> None:
    tree = ast.parse((ROOT / "simgl" / "__init__.py").read_text())
    (guarded,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.asname: node.module
        for node in guarded.body
        if isinstance(node, ast.ImportFrom) and node.module != "typing"
        for alias in node.names
    }
    loaded = {name: f"simgl.{module}" for name, module in simgl._MODULE_OF.items()}
    assert seen == loaded


@pytest.mark.parametrize("package", [simgl, simgl_bridge], ids=["simgl", "simgl_bridge"])
def test_the_page_documents_every_public_name(package: object) -> None:
    package_name = package.__name__  # type: ignore[attr-defined]
    directive = rf"^\.\. auto(?:function|class|exception|data):: {package_name}\.(\w+)$"
    documented = set(re.findall(directive, PAGE.read_text(), re.M))
    public = set(package.__all__) - {"__version__"}  # type: ignore[attr-defined]
    assert documented == public


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_has_a_docstring_and_an_example(name: str) -> None:
    item = getattr(simgl, name)
    if inspect.isclass(item) or inspect.isroutine(item):
        assert inspect.getdoc(item)
    shown = "".join(
        example.source for example in doctest.DocTestParser().get_examples(PAGE.read_text())
    )
    assert re.search(rf"\b{name}\b", shown), f"docs/python.md shows no use of {name}"


def public_callables() -> Iterator[tuple[str, Callable[..., object], str]]:
    """Name, signature's owner and docstring of what the page documents, with public methods."""
    named = [(p, name) for p in (simgl, simgl_bridge) for name in p.__all__ if name[0] != "_"]
    for module in map(importlib.import_module, sorted(PUBLIC_MODULES - {"simgl.arrays"})):
        defined = (n for n, v in vars(module).items() if inspect.getmodule(v) is module)
        named += [(module, name) for name in defined if name[0] != "_" and name.isidentifier()]
    for package, name in named:
        item = getattr(package, name)
        if not callable(item) or (inspect.isclass(item) and issubclass(item, Enum)):
            continue
        yield f"{package.__name__}.{name}", item, item.__doc__ or ""
        for method, function in vars(item).items() if inspect.isclass(item) else ():
            plain = function.__func__ if isinstance(function, classmethod) else function
            if inspect.isfunction(plain) and method[0] != "_":
                yield f"{package.__name__}.{name}.{method}", plain, plain.__doc__ or ""


@pytest.mark.parametrize(
    ("item", "text"), [pytest.param(i, t, id=name) for name, i, t in public_callables()]
)
def test_every_parameter_of_the_public_interface_is_described(
    item: Callable[..., object], text: str
) -> None:
    # "info" of a frame is described once, in its module; keywords of a dictionary one by one.
    not_described = {"self", "cls", "info"}
    described = {
        name.strip()
        for line in re.findall(r"^ *([\w, ]+) : ", text, re.M)
        for name in line.split(",")
    }
    # An exception without parameters of its own takes those of all exceptions.
    plain = inspect.isclass(item) and "__init__" not in vars(item) and issubclass(item, Exception)
    parameters = [] if plain else list(inspect.signature(item).parameters.values())
    named = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
    assert not named - described - not_described


@pytest.mark.usefixtures("gl")
def test_the_examples_of_the_page_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    run(doctest.DocTestParser().get_doctest(PAGE.read_text(), {}, "python.md", str(PAGE), 0))


@pytest.mark.parametrize(
    "name", [n for n in NAMES if ">>>" in (inspect.getdoc(getattr(simgl, n)) or "")]
)
def test_the_example_of_a_docstring_runs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    text = inspect.getdoc(getattr(simgl, name)) or ""
    given = {"simgl": simgl, "np": np}
    run(doctest.DocTestParser().get_doctest(text, given, f"simgl.{name}", None, 0))


def modules_of(path: Path) -> set[str]:
    """Modules of simgl and its bridge that a script imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        found |= {name for name in names if name.partition(".")[0] in ("simgl", "simgl_bridge")}
    return found - {"simgl", "simgl_bridge"}


def test_short_examples_import_public_names_only() -> None:
    scripts = [*(ROOT / "examples").glob("*.py"), *(ROOT / "examples" / "short").glob("*.py")]
    for path in [*scripts, *(ROOT / "examples" / "bridge").glob("*.py")]:
        assert not modules_of(path), path.name


def test_larger_examples_import_few_inner_modules() -> None:
    used = set().union(*(modules_of(path) for path in (ROOT / "examples").rglob("*.py")))
    assert used <= PUBLIC_MODULES | LARGER_EXAMPLES_USE
    for module in PUBLIC_MODULES - {"simgl.arrays"}:
        assert f"automodule:: {module}\n" in PAGE.read_text() or module in PAGE.read_text()
        importlib.import_module(module)


def test_pages_import_modules_that_the_page_of_the_interface_names() -> None:
    pages = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "howto").glob("*.md")]
    texts = "\n".join(page.read_text() for page in pages)
    used = set(re.findall(r"^from (simgl\.[\w.]+) import", texts, re.M))
    assert used
    for module in used:
        assert f"`{module}." in PAGE.read_text(), module


def test_the_readme_imports_public_names_only() -> None:
    text = (ROOT / "README.md").read_text()
    for names in re.findall(r"^from simgl import (.*)$", text, re.M):
        assert set(names.split(", ")) <= set(simgl.__all__)
    assert not re.search(r"^(?:from|import) simgl\.", text, re.M)


def test_importing_simgl_loads_neither_numpy_nor_opengl() -> None:
    """What takes time to import waits for the first use of a name."""
    code = (
        "import sys, simgl; print([m for m in ('numpy', 'moderngl', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_imports_nothing_that_computes() -> None:
    """It is there at once: completion in a shell starts the same way."""
    slow = ("numpy", "scipy", "trimesh", "moderngl", "matplotlib", "PIL", "erfa", "zmq", "msgspec")
    program = (
        "import atexit, sys; from simgl.cli import main\n"
        "atexit.register(lambda: print(*sys.modules, file=sys.stderr))\n"
        "sys.argv = ['simgl', '--help']; main()"
    )
    ended = run_to_end([sys.executable, "-c", program])
    assert "serve" in ended.stdout
    assert not [name for name in ended.stderr.split() if name.startswith(slow)]


def test_a_simulator_imports_only_what_its_scenario_needs() -> None:
    slow = ("scipy.stats", "scipy.optimize", "scipy.interpolate", "scipy.ndimage", "scipy.fft")
    others = ("trimesh", "matplotlib", "OpenEXR", "typer", "rich", "dask", "glfw", "zmq")
    program = "import sys; from simgl import Simulator, load_scenario; print(*sys.modules)"
    loaded = run_to_end([sys.executable, "-c", program]).stdout.split()
    assert not [name for name in loaded if name.startswith((*slow, *others))]
