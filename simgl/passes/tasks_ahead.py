"""What later frames need, made in other threads beside the frames before."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import TypeVar

_Result = TypeVar("_Result")


class TasksAhead:
    """Tasks that wait until a frame has its light, and run beside the rest of it and the next.

    executor : runs them in the order in which they were given, so that tasks may wait for earlier
        ones
    """

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._due: list[Callable[[], None]] = []
        self._begun: list[Future[None]] = []

    def add(self, task: Callable[[], None]) -> None:
        """One more to ``begin``."""
        self._due.append(task)

    def begin(self) -> None:
        """Begin what is due, if anything is, once all that was begun before is finished."""
        if self._due:
            self.finish()
            self._begun = [self._executor.submit(task) for task in self._due]
            self._due.clear()

    def finish(self) -> None:
        """Wait for all that was begun; raises what went wrong in it."""
        while self._begun:
            self._begun.pop().result()

    def then(self, work: Callable[[], _Result]) -> Future[_Result]:
        """Work that reads what they make: the thread that does it waits for them, not this one."""
        begun = tuple(self._begun)

        def after() -> _Result:
            for task in begun:
                task.result()
            return work()

        return self._executor.submit(after)
