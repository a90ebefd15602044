"""The source of the packages as syntax trees."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "simgl"
BRIDGE = PACKAGE.parent / "bridge" / "simgl_bridge"


@dataclass(frozen=True)
class Module:
    """One file of a package.

    name : dotted, e.g. ``simgl.physics.frames``; a package goes by its folder
    """

    name: str
    path: Path

    @cached_property
    def text(self) -> str:
        """The source."""
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        """The syntax tree."""
        return ast.parse(self.text, str(self.path))

    @property
    def package(self) -> str:
        """The first name below ``simgl``; empty for the package itself."""
        return self.name.partition(".")[2].partition(".")[0]


@cache
def modules(package: Path = PACKAGE) -> tuple[Module, ...]:
    """Every Python file of ``simgl`` or another package, read and parsed once for all tests."""
    files = []
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        files.append(Module(".".join(p for p in parts if p != "__init__"), path))
    return tuple(files)


def shipped_modules() -> tuple[Module, ...]:
    """Every Python file of the wheel's packages."""
    return modules() + modules(BRIDGE)


def imports(module: Module) -> Iterator[str]:
    """Dotted name of everything that a module imports, wherever in the file; ``a.b.name`` for
    ``from a.b import name``."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module.name}:{node.lineno} imports by dots"
            for alias in node.names:
                yield f"{node.module}.{alias.name}"


@cache
def imported_modules(module: Module) -> frozenset[str]:
    """The package's modules that a module imports."""
    names = {m.name for m in modules()}
    imported = set()
    for name in imports(module):
        # Every layer may name the version.
        if name.partition(".")[0] != "simgl" or name == "simgl.__version__":
            continue
        # ``from simgl.x import y`` names the module simgl.x.y or a thing in simgl.x.
        imported.add(name if name in names else name.rpartition(".")[0])
    return frozenset(imported)
