"""Every block of the quick how-to guides runs, in order, in an empty folder of each guide."""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from tests.docs.few_pixels import with_few_pixels
from tools.page_blocks import blocks, run_page
from tools.run_guides import GUIDES

# What each guide leaves, and says.
LEAVES = {
    "cluster.md": (("examples/campaign/approach.toml",), ""),
    "headless.md": (("first/scenario.toml", "keys/server.key_secret", "keys/client.key"), ""),
    "opengl.md": ((), "will render with"),
}
# Tens of seconds: python -m tools.run_guides.
SLOW = {"calibrated_camera.md", "exposure.md", "reproduce.md"}


def test_every_guide_with_a_command_is_run() -> None:
    to_run = {
        page.name
        for page in GUIDES.glob("*.md")
        if any(block.language == "sh" and block.not_run is None for block in blocks(page))
    }
    assert to_run == set(LEAVES) | SLOW


@pytest.mark.parametrize("name", LEAVES)
def test_a_guide_does_what_it_says(name: str, tmp_path: Path) -> None:
    leaves, says = LEAVES[name]
    with redirect_stdout(StringIO()) as printed:
        run_page(GUIDES / name, tmp_path, with_few_pixels)
    assert [path for path in leaves if not (tmp_path / path).exists()] == []
    assert says in printed.getvalue()
