"""Tiles of the background that spacecraft hide: none in which anything is seen past them."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.view.background_tiles import MERGED, TILE, tiles_behind

# A pixel may show what is seen in the two pixels around it.
AROUND = 2


@pytest.mark.parametrize("edge", [2.0, 1.0, 0.5])
@pytest.mark.parametrize("seed", range(6))
def test_hidden_are_the_tiles_around_whose_pixels_every_block_is_full(
    edge: float, seed: int
) -> None:
    """Blocks over a part of the image or all of it, one in a few thousand bare."""
    rng = np.random.default_rng(seed)
    width, height = 300, 210
    whole = seed % 2 == 0
    corner = (0, 0) if whole else (int(rng.integers(0, 40)), int(rng.integers(0, 40)))
    end = (width, height) if whole else (width - 17, height - 3)
    columns, rows = (int(np.ceil((b - a) / edge)) for a, b in zip(corner, end, strict=True))
    bare = rng.random((rows, columns)) < 2e-4 * edge**2
    hidden = tiles_behind(bare, corner, edge, (width, height))
    assert hidden.shape == (-(-height // TILE), -(-width // TILE))

    # Whether each pixel of the image is full: its blocks are there, and none is bare.
    y, x = np.mgrid[:height, :width]
    full = np.zeros((height, width), dtype=bool)
    inside = (x >= corner[0]) & (x < end[0]) & (y >= corner[1]) & (y < end[1])
    parts = max(1, round(1.0 / edge))
    full[inside] = True
    for j in range(parts):
        for i in range(parts):
            row = np.floor((y + (j + 0.5) / parts - corner[1]) / edge).astype(int)
            column = np.floor((x + (i + 0.5) / parts - corner[0]) / edge).astype(int)
            full[inside] &= ~bare[row[inside], column[inside]]
    step = TILE * MERGED
    found = 0
    for row, column in np.ndindex(-(-height // step), -(-width // step)):
        top, left = row * step, column * step
        around = full[
            max(top - AROUND, 0) : top + step + AROUND, max(left - AROUND, 0) : left + step + AROUND
        ]
        tiles = hidden[row * MERGED : (row + 1) * MERGED, column * MERGED : (column + 1) * MERGED]
        found += int(around.all())
        # Blocks of two pixels may reach one pixel farther than the pixels asked for.
        if tiles.any():
            assert around.all()
        assert tiles.all() == tiles.any()
    assert 0 < hidden.sum() <= MERGED**2 * found
    assert hidden.sum() > 0.5 * MERGED**2 * found


def test_an_image_without_bare_blocks_has_nothing_behind() -> None:
    full = np.zeros((105, 150), dtype=bool)
    assert tiles_behind(full, (0, 0), 2.0, (300, 210)).all()
    # Of a craft that ends a pixel before the image's edge, the tiles there are seen past it.
    hidden = tiles_behind(full[:, :-1], (0, 0), 2.0, (300, 210))
    assert not hidden[:, -MERGED:].any() or not hidden[:, -1].any()
    assert hidden[:, 0].all()
