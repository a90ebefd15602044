"""What a crew is given to do."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Protocol, TypeVar

from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

# From the numbers of frames to these, in whatever order they are ready.
Taking = Callable[[Sequence[int]], Iterator[T]]
Crew = AbstractContextManager[Taking[T]]


class Job(Protocol[T_co]):
    """Frames of one scenario, each of which depends on its number alone."""

    @property
    def scenario(self) -> Scenario:
        """What the simulators of a crew are opened for."""

    def take(self, simulator: Simulator, frame: int) -> T_co:
        """One frame."""
