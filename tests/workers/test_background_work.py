"""Work beside other work: its steps are shown in turn, and it ends where nobody waits for it."""

from __future__ import annotations

import threading

import pytest

from simgl.background_work import background_work
from simgl.progress import ProgressCallback, begin_stage

PATIENCE_S = 60.0


class Shown:
    """A call-back that keeps what it is told, and tells when that is a certain stage."""

    def __init__(self, awaited: str) -> None:
        self.lines: list[object] = []
        self.came = threading.Event()
        self._awaited = awaited

    def begin_stage(self, name: str) -> None:
        self.lines.append(name)
        if name == self._awaited:
            self.came.set()

    def __call__(self, done: int, total: int) -> None:
        self.lines.append((done, total))


def test_steps_are_shown_once_the_block_has_ended() -> None:
    shown, half = Shown(awaited="light"), threading.Event()

    def work(progress: ProgressCallback) -> None:
        begin_stage(progress, "light")
        progress(1, 2)
        half.set()
        assert shown.came.wait(PATIENCE_S)
        progress(2, 2)
        begin_stage(progress, "more light")

    with background_work(work, shown):
        assert half.wait(PATIENCE_S)
        begin_stage(shown, "maps")
        shown(3, 3)
    assert shown.lines == ["maps", (3, 3), "light", (2, 2), "more light"]


def test_work_whose_block_fails_ends_at_its_next_step() -> None:
    begun = threading.Event()

    def work(progress: ProgressCallback) -> None:
        while True:
            progress(1, 2)
            begun.set()

    def fail() -> None:
        assert begun.wait(PATIENCE_S)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), background_work(work, None):
        fail()


def test_an_error_of_the_work_is_that_of_the_block() -> None:
    def work(progress: ProgressCallback) -> None:
        progress(0, 2)
        raise MemoryError("no room for rays")

    with pytest.raises(MemoryError, match="no room for rays"), background_work(work, None):
        pass
