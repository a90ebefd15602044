"""Rectangles of the image."""

from __future__ import annotations

# x0, y0, x1, y1 [px].
Box = tuple[int, int, int, int]


def overlap(a: Box, b: Box) -> bool:
    """Whether boxes share pixels."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def union(a: Box, b: Box) -> Box:
    """The least box that holds both."""
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def area_of(box: Box) -> int:
    """Its pixels."""
    return (box[2] - box[0]) * (box[3] - box[1])
