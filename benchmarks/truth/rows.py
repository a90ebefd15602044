"""Rows of truth tables."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """One case.

    truth, simgl : in the unit that the table names
    error : as the table counts it; its goal is its largest size
    """

    case: str
    truth: float
    simgl: float
    error: float
    goal: float

    @property
    def met(self) -> bool:
        """Whether the error is as small as it has to be."""
        return abs(self.error) <= self.goal

    @property
    def share(self) -> float:
        """The error over its goal."""
        return abs(self.error) / self.goal if self.goal else abs(self.error)


class Table(msgspec.Struct, frozen=True, kw_only=True):
    """Cases of one subject.

    reference : where the truth comes from
    quantity : what the rows give, with its unit
    error : how errors count
    made : date and machine, of a table from another run than its record's
    """

    title: str
    reference: str
    quantity: str
    error: str
    rows: list[Row]
    made: str = ""


def relative(case: str, truth: float, simgl: float, goal: float) -> Row:
    """A row whose error is relative to the truth."""
    return Row(case=case, truth=truth, simgl=simgl, error=simgl / truth - 1.0, goal=goal)


def difference(case: str, truth: float, simgl: float, goal: float) -> Row:
    """A row whose error has the quantity's own unit."""
    return Row(case=case, truth=truth, simgl=simgl, error=simgl - truth, goal=goal)


def worst(rows: Iterable[Row]) -> Row:
    """The row that is farthest off for its goal."""
    return max(rows, key=lambda row: row.share)
