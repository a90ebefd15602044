"""Squares of 4 x 4 cells over which light is smooth, so that four shading points stand for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from simgl.arrays import AnyArray, Array32, Mask

# What a square is, as in shaders/surface/sunlight.frag: light is not smooth over it; it is, and all
# of the sunlight arrives, none, or some.
UNEVEN, LIT, DARK, PARTLY_LIT = range(4)
# By so much at most the share of the sunlight changes between the points of a square, in a penumbra
# as wide as SMOOTH_RADIUS there allows and with what the Sun's directions scatter by.
_MAX_CHANGE = 0.12
# Of the second difference between a point and its two neighbours, what is taken away along rows and
# along columns: it halves the scatter, and in the narrowest penumbra errs by 0.2 % rms.
_SMOOTHING = 1.0 / 6.0
# A larger one is that of a step, not of scatter.
_MAX_BEND = 0.1


@dataclass(frozen=True, eq=False)
class EvenSquares:
    """What squares are.

    kinds : (rows, columns) uint8, ``UNEVEN`` and so on
    partly_lit : (n, 4, 4) of those partly lit the shares of the sunlight per band at their four
        points, row by row
    larger : (rows // 2, columns // 2) whether 2 x 2 of them, all lit or all dark, are one of 8 x 8
        cells over which light is as smooth
    """

    kinds: AnyArray
    partly_lit: Array32
    larger: Mask


def without_penumbras(kinds: AnyArray) -> EvenSquares:
    """Squares of which none is partly lit."""
    return EvenSquares(kinds, np.zeros((0, 4, 4), dtype=np.float32), _none_larger(kinds))


def _none_larger(kinds: AnyArray) -> Mask:
    return np.zeros((kinds.shape[0] // 2, kinds.shape[1] // 2), dtype=bool)


def with_shares(kinds: AnyArray, shares: Array32) -> EvenSquares:
    """Squares of which those that may be partly lit have been searched.

    kinds : ``PARTLY_LIT`` where they have
    shares : (n, 4, 4) of the sunlight per band at their four points, row by row; negative where it
        is not linear between these
    """
    asked = kinds == PARTLY_LIT
    lowest, highest = _ends(list(shares.transpose(1, 2, 0)))
    darkest, brightest = lowest.min(axis=0), highest.max(axis=0)
    linear = (darkest >= 0.0) & ((highest - lowest).max(axis=0) < _MAX_CHANGE)
    dark, lit = (darkest == 0.0) & (brightest == 0.0), (darkest == 1.0) & (brightest == 1.0)
    kinds = kinds.copy()
    kinds[asked] = np.select([~linear, lit, dark], [UNEVEN, LIT, DARK], PARTLY_LIT)
    # The rim of a narrow penumbra may reach into a square between its points' directions.
    kinds[asked & _with_neighbours(asked & (kinds == UNEVEN))] = UNEVEN
    partly = kinds[asked] == PARTLY_LIT
    return EvenSquares(kinds, _smoothed(kinds, shares[partly]), _none_larger(kinds))


def with_larger(squares: EvenSquares, smooth: Mask) -> EvenSquares:
    """The same with larger ones, of 8 x 8 cells.

    smooth : (rows // 2, columns // 2) of these, whether light is smooth over them but for shadows
    """
    rows, columns = (2 * n for n in smooth.shape)
    kinds = squares.kinds[:rows, :columns]
    lowest, highest = _ends([kinds[i::2, j::2] for i in (0, 1) for j in (0, 1)])
    one_kind = (lowest == highest) & ((lowest == LIT) | (lowest == DARK))
    return replace(squares, larger=smooth & one_kind)


def _ends(values: Sequence[AnyArray]) -> tuple[AnyArray, AnyArray]:
    """Least and largest of a few arrays: along a short axis numpy takes ten times as long."""
    return reduce(np.minimum, values), reduce(np.maximum, values)


def _with_neighbours(squares: Mask) -> Mask:
    """Some squares, and all that touch them."""
    rows = squares.copy()
    rows[1:] |= squares[:-1]
    rows[:-1] |= squares[1:]
    both = rows.copy()
    both[:, 1:] |= rows[:, :-1]
    both[:, :-1] |= rows[:, 1:]
    return both


def _smoothed(kinds: AnyArray, shares: Array32) -> Array32:
    """Shares of ``EvenSquares`` without much of their scatter: in a wide penumbra they are nearly
    linear over a square, and bend little from one to the next."""
    twist = 0.25 * (shares[:, 0] - shares[:, 1] - shares[:, 2] + shares[:, 3])
    shares = shares - twist[:, None] * np.array([1.0, -1.0, -1.0, 1.0], dtype=np.float32)[:, None]
    row, column = np.nonzero(kinds == PARTLY_LIT)
    count = 4 * len(row)
    dark, lit, unknown = count, count + 1, count + 2
    # Where the share of each point stands in a list, and of those around the tile.
    index = np.full((2 * kinds.shape[0] + 2, 2 * kinds.shape[1] + 2), unknown, dtype=np.intp)
    for corner in range(4):
        points = index[1 + corner // 2 : -1 : 2, 1 + corner % 2 : -1 : 2]
        points[kinds == DARK] = dark
        points[kinds == LIT] = lit
        points[row, column] = np.arange(corner, count, 4)
    known = shares.reshape(-1, 4)
    others = np.array([[0.0], [1.0], [np.nan]], dtype=np.float32)
    listed = np.concatenate([known, np.broadcast_to(others, (3, 4))])
    corners = np.arange(4)
    y = (2 * row[:, None] + 1 + corners // 2).ravel()
    x = (2 * column[:, None] + 1 + corners % 2).ravel()
    smoothed = known.copy()
    for before, after in (((y, x - 1), (y, x + 1)), ((y - 1, x), (y + 1, x))):
        bend = listed.take(index[before], axis=0) + listed.take(index[after], axis=0) - 2.0 * known
        small = reduce(np.logical_and, (np.abs(bend) < _MAX_BEND).T)
        smoothed += np.where(small[:, None], np.float32(_SMOOTHING) * bend, np.float32(0.0))
    return np.clip(smoothed, 0.0, 1.0).reshape(-1, 4, 4)
