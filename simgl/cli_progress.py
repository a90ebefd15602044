"""Progress bars on the terminal, for work of more than a second."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from simgl.progress import ProgressCallback

if TYPE_CHECKING:
    from simgl.scenario.scenario import Scenario
    from simgl.simulator import Simulator


@contextmanager
def frame_bar(console: Console | None = None) -> Iterator[ProgressCallback]:
    """Shows the frames done, their number and the time left; on a terminal only.

    console : standard error, if not given
    """
    columns = (TextColumn("frames"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True) if console is None else console
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        yield _updates(bar, "")


@contextmanager
def bake_bar(console: Console | None = None) -> Iterator[ProgressCallback]:
    """Shows the preparation of a ``Simulator``; on a terminal only, and only if there is work.

    console : standard error, if not given
    """
    console = Console(stderr=True) if console is None else console
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        yield _updates(bar, "light between surfaces and in the air, once")


def _updates(bar: Progress, description: str) -> ProgressCallback:
    """The bar's one task, which appears with the first report."""

    def report(done: int, total: int) -> None:
        if not bar.task_ids:
            bar.add_task(description)
        bar.update(bar.task_ids[0], completed=done, total=total)

    return report


def opened(scenario: Scenario) -> Simulator:
    """A simulator, with a bar while it prepares."""
    from simgl.simulator import Simulator

    with bake_bar() as progress:
        return Simulator(scenario, progress=progress)
