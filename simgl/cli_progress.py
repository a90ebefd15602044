"""Bars on the terminal, for work of more than a second."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from simgl.progress import Progress
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator


@contextmanager
def frame_bar(console: Console | None = None) -> Iterator[Progress]:
    """What a run tells the pictures done and their number to; with the time left, on a terminal.

    console : standard error, if not given
    """
    console = Console(stderr=True) if console is None else console
    columns = (TextColumn("frames"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, console=console, disable=not console.is_terminal) as bar:
        task = None

        def report(done: int, total: int) -> None:
            nonlocal task
            if task is None:
                task = bar.add_task("", completed=done, total=total)
            bar.update(task, completed=done)

        yield report


@contextmanager
def bake_bar(console: Console | None = None) -> Iterator[Progress]:
    """What a ``Simulator`` tells its progress to; on a terminal only, and only if there is work.

    console : standard error, if not given
    """
    console = Console(stderr=True) if console is None else console
    with Bar(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = None

        def report(done: int, total: int) -> None:
            nonlocal task
            if task is None:
                task = bar.add_task("light between surfaces and in the air, once")
            bar.update(task, completed=done, total=total)

        yield report


def opened(scenario: Scenario) -> Simulator:
    """A simulator, with a bar while it prepares."""
    with bake_bar() as progress:
        return Simulator(scenario, progress=progress)
