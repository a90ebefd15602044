"""What long work tells of its steps."""

from __future__ import annotations

from collections.abc import Callable

# Told the steps done and their number.
Progress = Callable[[int, int], None]


def silent(done: int, total: int) -> None:
    """For work that nobody watches."""
