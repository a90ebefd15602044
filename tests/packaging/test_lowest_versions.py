"""The lowest versions of all dependencies, with which CI runs some tests."""

from __future__ import annotations

from pathlib import Path

from tools.lowest_versions import constraints

ROOT = Path(__file__).resolve().parents[2]


def test_the_file_is_what_the_project_allows() -> None:
    """Otherwise: python -m tools.lowest_versions > constraints-lowest.txt."""
    assert (ROOT / "constraints-lowest.txt").read_text(encoding="utf-8") == constraints()


def test_every_dependency_has_a_lowest_version() -> None:
    names = [line.partition("==")[0] for line in constraints().splitlines()[1:]]
    assert len(names) == len(set(names))
    assert {"numpy", "embreex", "OpenEXR", "av", "distributed", "pytest"} <= set(names)
