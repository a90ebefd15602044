"""The folder of scenarios that clients may choose from, by name."""

from __future__ import annotations

from os.path import dirname, realpath
from pathlib import Path


def scenario_names(root: Path | None) -> tuple[str, ...]:
    """Names of the scenarios in a folder; links that lead out of it are left out."""
    if root is None:
        return ()
    folder = root.resolve()
    # Unlike Path.resolve, realpath takes a link that leads to itself.
    contained = [path for path in folder.glob("*.toml") if dirname(realpath(path)) == str(folder)]
    return tuple(sorted(path.stem for path in contained))
