"""What is drawn depends on seed, name and frame alone, and lies as it should."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from simgl.campaign.random_draws import (
    Distribution,
    Draw,
    choice,
    direction,
    log_uniform,
    normal,
    rotation,
    uniform,
)

FRAMES = 2000


def test_a_frame_draws_the_same_in_any_order_and_beside_anything() -> None:
    forth = [Draw(1, frame).uniforms("range", 3) for frame in range(50)]
    back = []
    for frame in reversed(range(50)):
        draw = Draw(1, frame)
        draw.uniforms("another", 7)
        back.append(draw.uniforms("range", 3))
    assert np.array_equal(forth, back[::-1])
    # Every number is a new one, and so is every seed, name and attempt.
    others = [Draw(2, 0), Draw(1, 0, 1)]
    numbers = [*np.ravel(forth), *(v for d in others for v in d.uniforms("range", 3))]
    numbers += Draw(1, 0).uniforms("roll", 3).tolist()
    assert len(set(numbers)) == len(numbers)


def test_values_lie_as_their_distribution_says() -> None:
    """Kolmogorov's distance of n values passes 1.95 / sqrt(n) once in a thousand times."""

    def distance(distribution: Distribution, share_below: Callable[[float], float]) -> float:
        values = np.sort([distribution.at(Draw(7, f), "x") for f in range(FRAMES)])
        steps = (np.arange(FRAMES) + 0.5) / FRAMES
        return float(np.abs(np.vectorize(share_below)(values) - steps).max())

    allowed = 1.95 / np.sqrt(FRAMES)
    assert distance(uniform(-2.0, 6.0), lambda v: (v + 2.0) / 8.0) < allowed
    assert distance(log_uniform(1.0, 100.0), lambda v: np.log10(v) / 2.0) < allowed
    assert distance(normal(3.0, 2.0), lambda v: norm.cdf(v, 3.0, 2.0)) < allowed
    counts = np.unique([choice((1.0, 4.0)).at(Draw(7, f), "x") for f in range(FRAMES)],
                       return_counts=True)  # fmt: skip
    assert counts[0].tolist() == [1.0, 4.0]
    # Binomial: three standard deviations are 67.
    assert abs(counts[1][0] - FRAMES / 2) < 3.0 * np.sqrt(FRAMES / 4)


def test_directions_and_rotations_are_uniform() -> None:
    """A uniform direction has mean 0 and second moment 1/3; so has each column of a rotation.

    The mean of n components deviates by 1 / sqrt(3 n), the moment by sqrt(4 / 45 / n); of 24 each
    none passes 4 of these, but once in 300 times.
    """
    drawn = np.array([rotation(Draw(3, f), "attitude") for f in range(FRAMES)])
    assert np.allclose(drawn @ np.swapaxes(drawn, 1, 2), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(drawn), 1.0)
    lines = [direction(Draw(3, f), "sphere") for f in range(FRAMES)]
    columns = np.concatenate([drawn, np.array(lines)[:, :, None]], axis=2)
    assert np.abs(columns.mean(axis=0)).max() < 4.0 / np.sqrt(3 * FRAMES)
    assert np.abs((columns**2).mean(axis=0) - 1 / 3).max() < 4.0 * np.sqrt(4 / 45 / FRAMES)
    # The turn of a uniform rotation has the density (1 - cos a) / pi: its mean is pi / 2 + 2 / pi.
    turns = np.arccos(np.clip(0.5 * (np.trace(drawn, axis1=1, axis2=2) - 1.0), -1.0, 1.0))
    assert turns.mean() == pytest.approx(np.pi / 2 + 2 / np.pi, abs=4.0 * 0.65 / np.sqrt(FRAMES))
