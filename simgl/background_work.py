"""Work in a background thread, so that a long computation on one core does not delay the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from simgl.progress import ProgressCallback, begin_stage, silent


@contextmanager
def background_work(
    work: Callable[[ProgressCallback], None], progress: ProgressCallback | None
) -> Iterator[None]:
    """Work in another thread while the block runs; at its end wait for it, and raise its error.

    work : gets a call-back; where the block fails, this ends the work at its next step
    progress : shows the work's steps once the block has ended: what shows progress shows one thing
        at a time
    """
    steps = _Steps(progress)
    with ThreadPoolExecutor(max_workers=1, thread_name_prefix="simgl-side") as thread:
        done = thread.submit(work, steps)
        try:
            yield
            steps.show()
            done.result()
        except BaseException:
            steps.stop()
            raise


class _StoppedError(Exception):
    """Ends work whose result nobody waits for."""


class _Steps:
    """The call-back of the work."""

    def __init__(self, progress: ProgressCallback | None) -> None:
        self._progress = progress
        self._shown: ProgressCallback = silent
        self._stage: str | None = None
        self._stopped = False

    def begin_stage(self, name: str) -> None:
        self._stage = name
        if self._shown is not silent:
            begin_stage(self._progress, name)

    def __call__(self, done: int, total: int) -> None:
        if self._stopped:
            raise _StoppedError
        self._shown(done, total)

    def show(self) -> None:
        """Show this stage and what comes after it."""
        if self._progress is not None:
            self._shown = self._progress
            if self._stage is not None:
                begin_stage(self._progress, self._stage)

    def stop(self) -> None:
        self._stopped = True
