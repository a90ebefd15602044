"""``constraints-lowest.txt``, made from ``pyproject.toml``: ``python -m tools.lowest_versions``.

Every dependency at the lowest version that ``pyproject.toml`` allows. CI runs some tests with them.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

_PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"
_REQUIREMENT = re.compile(r"([A-Za-z0-9_.-]+)(?:\[[^]]*\])?>=([0-9.a-z]+)")
# The documentation is not made with them, and Basilisk is installed apart.
_EXTRAS = (
    "dev",
    "aedat4",
    "campaign",
    "compression",
    "dds",
    "events",
    "ros",
    "spice",
    "web",
    "xarray",
)


def constraints() -> str:
    """The lines of the file."""
    return "\n".join(["# Made by python -m tools.lowest_versions.", *sorted(_pins())]) + "\n"


def _pins() -> Iterator[str]:
    project = tomllib.loads(_PROJECT.read_text(encoding="utf-8"))["project"]
    extras = (project["optional-dependencies"][name] for name in _EXTRAS)
    for requirement in [*project["dependencies"], *(one for extra in extras for one in extra)]:
        if requirement.startswith("simgl["):
            continue
        match = _REQUIREMENT.fullmatch(requirement)
        assert match is not None, f"{requirement} has no lowest version"
        yield f"{match[1]}=={match[2]}"


if __name__ == "__main__":
    print(constraints(), end="")
