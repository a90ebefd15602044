"""The protocol of a job, and of what executes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Protocol, TypeVar

from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Job(Protocol[T_co]):
    """Frames of one scenario, each of which depends on the job and its number alone."""

    @property
    def scenario(self) -> Scenario:
        """Scenario that the simulators are opened for."""

    def render(self, simulator: Simulator, frame: int) -> T_co:
        """One frame."""


# From frame numbers to results, in the order in which they are ready.
Execute = Callable[[Sequence[int]], Iterator[T]]
# Open while its workers are.
Executor = AbstractContextManager[Execute[T]]
