"""Interpolation between many knots: the same bits as numpy's, whatever the knots."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array32
from simgl.scene.knot_table import interpolated

RNG = np.random.default_rng(1)
EVEN = np.linspace(-3.0, 3.0, 500, dtype=np.float32)


@pytest.mark.parametrize(
    "knots",
    [
        EVEN,
        np.sort(RNG.standard_normal(20_000)).astype(np.float32),
        # Most of them crowd into one of the table's steps; some are equal.
        np.sort(np.exp(3.0 * RNG.standard_normal(20_000))).astype(np.float32),
        np.repeat(EVEN, 3),
        np.array([0.0, 1.0], dtype=np.float32),
    ],
    ids=["even", "normal", "crowded", "equal", "two"],
)
def test_it_is_what_numpy_returns(knots: Array32) -> None:
    at_knots = RNG.standard_normal(len(knots))
    # Beyond both ends, between knots, and on them; some thousands together and some alone.
    away = (knots[-1] - knots[0]) * RNG.uniform(-0.1, 1.1, 20_000) + knots[0]
    values = np.concatenate([away.astype(np.float32), knots]).reshape(-1, 2)
    # numpy takes the first of several knots at the lowest value, and the last of all others.
    values = values[np.all(values >= knots[0], axis=1)] if knots[0] == knots[1] else values
    expected = np.interp(values, knots, at_knots).astype(np.float32)
    np.testing.assert_array_equal(interpolated(values, knots, at_knots), expected)
