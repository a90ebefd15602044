"""The lit limb of a spacecraft, where its image needs more samples than elsewhere.

Most of a crescent's light lies at its limb: the samples there decide where its centre is. A tile is
cut into boxes, of which those along the limb have a finer sample grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Mask
from simgl.physics.frames import norm
from simgl.sample_grid import (
    MAX_SAMPLES,
    USEFUL_NEED,
    SampleGrid,
    rotated_sample_grid,
)
from simgl.view.image_box import Box, area_of

# Boxes are cut along squares of this edge [px].
_CELL = 8
# Samples that could be lit in the time that a box takes whatever is in it: with a finer grid, and
# where it is only averaged.
_SAMPLES_OF_A_BOX, _SAMPLES_OF_A_MEAN = 65_000, 20_000
# Of a tile, for finer grids. Most samples there see nothing, and cost little; twice as many make a
# frame of a large spacecraft before the Sun take four times as long.
_BUDGETS = 4
# A limb that needs so many times the samples of its tile is worth boxes of its own: each draws all
# triangles again. Small parts beside a large spacecraft in a docking camera's view need five times.
# The centre of a thin crescent is 0.05 px off with so few, beyond a phase angle of 130 deg.
_ABOUT, _ABOUT_THIN = 6.0, USEFUL_NEED
_THIN_CRESCENT = float(np.cos(np.radians(130.0)))
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
    cos_phase : cosine of the phase angle
    """

    outline: Array
    to_sun: Array
    samples_per_pixel: float
    margin: float = 0.0
    cos_phase: float = 1.0

    def is_served_by(self, grid: SampleGrid) -> bool:
        """Whether a grid is so near to what it needs that boxes cost more than they bring."""
        about = _ABOUT_THIN if self.cos_phase < _THIN_CRESCENT else _ABOUT
        return self.samples_per_pixel <= about * grid.scale**2

    def lit(self) -> Array:
        """(k, 2) places along its lit part, at most a pixel apart [px]."""
        step = np.roll(self.outline, -1, axis=0) - self.outline
        length = np.hypot(*step.T)
        outward = np.stack([-step[:, 1], step[:, 0]], axis=-1) / length[:, None]
        facing = outward @ self.to_sun > _DARK * norm(self.to_sun)
        each = np.where(facing, np.ceil(length), 0.0).astype(int)
        edge = np.repeat(np.arange(len(each)), each)
        number = np.arange(len(edge)) - np.repeat(np.cumsum(each) - each, each)
        return np.asarray(self.outline[edge] + (number / each[edge])[:, None] * step[edge])


# First and end of columns and of rows of cells.
_Cells = tuple[int, int, int, int]


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
    allowed = _BUDGETS * sample_budget + coarse * area_of(box)
    tile = _TileCells.of(box, [one for one in limbs if not one.is_served_by(grid)], limbs)
    share = 1.0
    while share * USEFUL_NEED >= 1.0:
        boxes = tile.cut(share).boxes
        if sum(area_of(part) * samples for part, samples in boxes) <= allowed:
            return tuple(
                (part, rotated_sample_grid(samples) if samples else grid) for part, samples in boxes
            )
        share *= 0.8
    return ()


@dataclass(frozen=True, kw_only=True, eq=False)
class _TileCells:
    """The cells of a tile from its corner.

    shown : sums, as of ``_sums``, of the cells that may show spacecraft
    lit : of the cells at each limb that needs a finer grid, and the samples per pixel that it needs
    """

    box: Box
    size: tuple[int, int]
    shown: list[list[int]]
    lit: list[tuple[list[list[int]], float]]

    @classmethod
    def of(cls, box: Box, finer: Sequence[Limb], limbs: Sequence[Limb]) -> _TileCells:
        size = -(-(box[2] - box[0]) // _CELL), -(-(box[3] - box[1]) // _CELL)
        shown = np.any([_shown_cells(one, box, size) for one in limbs], axis=0)
        lit = [(_sums(_lit_cells(one, box, size)), one.samples_per_pixel) for one in finer]
        return cls(box=box, size=size, shown=_sums(shown), lit=lit)

    def cut(self, share: float) -> _Cut:
        """A cheap way to cut it, for a share of the samples that limbs need."""
        return self._cut((0, self.size[0], 0, self.size[1]), share)

    def _cut(self, cells: _Cells, share: float) -> _Cut:
        """The same of some cells: what holds no limb, halves of the rest, quarters and so on."""
        at_limb = self._at_limbs(cells)
        if at_limb is None:
            return self._averaged([cells])
        around = self._averaged(_around(at_limb, cells))
        needed = max(samples for lit, samples in self.lit if _any(lit, at_limb))
        box, samples = self._pixels(at_limb), min(share * needed, float(MAX_SAMPLES))
        best = _Cut(((box, samples),), _SAMPLES_OF_A_BOX + samples * area_of(box))
        halves = _halves(at_limb)
        # Cheaper than a second box, it stays whole.
        if halves and samples * area_of(box) > _SAMPLES_OF_A_BOX:
            first, second = (self._cut(half, share) for half in halves)
            if first.cost + second.cost < best.cost:
                best = _Cut(first.boxes + second.boxes, first.cost + second.cost)
        return _Cut(around.boxes + best.boxes, around.cost + best.cost)

    def _averaged(self, parts: Sequence[_Cells]) -> _Cut:
        """Parts without a limb, those that may show spacecraft."""
        boxes = tuple((self._pixels(part), 0.0) for part in parts if _any(self.shown, part))
        return _Cut(boxes, _SAMPLES_OF_A_MEAN * len(boxes))

    def _at_limbs(self, cells: _Cells) -> _Cells | None:
        """The least part of some cells that holds all that lie at limbs; None without."""
        if not self._is_lit(*cells):
            return None
        left, right, low, high = cells
        while not self._is_lit(left, left + 1, low, high):
            left += 1
        while not self._is_lit(right - 1, right, low, high):
            right -= 1
        while not self._is_lit(left, right, low, low + 1):
            low += 1
        while not self._is_lit(left, right, high - 1, high):
            high -= 1
        return left, right, low, high

    def _is_lit(self, left: int, right: int, low: int, high: int) -> bool:
        return any(_any(sums, (left, right, low, high)) for sums, _ in self.lit)

    def _pixels(self, cells: _Cells) -> Box:
        x0, y0, x1, y1 = self.box
        left, right, low, high = (_CELL * end for end in cells)
        return x0 + left, y0 + low, min(x0 + right, x1), min(y0 + high, y1)


def _around(part: _Cells, cells: _Cells) -> list[_Cells]:
    """What some cells hold around a part of them."""
    left, right, low, high = cells
    first, end, top, bottom = part
    sides = (
        (left, right, low, top),
        (left, right, bottom, high),
        (left, first, top, bottom),
        (end, right, top, bottom),
    )
    return [side for side in sides if side[0] < side[1] and side[2] < side[3]]


def _halves(cells: _Cells) -> tuple[_Cells, ...]:
    """None of a cell alone."""
    left, right, low, high = cells
    if max(right - left, high - low) == 1:
        return ()
    if right - left >= high - low:
        middle = (left + right) // 2
        return (left, middle, low, high), (middle, right, low, high)
    middle = (low + high) // 2
    return (left, right, low, middle), (left, right, middle, high)


def _sums(cells: Mask) -> list[list[int]]:
    """Of a mask (rows, columns): how many cells are set before each row and column."""
    return np.pad(np.cumsum(np.cumsum(cells, axis=0), axis=1), [(1, 0), (1, 0)]).tolist()


def _any(sums: list[list[int]], cells: _Cells) -> bool:
    """Whether one of some cells is set."""
    left, right, low, high = cells
    return sums[high][right] - sums[high][left] > sums[low][right] - sums[low][left]


def _lit_cells(limb: Limb, box: Box, size: tuple[int, int]) -> Mask:
    """(rows, columns) that lie near the lit part of a limb."""
    margin = _AROUND + limb.margin
    places = limb.lit() - np.array(box[:2])
    ends = np.array(size) * _CELL
    places = places[np.all((places > -margin) & (places < ends + margin), axis=1)]
    last = np.array(size) - 1
    low, high = (
        np.clip((places + side * margin) // _CELL, 0, last).astype(int) for side in (-1.0, 1.0)
    )
    # Where squares of cells begin and end.
    change = np.zeros((size[1] + 1, size[0] + 1), dtype=int)
    for x, y, step in (
        (low[:, 0], low[:, 1], 1),
        (high[:, 0] + 1, high[:, 1] + 1, 1),
        (low[:, 0], high[:, 1] + 1, -1),
        (high[:, 0] + 1, low[:, 1], -1),
    ):
        np.add.at(change, (y, x), step)
    return np.asarray(np.cumsum(np.cumsum(change, axis=0), axis=1)[:-1, :-1] > 0)


def _shown_cells(limb: Limb, box: Box, size: tuple[int, int]) -> Mask:
    """(rows, columns) that lie within an outline or near it."""
    margin = _AROUND + limb.margin
    (x, y), (to_x, to_y) = (
        (corners - np.array(box[:2])).T
        for corners in (limb.outline, np.roll(limb.outline, -1, axis=0))
    )
    rows = _CELL * np.arange(size[1])[:, None]
    # Where each edge enters and leaves each row of cells, as shares of its length.
    fall = np.where(to_y == y, 1e-9, to_y - y)
    shares = np.stack([(rows - margin - y) / fall, (rows + _CELL + margin - y) / fall])
    enters, leaves = np.maximum(shares.min(axis=0), 0.0), np.minimum(shares.max(axis=0), 1.0)
    ends = np.stack([x + enters * (to_x - x), x + leaves * (to_x - x)])
    meets = enters <= leaves
    left = np.where(meets, ends.min(axis=0), np.inf).min(axis=1) - margin
    right = np.where(meets, ends.max(axis=0), -np.inf).max(axis=1) + margin
    columns = _CELL * np.arange(size[0])
    return np.asarray((columns <= right[:, None]) & (columns + _CELL >= left[:, None]))
