"""The progress call-back of long computations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

# Called with the number of steps done and of all steps.
ProgressCallback = Callable[[int, int], None]


@runtime_checkable
class StageCallback(Protocol):
    """A progress call-back that also shows the name of what is being done."""

    def begin_stage(self, name: str) -> None:
        """The next steps are those of another computation."""


def silent(done: int, total: int) -> None:
    """A call-back that shows nothing."""


def begin_stage(progress: ProgressCallback | None, name: str) -> None:
    """Tell a call-back what comes next, where it shows names."""
    if isinstance(progress, StageCallback):
        progress.begin_stage(name)
