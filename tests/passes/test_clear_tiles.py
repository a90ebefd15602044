"""Tiles that leave clouds out show what they show with all clouds looked up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.passes.background.tile_kinds import TileDraws
from simgl.view.map_cells import MapBounds
from tests.passes.test_ground import looking_down, tilted_sun

Array = np.ndarray[Any, Any]


@pytest.mark.parametrize("zenith", [20.0, 80.0])
def test_nothing_of_clouds_is_lost_in_clear_tiles(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, zenith: float
) -> None:
    # Clouds of 20 to 60 km with as much between them, from a picture of 11 km a pixel.
    spots = np.random.default_rng(5).random((600, 1200)) < 0.08
    picture = np.where(spots.repeat(3, axis=0).repeat(3, axis=1), 255, 0).astype(np.uint8)
    Image.fromarray(picture).save(tmp_path / "spots.png")
    clouds = {"picture": str(tmp_path / "spots.png"), "optical_thickness": 30.0}
    place = (23.0, 9.0)
    drawn: list[str] = []
    add = TileDraws.add_even

    def noted(draws: TileDraws, program: str, tiles: Any, defines: Any, which: Any) -> None:
        drawn.extend(define for kind in np.unique(which) for define in defines[kind % len(defines)])
        add(draws, program, tiles, defines, which)

    monkeypatch.setattr(TileDraws, "add_even", noted)

    def seen() -> Array:
        drawn.clear()
        sun = tilted_sun(place, zenith, 60.0)
        return looking_down(gl, place, sun, {"clouds": clouds}, width=500.0, pixels=160)

    some_clear = seen()
    assert "CLEAR" in drawn
    monkeypatch.setattr(MapBounds, "free_of_clouds", lambda *_: np.zeros((), dtype=bool))
    all_looked_up = seen()
    assert not {"CLEAR", "NO_HIGH_CLOUD"} & {*drawn}
    np.testing.assert_allclose(some_clear, all_looked_up, rtol=1e-5)
