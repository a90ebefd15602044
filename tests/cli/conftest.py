"""The small scene as a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.small_scene import SCENE


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The scenario file."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path
