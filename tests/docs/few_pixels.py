"""Scenario and camera files with fewer pixels, so that tests of pages take seconds."""

from __future__ import annotations

import re
from pathlib import Path

# Half: with fewer, the test of a camera no longer tells its noise to 1.5 %.
_KEY = re.compile(r"\b(width_px|height_px|focal_length_mm) = ([\d.]+)(?![\d.]|  # halved)")


def with_few_pixels(folder: Path) -> None:
    """Half of the pixels along each side of all cameras, in their fields of view."""
    for path in folder.rglob("*.toml"):
        path.write_text(_KEY.sub(_halved, path.read_text()))


def _halved(match: re.Match[str]) -> str:
    half = float(match[2]) / 2.0
    return f"{match[1]} = {half if '.' in match[2] else round(half)}  # halved"
