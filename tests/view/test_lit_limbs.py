"""Tiles cut into boxes whose sample grids are finer along the lit limbs of spacecraft."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.sample_grid import SampleGrid, rotated_sample_grid
from simgl.view.image_box import Box
from simgl.view.lit_limbs import Limb, limb_boxes
from simgl.view.small_targets import convex_outline

GRID, NEEDED, BUDGET = rotated_sample_grid(5.0), 90.0, 125_000
RADIUS = 150.0
TILE = 10, 20, 320, 330


def disc(x: float = 165.0, y: float = 175.0, needed: float = NEEDED) -> Limb:
    """The outline of a sphere, the Sun to the right of it in the image."""
    turn = np.arange(192) * (2.0 * np.pi / 192)
    outline = np.stack([x + RADIUS * np.cos(turn), y + RADIUS * np.sin(turn)], axis=1)
    return Limb(
        outline=convex_outline(outline), to_sun=np.array([1.0, 0.0]), samples_per_pixel=needed
    )


def samples_at(boxes: tuple[tuple[Box, SampleGrid], ...]) -> Array:
    """(340, 340) samples per pixel; 0 outside all boxes. No two boxes overlap."""
    image = np.zeros((340, 340))
    for (x0, y0, x1, y1), grid in boxes:
        assert not image[y0:y1, x0:x1].any()
        image[y0:y1, x0:x1] = grid.scale**2
    return image


def test_every_pixel_of_a_crescent_is_drawn_and_its_lit_limb_finely() -> None:
    samples = samples_at(limb_boxes(TILE, GRID, [disc()], BUDGET))
    y, x = np.mgrid[:340, :340] + 0.5
    distance = np.hypot(x - 165.0, y - 175.0)
    # Half a pixel's diagonal is 0.7.
    assert np.all(samples[distance < RADIUS + 0.7] > 0.0)
    at_limb = np.abs(distance - RADIUS) < 0.7
    # The budgets may pay for no more than half of what it needs.
    assert np.all(samples[at_limb & (x > 165.0)] >= 0.5 * NEEDED)
    assert np.all(samples[distance < 0.5 * RADIUS] == pytest.approx(5.0))
    # What lies beyond the limb by more than the largest box that pays is not drawn.
    assert np.all(samples[distance > RADIUS + 110.0] == 0.0)
    # A crescent's half of the limb, some 25 pixels wide.
    assert samples.sum() < 1.5 * 5.0 * 310**2 + NEEDED * 25.0 * np.pi * RADIUS


@pytest.mark.parametrize(("x", "y"), [(165.0, 175.0), (165.5, 175.5), (164.7, 175.6), (165.3, 175)])
def test_a_crescent_is_drawn_finely_wherever_it_lies(x: float, y: float) -> None:
    """A sphere of 300 pixels at a phase angle of 150 degrees, in the pixels that it touches."""
    limb = disc(x, y, needed=92.5)
    low, high = np.floor(limb.outline.min(axis=0)), np.ceil(limb.outline.max(axis=0))
    tile = int(low[0]), int(low[1]), int(high[0]), int(high[1])
    samples = samples_at(limb_boxes(tile, GRID, [limb], BUDGET))
    assert samples.max() >= 0.5 * 92.5
    assert samples[samples > 5.1].sum() <= 4.0 * BUDGET + 5.0 * 302**2


def test_limbs_whose_samples_suffice_or_cost_too_much_cut_nothing() -> None:
    assert limb_boxes(TILE, GRID, [disc(needed=5.4)], BUDGET) == ()
    assert limb_boxes(TILE, GRID, [disc()], 1000) == ()


def test_another_spacecraft_of_the_tile_is_drawn_too() -> None:
    beside = Limb(
        outline=np.array([[20.0, 30.0], [20.0, 25.0], [24.0, 30.0]])[[0, 2, 1]],
        to_sun=np.array([1.0, 0.0]),
        samples_per_pixel=1.0,
    )
    samples = samples_at(limb_boxes(TILE, GRID, [disc(), beside], BUDGET))
    assert np.all(samples[26:30, 20:22] == pytest.approx(5.0))
