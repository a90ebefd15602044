"""Tiles are free of clouds only where none of the texels that they read has any."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simgl.passes.background.earth_maps import cell_sums, over_cells
from simgl.view.map_cells import MapBounds, MapCells

Array = np.ndarray[Any, Any]

HEIGHT, KM = 2048, 1.0 / 6378.137


def bounds(latitude: Array, longitude: Array, half: Array, pixel: float) -> MapBounds:
    """Of tiles about some places, that reach so far along parallels and meridians [rad]."""
    wide = half / np.cos(latitude)
    low = np.stack([latitude - half, longitude - wide, np.sin(latitude - half)])
    high = np.stack([latitude + half, longitude + wide, np.sin(latitude + half)])
    return MapBounds(
        low=low[:, None, None],
        high=high[:, None, None],
        pixel=np.full((1, 1, len(half)), pixel * KM),
    )


def read(codes: Array, latitude: Array, longitude: Array) -> Array:
    """The largest of the four texels that a bilinear look-up mixes."""
    row = (0.5 - latitude / np.pi) * HEIGHT - 0.5
    column = (longitude / (2.0 * np.pi) + 0.5) * 2 * HEIGHT - 0.5
    rows = np.clip(np.floor(row).astype(int) + np.array([0, 1])[:, None, None], 0, HEIGHT - 1)
    columns = (np.floor(column).astype(int) + np.array([0, 1])[:, None, None, None]) % (2 * HEIGHT)
    return np.asarray(codes[rows[None], columns].max(axis=(0, 1)))


@pytest.mark.parametrize("off_km", [0.0, 15.0])
def test_what_is_free_of_clouds_reads_no_cloudy_texel(off_km: float) -> None:
    rng = np.random.default_rng(3)
    codes = (rng.random((HEIGHT, 2 * HEIGHT)) < 0.01).astype(np.uint8)
    cloudy = cell_sums(over_cells(np.maximum, codes) > 0)
    cells = MapCells(shores=np.stack([cloudy] * 2), clouds=np.stack([cloudy] * 2))
    count = 40_000
    latitude = np.arcsin(rng.uniform(-0.94, 0.94, count))
    longitude = rng.uniform(-3.1, 3.1, count)
    half = rng.uniform(1.0, 8.0, count) * KM
    tiles = bounds(latitude, longitude, half, 0.5)
    free = tiles.free_of_clouds(cells, 1, np.full((1, 1, count), off_km * KM))[0, 0]
    assert 0.15 < free.mean() < 0.85
    # Places of such a tile, and what stands off them to all sides.
    x, y = rng.uniform(-1.0, 1.0, (2, 100, 1))
    turn, away = rng.uniform(0.0, 2.0 * np.pi, (100, 1)), off_km * KM
    at = latitude[free] + half[free] * y + away * np.sin(turn)
    along = (half[free] * x + away * np.cos(turn)) / np.cos(latitude[free])
    assert read(codes, at, longitude[free] + along).max() == 0


def test_cells_touch_the_date_line_without_being_known() -> None:
    cells = MapCells(
        shores=np.zeros((2, 1025, 2049), np.int32), clouds=np.zeros((2, 1025, 2049), np.int32)
    )
    longitude = np.array([0.0, 3.1405])
    tiles = bounds(np.zeros(2), longitude, np.full(2, 5.0 * KM), 0.5)
    sea, land = tiles.on_one_side(cells)
    assert sea[0, 0].tolist() == land[0, 0].tolist() == [True, False]
