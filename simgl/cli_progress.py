"""Progress bars on the terminal, on standard error."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from simgl.progress import ProgressCallback
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator


@contextmanager
def _on_terminal(bar: Progress, label: str) -> Iterator[ProgressCallback]:
    """The call-back of a bar, which appears at the first call."""
    with bar:

        def report(done: int, total: int) -> None:
            if not bar.task_ids:
                bar.add_task(label, completed=done, total=total)
            bar.update(bar.task_ids[0], completed=done, total=total)

        yield report


@contextmanager
def frame_bar(console: Console | None = None) -> Iterator[ProgressCallback]:
    """A bar for the frames of a run, with the time left; nothing if not on a terminal.

    console : standard error by default
    """
    console = Console(stderr=True) if console is None else console
    columns = (TextColumn("frames"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with _on_terminal(
        Progress(*columns, console=console, disable=not console.is_terminal), ""
    ) as report:
        yield report


@contextmanager
def bake_bar(console: Console | None = None) -> Iterator[ProgressCallback]:
    """A bar for the precomputations of a ``Simulator``; nothing if not on a terminal.

    console : standard error by default
    """
    console = Console(stderr=True) if console is None else console
    bar = Progress(console=console, transient=True, disable=not console.is_terminal)
    with _on_terminal(bar, "light between surfaces and in the air, once") as report:
        yield report


def opened(scenario: Scenario) -> Simulator:
    """A simulator, with a progress bar while it prepares."""
    with bake_bar() as progress:
        return Simulator(scenario, progress=progress)
