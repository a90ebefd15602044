"""The table of pages: each block of cells has as many pages as it asks for, one after the other."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.passes.shading_points import ENTRIES, page_table


@pytest.mark.parametrize("shape", [(1, 1), (3, 500), (41, 67), (8192, 1), (1, 8192)])
def test_each_page_tells_its_block_and_layer(shape: tuple[int, int]) -> None:
    """Blocks of an image of 16384 pixels, up to 16 layers each, some without any."""
    counts = np.random.default_rng(1).integers(0, 17, shape).astype(np.uint8)
    counts[-1, -1] = 16
    entries, first, _ = page_table(counts)
    pages = entries.ravel()
    total = int(counts.sum())
    assert entries.shape == (-(-total // ENTRIES), ENTRIES)
    assert np.all(pages[:total] >> 31 == 1)
    assert not pages[total:].any()
    row, column, layer = (pages[:total] >> shift & mask for shift, mask in _FIELDS)
    np.testing.assert_array_equal(first[row, column] + layer, np.arange(total))
    np.testing.assert_array_less(layer, counts[row, column])


_FIELDS = ((13, 0x1FFF), (0, 0x1FFF), (26, 15))


def test_no_block_asks_for_a_page() -> None:
    entries, first, _ = page_table(np.zeros((4, 6), dtype=np.uint8))
    assert not entries.any()
    assert not first.any()
    assert entries.shape == (1, ENTRIES)
