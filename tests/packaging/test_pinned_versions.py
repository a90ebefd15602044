"""What ``constraints.txt`` pins can be installed where simgl can."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

from packaging.specifiers import SpecifierSet

PINS = Path(__file__).parents[2] / "constraints.txt"
# Debian 12 has this version of Python.
OLDEST = "3.11.2"


def test_the_oldest_python_may_have_every_pinned_version() -> None:
    for line in PINS.read_text().splitlines():
        name, _, pinned = line.partition(";")[0].strip().partition("==")
        if not pinned or name.startswith("#"):
            continue
        try:
            installed = metadata(name)
        except PackageNotFoundError:
            continue
        if installed["Version"] == pinned:
            allowed = installed.get_all("Requires-Python", [""])[0]
            assert SpecifierSet(allowed).contains(OLDEST), line
