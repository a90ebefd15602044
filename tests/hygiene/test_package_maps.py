"""Each package says at its head what it is, what its modules hold, and what it may import."""

from __future__ import annotations

import ast
import re

import pytest

from tests.hygiene.source import Module, modules

PACKAGES = [m for m in modules() if m.path.stem == "__init__"]


@pytest.mark.parametrize("package", PACKAGES, ids=lambda m: m.name)
def test_a_package_has_a_map(package: Module) -> None:
    docstring = ast.get_docstring(package.tree) or ""
    first, _, rest = docstring.partition("\n")
    assert first.endswith("."), (
        f"{package.name}: the first line is a sentence, ended by a full stop"
    )
    lines = [line for line in rest.splitlines() if line.strip()]
    assert len(lines) >= 4, f"{package.name}: say which modules hold what, and where to add what"
    # A map without places is none.
    named = {m.path.stem for m in modules() if m.path.parent == package.path.parent} - {"__init__"}
    used = set(re.findall(r"\w+", docstring))
    assert package.name == "simgl" or not named or named & used, package.name
