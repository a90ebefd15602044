"""The package's own source as syntax trees."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "simgl"


@dataclass(frozen=True)
class Module:
    """One file of the package.

    name : dotted, e.g. ``simgl.physics.frames``; a package goes by its folder
    """

    name: str
    path: Path

    @property
    def text(self) -> str:
        """The source."""
        return self.path.read_text(encoding="utf-8")

    @property
    def tree(self) -> ast.Module:
        """The syntax tree."""
        return ast.parse(self.text, str(self.path))

    @property
    def package(self) -> str:
        """The first name below ``simgl``; empty for the package itself."""
        return self.name.partition(".")[2].partition(".")[0]


@cache
def modules() -> tuple[Module, ...]:
    """Every Python file of the package."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        found.append(Module(".".join(p for p in parts if p != "__init__"), path))
    return tuple(found)


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


def imported_modules(module: Module) -> set[str]:
    """The package's modules that a module imports."""
    names = {m.name for m in modules()}
    found = set()
    for name in imports(module):
        # The version says who we are, on every floor.
        if name.partition(".")[0] != "simgl" or name == "simgl.__version__":
            continue
        # ``from simgl.x import y`` names the module simgl.x.y or a thing in simgl.x.
        found.add(name if name in names else name.rpartition(".")[0])
    return found
