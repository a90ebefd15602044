"""Points to search through the Sun's disc: each is drawn once, and is found again by its page."""

from __future__ import annotations

import numpy as np

from simgl.arrays import AnyArray
from simgl.passes.shading_points import COLUMNS, ENTRIES, in_list_order, listed_points

NONE = 0xFFFFFFFF


def place_of(results: AnyArray, row: int, column: int) -> tuple[int, int]:
    """Row and column of a point's result, as shaders/surface/sun.glsl finds it."""
    entry = 4 * (column // 4) + 2 * (row // 2 % 2) + column // 2 % 2
    page = int(results[row // 4, entry])
    before = page & ((1 << (2 * (row % 2) + column % 2)) - 1)
    index = (page >> 4) + (before & 0xF).bit_count()
    square = index // 16
    return 4 * (square // (COLUMNS // 4)) + index // 4 % 4, 4 * (
        square % (COLUMNS // 4)
    ) + index % 4


def test_every_point_finds_its_own_result() -> None:
    """Some 4,000 points at random in three rows of squares, more than one row of results holds."""
    masks = np.random.default_rng(7).integers(0, 16, (3, ENTRIES)).astype(np.uint8)
    masks[1, 200:700] = 0
    results = np.zeros(masks.shape, dtype=np.uint32)
    points = listed_points(masks, results)
    wanted = set()
    for row in range(4 * len(masks)):
        for column in range(COLUMNS):
            entry = 4 * (column // 4) + 2 * (row // 2 % 2) + column // 2 % 2
            if masks[row // 4, entry] >> (2 * (row % 2) + column % 2) & 1:
                wanted.add((row, column))
    assert len(wanted) > 4 * COLUMNS
    drawn = points[points != NONE].astype(np.int64)
    assert sorted((int(p) >> 16, int(p) & 0xFFFF) for p in drawn) == sorted(wanted)
    for row, column in wanted:
        assert points[place_of(results, row, column)] == row << 16 | column


def test_results_are_read_back_in_the_order_of_the_list() -> None:
    masks = np.random.default_rng(8).integers(0, 16, (2, ENTRIES)).astype(np.uint8)
    results = np.zeros(masks.shape, dtype=np.uint32)
    points = listed_points(masks, results)
    in_order = in_list_order(points)
    squares = np.flatnonzero(masks.ravel())
    # The first point of each page stands where the page says.
    pages = in_order[results.ravel()[squares] >> 4].astype(np.int64)
    row, column = pages >> 16, pages & 0xFFFF
    np.testing.assert_array_equal(
        row // 4 * ENTRIES + column // 4 * 4 + row // 2 % 2 * 2 + column // 2 % 2, squares
    )
    assert (in_order[int(np.unpackbits(masks).sum()) :] == NONE).all()


def test_one_point_is_one_result() -> None:
    masks = np.zeros((1, ENTRIES), dtype=np.uint8)
    masks[0, -1] = 8
    results = np.zeros(masks.shape, dtype=np.uint32)
    points = listed_points(masks, results)
    assert points.shape == (4, COLUMNS)
    assert points[0, 0] == 3 << 16 | COLUMNS - 1
    assert (points.ravel()[1:] == NONE).all()
    assert place_of(results, 3, COLUMNS - 1) == (0, 0)
