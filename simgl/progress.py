"""The progress call-back of long computations."""

from __future__ import annotations

from collections.abc import Callable

# Called with the number of steps done and of all steps.
ProgressCallback = Callable[[int, int], None]


def silent(done: int, total: int) -> None:
    """A call-back that shows nothing."""
