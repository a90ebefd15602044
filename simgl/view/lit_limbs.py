"""The lit limb of a spacecraft, where its image needs more samples than elsewhere.

Most of a crescent's light lies at its limb: the samples there decide where its centre is. A tile is
cut into boxes, of which those along the limb have a finer sample grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Mask
from simgl.sample_grid import (
    MAX_SAMPLES,
    USEFUL_NEED,
    SampleGrid,
    rotated_sample_grid,
)
from simgl.view.image_box import Box

# Boxes are not cut below twice this edge [px].
_SMALLEST = 8
# Samples that could be lit in the time that a box takes whatever is in it: with a finer grid, and
# where it is only averaged.
_SAMPLES_OF_A_BOX, _SAMPLES_OF_A_MEAN = 50_000, 2_000
# Of a tile, for finer grids. Most samples there see nothing, and cost little; twice as many make a
# frame of a large spacecraft before the Sun take four times as long.
_BUDGETS = 4
# A limb that needs so many times the samples of its tile is worth boxes of its own: each draws all
# triangles again. Small parts beside a large spacecraft in a docking camera's view need five times.
_ABOUT = 6.0
# Beyond an outline its pixels reach, and samples that round to it [px].
_AROUND = 1.5
# Cosine to the Sun, in the image, of directions across the outline beyond which it counts as dark.
_DARK = -0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Limb:
    """The outline of a spacecraft, part of which the Sun lights.

    outline : (n, 2) of its ``convex_outline`` [px]
    to_sun : (2,) where things go in the image that move towards the Sun
    samples_per_pixel : that its lit part needs
    margin : by which it may lie elsewhere, beyond ``_AROUND`` [px]
    """

    outline: Array
    to_sun: Array
    samples_per_pixel: float
    margin: float = 0.0

    def is_served_by(self, grid: SampleGrid) -> bool:
        """Whether a grid is so near to what it needs that boxes cost more than they bring."""
        return self.samples_per_pixel <= _ABOUT * grid.scale**2

    def lit(self) -> Array:
        """(k, 2) places along its lit part, at most a pixel apart [px]."""
        step = np.roll(self.outline, -1, axis=0) - self.outline
        length = np.hypot(*step.T)
        outward = np.stack([-step[:, 1], step[:, 0]], axis=-1) / length[:, None]
        facing = outward @ self.to_sun > _DARK * float(np.linalg.norm(self.to_sun))
        each = np.where(facing, np.ceil(length), 0.0).astype(int)
        edge = np.repeat(np.arange(len(each)), each)
        number = np.arange(len(edge)) - np.repeat(np.cumsum(each) - each, each)
        return np.asarray(self.outline[edge] + (number / each[edge])[:, None] * step[edge])


@dataclass(frozen=True)
class _Cut:
    """Boxes with their samples per pixel, 0 where the tile's own do, and what they cost together in
    samples."""

    boxes: tuple[tuple[Box, float], ...]
    cost: float


def limb_boxes(
    box: Box, grid: SampleGrid, limbs: Sequence[Limb], sample_budget: int
) -> tuple[tuple[Box, SampleGrid], ...]:
    """The boxes of a tile that may show spacecraft, and the sample grid of each; none where its own
    serves all limbs, or finer ones along them would take more than its samples and ``_BUDGETS``.

    box : of the tile, x0, y0, x1, y1 [px]; grid : of what is not at a limb
    """
    if all(one.is_served_by(grid) for one in limbs):
        return ()
    coarse = grid.scale**2
    allowed = _BUDGETS * sample_budget + coarse * _area(box)
    lit = [np.empty((0, 2)) if one.is_served_by(grid) else one.lit() for one in limbs]
    share = 1.0
    while share * USEFUL_NEED >= 1.0:
        finer = [share * min(one.samples_per_pixel, MAX_SAMPLES / share) for one in limbs]
        boxes = _cut(box, lit, limbs, finer).boxes
        if sum(_area(part) * samples for part, samples in boxes) <= allowed:
            return tuple(
                (part, rotated_sample_grid(samples) if samples else grid) for part, samples in boxes
            )
        share *= 0.8
    return ()


def _area(box: Box) -> int:
    return (box[2] - box[0]) * (box[3] - box[1])


def _near(places: Array, box: Box, margin: float) -> Mask:
    """Which places (n, 2) lie in a box or close to it."""
    low, high = np.array(box[:2]) - margin, np.array(box[2:]) + margin
    return np.asarray(np.all((places > low) & (places < high), axis=1))


def _cut(box: Box, lit: Sequence[Array], limbs: Sequence[Limb], finer: Sequence[float]) -> _Cut:
    """The cheapest way to cut a box into halves, quarters and so on.

    lit : of each limb, the places that may lie in the box; finer : samples per pixel that they need
    """
    lit = [
        places[_near(places, box, _AROUND + limb.margin)]
        for places, limb in zip(lit, limbs, strict=True)
    ]
    needed = [samples for places, samples in zip(lit, finer, strict=True) if len(places)]
    if not needed:
        shown = any(_may_show(one, box) for one in limbs)
        return _Cut(((box, 0.0),), _SAMPLES_OF_A_MEAN) if shown else _Cut((), 0.0)
    uncut = _Cut(((box, max(needed)),), _SAMPLES_OF_A_BOX + max(needed) * _area(box))
    x0, y0, x1, y1 = box
    width, height = x1 - x0, y1 - y0
    if max(width, height) < 2 * _SMALLEST:
        return uncut
    if width >= height:
        halves = (x0, y0, x0 + width // 2, y1), (x0 + width // 2, y0, x1, y1)
    else:
        halves = (x0, y0, x1, y0 + height // 2), (x0, y0 + height // 2, x1, y1)
    first, second = (_cut(half, lit, limbs, finer) for half in halves)
    if first.cost + second.cost >= uncut.cost:
        return uncut
    return _Cut(first.boxes + second.boxes, first.cost + second.cost)


def _sides(limb: Limb, box: Box) -> Array:
    """(n, 4) by how much each corner of a box lies within each edge of an outline [px^2]."""
    x0, y0, x1, y1 = box
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=np.float64)
    step = np.roll(limb.outline, -1, axis=0) - limb.outline
    away = corners[None] - limb.outline[:, None]
    inside = step[:, None, 1] * away[..., 0] - step[:, None, 0] * away[..., 1]
    reach = (_AROUND + limb.margin) * np.hypot(*step.T)
    return np.asarray(inside + reach[:, None])


def _may_show(limb: Limb, box: Box) -> bool:
    """Whether no edge of an outline has all of a box beyond it."""
    return bool(np.all(np.any(_sides(limb, box) >= 0.0, axis=1)))
