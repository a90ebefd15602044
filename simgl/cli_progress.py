"""What the command line is doing, on stderr: a bar in a terminal, else a line every ten seconds.

``--quiet`` turns both off. Results go to stdout and never mix with it.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

if TYPE_CHECKING:
    from pathlib import Path

    from simgl.scenario.scenario import Scenario
    from simgl.simulator import Simulator

# Between two lines where stderr is no terminal [s].
LINE_INTERVAL = 10.0


class Activity(Protocol):
    """What is shown of one piece of work; a ``ProgressCallback`` that shows names."""

    def begin_stage(self, name: str) -> None:
        """Show another name; the steps begin again."""

    def __call__(self, done: int, total: int) -> None:
        """Show how many steps are done."""


class _Bar:
    """A bar in a terminal."""

    def __init__(self, bar: Progress, name: str) -> None:
        self._bar = bar
        self._task = bar.add_task(name, total=None)

    def begin_stage(self, name: str) -> None:
        self._bar.reset(self._task, total=None, description=name)

    def __call__(self, done: int, total: int) -> None:
        self._bar.update(self._task, completed=done, total=total)


class _Text:
    """What a line says; of no use by itself where nothing is to be shown."""

    def __init__(self, name: str) -> None:
        self.begin_stage(name)

    def begin_stage(self, name: str) -> None:
        self._name, self._steps, self._start = name, "", time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        self._steps = f"{done} of {total}, "

    def __str__(self) -> str:
        return f"simgl: {self._name}: {self._steps}{time.monotonic() - self._start:.0f} s"


class _Lines(threading.Thread):
    """Prints what the process is doing, again and again until its end.

    One for all activities: many that are short together take long, too.
    """

    def __init__(self) -> None:
        super().__init__(name="simgl-progress", daemon=True)
        self.shown: _Text | None = None
        self.restart()

    def restart(self) -> None:
        """Wait from now on for the next line."""
        self._due = time.monotonic() + LINE_INTERVAL

    def run(self) -> None:
        while True:
            while (wait := self._due - time.monotonic()) > 0.0:
                time.sleep(wait)
            self.restart()
            if (shown := self.shown) is not None:
                try:
                    print(shown, file=sys.stderr, flush=True)
                except OSError:
                    # Nobody reads any more.
                    return


_lines: _Lines | None = None
_quiet = False


def set_quiet(quiet: bool) -> None:
    """Whether nothing is shown of the command that begins now."""
    global _quiet
    _quiet = quiet
    if _lines is not None:
        _lines.restart()


@contextmanager
def activity(name: str, console: Console | None = None) -> Iterator[Activity]:
    """Show what is done while the block runs; in a terminal it disappears at the end.

    console : standard error, if not given
    """
    console = Console(stderr=True) if console is None else console
    if not _quiet and console.is_terminal:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=console, transient=True) as bar:
            yield _Bar(bar, name)
        return
    text = _Text(name)
    _show_in_lines(None if _quiet else text)
    try:
        yield text
    finally:
        _show_in_lines(None)


def _show_in_lines(text: _Text | None) -> None:
    global _lines
    if _lines is None and text is not None:
        _lines = _Lines()
        _lines.start()
    if _lines is not None:
        _lines.shown = text


def load(path: Path) -> Scenario:
    """The scenario of a file, its models' notes on stderr; raises ConfigError and AssetError."""
    with activity(f"loading {path.name}"):
        from simgl.scenario.loader import load_scenario

        scenario = load_scenario(path)
    for spacecraft, model in scenario.models.items():
        for note in () if _quiet else model.notes:
            print(f"simgl: note: {spacecraft}: {note}", file=sys.stderr)
    return scenario


def opened(scenario: Scenario) -> Simulator:
    """A simulator; raises ContextError."""
    with activity("opening OpenGL") as progress:
        from simgl.simulator import Simulator

        return Simulator(scenario, progress=progress)
