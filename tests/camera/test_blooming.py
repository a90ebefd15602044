"""Blooming: charge that spills along columns."""

from __future__ import annotations

import numpy as np

from simgl.camera.blooming import with_blooming

WELL = 100.0


def column(*electrons: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.array(electrons, dtype=np.float32)[:, None]


def test_excess_fills_the_neighbours_both_ways() -> None:
    # 500 above the well: 250 each way, 90 into each neighbour with 10, 100 into empty ones.
    got = with_blooming(column(0, 0, 0, 10, 600, 10, 0, 0, 0), WELL, 1.0)
    np.testing.assert_array_equal(got, column(0, 60, 100, 100, 100, 100, 100, 60, 0))


def test_charge_is_kept_between_the_edges_and_drained_by_the_share() -> None:
    rng = np.random.default_rng(1)
    collected = rng.integers(0, 50, (400, 30)).astype(np.float32)
    collected[200, :] = rng.integers(200, 3000, 30)
    excess = (collected - WELL).clip(0.0)
    whole = with_blooming(collected, WELL, 1.0)
    # Halves of odd numbers lose an electron.
    lost = collected.sum(axis=0) - whole.sum(axis=0)
    assert np.all((lost >= 0.0) & (lost <= 1.0))
    half = with_blooming(collected, WELL, 0.5)
    gained = half.sum(axis=0) - np.minimum(collected, WELL).sum(axis=0)
    assert np.all(np.abs(gained - 0.5 * excess.sum(axis=0)) <= 1.5)
    assert whole.max() == half.max() == WELL


def test_columns_keep_to_themselves_and_calm_pictures_stay() -> None:
    collected = np.full((20, 5), 30.0, dtype=np.float32)
    np.testing.assert_array_equal(with_blooming(collected, WELL, 1.0), collected)
    collected[10, 2] = 1e7
    got = with_blooming(collected, WELL, 1.0)
    np.testing.assert_array_equal(got[:, [0, 1, 3, 4]], 30.0)
    np.testing.assert_array_equal(got[:, 2], WELL)
