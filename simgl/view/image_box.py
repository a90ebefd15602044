"""Rectangles of the image."""

from __future__ import annotations

# x0, y0, x1, y1 [px].
Box = tuple[int, int, int, int]
